//! A relay as a pure state machine: one worker to whoever leads it, and a leader to its own workers. It splits each lease
//! that it is given among them, merges what they bring, and passes on one result.
//!
//! Its books stand on end: leases follow each other in the order in which they came, whatever walks they hold, and looks are
//! where one ends. So the prefix is what has come in of the first; at a look it is taken off and sent on; what workers
//! have done of the next waits beside it, as with a coordinator. What a relay holds is bounded in the same way.

use std::collections::VecDeque;

use radiosity::Tally;

use crate::captain::Captain;
use crate::codec::pack;
use crate::crew::Crew;
use crate::deliveries::Deliveries;
use crate::effort::Effort;
use crate::lead::{Action, Now};
use crate::ledger::{LeaseId, Ledger};
use crate::message::{LeaseResult, ToCoordinator};
use crate::pace::RELAY_ROUNDS;
use crate::provenance::Provenance;
use crate::terms::Terms;

/// A lease that was given to the relay.
struct Held {
    lease: LeaseId,
    walks: u64,
    since: Now,
}

/// The state of a relay.
pub struct Relay {
    crew: Crew,
    lots: u64,
    /// In the order in which they came.
    held: VecDeque<Held>,
    /// What is to be said to whoever leads.
    outbox: Vec<ToCoordinator>,
    /// Threads of its workers that whoever leads knows of.
    told: usize,
    over: Option<End>,
}

/// Why a relay ends by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It was told that the job is done, or to leave.
    Told,
    /// A sum overflowed.
    Overflow,
    /// Whoever leads gave it more walks than there are numbers.
    Excess,
}

impl Relay {
    /// A relay of a job, without workers. `lots` are drawn at random and kept secret: they decide which leases of its workers
    /// are told of one by one, where these are many.
    pub fn new(terms: Terms, lots: u64) -> Self {
        let ledger = books(&terms, lots);
        let crew = Crew::new(terms, ledger, Ledger::span, vec![], Effort::default());
        Relay { crew, lots, held: VecDeque::new(), outbox: vec![], told: 0, over: None }
    }

    /// Why it ended, once it has.
    pub fn end(&self) -> Option<End> {
        self.over
    }

    /// Grows while its workers get on.
    pub fn progress(&self) -> u64 {
        self.crew.progress()
    }

    /// What is to be said to whoever leads, in this order. Large results are to be offered first.
    pub fn take_outbox(&mut self) -> Vec<ToCoordinator> {
        std::mem::take(&mut self.outbox)
    }

    /// Whoever leads gave it a lease.
    pub fn on_lease(&mut self, lease: LeaseId, first: u64, walks: u64, now: Now) -> Vec<Action> {
        if self.crew.threads() == 0 {
            // The last of its workers left while this was under way. Whoever leads is to know before it is given it back.
            self.tell_capacity(now);
            self.outbox.push(ToCoordinator::Return { lease });
            return vec![];
        }
        if !self.crew.ledger.extend(first, walks) {
            return self.finish(End::Excess);
        }
        self.held.push_back(Held { lease, walks, since: now });
        self.crew.go_on(now)
    }

    /// Sends everybody home.
    pub fn finish(&mut self, end: End) -> Vec<Action> {
        if self.over.is_some() {
            return vec![];
        }
        self.over = Some(end);
        self.crew.dismiss()
    }

    /// Sends on the result of the first lease.
    fn send_on(&mut self, now: Now) {
        let (tally, deliveries) = self.crew.ledger.take_off();
        let Held { lease, walks, since } = self.held.pop_front().expect("each look is the end of a lease");
        // By what its workers can do: some of this lease was done while the one before was not yet whole.
        let rate = self.crew.rate();
        let seconds = if rate > 0.0 { walks as f64 / rate } else { (now - since).as_secs_f64() };
        let cpu_seconds = self.crew.effort().cpu_seconds;
        let result = LeaseResult {
            lease,
            seconds,
            cpu_seconds,
            counts: Box::new(tally.counts.to_array()),
            sums: pack(tally.sums()),
            // These are the digests that came with the parts: where a sum was changed here, the leader finds out.
            digest: deliveries.digest(),
            provenance: Provenance::new(&deliveries, self.crew.workers()),
        };
        self.outbox.push(ToCoordinator::Result(result));
    }

    /// Says how many threads work here, where whoever leads knows another number. Without any, leases go back, and what was
    /// done of them is dropped.
    fn tell_capacity(&mut self, now: Now) {
        let threads = self.crew.threads();
        if threads == self.told {
            return;
        }
        self.told = threads;
        let rounds = RELAY_ROUNDS * self.crew.terms().leases_per_thread as f64;
        let lease_seconds = rounds * self.crew.longest_lease_seconds(now);
        let threads = u32::try_from(threads).unwrap_or(u32::MAX);
        self.outbox.push(ToCoordinator::Capacity { threads, lease_seconds });
        if threads == 0 {
            let held = self.held.drain(..);
            self.outbox.extend(held.map(|held| ToCoordinator::Return { lease: held.lease }));
            self.crew.ledger = books(self.crew.terms(), self.lots);
        }
    }
}

/// Books without walks.
fn books(terms: &Terms, lots: u64) -> Ledger {
    let empty = Tally::new(terms.patches, terms.layout);
    Ledger::new(0, terms.stream_walks.max(1), vec![], empty.into(), Deliveries::default()).drawn_by(lots)
}

impl Captain for Relay {
    fn crew(&mut self) -> &mut Crew {
        &mut self.crew
    }

    fn its_crew(&self) -> &Crew {
        &self.crew
    }

    fn is_over(&self) -> bool {
        self.over.is_some()
    }

    /// Merges what is in, sends on what is whole, and gives out more work.
    fn advance(&mut self, now: Now) -> Vec<Action> {
        loop {
            match self.crew.advance() {
                Ok(true) if self.crew.ledger.at_look() => self.send_on(now),
                Ok(true) => {}
                Ok(false) => return self.crew.go_on(now),
                Err(_) => return self.finish(End::Overflow),
            }
        }
    }

    fn overflow(&mut self) -> Vec<Action> {
        self.finish(End::Overflow)
    }

    /// Notices silence and stalls, and tells whoever leads how many work here.
    fn tick(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.crew.tick(now);
        if !actions.is_empty() {
            actions.extend(self.advance(now));
        }
        if self.over.is_none() {
            actions.extend(self.crew.keep_going(now));
        }
        self.tell_capacity(now);
        actions
    }
}
