//! `radwalk merge`: several results as one.

use cluster::checkpoint::{self, Checkpoint, CheckpointError};
use cluster::merge::MergeFault;

use crate::args::{MergeArgs, OutArgs};
use crate::checkpoints::{CURRENT, Latest};
use crate::console::Phase;
use crate::fault::{Fault, Outcome};
use crate::outputs::RunOutput;
use crate::replica::{self, check_shape};
use crate::settings::Settings;

/// Merges the runs in the order given; settings are those of the first.
pub fn merge(args: &MergeArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the results");
    let (first, others) = args.runs.split_first().expect("at least one is required");
    let mut merged = checkpoint::read(&first.join(CURRENT))?;
    let (mut settings, experiment) = replica::unpack(&merged.book.job).map_err(|reason| Fault::Kept {
        path: first.clone(),
        reason,
        build: builds(&merged),
    })?;
    check_shape(&merged.tally, &experiment)
        .map_err(|fault| CheckpointError { path: first.join(CURRENT), fault })?;
    for path in others {
        let other = checkpoint::read(&path.join(CURRENT))?;
        add(&mut merged, other, &settings).map_err(|fault| Fault::Merge { path: path.clone(), fault })?;
    }
    settings.paths = merged.tally.counts.walks.saturating_mul(experiment.paths_per_walk());
    settings.seed = merged.book.parts.first().map_or(settings.seed, |part| part.seed);
    drop(phase);
    let output = RunOutput::new(&args.out, args.force, &args.export.export)?;
    let out = OutArgs { out: None, force: args.force, quiet: args.quiet, json: false };
    output.write(&settings, &experiment, &merged, Latest::Foreign, &out)?;
    Ok(Outcome::Done)
}

fn add(merged: &mut Checkpoint, other: Checkpoint, settings: &Settings) -> Result<(), MergeFault> {
    if merged.scene_hash != other.scene_hash {
        return Err(MergeFault::Scene);
    }
    let is_ours = |part: &checkpoint::Part| {
        part.job_hash == job::job_hash(merged.scene_hash, &settings.method, &settings.sensors, part.seed)
    };
    if !other.book.parts.iter().all(is_ours) {
        return Err(MergeFault::Method);
    }
    merged.merge(other)
}

/// Who wrote a result.
pub fn builds(checkpoint: &Checkpoint) -> String {
    let mut builds: Vec<&str> = checkpoint.book.sessions.iter().map(|session| &session.build[..]).collect();
    builds.dedup();
    builds.join(", ")
}
