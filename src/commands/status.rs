//! `radwalk status`: the state of a running job, or the end of one.

use monitor::{JobState, ended, find, watched};
use results::unix_seconds;
use serde_json::json;
use voice::say;

use crate::args::StatusArgs;
use crate::fault::{Fault, Outcome};

/// Prints the state of the job of an access file or an output folder.
pub(crate) fn status(args: &StatusArgs) -> Result<Outcome, Fault> {
    match find(&args.of)? {
        JobState::Summary(summary) => {
            if args.json {
                say(&json!({"state": "done", "summary": summary}).to_string());
            } else {
                say(&ended(&args.of, &summary));
            }
            Ok(Outcome::Done)
        }
        JobState::Report(file, report) => {
            let (report, alive) = watched(&file, *report);
            if args.json {
                let mut line = serde_json::to_value(&report).expect("numbers and names");
                line["state"] = if alive { "running" } else { "silent" }.into();
                say(&line.to_string());
            } else {
                report.lines().iter().for_each(|line| say(line));
            }
            let seconds = unix_seconds().saturating_sub(report.time);
            if alive {
                Ok(Outcome::Done)
            } else {
                Err(Fault::Silent { host: report.host, pid: report.pid, seconds })
            }
        }
    }
}
