//! The score of exchange factors: which group takes a walk.

use super::score::Scorer;
use crate::random::rng::WalkRng;
use crate::simd::batch::{Decisions, WIDTH};
use crate::tally::Scoreboard;

/// Exchange: one unit for each walk that an active side takes, in the row of that face's group.
pub(crate) struct Exchanged<'a, const M: usize> {
    board: &'a mut Scoreboard<u64, (), 1, M>,
    group_of_face: &'a [u32],
    /// The row of the first group.
    first_row: u32,
}

impl<'a, const M: usize> Exchanged<'a, M> {
    pub(crate) fn new(
        board: &'a mut Scoreboard<u64, (), 1, M>,
        group_of_face: &'a [u32],
        first_row: u32,
    ) -> Self {
        Exchanged { board, group_of_face, first_row }
    }
}

impl<const M: usize> Scorer<1> for Exchanged<'_, M> {
    #[inline(always)]
    fn begin(&mut self, _: usize, _: u32) {}

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        decided.died.each(|lane| {
            self.board.add_one(self.first_row + self.group_of_face[faces[lane] as usize], 0);
        });
    }

    #[inline(always)]
    fn end(&mut self, _: usize, _: WalkRng) {}

    fn relocate(&mut self, _: usize, _: usize) {}
}
