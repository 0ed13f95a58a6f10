//! `radwalk merge`: several results as one.

use results::{Kept, Latest, RunOutput};
use voice::Phase;

use crate::args::MergeArgs;
use crate::fault::{Fault, Outcome};
use crate::summary::write;

/// Merges the runs in the order given; settings are those of the first.
pub(crate) fn merge(args: &MergeArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the results");
    let (first, others) = args.runs.split_first().expect("at least one is required");
    let Kept { checkpoint, settings, experiment } = results::merge(first, others)?;
    drop(phase);
    let output = RunOutput::new(&args.out, args.made.force, &args.made.export.export, crate::build::GIT)?;
    write(&output, &settings, &experiment, &checkpoint, Latest::Foreign, &args.made.out())?;
    Ok(Outcome::Done)
}
