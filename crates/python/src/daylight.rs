//! Daylight of a year.

use std::path::PathBuf;

use pyo3::prelude::*;
use radiosity::daylight::SkyPatches;
use report::OutputFolder;
use results::daylight::{DAYLIGHT_FILES, DaylightAnswer, DaylightQuestion, Wished, count_here};
use sky::Wanted;

use crate::refusal::refuse;
use crate::run::JobSource;
use crate::watcher::Watcher;

/// What of the daylight is asked for, as Python has it.
#[derive(FromPyObject)]
pub(crate) struct DaylightRequest {
    weather: PathBuf,
    sky_patches: u32,
    ground: f64,
    channel: Option<usize>,
    tolerance: f64,
    enough: f64,
}

impl DaylightRequest {
    /// # Errors
    /// Where there is no such sky.
    fn wished(&self) -> PyResult<Wished<'_>> {
        let wrong =
            "there is no such sky (it has 145, 577 or 2305 patches); give one of these as sky_patches";
        let patches = SkyPatches::new(self.sky_patches)
            .ok_or_else(|| pyo3::exceptions::PyValueError::new_err(wrong))?;
        Ok(Wished {
            weather: &self.weather,
            patches,
            ground: self.ground,
            channel: self.channel,
            tolerance: self.tolerance,
            wanted: Wanted { enough: self.enough, ..Wanted::default() },
        })
    }
}

/// Counts the daylight coefficients of a job's sensors on threads, and writes what `radwalk daylight --export npz` calls `daylight.npz` into a folder, which
/// must be empty. `watch(part)` hears what part of a look is done. Returns whether the tolerance is met at every place, and what makes the figures
/// doubtful.
#[pyfunction]
#[pyo3(signature = (source, overrides, folder, wanted, threads, watch=None))]
pub(crate) fn daylight(
    py: Python<'_>,
    source: JobSource<'_>,
    overrides: Vec<String>,
    folder: PathBuf,
    wanted: DaylightRequest,
    threads: usize,
    watch: Option<Py<PyAny>>,
) -> PyResult<(bool, Vec<String>)> {
    let (job, wished) = (source.as_written(&overrides)?, wanted.wished()?);
    let mut watcher = Watcher::new(watch);
    let mut ask = |part: f64| watcher.tell((part,));
    let count = || -> Result<Option<(bool, Vec<String>)>, results::Error> {
        let question = DaylightQuestion::of(job, &wished)?;
        let counted = count_here(&question, threads, &mut ask);
        if counted.interrupted {
            return Ok(None);
        }
        let answer = DaylightAnswer::of(&question, counted, threads);
        answer.write_arrays(&OutputFolder::claim(&folder, &DAYLIGHT_FILES, false)?)?;
        Ok(Some((answer.reached(), answer.warnings())))
    };
    let done = py.detach(count).map_err(refuse)?;
    watcher.end(done)
}
