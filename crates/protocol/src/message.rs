//! The protocol: everything that coordinator and workers say to each other.
//!
//! worker or relay                 coordinator or relay
//! (a Noise handshake, see `cluster::noise`; all that follows is sealed)
//! Hello (who)         →
//!                     ←  Welcome (job) or Refused
//! Ready (hashes)      →
//!                     ←  Lease, Lease, …
//! Result, Alive, …    →
//! Leave or Failed     →
//! Offer               →
//!                     ←  Send, when there is room
//! Piece, …, Result    →
//!                     ←  Done
//! of a relay also: Capacity, Return

use std::sync::Arc;

use bincode::{Decode, Encode};

use crate::codec::{LONG_FRAME, LONGEST_SUM, SHORT_FRAME};
use crate::provenance::{self, Provenance};

/// A number that names one lease; never used twice.
pub type LeaseId = u64;

/// Changes whenever a message or what it means does.
pub const PROTOCOL: u32 = 6;

/// Tallies of at most so many sums are sent without asking.
pub const SMALL_TALLY: usize = 2048;

/// Bytes of packed sums in a piece: what a small tally takes at most.
pub const PIECE: usize = SMALL_TALLY * LONGEST_SUM;

// No peer may send a longer frame, of whatever job.
const _: () = assert!(SHORT_FRAME + PIECE + provenance::MOST_BYTES <= LONG_FRAME);

/// What a worker says.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToCoordinator {
    /// Introduces itself.
    Hello(Hello),
    /// Has built its replica; these are the hashes it came to.
    Ready {
        /// Hash of its scene.
        scene_hash: [u8; 32],
        /// Hash of its job.
        job_hash: [u8; 32],
    },
    /// The walks of one lease, whole, or the end of what pieces have brought.
    Result(LeaseResult),
    /// A lease is done, and its tally is too large to send without asking.
    Offer {
        /// The lease.
        lease: u64,
        /// What its packed sums take.
        bytes: u64,
    },
    /// The next [`PIECE`] bytes of the packed sums of a lease that was asked for.
    Piece {
        /// The lease.
        lease: u64,
        /// The bytes.
        sums: Vec<u8>,
    },
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
    /// Leaves because its owner told it to.
    Leave,
    /// Of a relay: what its workers come to now. It is leased nothing before.
    Capacity {
        /// Threads that shoot there; without any it is leased nothing.
        threads: u32,
        /// How long its leases should take at least, to be split among them [s].
        lease_seconds: f64,
    },
    /// Of a relay: nobody is left there to walk this lease.
    Return {
        /// The lease.
        lease: u64,
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
    /// Whether others walk for it: it works on one lease at once, with as many threads as it says later.
    pub relays: bool,
}

/// What a lease came to.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct LeaseResult {
    /// The lease.
    pub lease: u64,
    /// Time it took [s].
    pub seconds: f64,
    /// Processor time that the worker's threads have walked so far [s].
    pub cpu_seconds: f64,
    /// How its walks ended ([`radiosity::Counts::to_array`]).
    pub counts: Box<[u128; 15]>,
    /// All sums, patch-major, packed ([`crate::codec::pack`]); after pieces, what they have left.
    pub sums: Vec<u8>,
    /// The digest of counts and sums.
    pub digest: u64,
    /// Of a relay: who walked its parts.
    pub provenance: Provenance,
}

/// What the coordinator says.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToWorker {
    /// Come in.
    Welcome {
        /// The job, for the program to read.
        job: Arc<[u8]>,
        /// Walks per stream.
        stream_walks: u64,
        /// Leases per thread that are out at once.
        leases_per_thread: u32,
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
    /// There is room for what was offered.
    Send {
        /// The lease.
        lease: u64,
    },
    /// Nobody needs what was offered any more: others were faster.
    Drop {
        /// The lease.
        lease: u64,
    },
    /// Still there.
    Alive,
    /// The job is done; leave.
    Done,
}
