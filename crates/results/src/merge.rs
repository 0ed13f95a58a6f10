//! Several results as one.

use std::path::{Path, PathBuf};

use protocol::{Checkpoint, MergeFault, WalkRange};

use crate::checkpoints::CURRENT;
use crate::error::Error;
use crate::settings::Settings;
use crate::stored_run::StoredRun;

/// Merges the results of some runs into that of the first, in the order given. Settings are those of the first.
///
/// # Errors
/// Where a result cannot be read, is not of the scene and method of the first, or holds walks of one before it.
pub fn merge(first: &Path, others: &[PathBuf]) -> Result<StoredRun, Error> {
    let mut merged = StoredRun::open(first)?;
    let StoredRun { checkpoint, settings, experiment } = &mut merged;
    for run in others {
        let other = Checkpoint::read(&run.join(CURRENT))?;
        add(checkpoint, other, settings).map_err(|fault| Error::Merge { path: run.clone(), fault })?;
    }
    settings.paths = checkpoint.tally.counts.walks.saturating_mul(experiment.unit().paths());
    settings.seed = checkpoint.book.parts.first().map_or(settings.seed, |part| part.seed);
    Ok(merged)
}

fn add(merged: &mut Checkpoint, other: Checkpoint, settings: &Settings) -> Result<(), MergeFault> {
    if merged.scene_hash != other.scene_hash {
        return Err(MergeFault::Scene);
    }
    let is_ours = |part: &WalkRange| part.job_hash == settings.job_hash(merged.scene_hash, part.seed);
    if !other.book.parts.iter().all(is_ours) {
        return Err(MergeFault::Method);
    }
    merged.merge(other)
}
