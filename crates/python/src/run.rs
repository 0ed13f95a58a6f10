//! Jobs, walked and solved.

use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use crossbeam::channel::{RecvTimeoutError, bounded};
use job::Job;
use pyo3::prelude::*;
use radiosity::Experiment;
use results::{Kept, Stage, all_threads, choose, walk_here};

use crate::answer::Answer;
use crate::mesh::ArrayMesh;
use crate::refusal::refuse;
use crate::table::{PyColumn, to_python};

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

impl JobSource<'_> {
    /// The job with the patches that the scene has, where light plays no part.
    pub(crate) fn surfaces(&self, overrides: &[String]) -> PyResult<Job> {
        match self {
            JobSource::Mesh(mesh) => job::load_mesh(&mesh.name, mesh.mesh.clone(), overrides),
            JobSource::File(path) => job::load_surfaces(path, overrides),
        }
        .map_err(refuse)
    }

    /// The job as it is written, with the patches that the scene has.
    pub(crate) fn as_written(&self, overrides: &[String]) -> PyResult<Job> {
        match self {
            JobSource::Mesh(mesh) => job::load_mesh(&mesh.name, mesh.mesh.clone(), overrides),
            JobSource::File(path) => job::load_as_written(path, overrides),
        }
        .map_err(refuse)
    }

    /// The job, with the patches that a pilot chooses where it leaves them open.
    fn job(&self, overrides: &[String]) -> PyResult<Job> {
        let job = match self {
            JobSource::Mesh(mesh) => job::load_mesh(&mesh.name, mesh.mesh.clone(), overrides),
            JobSource::File(path) => job::load(path, overrides),
        }
        .map_err(refuse)?;
        let Some(chosen) = choose(&job, all_threads()).map_err(refuse)? else { return Ok(job) };
        job.cut(overrides, &chosen.partition).map_err(refuse)
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
    let mut trouble = None;
    // The interpreter is taken for as long as it takes to ask for signals and to call the watcher, and let go while walks go on.
    let mut ask = |stage: Stage| {
        let asked = Python::attach(|py| {
            py.check_signals()?;
            let Stage { paths, paths_total, seconds, median_relative_error } = stage;
            let told = (paths, paths_total, seconds, median_relative_error);
            watch.as_ref().map_or(Ok(()), |watch| watch.call1(py, told).map(drop))
        });
        trouble = asked.err();
        trouble.is_none()
    };
    let done = py.detach(|| walk(&job, threads, &mut ask));
    match (trouble, done?) {
        (Some(trouble), _) => Err(trouble),
        (None, Some(answer)) => Ok(answer),
        (None, None) => unreachable!("walks are given up for trouble alone"),
    }
}

fn walk(job: &Job, threads: usize, watch: &mut dyn FnMut(Stage) -> bool) -> PyResult<Option<Answer>> {
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
    let kept = py.detach(|| Kept::open(&folder)).map_err(refuse)?;
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
