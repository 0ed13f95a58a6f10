//! What is known of one connection.

use std::collections::HashMap;
use std::time::Duration;

use crate::lead::{Now, PeerId};
use crate::ledger::LeaseId;

/// Where a connection stands.
#[derive(Debug)]
pub(super) enum Stage {
    /// Knows the key.
    Admitted,
    /// Is building its replica.
    Welcomed,
    /// Shoots.
    Working,
}

/// Threads that are believed of a worker that has not delivered anything.
const FIRST_THREADS: usize = 64;

/// When a lease was given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Since {
    /// By the waking clock.
    pub awake: Duration,
    pub now: Now,
}

/// A connection, and what its worker was given.
#[derive(Debug)]
pub(super) struct Peer {
    pub stage: Stage,
    pub name: String,
    /// Whether it has others work for it.
    pub relays: bool,
    /// Threads that shoot there.
    pub threads: usize,
    /// Leases that it works on at once: one a thread; of a relay one in all, none while it has no workers.
    pub slots: usize,
    /// How long its leases take at least [s].
    pub lease_seconds: f64,
    /// What it was given and has not answered for, and when. Some of it others may have done since.
    pub leases: HashMap<LeaseId, Since>,
    /// When it last spoke, by the waking clock.
    pub heard: Duration,
    pub progress: u64,
    /// When it last made progress, by the waking clock.
    pub progressed: Duration,
    /// Walks per second of one thread; 0 before the first result.
    pub rate: f64,
    pub longest_lease: u64,
    pub cpu_seconds: f64,
    /// Results that it brought.
    pub results: usize,
    /// When it last brought one, by the waking clock.
    pub delivered: Duration,
    /// Heartbeats that it may send now.
    pub beats: f64,
}

impl Peer {
    /// Somebody who knows the key, at a time of the waking clock.
    pub(super) fn new(id: PeerId, now: Duration, beats: f64) -> Self {
        Peer {
            stage: Stage::Admitted,
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
        matches!(self.stage, Stage::Working)
    }

    /// Threads that are believed: more with every result, so that a claim alone costs nothing.
    pub(super) fn trusted_threads(&self) -> usize {
        self.threads.min(FIRST_THREADS.saturating_mul(1 + self.results))
    }

    /// Leases that it may work on at once.
    pub(super) fn trusted_slots(&self) -> usize {
        if self.relays { self.threads.min(1) } else { self.trusted_threads() }
    }

    /// Threads that share a lease.
    pub(super) fn lease_threads(&self) -> usize {
        if self.relays { self.trusted_threads() } else { 1 }
    }

    /// Walks per second of those that share a lease.
    pub(super) fn lease_rate(&self) -> f64 {
        self.rate * self.lease_threads() as f64
    }
}
