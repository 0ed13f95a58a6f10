//! When walks under way are kept beside the checkpoints of runs: those of pilots and of rounds.

use std::time::{Duration, Instant};

use tracing::warn;

/// Between two times that walks are kept: what they are of takes seconds or minutes, and no second of it is to be lost.
const INTERVAL: Duration = Duration::from_millis(250);

/// They are kept again after this many times the time that it took.
const RARELY: u32 = 20;

/// Keeps the first walks of a number, now and then.
pub(crate) struct Keeping {
    all: u64,
    kept: u64,
    due: Instant,
}

impl Keeping {
    /// Of `all` walks some are kept.
    pub(crate) fn new(all: u64, kept: u64) -> Self {
        Keeping { all, kept, due: Instant::now() + INTERVAL }
    }

    /// Keeps the first walks by `keep`, where that is due or they are all. Walks go on where they cannot be kept.
    pub(crate) fn keep(&mut self, walks: u64, keep: impl FnOnce() -> Result<(), results::Error>) {
        let began = Instant::now();
        if walks == self.kept || (began < self.due && walks < self.all) {
            return;
        }
        match keep() {
            Ok(()) => self.kept = walks,
            Err(error) => warn!("{error}; the walks go on without being kept"),
        }
        self.due = Instant::now() + INTERVAL.max(RARELY * began.elapsed());
    }
}
