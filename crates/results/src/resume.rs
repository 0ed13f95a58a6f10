//! What a run goes on from: the latest usable checkpoint of its output folder.

use std::path::Path;

use job::MethodTable;
use protocol::{Book, Checkpoint, CheckpointError, CheckpointFault, Past};
use radiosity::Experiment;

use crate::checkpoints::{Identity, Latest, ResumePoint, find, session};
use crate::error::Error;
use crate::replica::{check_shape, unpack};
use crate::settings::Settings;

/// The state of an earlier run from its checkpoint.
pub struct Resumed {
    /// The walks that are done, and their books.
    pub past: Past,
    /// What the latest tally of the folder is to the run.
    pub latest: Latest,
    /// Why the latest checkpoint was not used, where it was not.
    pub passed_over: Option<CheckpointError>,
    /// The paths that are done.
    pub paths: u64,
}

/// Finds what a run in `folder` goes on from; `None` where there is no checkpoint. The run's session, of this `build`, joins those of
/// `identity`.
///
/// # Errors
/// Where no checkpoint there is of this job, and where one holds more than the job's `budget` [paths].
pub fn resume(
    folder: &Path,
    identity: &mut Identity,
    (settings, experiment): (&Settings, &Experiment),
    budget: u64,
    build: &str,
) -> Result<Option<Resumed>, Error> {
    let Identity { scene_hash, job_hash, first, .. } = &*identity;
    let fits = |checkpoint: &Checkpoint| {
        checkpoint.check_job(scene_hash, job_hash, *first)?;
        check_shape(&checkpoint.tally, experiment)
    };
    let found = find(folder, fits).map_err(|error| explain(error, settings, experiment))?;
    let Some(ResumePoint { checkpoint, passed_over }) = found else { return Ok(None) };
    let paths = checkpoint.tally.counts.walks.saturating_mul(experiment.unit().paths());
    if paths > budget {
        return Err(Error::BeyondBudget { walks: paths, paths: budget });
    }
    let latest = if passed_over.is_some() { Latest::Damaged } else { Latest::Good };
    Ok(Some(Resumed { past: go_on_from(checkpoint, identity, build), latest, passed_over, paths }))
}

/// Why a checkpoint is of no use: the length of batches may have changed with the budget alone.
fn explain(error: CheckpointError, settings: &Settings, experiment: &Experiment) -> Error {
    let theirs = || {
        let kept = Checkpoint::read(&error.path).ok()?.book.job;
        let (theirs, _) = unpack(&kept).ok()?;
        let rays = theirs.method.batch_paths?;
        let method = MethodTable { batch_paths: settings.method.batch_paths, ..theirs.method };
        ((method, theirs.seed) == (settings.method.clone(), settings.seed)).then_some(rays)
    };
    match (experiment.unit().batch(), &error.fault) {
        (Some(ours), CheckpointFault::ForeignJob) => match theirs().filter(|&theirs| theirs != ours) {
            Some(theirs) => Error::OtherBatches { theirs, ours },
            None => error.into(),
        },
        _ => error.into(),
    }
}

fn go_on_from(Checkpoint { tally, book, .. }: Checkpoint, identity: &mut Identity, build: &str) -> Past {
    let walks = tally.counts.walks;
    let Book { parts, out_of_order, workers, mut looks, goal, effort, sessions, .. } = book;
    // Looks at another target have decided nothing.
    if goal != identity.goal {
        looks.iter_mut().for_each(|look| (look.promising, look.reached) = (false, false));
    }
    looks.retain(|look| look.walks <= walks);
    // Of this job there is one part: that was checked.
    let deliveries = parts.into_iter().next().map(|part| part.deliveries).unwrap_or_default();
    identity.sessions = sessions;
    identity.sessions.push(session(build));
    Past { tally, deliveries, out_of_order, workers, looks, effort }
}
