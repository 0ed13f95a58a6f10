//! Why a result is not taken.

use radiosity::MergeError;

use crate::message::LeaseId;

/// Why a result was not taken.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum Rejected {
    /// No such lease is out: it was lost and given to others, or never was.
    #[error("lease {0} is not out")]
    NotLeased(LeaseId),
    /// The result is for another number of walks than was leased.
    #[error("the result holds {got} walks instead of {expected}")]
    Walks {
        /// Walks of the lease.
        expected: u64,
        /// Walks of the result.
        got: u64,
    },
    /// The tally is not the one that the worker sent off.
    #[error("its digest is not that of its sums: it was changed on its way")]
    Digest,
    /// The sums cannot be unpacked.
    #[error("its sums are no numbers")]
    Malformed,
    /// No walks of the job come to this.
    #[error("{0}")]
    Impossible(&'static str),
    /// Its counts exceed 64 bits.
    #[error("its counts exceed 64 bits")]
    Counts,
    /// The tally does not fit.
    #[error(transparent)]
    Tally(#[from] MergeError),
}
