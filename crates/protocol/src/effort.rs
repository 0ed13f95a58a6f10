//! What a run took.

use bincode::{Decode, Encode};

/// What a run took, its earlier sessions included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Encode, Decode)]
pub struct Effort {
    /// From the first lease to the last result that was merged.
    pub seconds: f64,
    /// Processor time that all workers walked.
    pub cpu_seconds: f64,
    /// Workers that ever shot.
    pub workers_seen: u64,
    /// Workers that were lost while the job ran.
    pub workers_lost: u64,
    /// Streams of lost leases.
    pub streams_reissued: u64,
}
