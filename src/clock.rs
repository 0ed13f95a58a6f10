//! The processor time of this process, and of its walks.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::time::{ClockId, clock_gettime};

/// CPU time of this process so far [s].
pub(crate) fn cpu_seconds() -> f64 {
    1e-9 * nanoseconds(ClockId::ProcessCPUTime) as f64
}

fn nanoseconds(clock: ClockId) -> u64 {
    let time = clock_gettime(clock);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// The processor time that threads have walked: without starting, building the scene, and talking.
#[derive(Clone, Default)]
pub(crate) struct WalkClock(Arc<AtomicU64>);

impl WalkClock {
    /// Adds the processor time that this thread takes for something.
    pub(crate) fn time<T>(&self, walk: impl FnOnce() -> T) -> T {
        let began = nanoseconds(ClockId::ThreadCPUTime);
        let done = walk();
        self.0.fetch_add(nanoseconds(ClockId::ThreadCPUTime) - began, Ordering::Relaxed);
        done
    }

    /// What it comes to [s].
    pub(crate) fn seconds(&self) -> f64 {
        1e-9 * self.0.load(Ordering::Relaxed) as f64
    }
}
