//! The reasons why a result is not taken.

use radiosity::boards::MergeError;

use crate::message::LeaseId;

/// The reason why a result was not taken.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum Rejected {
    /// No such lease is out: it was lost and given to another worker, or it never was.
    #[error("lease {0} is not out")]
    NotLeased(LeaseId),
    /// The result holds another number of walks than the lease.
    #[error("the result holds {got} walks instead of {expected}")]
    Walks {
        /// The number of walks in the lease.
        expected: u64,
        /// The number of walks in the result.
        got: u64,
    },
    /// The tally is not the one that the worker sent.
    #[error("its digest does not match its sums: it was changed on its way")]
    Digest,
    /// The sums cannot be unpacked.
    #[error("its packed sums cannot be read")]
    Malformed,
    /// No walks of the job can come to this result.
    #[error("{0}")]
    Impossible(&'static str),
    /// A count of the result exceeds 64 bits.
    #[error("its counts exceed 64 bits")]
    Counts,
    /// The tally does not fit the job's.
    #[error(transparent)]
    Tally(#[from] MergeError),
}
