//! Who gets which walks: leases by pace, gaps where a job is stopping, and copies of what is late.

use std::ops::Range;
use std::time::Duration;

use super::Crew;
use super::peer::{Peer, Since};
use crate::lead::{Action, Now, PeerId};
use crate::ledger::LeaseId;
use crate::message::ToWorker;
use crate::pace::{LATE, LEASE_GROWTH, lease_seconds, taking_seconds};

/// A gap below what is in may be this many times as late as a lease at the end, where workers have nothing else to do.
const GAP_PATIENCE: f64 = 4.0;

/// The most leases that are looked at for that. Walks are leased in their order, so that the lowest have been out for longest.
const MOST_LOOKED_AT: usize = 4096;

/// The most leases that are given once more at a time.
const MOST_LATE: usize = 64;

/// How often late leases are looked for.
const LATE_LOOK: Duration = Duration::from_millis(100);

/// Walks that are out, and how late they are.
pub(super) struct Late {
    start: u64,
    lease: LeaseId,
    /// The workers that are at these walks.
    pub(super) holders: Vec<PeerId>,
    /// Whether a worker that has nothing else to do should take them.
    is_late: bool,
    /// Whether they are so late that workers with other work should take them.
    pub(super) holds_up: bool,
}

impl Late {
    fn copies_at(&self, id: PeerId) -> usize {
        self.holders.iter().filter(|&&holder| holder == id).count()
    }
}

impl Crew {
    /// Notes whether a peer has room for a lease.
    pub(super) fn consider(&mut self, id: PeerId) {
        let Some(peer) = self.peers.get(&id) else { return };
        if peer.is_working() && peer.leases.len() < self.terms.leases_per_thread * peer.slots {
            self.hungry.insert(id);
        } else {
            self.hungry.remove(&id);
        }
    }

    /// Asks for what is kept and gives out what there is to do.
    pub fn go_on(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.ask();
        actions.extend(self.hand_out(now));
        actions
    }

    /// From now on no walk is leased that does not fill a gap below others.
    pub fn fill_gaps(&mut self) {
        self.fills_gaps = true;
        self.ledger.hurry();
    }

    /// Where what is walked ends: what is in, and what workers keep or are sending.
    fn walked(&self) -> u64 {
        self.ledger.last_waiting().max(self.transfers.end()).unwrap_or(0)
    }

    /// Whether a gap below what is walked may still be filled.
    pub fn gap_may_close(&self) -> bool {
        let walked = self.walked();
        self.ledger.gap_is_out(walked) || (self.ledger.gap_is_lost(walked) && self.workers_now > 0)
    }

    /// Fills every working peer up with leases, the idlest first. While stopping, with those alone that fill
    /// gaps below what is walked.
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

    /// How many walks to lease to a peer: by its rate, but ever fewer towards the end so that all finish
    /// together. Only the pace depends on it, never the answer.
    fn lease_walks(&self, id: PeerId, now: Now) -> u64 {
        let peer = &self.peers[&id];
        let by_rate = peer.lease_rate() * self.lease_seconds(now).max(peer.lease_seconds);
        let streams = (peer.lease_threads() as u64).saturating_mul(self.terms.stream_walks);
        let by_growth = peer.longest_lease.max(streams) as f64 * LEASE_GROWTH;
        let parts = (self.terms.leases_per_thread * self.threads).max(1) as u128;
        let share = u128::from((self.in_hand)(&self.ledger)) * peer.lease_threads() as u128 / parts;
        // Results must not come faster than they are taken, towards the end either.
        let least = (peer.lease_rate() * taking_seconds(self.terms.sums(), self.slots)) as u64;
        // Rounded up to whole streams, that is one for every thread.
        let one_each = streams.saturating_sub(self.terms.stream_walks - 1);
        (by_rate.min(by_growth) as u64).min((share as u64).max(least)).max(one_each)
    }

    /// How long a lease should take.
    pub fn lease_seconds(&self, now: Now) -> f64 {
        let age = self.spent.seconds + now.as_secs_f64();
        lease_seconds(self.terms.sums(), self.slots, age)
    }

    /// How long leases take that are out now, at most [s].
    pub fn longest_lease_seconds(&self, now: Now) -> f64 {
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

    /// Gives walks that are late to other workers as well; the first result counts. Walks that others wait for, because they
    /// are a gap below what is in, go to those that have just brought a result; towards the end, when all walks are out, any go
    /// to those that have nothing to do. So neither prefix nor end waits for a worker, or one of its threads, that is slow or
    /// silent.
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
                    // Another thread of the same worker may do it where no other worker is there.
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

    /// Some of those that brought a result, those first that have just done so.
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

    /// Leases below a walk that should have been in long ago, lowest first, since all wait for the lowest. Of walks that are out
    /// more than once, the last lease counts, and each takes twice the patience of the one before.
    fn late(&self, now: Now, below: u64) -> Vec<Late> {
        let fastest = self.fastest();
        let below = |&(start, _): &(u64, &[LeaseId])| start < below;
        let out = self.ledger.out().take_while(below).take(MOST_LOOKED_AT);
        // The walks of a result that is kept are done; it waits for those before it.
        let undone = out.filter(|&(start, leases)| !self.transfers.keeps_any(start, leases));
        undone
            .filter_map(|(start, leases)| self.look_at(start, leases, fastest, now))
            .filter(|late| late.is_late)
            .take(MOST_LATE)
            .collect()
    }

    /// The lowest walks that are out and of which no result is kept.
    pub(super) fn gap(&self, now: Now) -> Option<Late> {
        let mut out = self.ledger.out().take(MOST_LOOKED_AT);
        let (start, leases) = out.find(|&(start, leases)| !self.transfers.keeps_any(start, leases))?;
        self.look_at(start, leases, self.fastest(), now)
    }

    /// The rate of the fastest thread [walks/s].
    fn fastest(&self) -> f64 {
        self.peers.values().map(|peer| peer.rate).fold(0.0, f64::max)
    }

    /// How late the walks of some leases are.
    fn look_at(&self, start: u64, leases: &[LeaseId], fastest: f64, now: Now) -> Option<Late> {
        let holders: Vec<PeerId> =
            leases.iter().filter_map(|lease| self.holders.get(lease).copied()).collect();
        let given = leases.iter().zip(&holders).map(|(lease, id)| self.peers[id].leases[lease].awake);
        let since = given.max()?;
        let patience = self.patience(leases[0], holders[0], fastest, now)
            * f64::from(1_u32 << holders.len().min(20))
            / 2.0;
        let waited = (self.awake - since).as_secs_f64();
        let (is_late, holds_up) = (waited > patience, waited > GAP_PATIENCE * patience);
        Some(Late { start, lease: leases[0], holders, is_late, holds_up })
    }

    /// How long a lease may take before it is late [s].
    fn patience(&self, lease: LeaseId, holder: PeerId, fastest: f64, now: Now) -> f64 {
        let (peer, range) = (&self.peers[&holder], self.ledger.range(lease).unwrap_or_default());
        let walking = (range.end - range.start) as f64 / (fastest * peer.lease_threads().max(1) as f64);
        // What a relay says of its leases is believed when it has brought one.
        let claimed = if peer.results > 0 { peer.lease_seconds } else { 0.0 };
        let seconds = self.lease_seconds(now).max(claimed).max(walking);
        LATE * self.terms.leases_per_thread as f64 * seconds
    }
}
