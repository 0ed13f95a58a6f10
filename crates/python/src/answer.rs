//! What a run has come to.

use std::path::PathBuf;

use job::{OutputFile, Word};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use results::{Ending, Kept, Latest, RunOutput};

use crate::refusal::refuse;
use crate::table::{PyColumn, to_python};

/// The commit of the program, for summaries.
const GIT: &str = env!("RADWALK_GIT");

/// A result of a job, as Python sees it.
#[pyclass(frozen, module = "radwalk._radwalk")]
pub(crate) struct Answer {
    pub(crate) kept: Kept,
    /// Why its walks ended; `None` where it was opened from a folder, which does not say.
    pub(crate) ending: Option<Ending>,
    /// What was to be said of the scene before it was walked, a sentence each.
    #[pyo3(get)]
    pub(crate) warnings: Vec<String>,
}

/// Corners, and how many of them each row has.
type Corners<'py> = (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

#[pymethods]
impl Answer {
    /// The name of the job.
    #[getter]
    fn name(&self) -> &str {
        &self.kept.settings.name
    }

    /// Why the walks ended.
    #[getter]
    fn ending(&self) -> Option<&'static str> {
        self.ending.map(|ending| match ending {
            Ending::BudgetSpent => "budget spent",
            Ending::TargetReached => "target reached",
            Ending::WallClock => "wall clock",
        })
    }

    /// The columns of `patches.csv`.
    fn patches<'py>(&self, py: Python<'py>) -> PyResult<Vec<PyColumn<'py>>> {
        let columns = py.detach(|| report::columns(&self.kept.estimates())).map_err(refuse)?;
        to_python(py, columns)
    }

    /// The columns of `sensors.csv`, where there are sensors.
    fn sensors<'py>(&self, py: Python<'py>) -> PyResult<Option<Vec<PyColumn<'py>>>> {
        let Some(readings) = self.kept.readings() else { return Ok(None) };
        let mut table = Vec::new();
        report::write_sensors(&mut table, &readings).map_err(refuse)?;
        to_python(py, report::read_table(&table).map_err(refuse)?).map(Some)
    }

    /// The corners of the outlines that rows are drawn by [m] (f64, three a corner), how many of them each outline has (i64), and
    /// the row of each outline (i64).
    fn corners<'py>(&self, py: Python<'py>) -> Corners<'py> {
        let (mut points, mut counts, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        for (row, corners) in report::corners(&self.kept.estimates()) {
            rows.extend((row as i64).to_le_bytes());
            counts.extend((corners.len() as i64).to_le_bytes());
            points.extend(corners.iter().flat_map(|corner| corner.to_array()).flat_map(f64::to_le_bytes));
        }
        (PyBytes::new(py, &points), PyBytes::new(py, &counts), PyBytes::new(py, &rows))
    }

    /// The summary as JSON.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        let mut bytes = Vec::new();
        py.detach(|| self.kept.summary(GIT)).write(&mut bytes).map_err(refuse)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Writes an output folder, with files beyond those that the job names.
    fn save(&self, py: Python<'_>, folder: PathBuf, force: bool, export: Vec<String>) -> PyResult<()> {
        let file = |word: &String| {
            let found = OutputFile::ALL.iter().copied().find(|file| file.word() == word);
            found.ok_or_else(|| {
                let known: Vec<&str> = OutputFile::ALL.iter().map(|file| file.word()).collect();
                refuse(format!("there is no output file {word:?} (results are written as tables, pictures and pages); choose from {}", known.join(", ")))
            })
        };
        let files = export.iter().map(file).collect::<PyResult<Vec<_>>>()?;
        let Kept { checkpoint, settings, experiment } = &self.kept;
        let write = || {
            let output = RunOutput::new(&folder, force, &files, GIT)?;
            output.write(settings, experiment, checkpoint, Latest::Foreign, &|_| ()).map(drop)
        };
        py.detach(write).map_err(|error: results::Error| refuse(error))
    }
}
