//! `radwalk combine`: mixtures of sources.

use std::path::{Path, PathBuf};

use results::{RunOutput, StoredRun};
use voice::Phase;

use crate::args::CombineArgs;
use crate::fault::{Fault, Outcome};
use crate::summary::write_made;

/// Tells of a result with other factors of its sources.
pub(crate) fn combine(args: &CombineArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the result");
    let StoredRun { checkpoint, settings, experiment } = results::combine(&args.run, &args.set)?;
    drop(phase);
    let folder = args.out.clone().unwrap_or_else(|| beside(&args.run));
    let output = RunOutput::new(&folder, args.made.force, &args.made.export.export, crate::build::GIT)?;
    write_made(&output, &settings, &experiment, &checkpoint, &args.made.out())?;
    Ok(Outcome::Done)
}

/// The folder of a mixture of the sources of a run.
fn beside(run: &Path) -> PathBuf {
    // The path of a folder may end with a slash, or be `.`.
    let run = run.canonicalize().unwrap_or_else(|_| run.into());
    let name = run.file_name().map_or_else(|| "out".into(), |name| name.to_string_lossy().into_owned());
    run.with_file_name(format!("{name}-mix"))
}
