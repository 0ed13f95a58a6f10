//! The end of a run: its results written to the folder, and a few lines on screen.

use std::io::{IsTerminal as _, Write as _};
use std::{env, fs, io};

use job::OutputFile;
use protocol::Checkpoint;
use radiosity::Experiment;
use results::{Latest, RunOutput, Settings, summary_lines};
use tracing::warn;
use voice::{Phase, emit, say};

use crate::args::OutArgs;
use crate::fault::Fault;

/// Writes what follows from the tally of some walks, which is kept before, and prints a summary. Without walks nothing is written. `joined` is how
/// many workers have joined in this session, if there is one.
///
/// # Errors
/// Where a file cannot be written.
pub(crate) fn write(
    output: &RunOutput,
    (settings, joined): (&Settings, Option<u64>),
    experiment: &Experiment,
    checkpoint: &Checkpoint,
    out: &OutArgs,
) -> Result<(), Fault> {
    if checkpoint.tally.counts.walks == 0 {
        warn!(
            "no walk was finished, so no result is written to {}; one that is there is from before",
            output.path().display()
        );
        return Ok(());
    }
    let phase = Phase::begin("estimating every patch");
    let summary = output.write(settings, experiment, checkpoint, &|doing| phase.now(doing))?;
    drop(phase);
    if out.json {
        emit(&serde_json::json!({"event": "done", "out": output.path(), "paths": summary.paths}));
    } else if !out.quiet {
        summary_lines(&summary, settings, joined).iter().for_each(|line| say(line));
        say(&format!("written to {}", output.path().display()));
        output.left_out_line(settings).iter().for_each(|line| say(line));
        output.digits_line(settings, experiment.scene()).iter().for_each(|line| say(line));
        if settings.files.as_ref().is_none_or(|files| files.contains(&OutputFile::Picture)) {
            show(output);
        }
    }
    Ok(())
}

/// Keeps a tally that was made of others, and writes what follows from it.
///
/// # Errors
/// Where the books do not balance or a file cannot be written.
pub(crate) fn write_made(
    output: &RunOutput,
    settings: &Settings,
    experiment: &Experiment,
    checkpoint: &Checkpoint,
    out: &OutArgs,
) -> Result<(), Fault> {
    if checkpoint.tally.counts.walks > 0 {
        output.keep(checkpoint, Latest::Foreign)?;
    }
    write(output, (settings, None), experiment, checkpoint, out)
}

/// Shows the picture of a run where standard output is a terminal that says it can.
fn show(output: &RunOutput) {
    let [term, program] = ["TERM", "TERM_PROGRAM"].map(|name| env::var(name).unwrap_or_default());
    if !(io::stdout().is_terminal() && report::shows_pictures([&term, &program])) {
        return;
    }
    if let Ok(png) = fs::read(output.path().join(OutputFile::Picture.name())) {
        // A picture that cannot be shown takes nothing from the results, which are in the folder.
        let _ = io::stdout().write_all(report::in_terminal(&png).as_bytes());
    }
}
