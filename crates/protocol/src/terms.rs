//! What a worker must know and be to join a job.

use std::sync::Arc;

use radiosity::Layout;

use crate::codec::LONGEST_SUM;
use crate::limits::Limits;

/// What a worker must know and be to join a job.
#[derive(Clone, Debug)]
pub struct Terms {
    /// The job, encoded as workers read it.
    pub job: Arc<[u8]>,
    /// The digest that the scene of a worker's replica must have.
    pub scene_hash: [u8; 32],
    /// The digest that the job of a worker's replica must have.
    pub job_hash: [u8; 32],
    /// The build of the program; workers of another build are refused.
    pub build: String,
    /// The number of walks per stream.
    pub stream_walks: u64,
    /// The leases that each worker thread may have at once.
    pub leases_per_thread: usize,
    /// The number of patches in the scene.
    pub patches: usize,
    /// The columns that a tally of the job keeps for each patch.
    pub layout: Layout,
    /// The most that the walks of the job can come to.
    pub limits: Limits,
}

impl Terms {
    /// The number of sums in a tally of the job.
    pub fn sums(&self) -> usize {
        self.patches * self.layout.columns()
    }

    /// The most bytes that the packed sums of a result can take.
    pub fn most_bytes(&self) -> usize {
        LONGEST_SUM * self.sums()
    }
}
