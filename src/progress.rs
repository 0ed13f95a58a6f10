//! What is shown while a job runs: a bar on a terminal, a line now and then elsewhere, JSON lines on request.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use cluster::coordinator::Coordinator;
use cluster::lead::Notice;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use radiosity::{Estimates, Experiment, Precision};
use report::words::{duration, percent, quantity};
use serde_json::json;

use crate::args::OutArgs;
use crate::console::tell;

/// Between two updates of a bar or of JSON lines.
const INTERVAL: Duration = Duration::from_millis(500);

/// Between two lines where stderr is no terminal.
const PLAIN_INTERVAL: Duration = Duration::from_secs(30);

/// Estimating the errors may take at most this part of the time.
const ERROR_SHARE: u32 = 20;

enum Style {
    Quiet,
    Json,
    Bar(ProgressBar),
    Plain,
}

/// The display of one run.
pub struct Display<'a> {
    style: Style,
    experiment: &'a Experiment,
    confidence: f64,
    paths: u64,
    began: Instant,
    shown: Instant,
    /// When walks first came in: rates count from there.
    shooting_since: Option<Instant>,
    precision: Option<Precision>,
    next_precision: Instant,
}

impl<'a> Display<'a> {
    /// A display in the style that was asked for and that stderr can show.
    pub fn new(args: &OutArgs, experiment: &'a Experiment, paths: u64, confidence: f64) -> Self {
        let style = match () {
            () if args.json => Style::Json,
            () if args.quiet => Style::Quiet,
            () if std::io::stderr().is_terminal() => Style::Bar(bar(paths)),
            () => Style::Plain,
        };
        let now = Instant::now();
        Display {
            style,
            experiment,
            confidence,
            paths,
            began: now,
            shown: now,
            shooting_since: None,
            precision: None,
            next_precision: now + INTERVAL,
        }
    }

    /// Says something that stays.
    pub fn note(&self, text: &str) {
        match &self.style {
            Style::Quiet => {}
            Style::Json => tell(&format!("{}", json!({"event": "note", "text": text}))),
            Style::Bar(bar) => bar.suspend(|| tell(text)),
            Style::Plain => tell(text),
        }
    }

    /// Says what must not be missed, to those who want to hear nothing, too.
    pub fn warn(&self, text: &str) {
        match &self.style {
            Style::Quiet => tell(&format!("radwalk: {text}")),
            _ => self.note(text),
        }
    }

    /// Says what happened to a worker.
    pub fn notice(&self, notice: &Notice) {
        match notice {
            Notice::Quiet { .. } => self.warn(&notice.to_string()),
            _ => self.note(&notice.to_string()),
        }
    }

    /// Shows where the job stands, if it is time to.
    pub fn update(&mut self, coordinator: &Coordinator) {
        let now = Instant::now();
        let interval = match self.style {
            Style::Quiet => return,
            Style::Plain => PLAIN_INTERVAL,
            Style::Json | Style::Bar(_) => INTERVAL,
        };
        if coordinator.progress().walks > 0 {
            self.shooting_since.get_or_insert(now);
        }
        if now - self.shown < interval {
            return;
        }
        self.shown = now;
        self.estimate_precision(coordinator, now);
        self.show(coordinator);
    }

    /// Estimates the errors of the prefix, as often as is cheap.
    fn estimate_precision(&mut self, coordinator: &Coordinator, now: Instant) {
        if now < self.next_precision || coordinator.prefix().counts.walks == 0 {
            return;
        }
        let estimates = Estimates::new(self.experiment, coordinator.prefix(), self.confidence);
        self.precision = Some(estimates.precision());
        self.next_precision = now + now.elapsed() * ERROR_SHARE;
    }

    fn show(&self, coordinator: &Coordinator) {
        let mut progress = coordinator.progress();
        // A chain of n rays counts as n paths.
        progress.walks *= self.experiment.paths_per_walk();
        let seconds = self.shooting_since.map_or(0.0, |since| since.elapsed().as_secs_f64());
        let counts = coordinator.prefix().counts;
        let paths_per_second = if seconds > 0.0 { progress.walks as f64 / seconds } else { 0.0 };
        let prefix_paths = counts.walks * self.experiment.paths_per_walk();
        let rays_per_path = counts.rays as f64 / prefix_paths.max(1) as f64;
        let rays_per_second = paths_per_second * rays_per_path;
        let seconds_left = (self.paths - progress.walks) as f64 / paths_per_second;
        match &self.style {
            Style::Quiet => {}
            // JSON has no infinity; serde_json writes null.
            Style::Json => tell(&format!(
                "{}",
                json!({
                    "event": "progress",
                    "seconds": self.began.elapsed().as_secs_f64(),
                    "paths": progress.walks,
                    "paths_total": self.paths,
                    "paths_per_second": paths_per_second,
                    "rays_per_second": rays_per_second,
                    "workers": progress.workers,
                    "rms_relative_error": self.precision.map(|p| p.rms_relative_error),
                    "max_relative_error": self.precision.map(|p| p.max_relative_error),
                    "seconds_left": seconds_left,
                })
            )),
            Style::Bar(bar) => {
                bar.set_position(progress.walks);
                bar.set_message(self.line(progress.workers, paths_per_second, rays_per_second, seconds_left));
            }
            Style::Plain => tell(&format!(
                "{} of {} paths, {}",
                progress.walks,
                self.paths,
                self.line(progress.workers, paths_per_second, rays_per_second, seconds_left)
            )),
        }
    }

    fn line(&self, workers: usize, paths_per_second: f64, rays_per_second: f64, seconds_left: f64) -> String {
        let errors = self.precision.map_or(String::new(), |p| {
            format!(" · half within {}, worst {}", percent(p.quantiles[0]), percent(p.max_relative_error))
        });
        let left = if seconds_left.is_finite() {
            format!(" · {} left", duration(seconds_left))
        } else {
            String::new()
        };
        let plural = if workers == 1 { "" } else { "s" };
        format!(
            "{workers} worker{plural} · {} paths/s · {} rays/s{errors}{left}",
            quantity(paths_per_second),
            quantity(rays_per_second)
        )
    }

    /// Clears the display at the end.
    pub fn finish(&self) {
        if let Style::Bar(bar) = &self.style {
            bar.finish_and_clear();
        }
    }
}

fn bar(paths: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(paths), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{bar:24} {percent:>3} % · {wide_msg}");
    bar.set_style(style.expect("the template is fixed and valid"));
    bar
}
