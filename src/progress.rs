//! What is shown while a job runs: a bar on a terminal, a line now and then elsewhere, JSON lines on request.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use monitor::RunStatus;
use protocol::Notice;
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

enum DisplayStyle {
    Quiet,
    Json,
    Bar(ProgressBar),
    Plain,
}

/// The display of one run.
pub(crate) struct Display {
    style: DisplayStyle,
    shown: Instant,
}

impl Display {
    /// A display in the style that was asked for and that stderr can show.
    pub(crate) fn new(args: &OutArgs) -> Self {
        let style = match () {
            () if args.json => DisplayStyle::Json,
            () if args.quiet => DisplayStyle::Quiet,
            () if std::io::stderr().is_terminal() => DisplayStyle::Bar(bar()),
            () => DisplayStyle::Plain,
        };
        if let DisplayStyle::Bar(bar) = &style {
            keep_below(Some(bar.clone()));
        }
        Display { style, shown: Instant::now() }
    }

    /// Whether it is time to show where the job stands.
    pub(crate) fn is_due(&self) -> bool {
        let interval = match self.style {
            DisplayStyle::Quiet => return false,
            DisplayStyle::Plain => PLAIN_INTERVAL,
            DisplayStyle::Json | DisplayStyle::Bar(_) => INTERVAL,
        };
        self.shown.elapsed() >= interval
    }

    /// Shows where the job stands.
    pub(crate) fn show(&mut self, status: &RunStatus) {
        self.shown = Instant::now();
        match &self.style {
            DisplayStyle::Quiet => {}
            DisplayStyle::Json => emit(&event(status)),
            DisplayStyle::Bar(bar) => {
                bar.set_length(status.end());
                bar.set_position(status.paths);
                bar.set_message(status.line(columns().saturating_sub(BAR_COLUMNS)));
            }
            DisplayStyle::Plain => {
                info!("{} of {} paths · {}", status.paths, status.paths_total, status.line(PLAIN_COLUMNS))
            }
        }
    }

    /// Clears the display at the end.
    pub(crate) fn finish(&self) {
        if let DisplayStyle::Bar(bar) = &self.style {
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

fn event(status: &RunStatus) -> Value {
    let mut event = json!({"event": "progress"});
    let status = serde_json::to_value(status).expect("numbers and names");
    if let (Value::Object(event), Value::Object(status)) = (&mut event, status) {
        event.extend(status);
    }
    event
}

/// The number of columns of the terminal that stderr is.
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
