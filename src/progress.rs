//! What is shown while a job runs: a bar on a terminal, a line now and then elsewhere, JSON lines on request.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use cluster::lead::Notice;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use monitor::Standing;
use report::words::{counted, duration, percent, quantity};
use rustix::termios::tcgetwinsize;
use serde_json::{Value, json};
use tracing::{info, warn};
use voice::{emit, keep_below};

use crate::args::OutArgs;

/// Between two updates of a bar or of JSON lines.
const INTERVAL: Duration = Duration::from_millis(500);

/// Between two lines where stderr is no terminal.
const PLAIN_INTERVAL: Duration = Duration::from_secs(30);

/// Columns of a terminal that does not say.
const COLUMNS: usize = 80;

/// Columns that the bar and its percentage take.
const BAR_COLUMNS: usize = 19;

/// Lines elsewhere are not cut.
const PLAIN_COLUMNS: usize = 400;

enum Style {
    Quiet,
    Json,
    Bar(ProgressBar),
    Plain,
}

/// The display of one run.
pub(crate) struct Display {
    style: Style,
    shown: Instant,
}

impl Display {
    /// A display in the style that was asked for and that stderr can show.
    pub(crate) fn new(args: &OutArgs) -> Self {
        let style = match () {
            () if args.json => Style::Json,
            () if args.quiet => Style::Quiet,
            () if std::io::stderr().is_terminal() => Style::Bar(bar()),
            () => Style::Plain,
        };
        if let Style::Bar(bar) = &style {
            keep_below(Some(bar.clone()));
        }
        Display { style, shown: Instant::now() }
    }

    /// Whether it is time to show where the job stands.
    pub(crate) fn is_due(&self) -> bool {
        let interval = match self.style {
            Style::Quiet => return false,
            Style::Plain => PLAIN_INTERVAL,
            Style::Json | Style::Bar(_) => INTERVAL,
        };
        self.shown.elapsed() >= interval
    }

    /// Shows where the job stands.
    pub(crate) fn show(&mut self, standing: &Standing) {
        self.shown = Instant::now();
        match &self.style {
            Style::Quiet => {}
            Style::Json => emit(&event(standing)),
            Style::Bar(bar) => {
                bar.set_length(end(standing));
                bar.set_position(standing.paths);
                bar.set_message(fitted(&parts(standing), columns().saturating_sub(BAR_COLUMNS)));
            }
            Style::Plain => info!(
                "{} of {} paths · {}",
                standing.paths,
                standing.paths_total,
                fitted(&parts(standing), PLAIN_COLUMNS)
            ),
        }
    }

    /// Clears the display at the end.
    pub(crate) fn finish(&self) {
        if let Style::Bar(bar) = &self.style {
            bar.finish_and_clear();
            keep_below(None);
        }
    }
}

/// Says what happened to a worker.
pub(crate) fn tell_notice(notice: &Notice) {
    match notice {
        Notice::Joined { name, .. } => info!(event = "joined", worker = &name[..], "{notice}"),
        Notice::Lost { name, .. } => info!(event = "lost", worker = &name[..], "{notice}"),
        Notice::Left { name } => info!(event = "left", worker = &name[..], "{notice}"),
        Notice::Refused { name, .. } => info!(event = "refused", worker = &name[..], "{notice}"),
        Notice::Failed(_) | Notice::Hushed(_) => info!(event = "connection", "{notice}"),
        Notice::Quiet { seconds, .. } => warn!(event = "quiet", seconds, "{notice}"),
    }
}

/// Where the run will probably end: at its targets or its budget.
fn end(standing: &Standing) -> u64 {
    standing.paths_expected.map_or(standing.paths_total, |paths| paths.min(standing.paths_total))
}

fn event(standing: &Standing) -> Value {
    let mut event = json!({"event": "progress"});
    let standing = serde_json::to_value(standing).expect("numbers and names");
    if let (Value::Object(event), Value::Object(standing)) = (&mut event, standing) {
        event.extend(standing);
    }
    event
}

/// What a line says, the most important first.
fn parts(standing: &Standing) -> Vec<String> {
    let error = match (standing.target, standing.median_relative_error) {
        (Some(goal), _) => Some(format!(
            "error {} (target {})",
            percent(goal.decisive_error.unwrap_or(f64::INFINITY)),
            short_percent(goal.relative_error)
        )),
        (None, Some(median)) => Some(format!("half within {}", percent(median))),
        (None, None) => None,
    };
    let works = standing.workers > 0;
    let left = standing.seconds_left.filter(|_| works).map(|seconds| format!("{} left", duration(seconds)));
    let workers = if works { counted(standing.workers as u64, "worker") } else { "no worker".into() };
    let rate = works.then(|| format!("{} rays/s", quantity(standing.rays_per_second)));
    let saved = standing.checkpoint.map(|saved| format!("saved {} ago", duration(saved.seconds_ago.floor())));
    let worst = standing.max_relative_error.map(|worst| format!("worst {}", percent(worst)));
    let paths = works.then(|| format!("{} paths/s", quantity(standing.paths_per_second)));
    [error, left, Some(workers), rate, saved, worst, paths].into_iter().flatten().collect()
}

/// As many of the parts as fit.
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

/// Of the terminal that stderr is.
fn columns() -> usize {
    let columns = tcgetwinsize(std::io::stderr()).map_or(0, |size| size.ws_col as usize);
    if columns == 0 { COLUMNS } else { columns }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{bar:12} {percent:>3} % {wide_msg}");
    bar.set_style(style.expect("the template is fixed and valid"));
    bar
}

/// A relative error that was asked for, in percent, as people write it.
fn short_percent(x: f64) -> String {
    format!("{} %", (1e8 * x).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use monitor::{Faults, Goal, Saved};

    fn standing() -> Standing {
        Standing {
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
            faults: Faults::default(),
        }
    }

    /// What the terminal would cut is left out, the least important first.
    #[test]
    fn lines_fit_their_columns() {
        let at = |columns: usize| fitted(&parts(&standing()), columns - BAR_COLUMNS);
        assert_eq!(at(80), "error 5.432 % (target 1.25 %) · 1 h 18 min left · 12 workers");
        assert_eq!(
            at(140),
            "error 5.432 % (target 1.25 %) · 1 h 18 min left · 12 workers · 12.3 M rays/s · saved 31.0 s ago · worst 23.456 %"
        );
        (20..200).for_each(|columns| assert!(at(columns).chars().count() <= columns - BAR_COLUMNS));
    }

    #[test]
    fn nothing_is_foretold_without_workers() {
        let line = fitted(&parts(&Standing { workers: 0, ..standing() }), PLAIN_COLUMNS);
        assert!(line.contains("no worker") && !line.contains("left") && !line.contains("/s"), "{line}");
    }

    /// The percentage of a bar is that of the way to the target.
    #[test]
    fn bars_end_at_the_target() {
        assert_eq!(end(&standing()), 1_000_000_000);
        assert_eq!(end(&Standing { target: None, ..standing() }), 10_000_000_000);
    }
}
