//! Jobs, walked and solved.

use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use crossbeam::channel::{RecvTimeoutError, bounded};
use job::Job;
use pyo3::prelude::*;
use radiosity::Experiment;
use results::{SoloProgress, StoredRun, all_threads, choose, walk_here};

use crate::answer::Answer;
use crate::mesh::ArrayMesh;
use crate::refusal::refuse;
use crate::table::{PyColumn, to_python};
use crate::watcher::Watcher;

/// Version and commit of the program.
const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("RADWALK_GIT"));

/// Between two questions whether Ctrl-C was pressed.
const ASKED: Duration = Duration::from_millis(100);

/// What a job is made of.
#[derive(FromPyObject)]
pub(crate) enum JobSource<'py> {
    /// A mesh of arrays.
    Mesh(PyRef<'py, ArrayMesh>),
    /// A job file, or a scene.
    File(PathBuf),
}

/// Reads a job by its path and what replaces its keys.
type Loader = fn(&Path, &[String]) -> Result<Job, job::Error>;

impl JobSource<'_> {
    /// The job with the patches that the scene has, where light plays no part.
    pub(crate) fn surfaces(&self, overrides: &[String]) -> PyResult<Job> {
        self.loaded(job::load_surfaces, overrides)
    }

    /// The job as it is written, with the patches that the scene has.
    pub(crate) fn as_written(&self, overrides: &[String]) -> PyResult<Job> {
        self.loaded(job::load_as_written, overrides)
    }

    /// The job, with the patches that a pilot chooses where it leaves them open.
    fn job(&self, overrides: &[String]) -> PyResult<Job> {
        let job = self.loaded(job::load, overrides)?;
        let Some(chosen) = choose(&job, all_threads()).map_err(refuse)? else { return Ok(job) };
        job.cut(overrides, &chosen.partition).map_err(refuse)
    }

    /// The job of the mesh, or what `load` makes of the file.
    fn loaded(&self, load: Loader, overrides: &[String]) -> PyResult<Job> {
        match self {
            JobSource::Mesh(mesh) => job::load_mesh(&mesh.name, mesh.mesh.clone(), overrides),
            JobSource::File(path) => load(path, overrides),
        }
        .map_err(refuse)
    }
}

/// Walks a job; `overrides` are of the form `key=value`. `watch(paths, paths_total, seconds, error)` hears where it stands.
#[pyfunction]
#[pyo3(signature = (source, overrides, threads=None, watch=None))]
pub(crate) fn run(
    py: Python<'_>,
    source: JobSource<'_>,
    overrides: Vec<String>,
    threads: Option<usize>,
    watch: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    let job = source.job(&overrides)?;
    let threads = threads.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from));
    let mut watcher = Watcher::new(watch);
    let mut ask = |SoloProgress { paths, paths_total, seconds, median_relative_error }: SoloProgress| {
        watcher.tell((paths, paths_total, seconds, median_relative_error))
    };
    let done = py.detach(|| walk(&job, threads, &mut ask))?;
    watcher.end(done)
}

fn walk(job: &Job, threads: usize, watch: &mut dyn FnMut(SoloProgress) -> bool) -> PyResult<Option<Answer>> {
    let scene = job.build_scene().map_err(refuse)?;
    let experiment = Experiment::new(scene, job.method.walks())
        .and_then(|experiment| experiment.with_sensors(job.scene.sensors()))
        .and_then(|experiment| experiment.with_groups(&job.sources, &job.sensitivity))
        .map_err(refuse)?;
    let warnings = [doctor::warnings(experiment.scene()), judge::sensor_warnings(&experiment)].concat();
    let walked = walk_here(job, experiment, threads, BUILD, watch).map_err(refuse)?;
    let Some((kept, ending)) = walked else { return Ok(None) };
    if kept.checkpoint.tally.counts.walks == 0 {
        return Err(refuse(
            "no walk was finished in the wall time (nothing is known without one); give a larger budget.wall_seconds",
        ));
    }
    Ok(Some(Answer { kept, ending: Some(ending), warnings }))
}

/// Opens the result of a run by its output folder.
#[pyfunction]
pub(crate) fn load(py: Python<'_>, folder: PathBuf) -> PyResult<Answer> {
    let kept = py.detach(|| StoredRun::open(&folder)).map_err(refuse)?;
    Ok(Answer { kept, ending: None, warnings: Vec::new() })
}

/// The table and the summary of a channel.
type ChannelTables = (Vec<report::Column>, String);

/// Solves a job's scene exactly; tables and summaries (JSON), one of each for a channel.
#[pyfunction]
pub(crate) fn exact<'py>(
    py: Python<'py>,
    source: JobSource<'py>,
    overrides: Vec<String>,
) -> PyResult<Vec<(Vec<PyColumn<'py>>, String)>> {
    let job = source.job(&overrides)?;
    // Dense linear algebra cannot be stopped halfway. On Ctrl-C its thread is left alone, and its result is dropped.
    let (out, solved) = bounded(1);
    thread::Builder::new().spawn(move || out.send(solve(&job)))?;
    let solved = loop {
        match py.detach(|| solved.recv_timeout(ASKED)) {
            Ok(solved) => break solved.map_err(refuse)?,
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(refuse("the solver ended without a result (a fault of the program); report it"));
            }
        }
    };
    solved.into_iter().map(|(columns, summary)| Ok((to_python(py, columns)?, summary))).collect()
}

fn solve(job: &Job) -> Result<Vec<ChannelTables>, String> {
    let words = |error: &dyn std::fmt::Display| error.to_string();
    let scene = job.build_scene().map_err(|error| words(&error))?;
    let answers = results::solve(job, &scene, &|_| (), &|_| ()).map_err(|error| words(&error))?;
    let solved = |answer: &results::ExactAnswer| {
        let (mut table, mut summary) = (Vec::new(), Vec::new());
        report::write_exact(&mut table, scene.faces(), &answer.columns)?;
        answer.summary.write(&mut summary)?;
        Ok((report::read_table(&table)?, String::from_utf8_lossy(&summary).into_owned()))
    };
    answers.iter().map(solved).collect::<std::io::Result<_>>().map_err(|error| words(&error))
}
