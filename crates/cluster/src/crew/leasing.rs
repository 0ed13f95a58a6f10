//! Who gets which walks: leases by pace, gaps where a job is stopping, and copies of what is late.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use super::Crew;
use super::peer::Peer;
use crate::lead::{Action, Now, PeerId};
use crate::ledger::LeaseId;
use crate::message::ToWorker;
use crate::pace::{LATE, LEASE_GROWTH, lease_seconds, taking_seconds};

/// So many workers may be at the same walks: the more, the sooner the end where several are silent.
const MOST_COPIES: usize = 3;

/// How often late leases are looked for.
const LATE_LOOK: Duration = Duration::from_millis(100);

/// A lease that is late.
struct Late {
    /// When its walks were last leased, by the waking clock.
    since: Duration,
    /// How long that may take.
    patience: f64,
    lease: LeaseId,
    /// Who is at them.
    holders: Vec<PeerId>,
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
        let parts = (self.terms.leases_per_thread * self.threads) as u128;
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
        peer.leases.insert(lease, self.awake);
        peer.longest_lease = peer.longest_lease.max(walks);
        self.consider(id);
        Action::Send(id, ToWorker::Lease { id: lease, first_walk: self.ledger.number(range.start), walks })
    }

    /// Gives walks that are late once more, to workers that have nothing to do when all walks are out. Whoever is first
    /// counts, so that the end waits for nobody who is slow or silent.
    pub fn lease_late(&mut self, now: Now) -> Vec<Action> {
        let nothing_else = !self.fills_gaps && self.ledger.unleased() == 0;
        if !nothing_else || now.saturating_sub(self.sought) < LATE_LOOK {
            return vec![];
        }
        self.sought = now;
        let is_idle = |peer: &Peer| peer.leases.len() < peer.slots;
        let idle: Vec<PeerId> = self.hungry.iter().copied().filter(|id| is_idle(&self.peers[id])).collect();
        let mut late = if idle.is_empty() { vec![] } else { self.late(now) };
        let mut actions = Vec::new();
        for id in idle {
            while is_idle(&self.peers[&id])
                && let Some(at) = late.iter().position(|late| !late.holders.contains(&id))
                && let Some((lease, range)) = self.ledger.lease_again(late.remove(at).lease)
            {
                actions.push(self.send_lease(id, lease, range, now));
            }
        }
        actions
    }

    /// Leases that should have been in long ago, those first that have been out for longest. Of walks that are out more
    /// than once, the last lease counts.
    fn late(&self, now: Now) -> Vec<Late> {
        let fastest = self.peers.values().map(|peer| peer.rate).fold(0.0, f64::max);
        let mut out: BTreeMap<u64, Late> = BTreeMap::new();
        for (&id, peer) in &self.peers {
            for (&lease, &since) in &peer.leases {
                // Others have done what is not out any more.
                let Some(range) = self.ledger.range(lease) else { continue };
                let walking = (range.end - range.start) as f64 / (fastest * peer.lease_threads() as f64);
                let seconds = self.lease_seconds(now).max(peer.lease_seconds).max(walking);
                let patience = LATE * self.terms.leases_per_thread as f64 * seconds;
                let fresh = || Late { since, patience, lease, holders: vec![] };
                let late = out.entry(range.start).or_insert_with(fresh);
                if since > late.since {
                    (late.since, late.patience) = (since, patience);
                }
                late.holders.push(id);
            }
        }
        let mut late: Vec<Late> = out
            .into_values()
            .filter(|late| {
                late.holders.len() < MOST_COPIES && (self.awake - late.since).as_secs_f64() > late.patience
            })
            .collect();
        late.sort_unstable_by_key(|late| late.since);
        late
    }
}
