//! Admission: which peers are let in, and how much of what they claim is believed.

use super::peer::PeerStage;
use super::{PoolOutcome, WorkerPool, printable, refuse};
use crate::lead::{Action, Notice, PeerId};
use crate::message::{Hello, LeaseId, PROTOCOL, ToWorker};
use crate::provenance::{NAME_CHARS, plain_name};
use crate::terms::Terms;

/// The heartbeats that one returned lease counts as.
const BEATS_PER_RETURN: f64 = 10.0;

/// The most threads of one worker that get leases, whatever the worker claims.
const MAX_THREADS: usize = 4096;
/// The most threads behind one relay that get leases.
const MAX_RELAYED_THREADS: usize = 1 << 20;

/// The most leases that all workers work on at once. A worker that claims more threads than are left of these gets one
/// lease.
const MOST_SLOTS: usize = 1 << 18;

/// The most times that a relay's lease may last longer than a worker's, whatever the relay asks for. Each level of
/// relays asks for four times what the level below takes.
const LONGEST_RELAYED: f64 = 256.0;

impl WorkerPool {
    /// Decides whether a peer that introduces itself may join: it must run the same protocol and build.
    pub(super) fn on_hello(&mut self, id: PeerId, hello: Hello) -> Vec<Action> {
        let name = plain_name(&hello.name);
        let refusal = if hello.protocol != PROTOCOL {
            Some(format!(
                "it speaks protocol {}, this coordinator speaks {PROTOCOL}; use the same version of radwalk",
                hello.protocol
            ))
        } else if hello.build != self.terms.build {
            Some(format!(
                "it is radwalk {}, this coordinator is {} (another build may walk differently); use the same build",
                printable(&hello.build, NAME_CHARS),
                self.terms.build
            ))
        } else if self.banned.contains(&name) {
            Some(
                "it sent an impossible result before (faulty memory, or another program); use another machine"
                    .into(),
            )
        } else if hello.threads == 0 && !hello.relays {
            Some("it has no threads; give it at least one".into())
        } else {
            None
        };
        if let Some(reason) = refusal {
            self.peers.remove(&id);
            return refuse(id, name, reason);
        }
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        peer.stage = PeerStage::Welcomed;
        peer.name = name;
        peer.relays = hello.relays;
        // A relay reports later how many threads its workers have.
        peer.threads = if hello.relays { 0 } else { (hello.threads as usize).min(MAX_THREADS) };
        let Terms { job, stream_walks, leases_per_thread, .. } = &self.terms;
        let (stream_walks, leases_per_thread) = (*stream_walks, *leases_per_thread as u32);
        vec![Action::Send(id, ToWorker::Welcome { job: job.clone(), stream_walks, leases_per_thread })]
    }

    /// Starts a peer that has built its replica, if its hashes of scene and job are ours.
    pub(super) fn on_ready(&mut self, id: PeerId, scene_hash: [u8; 32], job_hash: [u8; 32]) -> PoolOutcome {
        if (scene_hash, job_hash) != (self.terms.scene_hash, self.terms.job_hash) {
            self.spent.workers_lost += 1;
            let peer = self.peers.remove(&id).expect("the caller found it");
            let reason = "its replica of the scene differs (its build or memory is faulty)";
            return PoolOutcome::Still(refuse(id, peer.name, reason.into()));
        }
        self.spent.workers_seen += 1;
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        peer.stage = PeerStage::Working;
        self.workers_now += 1;
        let joined = Notice::Joined { name: peer.name.clone(), threads: peer.threads };
        self.believe(id);
        self.gets_on(id);
        self.consider(id);
        PoolOutcome::Moved(vec![Action::Tell(joined)])
    }

    /// Takes up a relay's new number of threads.
    pub(super) fn on_capacity(&mut self, id: PeerId, threads: u32, lease_seconds: f64) -> PoolOutcome {
        let least = self.lease_seconds(self.ticked);
        self.doubt(id);
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        peer.threads = (threads as usize).min(MAX_RELAYED_THREADS);
        let wanted = if lease_seconds.is_nan() { 0.0 } else { lease_seconds };
        peer.lease_seconds = wanted.clamp(0.0, LONGEST_RELAYED * least);
        self.believe(id);
        self.consider(id);
        PoolOutcome::Moved(vec![])
    }

    /// Adds the believed threads of a peer to the totals. Each peer keeps a share of [`MOST_SLOTS`], whatever the
    /// others claim.
    pub(super) fn believe(&mut self, id: PeerId) {
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        let left = MOST_SLOTS.saturating_sub(self.slots).max(1);
        peer.slots = peer.trusted_slots().min(left);
        self.threads += peer.trusted_threads();
        self.slots += peer.slots;
    }

    /// Takes the threads of a peer out of the totals.
    pub(super) fn doubt(&mut self, id: PeerId) {
        let peer = &self.peers[&id];
        self.threads -= peer.trusted_threads();
        self.slots -= peer.slots;
    }

    /// Takes a lease back from a relay that has lost its workers.
    pub(super) fn on_return(&mut self, id: PeerId, lease: LeaseId) -> PoolOutcome {
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        // A return costs as much as some heartbeats: a relay that only gives leases back is faulty.
        peer.beats -= BEATS_PER_RETURN;
        if peer.beats < 0.0 {
            return self.drop_peer(id, "gave leases back too often (a faulty program)");
        }
        if peer.leases.remove(&lease).is_none() {
            return self.drop_peer(id, "returned a lease that it did not have");
        }
        self.holders.remove(&lease);
        self.ledger.lose(lease);
        self.consider(id);
        PoolOutcome::Moved(vec![])
    }
}
