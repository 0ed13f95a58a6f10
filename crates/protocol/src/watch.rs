//! The coordinator's watchdog: it reports a job that stands still.

use std::time::Duration;

/// The time without results after which the owner is told, and told again.
pub(crate) const QUIET: Duration = Duration::from_secs(60);

/// The time without progress of any worker after which none is expected. Workers that hold leases are given up after
/// less than half of it.
pub(crate) const STILL: Duration = Duration::from_secs(150);

/// What the watchdog found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Watched {
    /// Results come in, or the owner was told recently that none do.
    Well,
    /// No result has come in for a long time.
    Quiet,
    /// No result has come in for a long time, and no worker makes progress.
    Still,
}

/// What the watchdog last saw, by the waking clock.
#[derive(Debug, Default)]
pub(crate) struct Watchdog {
    walks: (u64, Duration),
    progress: (u64, Duration),
    last_notice: Duration,
}

impl Watchdog {
    /// Looks at the number of walks that are in, and at a counter that grows with any worker's progress.
    pub(crate) fn look(&mut self, awake: Duration, walks: u64, progress: u64) -> Watched {
        if walks != self.walks.0 {
            self.walks = (walks, awake);
            self.last_notice = awake;
        }
        if progress != self.progress.0 {
            self.progress = (progress, awake);
        }
        if awake - self.last_notice < QUIET {
            return Watched::Well;
        }
        self.last_notice = awake;
        if awake - self.progress.1 >= STILL { Watched::Still } else { Watched::Quiet }
    }

    /// The time since the last result came in.
    pub(crate) fn quiet(&self, awake: Duration) -> Duration {
        awake - self.walks.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_stands_still_is_reported_once_a_minute() {
        let mut watch = Watchdog::default();
        let notices: Vec<(u64, Watched)> = (1..400)
            .map(|second| (second, watch.look(Duration::from_secs(second), second.min(100), second.min(130))))
            .filter(|(_, watched)| *watched != Watched::Well)
            .collect();
        assert_eq!(
            notices,
            [(160, Watched::Quiet), (220, Watched::Quiet), (280, Watched::Still), (340, Watched::Still)]
        );
        assert_eq!(watch.quiet(Duration::from_secs(400)), Duration::from_secs(300));
    }
}
