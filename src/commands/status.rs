//! `radwalk status`: the state of a running job, or the end of one.

use std::path::Path;

use monitor::{Faults, Found, Goal, Hand, Report, Standing, find, watched};
use report::words::{counted, duration, percent, quantity};
use results::unix_seconds;
use serde_json::{Value, json};
use voice::say;

use crate::args::StatusArgs;
use crate::fault::{Fault, Outcome};

/// The most workers that are printed one by one.
const TOLD: usize = 40;

/// Prints the state of the job of an access file or an output folder.
pub(crate) fn status(args: &StatusArgs) -> Result<Outcome, Fault> {
    match find(&args.of)? {
        Found::Summary(summary) => {
            if args.json {
                say(&json!({"state": "done", "summary": summary}).to_string());
            } else {
                describe_summary(&args.of, &summary);
            }
            Ok(Outcome::Done)
        }
        Found::Report(file, report) => {
            let (report, alive) = watched(&file, *report);
            if args.json {
                let mut line = serde_json::to_value(&report).expect("numbers and names");
                line["state"] = if alive { "running" } else { "silent" }.into();
                say(&line.to_string());
            } else {
                describe(&report);
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

fn describe(report: &Report) {
    let Report { description, standing, crew, .. } = report;
    let part = 100.0 * standing.paths as f64 / standing.paths_total.max(1) as f64;
    say(&format!(
        "{}: {} of {} paths ({part:.1} %) after {}, coordinated by process {} of {}",
        description.job,
        quantity(standing.paths as f64),
        quantity(standing.paths_total as f64),
        duration(standing.seconds),
        report.pid,
        report.host
    ));
    standing.target.iter().for_each(describe_target);
    if let (None, Some(paths)) = (&standing.target, standing.paths_expected) {
        say(&format!("target on sensors: {}", expected(paths)));
    }
    let error = |error: Option<f64>| percent(error.unwrap_or(f64::INFINITY));
    say(&format!(
        "half of the area is known within {}, the worst face within {}",
        error(standing.median_relative_error),
        error(standing.max_relative_error)
    ));
    describe_crew(standing, crew);
    say(&standing.checkpoint.map_or("no checkpoint in this session yet".into(), |saved| {
        format!(
            "last checkpoint: {} ago, {} paths",
            duration(saved.seconds_ago),
            quantity(saved.paths as f64)
        )
    }));
    describe_faults(standing.faults);
}

fn describe_target(goal: &Goal) {
    let expected = goal.paths_expected.map_or("no walk count can be predicted yet".into(), expected);
    say(&format!(
        "target: {} of the area within {}, now within {}; {expected}",
        percent(goal.fraction),
        percent(goal.relative_error),
        percent(goal.decisive_error.unwrap_or(f64::INFINITY))
    ));
}

fn expected(paths: u64) -> String {
    format!("expected at {} paths", quantity(paths as f64))
}

/// Prints the workers and their rates.
fn describe_crew(standing: &Standing, crew: &[Hand]) {
    if standing.workers == 0 {
        say("no worker is there: nothing is walked");
    } else {
        let left = standing.seconds_left.map_or(String::new(), |left| format!(", {} left", duration(left)));
        say(&format!(
            "{}: {} paths/s, {} rays/s{left}",
            counted(standing.workers as u64, "worker"),
            quantity(standing.paths_per_second),
            quantity(standing.rays_per_second)
        ));
    }
    for hand in crew.iter().take(TOLD) {
        let faults = match hand.faults {
            0 => String::new(),
            faults => format!(", {faults} of its results were impossible"),
        };
        say(&format!(
            "  {}: {}, {} paths/s, {} paths in the result, {}{faults}",
            hand.name,
            counted(hand.threads as u64, "thread"),
            quantity(hand.paths_per_second),
            quantity(hand.paths as f64),
            counted(hand.leases as u64, "lease")
        ));
    }
    if standing.workers > TOLD {
        say(&format!("  and {} more", standing.workers - TOLD));
    }
}

fn describe_faults(faults: Faults) {
    let Faults { workers_lost, workers_refused, connections_failed, checkpoints_failed } = faults;
    let told = [
        (workers_lost, "worker", "lost or left early"),
        (workers_refused, "worker", "not let in"),
        (connections_failed, "connection", "failed"),
        (checkpoints_failed, "checkpoint", "could not be written"),
    ];
    let told = told.iter().filter(|(number, ..)| *number > 0);
    let told: Vec<String> =
        told.map(|(number, noun, what)| format!("{} {what}", counted(*number, noun))).collect();
    say(&if told.is_empty() { "no faults seen".into() } else { format!("faults: {}", told.join(", ")) });
}

/// A job that has ended.
fn describe_summary(of: &Path, summary: &Value) {
    let target = match summary["target"]["reached"].as_bool() {
        Some(true) => ", target reached",
        Some(false) => ", target not reached",
        None => "",
    };
    say(&format!(
        "no coordinator reports to {}; its result holds {} paths{target}",
        of.display(),
        summary["paths"]
    ));
}
