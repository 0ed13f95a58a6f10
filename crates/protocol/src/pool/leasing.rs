//! Leasing: the size of leases by a worker's pace, gaps while a job is stopping, and copies of late leases.

use std::ops::Range;
use std::time::Duration;

use super::WorkerPool;
use super::peer::{Peer, Since};
use crate::lead::{Action, Now, PeerId};
use crate::message::{LeaseId, ToWorker};
use crate::pace::{LATE, LEASE_GROWTH, lease_seconds, taking_seconds};

/// A lease in a gap below what is in may be this many times as late as one at the end, where workers have nothing else
/// to do.
const GAP_PATIENCE: f64 = 4.0;

/// The most leases that are examined for lateness. Walks are leased in order, so the lowest have been out for longest.
const MOST_LOOKED_AT: usize = 4096;

/// The most late leases that are given out once more at a time.
const MOST_LATE: usize = 64;

/// The time between two searches for late leases.
const LATE_LOOK: Duration = Duration::from_millis(100);

/// A range of walks that is out, and how late it is.
pub(super) struct LateLease {
    start: u64,
    lease: LeaseId,
    /// The workers that have these walks.
    pub(super) holders: Vec<PeerId>,
    /// Whether an idle worker should take these walks.
    is_late: bool,
    /// Whether these walks are so late that even a busy worker should take them.
    pub(super) holds_up: bool,
}

impl LateLease {
    fn copies_at(&self, id: PeerId) -> usize {
        self.holders.iter().filter(|&&holder| holder == id).count()
    }
}

impl WorkerPool {
    /// Notes whether a peer has room for another lease.
    pub(super) fn consider(&mut self, id: PeerId) {
        let Some(peer) = self.peers.get(&id) else { return };
        if peer.is_working() && peer.leases.len() < self.terms.leases_per_thread * peer.slots {
            self.hungry.insert(id);
        } else {
            self.hungry.remove(&id);
        }
    }

    /// Asks for kept results and gives out leases.
    pub(crate) fn go_on(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.ask();
        actions.extend(self.hand_out(now));
        actions
    }

    /// Leases no walks from now on but those that fill a gap below others.
    pub(crate) fn fill_gaps(&mut self) {
        self.fills_gaps = true;
        self.ledger.hurry();
    }

    /// The end of all walks that are in, kept by workers or being sent.
    fn walked(&self) -> u64 {
        self.ledger.last_waiting().max(self.transfers.end()).unwrap_or(0)
    }

    /// Whether a gap below what is walked may still be filled.
    pub(crate) fn gap_may_close(&self) -> bool {
        let walked = self.walked();
        self.ledger.gap_is_out(walked) || (self.ledger.gap_is_lost(walked) && self.workers_now > 0)
    }

    /// Gives every working peer as many leases as it may have, the idlest peer first. While a job is stopping, only
    /// gaps below what is walked are leased.
    pub(super) fn hand_out(&mut self, now: Now) -> Vec<Action> {
        let mut actions = Vec::new();
        if self.ledger.unleased() == 0 {
            return actions;
        }
        for depth in 0..self.terms.leases_per_thread {
            let fed = |peer: &Peer| peer.leases.len() >= (depth + 1) * peer.slots;
            let hungry: Vec<PeerId> =
                self.hungry.iter().copied().filter(|id| !fed(&self.peers[id])).collect();
            for id in hungry {
                while !fed(&self.peers[&id]) {
                    let walks = self.lease_walks(id, now);
                    let leased = match self.fills_gaps {
                        false => self.ledger.lease(walks),
                        true => self.ledger.lease_gap(walks, self.walked()),
                    };
                    let Some((lease, range)) = leased else { return actions };
                    actions.push(self.send_lease(id, lease, range, now));
                }
            }
        }
        actions
    }

    /// The walks of a peer's next lease: by its rate, but ever fewer towards the end, so that all workers finish
    /// together. Only the pace depends on it, never the answer.
    fn lease_walks(&self, id: PeerId, now: Now) -> u64 {
        let peer = &self.peers[&id];
        let by_rate = peer.lease_rate() * self.lease_seconds(now).max(peer.lease_seconds);
        let streams = (peer.lease_threads() as u64).saturating_mul(self.terms.stream_walks);
        let by_growth = peer.longest_lease.max(streams) as f64 * LEASE_GROWTH;
        let parts = (self.terms.leases_per_thread * self.threads).max(1) as u128;
        let share = u128::from((self.in_hand)(&self.ledger)) * peer.lease_threads() as u128 / parts;
        // Results must not come faster than the leader takes them, not even towards the end.
        let least = (peer.lease_rate() * taking_seconds(self.terms.sums(), self.slots)) as u64;
        // Rounded up to whole streams, this is one stream for every thread.
        let one_each = streams.saturating_sub(self.terms.stream_walks - 1);
        (by_rate.min(by_growth) as u64).min((share as u64).max(least)).max(one_each)
    }

    /// The time that a lease should take [s].
    pub(crate) fn lease_seconds(&self, now: Now) -> f64 {
        let age = self.spent.seconds + now.as_secs_f64();
        lease_seconds(self.terms.sums(), self.slots, age)
    }

    /// The longest time that any lease now out should take [s].
    pub(crate) fn longest_lease_seconds(&self, now: Now) -> f64 {
        self.peers.values().map(|peer| peer.lease_seconds).fold(self.lease_seconds(now), f64::max)
    }

