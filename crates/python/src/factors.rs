//! View factors, counted row by row.

use std::path::PathBuf;

use pyo3::prelude::*;
use report::OutputFolder;
use results::factors::{
    Asked, FactorsQuestion, RowWalks, RowWatcher, SparseAnswer, SparseAsked, SparseFile, count_rows,
    sparse_files,
};

use crate::refusal::refuse;
use crate::run::JobSource;
use crate::watcher::Watcher;

/// What of the factors is asked for, as Python has it.
#[derive(FromPyObject)]
pub(crate) struct FactorRequest {
    rays: u32,
    drop: f64,
    sky: Option<u32>,
    reflections: bool,
    channel: Option<usize>,
    groups: Option<String>,
    tolerance: Option<f64>,
    smooth: bool,
    periods: Option<[f64; 2]>,
}

/// Counts the rows of a job's scene on threads, and writes what `radwalk factors --sparse --export npz` does into a folder, which must
/// be empty. `watch(part)` hears what part of them is done. Returns what makes the factors doubtful.
#[pyfunction]
#[pyo3(signature = (source, overrides, folder, wanted, threads, watch=None))]
pub(crate) fn factors(
    py: Python<'_>,
    source: JobSource<'_>,
    overrides: Vec<String>,
    folder: PathBuf,
    wanted: FactorRequest,
    threads: usize,
    watch: Option<Py<PyAny>>,
) -> PyResult<Vec<String>> {
    let walks = RowWalks::Each(wanted.rays);
    let sparse =
        SparseAsked { walks, least: wanted.drop, sky: wanted.sky, periods: wanted.periods, part: [1, 1] };
    let asked = Asked {
        groups: wanted.groups.as_deref(),
        reflections: wanted.reflections,
        channel: wanted.channel,
        tolerance: wanted.tolerance,
        smooth: wanted.smooth,
        sparse: Some(sparse),
        ..Asked::default()
    };
    let job = source.surfaces(&overrides)?;
    let mut watcher = Watcher::new(watch);
    let mut ask = |part: f64| watcher.tell((part,));
    let count = || -> Result<Option<Vec<String>>, results::Error> {
        let question = FactorsQuestion::of(job, &asked)?;
        let folder = OutputFolder::claim(&folder, &sparse_files(), false)?;
        let rows = RowWatcher { threads, watch: &mut ask };
        let counted = count_rows(&question, &sparse, &folder, false, &[], rows)?;
        if counted.interrupted {
            return Ok(None);
        }
        let answer = SparseAnswer::of(&question, &sparse, counted, &folder)?;
        answer.write(&folder, &[SparseFile::Npz])?;
        Ok(Some(answer.warnings()))
    };
    let done = py.detach(count).map_err(refuse)?;
    watcher.end(done)
}
