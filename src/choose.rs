//! Jobs whose patches the program cuts: read, tried by a pilot, and cut as it has chosen.

use std::path::Path;

use job::{Forecast, Job, Partition};
use radiosity::Scene;
use report::words::{counted, percent};
use results::{Chosen, PilotRunner, PilotStage, StageResult, all_threads, choose_by};
use tracing::info;
use voice::Phase;

use crate::args::JobArgs;
use crate::fault::Fault;

/// A job that was read, with all of its patches.
pub(crate) struct Read {
    pub(crate) job: Job,
    /// What a pilot chose for it.
    chosen: Option<Chosen>,
}

impl Read {
    /// Whether a pilot has just chosen patches.
    pub(crate) fn is_chosen(&self) -> bool {
        self.chosen.is_some()
    }

    /// The scene of the job, by what a pilot has built of it, and the job.
    ///
    /// # Errors
    /// Where the scene is refused.
    pub(crate) fn build(self) -> Result<(Scene, Job), Fault> {
        let Read { job, chosen } = self;
        let scene = chosen.map_or_else(|| job.build_scene(), |chosen| chosen.build_scene(&job))?;
        Ok((scene, job))
    }
}

/// Reads a job that may leave patches open.
///
/// # Errors
/// Where the job is refused.
pub(crate) fn read(args: &JobArgs) -> Result<Job, Fault> {
    let job = job::load(&args.job, &args.overrides()?)?;
    args.mesh.fit(&job)?;
    Ok(job)
}

/// [`load_anew`] of a job for a command that is about its patches alone: a pilot chooses patches only where the job says `auto`.
///
/// # Errors
/// Where the job is refused.
pub(crate) fn load_written(args: &JobArgs, phase: &Phase) -> Result<Read, Fault> {
    let job = job::load_as_written(&args.job, &args.overrides()?)?;
    args.mesh.fit(&job)?;
    choose_for(job, args, phase, (None, &mut walk_here))
}

/// Reads a job. A pilot chooses the patches that it leaves open, on threads of this process.
///
/// # Errors
/// Where the job is refused.
pub(crate) fn load_anew(args: &JobArgs, phase: &Phase) -> Result<Read, Fault> {
    choose_for(read(args)?, args, phase, (None, &mut walk_here))
}

/// Walks a stage of a pilot on all threads of this process.
pub(crate) fn walk_here(stage: &PilotStage) -> Result<StageResult, Fault> {
    Ok(stage.walk_here(all_threads())?)
}

/// A job with all of its patches: those that were `kept` of an earlier run of it, or those that a pilot chooses that `runner` walks.
///
/// # Errors
/// Where the job is refused, and those of the runner.
pub(crate) fn choose_for(
    job: Job,
    args: &JobArgs,
    phase: &Phase,
    (kept, runner): (Option<Partition>, &mut dyn PilotRunner<Fault>),
) -> Result<Read, Fault> {
    if job.auto.is_none() {
        return Ok(Read { job, chosen: None });
    }
    let chosen = match &kept {
        Some(_) => None,
        None => {
            phase.now("walking a pilot that chooses the patches");
            choose_by(&job, all_threads(), runner)?
        }
    };
    let Some(partition) = kept.as_ref().or(chosen.as_ref().map(|chosen| &chosen.partition)) else {
        return Ok(Read { job, chosen });
    };
    let job = job.cut(&args.overrides()?, partition)?;
    if let Some(forecast) = &job.forecast {
        tell(&job, forecast);
    }
    Ok(Read { job, chosen })
}

/// Says what was chosen.
fn tell(job: &Job, forecast: &Forecast) {
    info!(
        "{} {} chosen, with {} light on each: for {} paths an error of {} is predicted (noise {}, discretisation {}); the pilot took {} paths",
        counted(job.scene.patch_count(), "patch"),
        if job.scene.patch_count() == 1 { "is" } else { "are" },
        if forecast.linear { "linear" } else { "constant" },
        forecast.for_paths,
        percent(forecast.total()),
        percent(forecast.noise),
        percent(forecast.discretisation),
        forecast.paths
    );
}

/// Reads a job for a command that is about given patches.
///
/// # Errors
/// Where the job is refused, or leaves patches open.
pub(crate) fn load_given(path: &Path, overrides: &[String], command: &'static str) -> Result<Job, Fault> {
    given(job::load_as_written(path, overrides)?, command)
}

/// [`load_given`] for a command that light plays no part in.
///
/// # Errors
/// As [`load_given`].
pub(crate) fn load_surfaces(path: &Path, overrides: &[String], command: &'static str) -> Result<Job, Fault> {
    given(job::load_surfaces(path, overrides)?, command)
}

/// A job whose patches are not left open.
fn given(job: Job, command: &'static str) -> Result<Job, Fault> {
    match job.auto {
        None => Ok(job),
        Some(_) => Err(Fault::OpenPatches { path: job.path, name: job.name, command }),
    }
}
