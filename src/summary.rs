//! The end of a run: its results written to the folder, and a few lines on screen.

use protocol::Checkpoint;
use radiosity::Experiment;
use results::{Latest, RunOutput, Settings, summary_lines};
use tracing::warn;
use voice::{Phase, emit, say};

use crate::args::OutArgs;
use crate::fault::Fault;

/// Writes the results of some walks and prints a summary. Without walks nothing is written. `joined` is how many workers have
/// joined in this session, if there is one.
///
/// # Errors
/// Where the books do not balance or a file cannot be written.
pub(crate) fn write(
    output: &RunOutput,
    (settings, joined): (&Settings, Option<u64>),
    experiment: &Experiment,
    checkpoint: &Checkpoint,
    latest: Latest,
    out: &OutArgs,
) -> Result<(), Fault> {
    if checkpoint.tally.counts.walks == 0 {
        warn!(
            "no walk was finished, so nothing is written to {}; what is there is from before",
            output.path().display()
        );
        return Ok(());
    }
    let phase = Phase::begin("estimating every patch");
    let summary = output.write(settings, experiment, checkpoint, latest, &|doing| phase.now(doing))?;
    drop(phase);
    if out.json {
        emit(&serde_json::json!({"event": "done", "out": output.path(), "paths": summary.paths}));
    } else if !out.quiet {
        summary_lines(&summary, settings, joined).iter().for_each(|line| say(line));
        say(&format!("written to {}", output.path().display()));
        output.left_out_line(settings).iter().for_each(|line| say(line));
        output.digits_line(settings, experiment.scene()).iter().for_each(|line| say(line));
    }
    Ok(())
}
