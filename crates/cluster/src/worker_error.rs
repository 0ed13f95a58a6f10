//! The errors of a worker.

use protocol::Foreign;
use protocol::codec::CodecError;
use thiserror::Error;

/// The reason why a worker left before the job was done.
#[derive(Debug, Error)]
pub enum WorkerError {
    /// No process listens at the address.
    #[error(
        "cannot reach the coordinator at {address} ({source}); check that it runs and that this is its access file"
    )]
    Unreachable {
        /// The address as host:port.
        address: String,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The coordinator is of another build.
    #[error(
        "the coordinator is radwalk {theirs}, this is {ours} (another build may walk differently); use the same build"
    )]
    OtherBuild {
        /// The coordinator's build, from the access file.
        theirs: String,
        /// The build of this program.
        ours: String,
    },
    /// The coordinator refuses this worker.
    #[error("the coordinator refused this worker: {0}")]
    Refused(String),
    /// The process that listens at the address does not know the key.
    #[error(
        "the process that listens at the address of the access file is not its coordinator ({0}); use the access file of a running job"
    )]
    Impostor(#[from] Foreign),
    /// The job that was sent cannot be built.
    #[error("the job that the coordinator sent cannot be used: {0}")]
    Job(String),
    /// One of the worker's threads failed.
    #[error("this worker cannot go on: {0}")]
    Failed(String),
    /// The connection to the coordinator ended.
    #[error("lost the coordinator ({0}); its job goes on without this worker if it still runs")]
    Lost(#[from] CodecError),
    /// The coordinator sent a message that does not fit here.
    #[error("the coordinator sent an unexpected message (a foreign or faulty program)")]
    Protocol,
}
