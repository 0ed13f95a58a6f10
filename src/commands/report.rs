//! `radwalk report`: makes table, summary, picture and page again, from the tally alone.

use results::{RunOutput, StoredRun};
use voice::Phase;

use crate::args::ReportArgs;
use crate::build::GIT;
use crate::fault::{Fault, Outcome};

/// Makes the files of a result again that follow from its tally.
pub(crate) fn report(args: &ReportArgs) -> Result<Outcome, Fault> {
    let kept = StoredRun::open(&args.run)?;
    let phase = Phase::begin("estimating every patch");
    RunOutput::new(&args.run, true, &args.export.export, GIT)?.rebuild(&kept, &|doing| phase.now(doing))?;
    drop(phase);
    args.told.tell(&args.run, &[format!("written to {}", args.run.display())]);
    Ok(Outcome::Done)
}
