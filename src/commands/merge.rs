//! `radwalk merge`: several results as one.

use report::OutputFolder;
use results::factors::{self, FILES, FactorsFault, is_counted, matrices_in};
use results::{RunOutput, StoredRun};
use tracing::warn;
use voice::Phase;

use crate::args::MergeArgs;
use crate::fault::{Fault, Outcome};
use crate::summary::write_made;

/// Merges the runs in the order given; settings are those of the first.
pub(crate) fn merge(args: &MergeArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the results");
    let (first, others) = args.runs.split_first().expect("at least one is required");
    if is_counted(first) {
        return merge_factors(args, phase);
    }
    let StoredRun { checkpoint, settings, experiment } = results::merge(first, others)?;
    drop(phase);
    let output = RunOutput::new(&args.out, args.made.force, &args.made.export.export, crate::build::GIT)?;
    write_made(&output, &settings, &experiment, &checkpoint, &args.made.out())?;
    Ok(Outcome::Done)
}

/// Merges counts of exchange factors. Matrices are written where the first folder has them.
fn merge_factors(args: &MergeArgs, phase: Phase) -> Result<Outcome, Fault> {
    if !args.made.export.export.is_empty() {
        return Err(results::Error::from(FactorsFault::Exports).into());
    }
    let (first, others) = args.runs.split_first().expect("at least one is required");
    let merged = factors::merge(first, others)?;
    let answer = merged.answer()?;
    drop(phase);
    let folder = OutputFolder::claim(&args.out, &FILES, args.made.force)?;
    if args.made.force {
        folder.remove(&FILES)?;
    }
    merged.write(&folder)?;
    answer.write(&folder, &matrices_in(first))?;
    answer.warnings().iter().for_each(|warning| warn!("{warning}"));
    args.made.out().tell(folder.path(), answer.lines());
    Ok(Outcome::Done)
}
