//! Results: small ones arrive unasked; large ones are offered, asked for when there is room, and taken whole.

use std::collections::HashMap;

use radiosity::{Counts, boards::MergeError};

use super::peer::Peer;
use super::{PoolOutcome, SILENCE, WorkerPool};
use crate::deliveries::Delivery;
use crate::lead::{Action, Now, PeerId};
use crate::message::{LeaseId, LeaseResult, SMALL_TALLY, ToWorker};
use crate::pace::MOST_KEPT;
use crate::parcel::Parcel;
use crate::provenance::LeaseProvenance;
use crate::rejected::Rejected;
use crate::transfers::{Offer, TransferRoom};

/// The bytes of memory that each worker adds to the leader's room for out-of-order ranges, and for results under way.
const OUT_OF_ORDER_SHARE: usize = 32 << 10;
const STAGING_SHARE: usize = 8 << 10;

impl WorkerPool {
    /// Notes a worker's offer of a large result, and asks for it when there is room.
    pub(super) fn on_offer(&mut self, id: PeerId, lease: LeaseId, bytes: u64) -> PoolOutcome {
        let sums = self.terms.sums();
        let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
        let peer = &self.peers[&id];
        let offered = match self.ledger.range(lease) {
            // Another worker was faster.
            None if peer.leases.contains_key(&lease) => {
                return PoolOutcome::Moved(vec![self.spare(id, lease)]);
            }
            Some(walks)
                if peer.leases.contains_key(&lease) && (sums..=self.terms.most_bytes()).contains(&bytes) =>
            {
                self.transfers.offer(Offer { peer: id, lease, walks, bytes })
            }
            _ => false,
        };
        if offered {
            PoolOutcome::Still(self.ask())
        } else {
            self.drop_peer(id, "offered a result that it was not asked for")
        }
    }

    /// Takes the result of a lease, whole or not at all.
    pub(super) fn on_result(&mut self, id: PeerId, mut result: LeaseResult, now: Now) -> PoolOutcome {
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        let lease = result.lease;
        let asked = match self.terms.sums() {
            ..=SMALL_TALLY => true,
            _ => self.transfers.finish(id, lease, &result.sums).map(|sums| result.sums = sums).is_some(),
        };
        let Some(since) = asked.then(|| peer.leases.remove(&lease)).flatten() else {
            return self.drop_peer(id, "sent a result that it was not asked for");
        };
        self.holders.remove(&lease);
        if result.cpu_seconds.is_finite() {
            peer.cpu_seconds = peer.cpu_seconds.max(result.cpu_seconds);
        }
        // No worker walks faster than its results come: one lease waits while another is walked.
        let taken = now.saturating_sub(since.now).as_secs_f64() / (2.0 * self.terms.leases_per_thread as f64);
        let seconds = result.seconds.max(taken);
        self.gets_on(id);
        self.consider(id);
        match self.accept(id, result) {
            Ok(walks) => {
                let peer = self.peers.get_mut(&id).expect("the caller found it");
                // A time that is not a number becomes the least time here.
                let rate = walks as f64 / seconds.max(1e-6) / peer.lease_threads().max(1) as f64;
                peer.rate = if peer.rate == 0.0 { rate } else { 0.5 * (peer.rate + rate) };
                self.last_result = now;
                self.trust(id);
                PoolOutcome::Moved(vec![])
            }
            // Another worker was faster, or this worker was given up and is back.
            Err(Rejected::NotLeased(_)) => PoolOutcome::Moved(vec![]),
            Err(Rejected::Tally(MergeError::Overflow(_))) => PoolOutcome::Overflow,
            Err(rejected) => {
                self.ledger.lose(lease);
                self.ban(id, &rejected.to_string())
            }
        }
    }

    /// Checks a result and enters it in the ledger. Returns the number of its walks.
    fn accept(&mut self, id: PeerId, result: LeaseResult) -> Result<u64, Rejected> {
        let LeaseResult { lease, counts, sums, digest, provenance, .. } = result;
        let counts = Counts::from_array(*counts).ok_or(Rejected::Counts)?;
        let parcel = Parcel::new(counts, sums, digest, &self.digester)?;
        let range = self.ledger.range(lease).ok_or(Rejected::NotLeased(lease))?;
        let (walks, Peer { name, relays, .. }) = (counts.walks, &self.peers[&id]);
        if walks != range.end - range.start {
            return Err(Rejected::Walks { expected: range.end - range.start, got: walks });
        }
        if let Some(breach) = parcel.breach(&self.terms.limits, self.terms.layout) {
            return Err(Rejected::Impossible(breach));
        }
        let brought = match relays {
            true => {
                provenance
                    .breach(walks, digest)
                    .map_or(Ok(()), |breach| Err(Rejected::Impossible(breach)))?;
                provenance.entered(name, &mut self.roster)
            }
            false if provenance == LeaseProvenance::default() => {
                vec![Delivery::lease(walks, self.roster.number(name), digest)]
            }
            false => return Err(Rejected::Impossible("it is in parts, though no relay sent it")),
        };
        self.ledger.accept(lease, parcel, &brought).map(|()| walks)
    }

