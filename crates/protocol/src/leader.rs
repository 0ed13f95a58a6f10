//! What coordinator and relay share as leaders of a pool: how events reach the pool, and what follows from them.

use crate::lead::{Action, Lead, Now, PeerId};
use crate::message::ToCoordinator;
use crate::pool::{PoolOutcome, WorkerPool};

/// A leader of a pool: the coordinator or a relay. Each is a [`Lead`].
pub(crate) trait Leader {
    /// The leader's pool, to be changed.
    fn pool_mut(&mut self) -> &mut WorkerPool;
    /// The leader's pool, to be read.
    fn pool(&self) -> &WorkerPool;
    /// Whether the leader's job has ended; its books no longer change then.
    fn is_over(&self) -> bool;
    /// Goes on after results or walks came in or back: merges, and gives out leases.
    fn advance(&mut self, now: Now) -> Vec<Action>;
    /// Ends the job because a sum overflowed.
    fn overflow(&mut self) -> Vec<Action>;
    /// Does what is due at a time.
    fn tick(&mut self, now: Now) -> Vec<Action>;
    /// Counts bytes that peers have sent.
    fn count(&mut self, bytes: usize) {
        let _ = bytes;
    }
}

/// Carries out what an event in the pool asks for.
fn after(leader: &mut impl Leader, step: PoolOutcome, now: Now) -> Vec<Action> {
    match step {
        PoolOutcome::Still(actions) => actions,
        PoolOutcome::Moved(mut actions) => {
            actions.extend(leader.advance(now));
            actions
        }
        PoolOutcome::Overflow => leader.overflow(),
    }
}

impl<C: Leader> Lead for C {
    fn on_connect(&mut self, id: PeerId) -> Vec<Action> {
        if self.is_over() {
            return self.pool().farewell(id);
        }
        self.pool_mut().on_connect(id);
        vec![]
    }

    fn on_message(&mut self, id: PeerId, message: ToCoordinator, now: Now) -> Vec<Action> {
        if self.is_over() {
            return vec![];
        }
        let step = self.pool_mut().on_message(id, message, now);
        after(self, step, now)
    }

    fn on_stir(&mut self, id: PeerId) {
        self.pool_mut().on_stir(id);
    }

    fn on_bytes(&mut self, bytes: usize) {
        self.count(bytes);
    }

    fn on_lost(&mut self, id: PeerId, reason: &str, now: Now) -> Vec<Action> {
        // After the end all peers leave, which is no loss.
        if self.is_over() {
            return vec![];
        }
        let step = self.pool_mut().on_lost(id, reason);
        after(self, step, now)
    }

    fn on_tick(&mut self, now: Now) -> Vec<Action> {
        if self.is_over() { vec![] } else { self.tick(now) }
    }

    fn frame_cap(&self, id: PeerId) -> usize {
        self.pool().frame_cap(id)
    }
}