    fn send_lease(&mut self, id: PeerId, lease: LeaseId, range: Range<u64>, now: Now) -> Action {
        self.first_lease.get_or_insert(now);
        let walks = range.end - range.start;
        let peer = self.peers.get_mut(&id).expect("a working peer");
        if peer.leases.is_empty() {
            peer.progressed = self.awake;
        }
        peer.leases.insert(lease, Since { awake: self.awake, now });
        self.holders.insert(lease, id);
        peer.longest_lease = peer.longest_lease.max(walks);
        self.consider(id);
        Action::Send(id, ToWorker::Lease { id: lease, first_walk: self.ledger.number(range.start), walks })
    }

    /// Gives late walks to other workers as well; the first result counts. Walks in a gap below what is in go to
    /// workers that have just brought a result, since all later results wait for them. At the end, when all walks are
    /// out, late walks go to idle workers. So neither the prefix nor the end waits for a slow or silent worker, or for
    /// one slow thread of a worker.
    pub(super) fn lease_late(&mut self, now: Now) -> Vec<Action> {
        if now.saturating_sub(self.sought) < LATE_LOOK {
            return vec![];
        }
        self.sought = now;
        let at_end = !self.fills_gaps && self.ledger.unleased() == 0;
        let gap_end = self.walked();
        let is_idle = |peer: &Peer| peer.leases.len() < peer.slots;
        let mut idle: Vec<PeerId> =
            self.hungry.iter().copied().filter(|id| is_idle(&self.peers[id])).collect();
        if gap_end == 0 && idle.is_empty() {
            return vec![];
        }
        let mut busy: Option<Vec<PeerId>> = None;
        let mut actions = Vec::new();
        for late in self.late(now, if at_end && !idle.is_empty() { u64::MAX } else { gap_end }) {
            let free = |id: &PeerId| !late.holders.contains(id);
            let taker = match idle.iter().position(free) {
                Some(at) => idle.swap_remove(at),
                None if late.start >= gap_end || !late.holds_up => continue,
                None => {
                    let busy = busy.get_or_insert_with(|| self.diligent());
                    // Another thread of the same worker may do it if no other worker is there.
                    let others = |id: &PeerId| self.peers[id].slots > late.copies_at(*id);
                    let Some(at) = busy.iter().position(free).or_else(|| busy.iter().position(others)) else {
                        continue;
                    };
                    busy.remove(at)
                }
            };
            if let Some((lease, range)) = self.ledger.lease_again(late.lease) {
                actions.push(self.send_lease(taker, lease, range, now));
            }
        }
        actions
    }

    /// Workers that have brought a result, those first that brought one last.
    fn diligent(&self) -> Vec<PeerId> {
        let mut busy: Vec<PeerId> = self
            .peers
            .iter()
            .filter(|(_, peer)| peer.is_working() && peer.slots > 0 && peer.results > 0)
            .map(|(&id, _)| id)
            .collect();
        busy.sort_unstable_by_key(|id| (std::cmp::Reverse(self.peers[id].delivered), *id));
        busy.truncate(MOST_LATE);
        busy
    }

    /// The late leases below a walk, lowest first, since everything waits for the lowest. Of walks that are out more
    /// than once the last lease counts, and each copy is given twice the patience of the one before.
    fn late(&self, now: Now, below: u64) -> Vec<LateLease> {
        let fastest = self.fastest();
        let below = |&(start, _): &(u64, &[LeaseId])| start < below;
        let out = self.ledger.out().take_while(below).take(MOST_LOOKED_AT);
        // A kept result's walks are done; it only waits for those before it.
        let undone = out.filter(|&(start, leases)| !self.transfers.keeps_any(start, leases));
        undone
            .filter_map(|(start, leases)| self.look_at(start, leases, fastest, now))
            .filter(|late| late.is_late)
            .take(MOST_LATE)
            .collect()
    }

    /// The lowest walks that are out and of which no worker keeps a result.
    pub(super) fn gap(&self, now: Now) -> Option<LateLease> {
        let mut out = self.ledger.out().take(MOST_LOOKED_AT);
        let (start, leases) = out.find(|&(start, leases)| !self.transfers.keeps_any(start, leases))?;
        self.look_at(start, leases, self.fastest(), now)
    }

    /// The rate of the fastest thread [walks/s].
    fn fastest(&self) -> f64 {
        self.peers.values().map(|peer| peer.rate).fold(0.0, f64::max)
    }

    /// Looks up how late the walks of some leases are.
    fn look_at(&self, start: u64, leases: &[LeaseId], fastest: f64, now: Now) -> Option<LateLease> {
        let holders: Vec<PeerId> =
            leases.iter().filter_map(|lease| self.holders.get(lease).copied()).collect();
        let given = leases.iter().zip(&holders).map(|(lease, id)| self.peers[id].leases[lease].awake);
        let since = given.max()?;
        let patience = self.patience(leases[0], holders[0], fastest, now)
            * f64::from(1_u32 << holders.len().min(20))
            / 2.0;
        let waited = (self.awake - since).as_secs_f64();
        let (is_late, holds_up) = (waited > patience, waited > GAP_PATIENCE * patience);
        Some(LateLease { start, lease: leases[0], holders, is_late, holds_up })
    }

    /// The time that a lease may take before it is late [s].
    fn patience(&self, lease: LeaseId, holder: PeerId, fastest: f64, now: Now) -> f64 {
        let (peer, range) = (&self.peers[&holder], self.ledger.range(lease).unwrap_or_default());
        let walking = (range.end - range.start) as f64 / (fastest * peer.lease_threads().max(1) as f64);
        // What a relay says of its leases is believed once it has brought a result.
        let claimed = if peer.results > 0 { peer.lease_seconds } else { 0.0 };
        let seconds = self.lease_seconds(now).max(claimed).max(walking);
        LATE * self.terms.leases_per_thread as f64 * seconds
    }
}
