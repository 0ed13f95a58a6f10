//! The state of a job in words: for the display of a run, and for `radwalk status`.

use std::path::Path;

use report::words::{counted, duration, percent, quantity};
use serde_json::Value;

use crate::run_status::{FaultCounts, Goal, RunStatus};
use crate::status::{Report, WorkerStatus};

/// The most workers that are listed one by one.
const LISTED: usize = 40;

impl RunStatus {
    /// Where the run will probably end: at its targets or its budget.
    pub fn end(&self) -> u64 {
        self.paths_expected.map_or(self.paths_total, |paths| paths.min(self.paths_total))
    }

    /// The state in a line of at most `columns` characters; what matters least is left out.
    pub fn line(&self, columns: usize) -> String {
        fitted(&parts(self), columns)
    }
}

impl Report {
    /// The state of the job, a sentence or two a line.
    pub fn lines(&self) -> Vec<String> {
        let Report { status, workers, .. } = self;
        let error = |error: Option<f64>| percent(error.unwrap_or(f64::INFINITY));
        let mut lines = vec![self.progress()];
        lines.extend(status.target.iter().map(of_target));
        let of_sensors = status.paths_expected.filter(|_| status.target.is_none());
        lines.extend(of_sensors.map(|paths| format!("target on sensors: {}", expected(paths))));
        lines.push(format!(
            "median relative half-width by area {}, of the worst face {}",
            error(status.median_relative_error),
            error(status.max_relative_error)
        ));
        lines.extend(of_workers(status, workers));
        lines.push(status.checkpoint.map_or("no checkpoint in this session yet".into(), |saved| {
            let (ago, paths) = (duration(saved.seconds_ago), quantity(saved.paths as f64));
            format!("last checkpoint: {ago} ago, {paths} paths")
        }));
        lines.push(of_faults(status.faults));
        lines
    }

    fn progress(&self) -> String {
        let Report { description, status, .. } = self;
        let part = 100.0 * status.paths as f64 / status.paths_total.max(1) as f64;
        format!(
            "{}: {} of {} paths ({part:.1} %) after {}, coordinated by process {} of {}",
            description.job,
            quantity(status.paths as f64),
            quantity(status.paths_total as f64),
            duration(status.seconds),
            self.pid,
            self.host
        )
    }
}

fn of_target(goal: &Goal) -> String {
    let expected = goal.paths_expected.map_or("no walk count can be predicted yet".into(), expected);
    format!(
        "target: {} of the area within {}, now within {}; {expected}",
        percent(goal.fraction),
        percent(goal.relative_error),
        percent(goal.decisive_error.unwrap_or(f64::INFINITY))
    )
}

fn expected(paths: u64) -> String {
    format!("expected at {} paths", quantity(paths as f64))
}

/// The workers and their rates.
fn of_workers(status: &RunStatus, workers: &[WorkerStatus]) -> Vec<String> {
    let left = status.seconds_left.map_or(String::new(), |left| format!(", {} left", duration(left)));
    let mut lines = vec![match status.workers {
        0 => "no worker is there: nothing is walked".into(),
        workers => format!(
            "{}: {} paths/s, {} rays/s{left}",
            counted(workers as u64, "worker"),
            quantity(status.paths_per_second),
            quantity(status.rays_per_second)
        ),
    }];
    lines.extend(workers.iter().take(LISTED).map(|worker| {
        let faults = match worker.faults {
            0 => String::new(),
            faults => format!(", {faults} of its results were impossible"),
        };
        format!(
            "  {}: {}, {} paths/s, {} paths in the result, {}{faults}",
            worker.name,
            counted(worker.threads as u64, "thread"),
            quantity(worker.paths_per_second),
            quantity(worker.paths as f64),
            counted(worker.leases as u64, "lease")
        )
    }));
    if status.workers > LISTED {
        lines.push(format!("  and {} more", status.workers - LISTED));
    }
    lines
}

fn of_faults(faults: FaultCounts) -> String {
    let FaultCounts { workers_lost, workers_refused, connections_failed, checkpoints_failed } = faults;
    let faults = [
        (workers_lost, "worker", "lost or left early"),
        (workers_refused, "worker", "not let in"),
        (connections_failed, "connection", "failed"),
        (checkpoints_failed, "checkpoint", "could not be written"),
    ];
    let faults = faults.iter().filter(|(number, ..)| *number > 0);
    let faults: Vec<String> =
        faults.map(|(number, noun, what)| format!("{} {what}", counted(*number, noun))).collect();
    if faults.is_empty() { "no faults seen".into() } else { format!("faults: {}", faults.join(", ")) }
}

