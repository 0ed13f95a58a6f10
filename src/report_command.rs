//! `radwalk report`: makes table, summary, picture and page again, from the tally alone.

use cluster::checkpoint::{self, CheckpointError};

use crate::args::ReportArgs;
use crate::checkpoints::CURRENT;
use crate::console::say;
use crate::fault::{Fault, Outcome};
use crate::merge::builds;
use crate::outputs::RunOutput;
use crate::replica::{self, check_shape};

/// Makes the files of a result again that follow from its tally.
pub fn report(args: &ReportArgs) -> Result<Outcome, Fault> {
    let path = args.run.join(CURRENT);
    let checkpoint = checkpoint::read(&path)?;
    let kept = |reason| Fault::Kept { path: args.run.clone(), reason, build: builds(&checkpoint) };
    let (settings, experiment) = replica::unpack(&checkpoint.book.job).map_err(kept)?;
    check_shape(&checkpoint.tally, &experiment).map_err(|fault| CheckpointError { path, fault })?;
    RunOutput::new(&args.run, true, &args.export.export)?.rebuild(&settings, &experiment, &checkpoint)?;
    if !args.quiet {
        say(&format!("written to {}", args.run.display()));
    }
    Ok(Outcome::Done)
}
