//! The protocol: all messages between a coordinator (or relay) and its workers.
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
use crate::provenance::{self, LeaseProvenance};

/// A number that names one lease; it is never used twice.
pub type LeaseId = u64;

/// The version of the protocol. It changes whenever a message or its meaning changes.
pub const PROTOCOL: u32 = 6;

/// The most sums of a tally that a worker sends without being asked.
pub const SMALL_TALLY: usize = 2048;

/// The most bytes of packed sums in one piece: what a tally of [`SMALL_TALLY`] sums takes at most.
pub const PIECE: usize = SMALL_TALLY * LONGEST_SUM;

// The longest frame of any job must stay within what a peer may send.
const _: () = assert!(SHORT_FRAME + PIECE + provenance::MOST_BYTES <= LONG_FRAME);

/// A message from a worker or relay to its coordinator.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToCoordinator {
    /// The worker introduces itself.
    Hello(Hello),
    /// The worker has built its replica of the scene and sends the hashes of it.
    Ready {
        /// The hash of the worker's scene.
        scene_hash: [u8; 32],
        /// The hash of the worker's job.
        job_hash: [u8; 32],
    },
    /// The tally of one lease, whole, or the last part of one that came in pieces.
    Result(LeaseResult),
    /// A lease is done, but its tally is too large to be sent without being asked for.
    Offer {
        /// The lease that is done.
        lease: u64,
        /// The bytes of the lease's packed sums.
        bytes: u64,
    },
    /// The next [`PIECE`] bytes of the packed sums of a lease that the coordinator asked for.
    Piece {
        /// The lease that the piece belongs to.
        lease: u64,
        /// The bytes of the piece.
        sums: Vec<u8>,
    },
    /// A heartbeat: the worker is alive.
    Alive {
        /// The chunks of walks that the worker has finished so far.
        progress: u64,
    },
    /// The worker cannot go on.
    Failed {
        /// The reason, as a person may read it.
        reason: String,
    },
    /// The worker leaves because its owner told it to.
    Leave,
    /// A relay says how many threads its workers have now. It gets no lease before it has said so.
    Capacity {
        /// The threads that shoot walks behind the relay; a relay with 0 gets no lease.
        threads: u32,
        /// The least time that one of the relay's leases should take, since it is split among its workers [s].
        lease_seconds: f64,
    },
    /// A relay gives a lease back, because it has no worker left to walk it.
    Return {
        /// The lease that is given back.
        lease: u64,
    },
}

/// The first message of a worker: its protocol, build, name and threads.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct Hello {
    /// The [`PROTOCOL`] that the worker speaks.
    pub protocol: u32,
    /// The version and commit of the worker's program.
    pub build: String,
    /// The worker's name in messages to people.
    pub name: String,
    /// The threads of the worker; each works on one lease at once.
    pub threads: u32,
    /// Whether this is a relay: it works on one lease at once, with as many threads as it reports later.
    pub relays: bool,
}

/// The result of a lease.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct LeaseResult {
    /// The lease that was walked.
    pub lease: u64,
    /// The time that the lease took [s].
    pub seconds: f64,
    /// The processor time of all walks that the worker has shot so far [s].
    pub cpu_seconds: f64,
    /// How its walks ended ([`radiosity::Counts::to_array`]).
    pub counts: Box<[u128; 15]>,
    /// All sums, patch-major, packed ([`crate::codec::pack`]); after pieces, the bytes that follow them.
    pub sums: Vec<u8>,
    /// The digest of the counts and sums.
    pub digest: u64,
    /// The parts of a relay's lease and the workers that walked them; empty for a worker's lease.
    pub provenance: LeaseProvenance,
}

impl LeaseResult {
    /// The messages that bring a large result: pieces of its sums, then the result with the last of them.
    pub fn in_pieces(mut self) -> impl Iterator<Item = ToCoordinator> {
        let (lease, mut sums) = (self.lease, std::mem::take(&mut self.sums));
        let last = sums.len().saturating_sub(1) / PIECE * PIECE;
        self.sums = sums.split_off(last);
        let piece = move |from| ToCoordinator::Piece { lease, sums: sums[from..from + PIECE].into() };
        (0..last).step_by(PIECE).map(piece).chain([ToCoordinator::Result(self)])
    }
}

/// A message from the coordinator to a worker.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub enum ToWorker {
    /// The coordinator lets the worker in.
    Welcome {
        /// The job, encoded for the worker's program.
        job: Arc<[u8]>,
        /// The walks per stream.
        stream_walks: u64,
        /// The leases that each thread of the worker may have at once.
        leases_per_thread: u32,
    },
    /// The coordinator turns the worker away.
    Refused {
        /// The reason, as a person may read it.
        reason: String,
    },
    /// The coordinator gives the worker a lease.
    Lease {
        /// The lease's number, which its result names.
        id: u64,
        /// The number of the lease's first walk.
        first_walk: u64,
        /// The number of walks in the lease.
        walks: u64,
    },
    /// The coordinator has room for an offered result and asks for it.
    Send {
        /// The lease whose result is asked for.
        lease: u64,
    },
    /// The worker may drop an offered result, because another worker's result of the same walks came first.
    Drop {
        /// The lease whose result may be dropped.
        lease: u64,
    },
    /// A heartbeat: the coordinator is alive.
    Alive,
    /// The job is done, and the worker is to leave.
    Done,
}