/// What a summary says of a job that has ended; `of` is what the user asked about.
pub fn ended(of: &Path, summary: &Value) -> String {
    let target = match summary["target"]["reached"].as_bool() {
        Some(true) => ", target reached",
        Some(false) => ", target not reached",
        None => "",
    };
    let paths = &summary["paths"];
    format!("no coordinator reports to {}; its result holds {paths} paths{target}", of.display())
}

/// What a line says, the most important first.
fn parts(status: &RunStatus) -> Vec<String> {
    let error = match (status.target, status.median_relative_error) {
        (Some(goal), _) => Some(format!(
            "error {} (target {})",
            percent(goal.decisive_error.unwrap_or(f64::INFINITY)),
            short_percent(goal.relative_error)
        )),
        (None, Some(median)) => Some(format!("half within {}", percent(median))),
        (None, None) => None,
    };
    let works = status.workers > 0;
    let left = status.seconds_left.filter(|_| works).map(|seconds| format!("{} left", duration(seconds)));
    let workers = if works { counted(status.workers as u64, "worker") } else { "no worker".into() };
    let rate = works.then(|| format!("{} rays/s", quantity(status.rays_per_second)));
    let saved = status.checkpoint.map(|saved| format!("saved {} ago", duration(saved.seconds_ago.floor())));
    let worst = status.max_relative_error.map(|worst| format!("worst {}", percent(worst)));
    let paths = works.then(|| format!("{} paths/s", quantity(status.paths_per_second)));
    [error, left, Some(workers), rate, saved, worst, paths].into_iter().flatten().collect()
}

/// Joins as many of the parts as fit in a line of `columns` characters.
fn fitted(parts: &[String], columns: usize) -> String {
    let mut line = String::new();
    for part in parts {
        let joint = if line.is_empty() { "" } else { " · " };
        if [&line[..], joint, part].iter().map(|text| text.chars().count()).sum::<usize>() > columns {
            break;
        }
        line += joint;
        line += part;
    }
    line
}

/// A relative error that was asked for, in percent, as people write it.
fn short_percent(x: f64) -> String {
    format!("{} %", (1e8 * x).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run_status::Saved;

    fn status() -> RunStatus {
        RunStatus {
            seconds: 4000.0,
            paths: 123_456_789,
            paths_total: 10_000_000_000,
            paths_per_second: 1_234_567.0,
            rays_per_second: 12_345_678.0,
            workers: 12,
            median_relative_error: Some(0.01234),
            rms_relative_error: Some(0.02),
            max_relative_error: Some(0.23456),
            target: Some(Goal {
                relative_error: 0.0125,
                fraction: 0.99,
                decisive_error: Some(0.054_321),
                paths_expected: Some(1_000_000_000),
            }),
            paths_expected: Some(1_000_000_000),
            seconds_left: Some(4680.0),
            checkpoint: Some(Saved { seconds_ago: 31.4, paths: 123_000_000 }),
            faults: FaultCounts::default(),
        }
    }

    /// What the terminal would cut is left out, the least important first.
    #[test]
    fn lines_fit_their_columns() {
        let at = |columns: usize| status().line(columns);
        assert_eq!(at(61), "error 5.432 % (target 1.25 %) · 1 h 18 min left · 12 workers");
        assert_eq!(
            at(121),
            "error 5.432 % (target 1.25 %) · 1 h 18 min left · 12 workers · 12.3 M rays/s · saved 31.0 s ago · worst 23.456 %"
        );
        (20..200).for_each(|columns| assert!(at(columns).chars().count() <= columns));
    }

    #[test]
    fn nothing_is_predicted_without_workers() {
        let line = RunStatus { workers: 0, ..status() }.line(400);
        assert!(line.contains("no worker") && !line.contains("left") && !line.contains("/s"), "{line}");
    }

    /// The percentage of a bar is that of the way to the target.
    #[test]
    fn bars_end_at_the_target() {
        assert_eq!(status().end(), 1_000_000_000);
        assert_eq!(RunStatus { paths_expected: None, ..status() }.end(), 10_000_000_000);
    }
}
