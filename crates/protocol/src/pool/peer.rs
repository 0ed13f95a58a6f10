//! What the leader knows of one connection.

use std::collections::HashMap;
use std::time::Duration;

use crate::lead::{Now, PeerId};
use crate::message::LeaseId;

/// The state of a connection.
#[derive(Debug)]
pub(super) enum PeerStage {
    /// The peer has proved that it knows the key.
    Admitted,
    /// The peer was let in and builds its replica of the scene.
    Welcomed,
    /// The peer shoots walks.
    Working,
}

/// The threads that are believed of a worker that has not delivered anything.
const FIRST_THREADS: usize = 64;

/// The time at which a lease was given out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Since {
    /// The time by the waking clock.
    pub awake: Duration,
    pub now: Now,
}

/// A connection, and the leases of its worker.
#[derive(Debug)]
pub(super) struct Peer {
    pub stage: PeerStage,
    pub name: String,
    /// Whether the peer is a relay, whose own workers shoot its walks.
    pub relays: bool,
    /// The threads that shoot walks there.
    pub threads: usize,
    /// The leases that the peer works on at once: one per thread; for a relay one in all, and none while it has no
    /// workers.
    pub slots: usize,
    /// The least time that one of the peer's leases should take [s].
    pub lease_seconds: f64,
    /// The leases that the peer has not answered for. Other workers may have brought some of them since.
    pub leases: HashMap<LeaseId, Since>,
    /// The time of the peer's last message, by the waking clock.
    pub heard: Duration,
    pub progress: u64,
    /// The time of the peer's last progress, by the waking clock.
    pub progressed: Duration,
    /// The walks per second of one thread; 0 before the first result.
    pub rate: f64,
    pub longest_lease: u64,
    pub cpu_seconds: f64,
    /// The number of results that the peer brought.
    pub results: usize,
    /// The time of the peer's last result, by the waking clock.
    pub delivered: Duration,
    /// The heartbeats that the peer may send now.
    pub beats: f64,
}

impl Peer {
    /// A peer that has just proved that it knows the key, at `now` of the waking clock.
    pub(super) fn new(id: PeerId, now: Duration, beats: f64) -> Self {
        Peer {
            stage: PeerStage::Admitted,
            name: format!("peer {id}"),
            relays: false,
            threads: 0,
            slots: 0,
            lease_seconds: 0.0,
            leases: HashMap::new(),
            heard: now,
            progress: 0,
            progressed: now,
            rate: 0.0,
            longest_lease: 0,
            cpu_seconds: 0.0,
            results: 0,
            delivered: Duration::ZERO,
            beats,
        }
    }

    pub(super) fn is_working(&self) -> bool {
        matches!(self.stage, PeerStage::Working)
    }

    /// The threads that are believed: more with every result, so that a claim alone gains nothing.
    pub(super) fn trusted_threads(&self) -> usize {
        self.threads.min(FIRST_THREADS.saturating_mul(1 + self.results))
    }

    /// The leases that the peer may work on at once.
    pub(super) fn trusted_slots(&self) -> usize {
        if self.relays { self.threads.min(1) } else { self.trusted_threads() }
    }

    /// The threads that share one lease.
    pub(super) fn lease_threads(&self) -> usize {
        if self.relays { self.trusted_threads() } else { 1 }
    }

    /// The walks per second of the threads that share one lease.
    pub(super) fn lease_rate(&self) -> f64 {
        self.rate * self.lease_threads() as f64
    }
}