    /// Notes that a worker has brought a result, so that more of its threads are believed.
    fn trust(&mut self, id: PeerId) {
        self.doubt(id);
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        peer.results = peer.results.saturating_add(1);
        peer.delivered = self.awake;
        self.believe(id);
        self.consider(id);
    }

    /// Lets a worker drop a large result whose walks another worker has brought.
    fn spare(&mut self, id: PeerId, lease: LeaseId) -> Action {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.leases.remove(&lease);
            self.holders.remove(&lease);
        }
        self.gets_on(id);
        self.consider(id);
        Action::Send(id, ToWorker::Drop { lease })
    }

    /// Asks for large results for which there is room.
    pub(super) fn ask(&mut self) -> Vec<Action> {
        let void = self.transfers.take_void(&self.ledger);
        let mut actions: Vec<Action> = void.into_iter().map(|(id, lease)| self.spare(id, lease)).collect();
        let (workers, tally) = (self.workers_now, (size_of::<u128>() * self.terms.sums()).max(1));
        let room = TransferRoom {
            ranges: 1 + workers * OUT_OF_ORDER_SHARE / tally,
            bytes: tally / 4 + workers * STAGING_SHARE,
        };
        let asked = self.transfers.grant(&self.ledger, room, self.awake);
        for &(id, _) in &asked {
            self.gets_on(id);
        }
        actions.extend(asked.into_iter().map(|(id, lease)| Action::Send(id, ToWorker::Send { lease })));
        actions
    }

    /// Does what is due as time passes, whatever else happens: gives out copies of late leases, asks for kept results,
    /// and makes room where all workers wait for each other.
    pub(crate) fn keep_going(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.lease_late(now);
        actions.extend(self.ask());
        actions.extend(self.make_room(now));
        actions
    }

    /// Frees a worker to fill a gap, where all workers keep results beyond it. If a worker has the gap's walks behind
    /// results that it keeps, it drops these, once the gap is held up for long or no worker does anything else. If no
    /// worker has the gap, because its walks are lost, the worker whose kept results lie furthest drops them. Dropped
    /// walks are leased again.
    fn make_room(&mut self, now: Now) -> Vec<Action> {
        if self.transfers.kept() == 0 {
            return vec![];
        }
        let keepers = self.transfers.keepers();
        let gap = self.gap(now);
        let holds_up = gap.as_ref().is_some_and(|gap| gap.holds_up);
        let keeper = gap.and_then(|gap| gap.holders.into_iter().find(|id| keepers.contains_key(id)));
        let dropped = match keeper {
            Some(id) if holds_up || self.is_still(&keepers) => self.transfers.take_of(id),
            None if self.ledger.has_lost() && self.is_still(&keepers) => self.transfers.take_furthest(),
            _ => return vec![],
        };
        for &(_, lease) in &dropped {
            self.ledger.lose(lease);
        }
        let mut actions: Vec<Action> = dropped.into_iter().map(|(id, lease)| self.spare(id, lease)).collect();
        actions.extend(self.hand_out(now));
        actions
    }

    /// Whether no worker has room for a lease, sends a result, or walks a lease whose result it does not keep.
    fn is_still(&self, keepers: &HashMap<PeerId, usize>) -> bool {
        let kept = |id| keepers.get(id).copied().unwrap_or(0);
        self.hungry.is_empty()
            && !self.transfers.is_receiving()
            && !self.peers.iter().any(|(id, peer)| self.walks_on(peer, kept(id)))
    }

    /// Whether a worker that keeps `kept` results walks another lease: it has one, a thread that may begin it, and has
    /// made progress recently. A stuck thread holds its lease for ever.
    fn walks_on(&self, peer: &Peer, kept: usize) -> bool {
        let may_begin = peer.relays || kept < MOST_KEPT * peer.slots.max(1);
        may_begin && kept < peer.leases.len() && self.awake - peer.progressed < SILENCE
    }
}
