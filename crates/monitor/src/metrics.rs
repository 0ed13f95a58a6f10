//! A report as metrics in the text format of Prometheus.

use std::fmt::Write as _;

use crate::run_status::RunStatus;
use crate::status::Report;

/// One metric: its name after `radwalk_`, its kind, its help text, and its value if that is known.
type Metric = (&'static str, &'static str, &'static str, Option<f64>);

/// The page of metrics of a report.
pub(crate) fn metrics(report: &Report) -> String {
    let mut text = String::new();
    // Numbers that are not known are left out.
    for (name, kind, help, value) in numbers(&report.status) {
        let Some(value) = value else { continue };
        add(&mut text, name, kind, help);
        add_value(&mut text, name, "", value);
    }
    add(&mut text, "job_info", "gauge", "The job.");
    add_value(&mut text, "job_info", &format!("job=\"{}\"", label(&report.description.job)), 1.0);
    add(&mut text, "worker_paths_per_second", "gauge", "As far as each worker has shown.");
    for status in &report.workers {
        let worker = format!("worker=\"{}\"", label(&status.name));
        add_value(&mut text, "worker_paths_per_second", &worker, status.paths_per_second);
    }
    text
}

/// Adds the lines that describe a metric. Writing to a string cannot fail.
fn add(text: &mut String, name: &str, kind: &str, help: &str) {
    let _ = writeln!(text, "# HELP radwalk_{name} {help}\n# TYPE radwalk_{name} {kind}");
}

fn add_value(text: &mut String, name: &str, labels: &str, value: f64) {
    let _ = match labels {
        "" => writeln!(text, "radwalk_{name} {value}"),
        _ => writeln!(text, "radwalk_{name}{{{labels}}} {value}"),
    };
}

fn numbers(status: &RunStatus) -> impl Iterator<Item = Metric> {
    let groups = [progress(status), errors(status), ends(status), faults(status)];
    groups.into_iter().flatten()
}

/// The metrics of the job's progress and speed.
fn progress(status: &RunStatus) -> Vec<Metric> {
    vec![
        ("seconds", "gauge", "Seconds since this coordinator began.", Some(status.seconds)),
        ("paths", "gauge", "Paths that are in, earlier sessions included.", Some(status.paths as f64)),
        ("paths_budget", "gauge", "Paths of the budget.", Some(status.paths_total as f64)),
        ("paths_per_second", "gauge", "Of the last half minute.", Some(status.paths_per_second)),
        ("rays_per_second", "gauge", "Of the last half minute.", Some(status.rays_per_second)),
        ("workers", "gauge", "Workers that walk now.", Some(status.workers as f64)),
    ]
}

/// The metrics of its errors and of its target.
fn errors(status: &RunStatus) -> Vec<Metric> {
    let goal = status.target;
    let (median, max) = (status.median_relative_error, status.max_relative_error);
    let decisive = goal.and_then(|goal| goal.decisive_error);
    vec![
        ("relative_error_median", "gauge", "Half of the area is known within this part.", median),
        ("relative_error_max", "gauge", "Half-width over estimate of the worst face.", max),
        ("relative_error_target", "gauge", "Asked for.", goal.map(|goal| goal.relative_error)),
        ("relative_error_decisive", "gauge", "What the target's part of the area is known within.", decisive),
    ]
}

/// The metrics of its end and of its last checkpoint.
fn ends(status: &RunStatus) -> Vec<Metric> {
    let expected = status.paths_expected.map(|paths| paths as f64);
    let saved = status.checkpoint;
    let age = saved.map(|saved| saved.seconds_ago);
    let paths = saved.map(|saved| saved.paths as f64);
    vec![
        ("paths_expected", "gauge", "Where the target will probably be reached.", expected),
        ("seconds_left", "gauge", "To the target or the end of the budget.", status.seconds_left),
        ("checkpoint_age_seconds", "gauge", "Since the last checkpoint of this session.", age),
        ("checkpoint_paths", "gauge", "Paths of the last checkpoint.", paths),
    ]
}

/// The metrics of its faults.
fn faults(status: &RunStatus) -> Vec<Metric> {
    let faults = status.faults;
    let count = |number: u64| Some(number as f64);
    vec![
        (
            "workers_lost_total",
            "counter",
            "Workers that were lost or left early.",
            count(faults.workers_lost),
        ),
        ("workers_refused_total", "counter", "Workers that were not let in.", count(faults.workers_refused)),
        ("connections_failed_total", "counter", "Connections that failed.", count(faults.connections_failed)),
        (
            "checkpoints_failed_total",
            "counter",
            "Checkpoints that could not be written.",
            count(faults.checkpoints_failed),
        ),
    ]
}

/// The value of a label, with its quotes escaped.
fn label(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_escaped() {
        assert_eq!(label("a\"b\\c\nd"), "a\\\"b\\\\c\\nd");
    }
}
