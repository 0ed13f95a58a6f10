//! The effort of a run: its time, its workers and what was walked twice.

use bincode::{Decode, Encode};

/// The effort of a run, its earlier sessions included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Encode, Decode)]
pub struct Effort {
    /// The time from the first lease to the last result that was merged [s].
    pub seconds: f64,
    /// The processor time of all workers' walks [s].
    pub cpu_seconds: f64,
    /// The number of workers that ever joined.
    pub workers_seen: u64,
    /// The number of workers that were lost while the job ran.
    pub workers_lost: u64,
    /// The number of streams that were leased again.
    pub streams_reissued: u64,
}
