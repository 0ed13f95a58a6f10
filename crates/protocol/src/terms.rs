//! What workers have to know and to be.

use std::sync::Arc;

use radiosity::Layout;

use crate::codec::LONGEST_SUM;
use crate::limits::Limits;

/// What workers of a job have to know and to be.
#[derive(Clone)]
pub struct Terms {
    /// The job as workers read it.
    pub job: Arc<[u8]>,
    /// The digest that the scene of a worker's replica must have.
    pub scene_hash: [u8; 32],
    /// The digest that the job of a worker's replica must have.
    pub job_hash: [u8; 32],
    /// The only build that may join.
    pub build: String,
    /// Walks per stream.
    pub stream_walks: u64,
    /// Leases per worker thread that are out at once.
    pub leases_per_thread: usize,
    /// Patches of the scene.
    pub patches: usize,
    /// What a tally of the job keeps of each.
    pub layout: Layout,
    /// What its walks can come to at most.
    pub limits: Limits,
}

impl Terms {
    /// Numbers in a tally of the job.
    pub fn sums(&self) -> usize {
        self.patches * self.layout.columns()
    }

    /// What the packed sums of a result can take.
    pub fn most_bytes(&self) -> usize {
        LONGEST_SUM * self.sums()
    }
}
