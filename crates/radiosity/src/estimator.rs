//! Estimators: what a walk scores, and where.

use crate::tally::Scoreboard;

/// Scores the events of one walk after another.
pub trait Estimator {
    /// The next events belong to walk number `walk`.
    fn begin(&mut self, walk: u64);
    /// The walk arrived at an active side of `patch`.
    fn arrival(&mut self, patch: u32);
}

/// Collision shooting (S97 §2.4): every hit scores one unit, worth Φ_T of incoming power.
#[derive(Debug)]
pub struct Collision<'a, const M: usize> {
    board: &'a mut Scoreboard<M>,
    walk: u64,
}

impl<'a, const M: usize> Collision<'a, M> {
    /// Scores on a board.
    pub fn new(board: &'a mut Scoreboard<M>) -> Self {
        Collision { board, walk: 0 }
    }
}

impl<const M: usize> Estimator for Collision<'_, M> {
    #[inline(always)]
    fn begin(&mut self, walk: u64) {
        self.walk = walk;
    }

    #[inline(always)]
    fn arrival(&mut self, patch: u32) {
        self.board.add(self.walk, patch, 1);
    }
}
