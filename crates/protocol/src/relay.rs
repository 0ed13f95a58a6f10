//! A relay as a pure state machine: a worker to its leader, and a leader to its own workers. It splits each lease that
//! it is given among its workers, merges their results, and passes on one result.
//!
//! A relay's ledger holds leases one after the other, in the order in which they came, whatever the numbers of their
//! walks; each lease ends at a look. So the prefix is what has come in of the first lease. At a look the prefix is
//! taken off and sent on. Results of the next lease wait beside it, as with a coordinator, and what a relay holds is
//! bounded in the same way.

use std::collections::VecDeque;

use radiosity::Tally;

use crate::codec::pack;
use crate::deliveries::Deliveries;
use crate::effort::Effort;
use crate::lead::{Action, Now};
use crate::leader::Leader;
use crate::ledger::Ledger;
use crate::message::{LeaseId, LeaseResult, ToCoordinator};
use crate::pace::RELAY_ROUNDS;
use crate::pool::WorkerPool;
use crate::provenance::LeaseProvenance;
use crate::terms::Terms;

/// A lease that the relay was given.
struct Held {
    lease: LeaseId,
    walks: u64,
    since: Now,
}

/// The state of a relay and its pool.
pub struct Relay {
    pool: WorkerPool,
    lots: u64,
    /// The leases that the relay has, in the order in which they came.
    held: VecDeque<Held>,
    /// Messages that are to be sent to the relay's leader.
    outbox: Vec<ToCoordinator>,
    /// The number of its workers' threads that the relay last reported to its leader.
    announced: usize,
    over: Option<RelayEnd>,
}

/// The reason why a relay ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RelayEnd {
    /// The leader or the relay's owner told it to end.
    Dismissed,
    /// A sum overflowed, so that no result is of any use.
    Overflow,
    /// The leader gave it more walks than there are numbers.
    Excess,
}

impl Relay {
    /// A relay of a job, without workers. `lots` is a secret random number: it decides which of many leases of its
    /// workers are reported one by one.
    pub fn new(terms: Terms, lots: u64) -> Self {
        let ledger = books(&terms, lots);
        let pool = WorkerPool::new(terms, ledger, Ledger::span, vec![], Effort::default());
        Relay { pool, lots, held: VecDeque::new(), outbox: vec![], announced: 0, over: None }
    }

    /// The reason why the relay ended, once it has.
    pub fn end(&self) -> Option<RelayEnd> {
        self.over
    }

    /// A counter that grows whenever any of its workers makes progress.
    pub fn progress(&self) -> u64 {
        self.pool.progress()
    }

    /// Takes the messages for the relay's leader, in the order in which they are to be sent. Large results must be
    /// offered first.
    pub fn take_outbox(&mut self) -> Vec<ToCoordinator> {
        std::mem::take(&mut self.outbox)
    }

    /// Takes up a lease from the relay's leader.
    pub fn on_lease(&mut self, lease: LeaseId, first: u64, walks: u64, now: Now) -> Vec<Action> {
        if self.pool.threads() == 0 {
            // The last worker left while this lease was under way. The leader must learn that before the lease comes
            // back.
            self.tell_capacity(now);
            self.outbox.push(ToCoordinator::Return { lease });
            return vec![];
        }
        if !self.pool.ledger.extend(first, walks) {
            return self.finish(RelayEnd::Excess);
        }
        self.held.push_back(Held { lease, walks, since: now });
        self.pool.go_on(now)
    }

    /// Ends the relay and tells all its workers that the job is done.
    pub fn finish(&mut self, end: RelayEnd) -> Vec<Action> {
        if self.over.is_some() {
            return vec![];
        }
        self.over = Some(end);
        self.pool.dismiss()
    }

    /// Sends on the result of the first lease.
    fn send_on(&mut self, now: Now) {
        let (tally, deliveries) = self.pool.ledger.take_off();
        let Held { lease, walks, since } = self.held.pop_front().expect("each look is the end of a lease");
        // The time by its workers' rate: some of this lease was walked before the one before was whole.
        let rate = self.pool.rate();
        let seconds = if rate > 0.0 { walks as f64 / rate } else { (now - since).as_secs_f64() };
        let cpu_seconds = self.pool.effort().cpu_seconds;
        let result = LeaseResult {
            lease,
            seconds,
            cpu_seconds,
            counts: Box::new(tally.counts.to_array()),
            sums: pack(tally.sums()),
            // These are the digests that came with the parts: if a sum was changed in this relay, the leader finds out.
            digest: deliveries.digest(),
            provenance: LeaseProvenance::new(&deliveries, self.pool.workers()),
        };
        self.outbox.push(ToCoordinator::Result(result));
    }

    /// Reports the number of threads to the relay's leader when it has changed. With none left, all leases go back, and
    /// their results so far are dropped.
    fn tell_capacity(&mut self, now: Now) {
        let threads = self.pool.threads();
        if threads == self.announced {
            return;
        }
        self.announced = threads;
        let rounds = RELAY_ROUNDS * self.pool.terms().leases_per_thread as f64;
        let lease_seconds = rounds * self.pool.longest_lease_seconds(now);
        let threads = u32::try_from(threads).unwrap_or(u32::MAX);
        self.outbox.push(ToCoordinator::Capacity { threads, lease_seconds });
        if threads == 0 {
            let held = self.held.drain(..);
            self.outbox.extend(held.map(|held| ToCoordinator::Return { lease: held.lease }));
            self.pool.ledger = books(self.pool.terms(), self.lots).leased_after(&self.pool.ledger);
        }
    }
}

/// A ledger without walks.
fn books(terms: &Terms, lots: u64) -> Ledger {
    let empty = Tally::new(terms.patches, terms.layout);
    Ledger::new(0, terms.stream_walks.max(1), vec![], empty.into(), Deliveries::default()).drawn_by(lots)
}

impl Leader for Relay {
    fn pool_mut(&mut self) -> &mut WorkerPool {
        &mut self.pool
    }

    fn pool(&self) -> &WorkerPool {
        &self.pool
    }

    fn is_over(&self) -> bool {
        self.over.is_some()
    }

    /// Merges the results that are in, sends on the leases that are whole, and gives out more work.
    fn advance(&mut self, now: Now) -> Vec<Action> {
        loop {
            match self.pool.advance() {
                Ok(true) if self.pool.ledger.at_look() => self.send_on(now),
                Ok(true) => {}
                Ok(false) => return self.pool.go_on(now),
                Err(_) => return self.finish(RelayEnd::Overflow),
            }
        }
    }

    fn overflow(&mut self) -> Vec<Action> {
        self.finish(RelayEnd::Overflow)
    }

    /// Notices silence and stalls, and reports the number of threads to the relay's leader.
    fn tick(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.pool.tick(now);
        if !actions.is_empty() {
            actions.extend(self.advance(now));
        }
        if self.over.is_none() {
            actions.extend(self.pool.keep_going(now));
        }
        self.tell_capacity(now);
        actions
    }
}
