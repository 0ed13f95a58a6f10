//! The gauge of a running job: rates over a window, and errors as often as they are cheap to estimate.

use parallel::run_on_all_cores;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

use judge::plan::predict_stop;
use judge::target::Prospect;
use protocol::{Coordinator, Notice};
use radiosity::{
    Estimates, Experiment,
    precision::{Precision, Quantity},
};
use results::Settings;

use crate::run_status::{FaultCounts, Goal, RunStatus, Saved};

/// The length of the window over which rates are measured, up to now.
const WINDOW: Duration = Duration::from_secs(30);

/// The least time between two measurements of the rate.
const STEP: Duration = Duration::from_millis(250);

/// The inverse of the part of the time that estimating errors may take.
const ERROR_SHARE: u32 = 20;

/// The most faces from which the end is predicted: the coordinator must not keep its workers waiting.
const MOST_FACES: usize = 50_000;

/// The gauge of one run.
pub struct Gauge<'a> {
    experiment: &'a Experiment,
    settings: &'a Settings,
    wall: Option<f64>,
    level: f64,
    began: Instant,
    /// The walks that were in at some moments, the oldest first.
    history: VecDeque<(Instant, u64)>,
    /// The oldest such moment of this session.
    first: Option<(Instant, u64)>,
    precision: Option<Precision>,
    goal: Option<Goal>,
    /// The paths at which the run will probably end.
    expected: Option<u64>,
    next_precision: Instant,
    saved: Option<(Instant, u64)>,
    faults: FaultCounts,
}

impl<'a> Gauge<'a> {
    /// A gauge of a run that may take `wall` seconds, if its job sets a limit.
    pub fn new(experiment: &'a Experiment, settings: &'a Settings, wall: Option<f64>) -> Self {
        let now = Instant::now();
        Gauge {
            experiment,
            settings,
            wall,
            level: settings.level(experiment.scene()),
            began: now,
            history: VecDeque::new(),
            first: None,
            precision: None,
            goal: None,
            expected: None,
            next_precision: now,
            saved: None,
            faults: FaultCounts::default(),
        }
    }

    /// Counts what a notice reports.
    pub fn heed(&mut self, notice: &Notice) {
        match notice {
            Notice::Lost { .. } | Notice::Left { .. } => self.faults.workers_lost += 1,
            Notice::Refused { .. } => self.faults.workers_refused += 1,
            Notice::Failed(_) => self.faults.connections_failed += 1,
            Notice::Hushed(connections) => self.faults.connections_failed += *connections as u64,
            Notice::Joined { .. } | Notice::Quiet { .. } => {}
        }
    }

    /// Counts a checkpoint that could not be written.
    pub fn checkpoint_failed(&mut self) {
        self.faults.checkpoints_failed += 1;
    }

    /// Notes the latest checkpoint and the walks that are in.
    pub fn follow(&mut self, coordinator: &Coordinator, saved: Option<(Instant, u64)>) {
        self.saved = saved;
        let now = Instant::now();
        if self.history.back().is_some_and(|&(last, _)| now - last < STEP) {
            return;
        }
        let walks = coordinator.progress().walks;
        // The time before the first result measures the start, not the walking.
        if self.history.len() == 1 && self.history[0].1 == walks {
            self.history.clear();
            self.first = None;
        }
        self.first.get_or_insert((now, walks));
        self.history.push_back((now, walks));
        while self.history.len() > 2 && now - self.history[1].0 > WINDOW {
            self.history.pop_front();
        }
    }

