//! What a run has come to.

use std::path::{Path, PathBuf};

use job::{Keyword, OutputFile};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use results::{Ending, Latest, RunOutput, StoredRun};

use crate::refusal::refuse;
use crate::table::{PyColumn, to_python};

/// The commit of the program, for summaries.
const GIT: &str = env!("RADWALK_GIT");

/// A result of a job, as Python sees it.
#[pyclass(frozen, module = "radwalk._radwalk")]
pub(crate) struct Answer {
    pub(crate) kept: StoredRun,
    /// Why its walks ended; `None` where it was opened from a folder, which does not say.
    pub(crate) ending: Option<Ending>,
    /// What was to be said of the scene before it was walked, a sentence each.
    #[pyo3(get)]
    pub(crate) warnings: Vec<String>,
}

/// Corners, and how many of them each row has.
type RowCorners<'py> = (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

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
            Ending::TargetReached => "target reached",
            Ending::WallClock => "wall clock",
            _ => "budget spent",
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

    /// The columns of `sources.csv`, where sources are told apart.
    fn sources<'py>(&self, py: Python<'py>) -> PyResult<Option<Vec<PyColumn<'py>>>> {
        let StoredRun { checkpoint, settings, experiment } = &self.kept;
        if self.factors().is_empty() {
            return Ok(None);
        }
        let read = || {
            let mut table = Vec::new();
            let level = settings.source_level(experiment);
            report::write_sources(&mut table, experiment, &checkpoint.tally, level)?;
            report::read_table(&table)
        };
        to_python(py, py.detach(read).map_err(refuse)?).map(Some)
    }

    /// The columns of `sensitivities.csv`, where materials are asked for.
    fn sensitivities<'py>(&self, py: Python<'py>) -> PyResult<Option<Vec<PyColumn<'py>>>> {
        let Some(influences) = self.kept.influences() else { return Ok(None) };
        let read = || {
            let mut table = Vec::new();
            report::write_sensitivities(&mut table, &influences)?;
            report::read_table(&table)
        };
        to_python(py, py.detach(read).map_err(refuse)?).map(Some)
    }

    /// The sources by name, with what the emittance of each is multiplied by.
    fn factors(&self) -> Vec<(String, f64)> {
        let experiment = &self.kept.experiment;
        let names = experiment.groups().map_or(&[][..], |groups| groups.sources());
        let factor = |number: usize| experiment.mixture().map_or(1.0, |factors| factors[number]);
        names.iter().enumerate().map(|(number, name)| (name.clone(), factor(number))).collect()
    }

    /// The result with other factors of its sources.
    fn combine(&self, py: Python<'_>, set: Vec<(String, f64)>) -> PyResult<Answer> {
        let name = Path::new(&self.kept.settings.name);
        let kept = py.detach(|| results::mix(self.kept.clone(), name, &set)).map_err(refuse)?;
        Ok(Answer { kept, ending: self.ending, warnings: self.warnings.clone() })
    }

    /// The corners of the outlines that rows are drawn by [m] (f64, three a corner), how many of them each outline has (i64), and
    /// the row of each outline (i64).
    fn corners<'py>(&self, py: Python<'py>) -> RowCorners<'py> {
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
        let StoredRun { checkpoint, settings, experiment } = &self.kept;
        let write = || {
            let output = RunOutput::new(&folder, force, &files, GIT)?;
            output.keep(checkpoint, Latest::Foreign)?;
            output.write(settings, experiment, checkpoint, &|_| ()).map(drop)
        };
        py.detach(write).map_err(|error: results::Error| refuse(error))
    }
}
