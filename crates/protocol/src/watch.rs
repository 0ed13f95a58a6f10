//! The coordinator's watchdog: no job stands still without a word.

use std::time::Duration;

/// Where no walk comes in for this long, it is said, and again after as long.
pub const QUIET: Duration = Duration::from_secs(60);

/// Where no worker gets on for this long either, none will: workers that hold leases are given up after half of it.
pub const STILL: Duration = Duration::from_secs(150);

/// What was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// Walks come in, or it was said of late that none do.
    Well,
    /// No walk has come in for long.
    Quiet,
    /// Nor does any worker get on.
    Still,
}

/// What was last seen, by the waking clock.
#[derive(Debug, Default)]
pub struct Watch {
    walks: (u64, Duration),
    progress: (u64, Duration),
    told: Duration,
}

impl Watch {
    /// Looks at how many walks are in, and at a number that grows while any worker gets on.
    pub fn look(&mut self, awake: Duration, walks: u64, progress: u64) -> Watched {
        if walks != self.walks.0 {
            self.walks = (walks, awake);
            self.told = awake;
        }
        if progress != self.progress.0 {
            self.progress = (progress, awake);
        }
        if awake - self.told < QUIET {
            return Watched::Well;
        }
        self.told = awake;
        if awake - self.progress.1 >= STILL { Watched::Still } else { Watched::Quiet }
    }

    /// How long no walk has come in.
    pub fn quiet(&self, awake: Duration) -> Duration {
        awake - self.walks.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_stands_still_is_told_of_once_a_minute() {
        let mut watch = Watch::default();
        let told: Vec<(u64, Watched)> = (1..400)
            .map(|second| (second, watch.look(Duration::from_secs(second), second.min(100), second.min(130))))
            .filter(|(_, watched)| *watched != Watched::Well)
            .collect();
        assert_eq!(
            told,
            [(160, Watched::Quiet), (220, Watched::Quiet), (280, Watched::Still), (340, Watched::Still)]
        );
        assert_eq!(watch.quiet(Duration::from_secs(400)), Duration::from_secs(300));
    }
}