    /// Estimates the errors of the prefix, as often as is cheap.
    pub fn estimate(&mut self, coordinator: &Coordinator) {
        let now = Instant::now();
        if now < self.next_precision || coordinator.prefix().counts.walks == 0 {
            return;
        }
        let estimates = Estimates::new(self.experiment, coordinator.prefix(), self.level);
        let target = self.settings.target.as_ref();
        let quantity = target.map_or_else(Quantity::default, |target| target.quantity);
        self.precision = Some(estimates.precision(quantity, &run_on_all_cores));
        let sensors = self.settings.sensor_goal(self.experiment);
        let prospects = Prospect::all(target, sensors.as_ref(), &estimates, (self.level, MOST_FACES));
        let ending = if prospects.is_empty() || self.settings.total_target.is_some() {
            None
        } else {
            predict_stop(self.experiment, &prospects, coordinator.looks())
        };
        self.expected = ending.map(|ending| ending.walks().saturating_mul(self.experiment.unit().paths()));
        self.goal = target.zip(prospects.first()).map(|(target, prospect)| Goal {
            relative_error: target.relative_error,
            fraction: target.fraction,
            decisive_error: finite(prospect.error()),
            paths_expected: self.expected,
        });
        self.next_precision = Instant::now() + now.elapsed() * ERROR_SHARE;
    }

    /// The state of the job now.
    pub fn status(&self, coordinator: &Coordinator) -> RunStatus {
        let progress = coordinator.progress();
        // A chain of n rays counts as n paths.
        let per_walk = self.experiment.unit().paths();
        let paths = progress.walks * per_walk;
        let paths_per_second = self.walks_per_second() * per_walk as f64;
        let counts = coordinator.prefix().counts;
        let rays_per_path = counts.rays as f64 / (counts.walks * per_walk).max(1) as f64;
        let seconds = self.began.elapsed().as_secs_f64();
        let end = self.expected.unwrap_or(u64::MAX).min(self.settings.paths);
        let left = seconds_left(progress.workers, paths, end, paths_per_second);
        let wall = self.wall.map(|wall| (wall - seconds).max(0.0));
        let error = |of: fn(&Precision) -> f64| self.precision.as_ref().map(of).and_then(finite);
        RunStatus {
            seconds,
            paths,
            paths_total: self.settings.paths,
            paths_per_second,
            rays_per_second: paths_per_second * rays_per_path,
            workers: progress.workers,
            median_relative_error: error(|precision| precision.headline.quantiles[0]),
            rms_relative_error: error(|precision| precision.rms_relative_error),
            max_relative_error: error(|precision| precision.max_relative_error),
            target: self.goal,
            paths_expected: self.expected,
            seconds_left: match (left, wall) {
                (Some(left), Some(wall)) => Some(left.min(wall)),
                (left, wall) => left.or(wall),
            },
            checkpoint: self.saved.map(|(when, walks)| Saved {
                seconds_ago: when.elapsed().as_secs_f64(),
                paths: walks * per_walk,
            }),
            faults: self.faults,
        }
    }

    fn walks_per_second(&self) -> f64 {
        let (Some(first), Some(last)) = (self.history.front(), self.history.back()) else { return 0.0 };
        // A chain may take longer than the window; then the rate is that of the whole session.
        let first = if first.1 == last.1 { self.first.unwrap_or(*first) } else { *first };
        let seconds = (last.0 - first.0).as_secs_f64();
        if seconds > 0.0 { (last.1 - first.1) as f64 / seconds } else { 0.0 }
    }
}

/// The time from `paths` to `end` [s]; `None` while no worker walks.
fn seconds_left(workers: usize, paths: u64, end: u64, paths_per_second: f64) -> Option<f64> {
    let known = workers > 0 && paths_per_second > 0.0;
    known.then(|| end.saturating_sub(paths) as f64 / paths_per_second)
}

fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_workers_no_time_is_left() {
        assert_eq!(seconds_left(0, 10, 100, 30.0), None);
        assert_eq!(seconds_left(1, 10, 100, 0.0), None);
        assert_eq!(seconds_left(2, 10, 100, 30.0), Some(3.0));
        assert_eq!(seconds_left(2, 110, 100, 30.0), Some(0.0), "a target may be passed");
    }
}
