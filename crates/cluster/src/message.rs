//! The protocol: everything that coordinator and workers say to each other.
//!
//! worker                          coordinator
//!                     ←  Challenge (a nonce)
//! Hello (who, proof)  →
//!                     ←  Welcome (proof, job) or Refused
//! Ready (hashes)      →
//!                     ←  Lease, Lease, …
//! Result, Alive, …    →
//!                     ←  Done

use bincode::{Decode, Encode};

/// Changes whenever a message or what it means does.
pub const PROTOCOL: u32 = 3;

/// A nonce or a proof of knowing the run's key.
pub type Proof = [u8; 32];

/// What a worker says.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToCoordinator {
    /// Introduces itself and answers the challenge.
    Hello(Hello),
    /// Has built its replica; these are the hashes it came to.
    Ready {
        /// Hash of its scene.
        scene_hash: [u8; 32],
        /// Hash of its job.
        job_hash: [u8; 32],
    },
    /// The walks of one lease, whole.
    Result(LeaseResult),
    /// Still there; `progress` counts chunks of walks finished so far.
    Alive {
        /// Grows while the worker works.
        progress: u64,
    },
    /// Cannot go on.
    Failed {
        /// Why, in words.
        reason: String,
    },
}

/// How a worker introduces itself.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct Hello {
    /// Its [`PROTOCOL`].
    pub protocol: u32,
    /// Its version and commit.
    pub build: String,
    /// What to call it in messages to people.
    pub name: String,
    /// How many leases it works on at once.
    pub threads: u32,
    /// Its own nonce.
    pub nonce: Proof,
    /// The answer to the challenge.
    pub proof: Proof,
}

/// What a lease came to.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct LeaseResult {
    /// The lease.
    pub lease: u64,
    /// Time it took [s].
    pub seconds: f64,
    /// CPU time of the worker process so far [s].
    pub cpu_seconds: f64,
    /// How its walks ended ([`radiosity::Counts::to_array`]).
    pub counts: Box<[u128; 15]>,
    /// All sums, patch-major.
    pub sums: Vec<u128>,
    /// The digest of counts and sums.
    pub digest: u64,
}

/// What the coordinator says.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToWorker {
    /// Prove that you know the key.
    Challenge {
        /// To be proved over.
        nonce: Proof,
    },
    /// Come in; here is the job.
    Welcome {
        /// Proof over the worker's nonce.
        proof: Proof,
        /// The job, for the program to read.
        job: Vec<u8>,
    },
    /// Go away.
    Refused {
        /// Why, in words.
        reason: String,
    },
    /// Shoot these walks.
    Lease {
        /// To be named in the result.
        id: u64,
        /// Number of the first walk.
        first_walk: u64,
        /// How many.
        walks: u64,
    },
    /// The job is done; leave.
    Done,
}
