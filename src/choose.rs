//! Jobs whose patches the program cuts: read, tried by a pilot, and read again with the patches that it has chosen.

use std::path::Path;

use job::{Forecast, Job, Partition};
use report::words::{counted, percent};
use results::{all_threads, choose};
use tracing::info;
use voice::Phase;

use crate::args::JobArgs;
use crate::fault::Fault;

/// Reads a job. A pilot chooses the patches that it leaves open, unless `kept` finds those of an earlier run of the job.
///
/// # Errors
/// Where the job is refused.
pub(crate) fn load(
    args: &JobArgs,
    phase: &Phase,
    kept: impl FnOnce(&Job) -> Option<Partition>,
) -> Result<Job, Fault> {
    let job = job::load(&args.job, &args.overrides())?;
    if job.auto.is_none() {
        return Ok(job);
    }
    let chosen = match kept(&job) {
        Some(partition) => Some(partition),
        None => {
            phase.now("walking a pilot that chooses the patches");
            choose(&job, all_threads())?
        }
    };
    let Some(partition) = chosen else { return Ok(job) };
    phase.now("reading the scene");
    let job = job::load_cut(&args.job, &args.overrides(), &partition)?;
    if let Some(forecast) = &job.forecast {
        tell(&job, forecast);
    }
    Ok(job)
}

/// Says what was chosen.
fn tell(job: &Job, forecast: &Forecast) {
    info!(
        "{} are chosen, with {} light on each: for {} paths an error of {} is foretold (noise {}, discretisation {}); the pilot took {} paths",
        counted(job.scene.patch_count(), "patch"),
        if forecast.linear { "linear" } else { "constant" },
        forecast.for_paths,
        percent(forecast.total()),
        percent(forecast.noise),
        percent(forecast.discretisation),
        forecast.paths
    );
}

/// [`load`] of a job that no earlier run has cut.
///
/// # Errors
/// Where the job is refused.
pub(crate) fn load_anew(args: &JobArgs, phase: &Phase) -> Result<Job, Fault> {
    load(args, phase, |_| None)
}

/// Reads a job for a command that is about given patches.
///
/// # Errors
/// Where the job is refused, or leaves patches open.
pub(crate) fn load_given(path: &Path, overrides: &[String], command: &'static str) -> Result<Job, Fault> {
    let job = job::load(path, overrides)?;
    match job.auto {
        None => Ok(job),
        Some(_) => Err(Fault::OpenPatches { path: job.path, name: job.name, command }),
    }
}
