//! The score of exchange factors: which group takes a walk.

use super::score::Scorer;
use crate::geometry::sky::SkyPatches;
use crate::random::rng::WalkRng;
use crate::simd::batch::{Decisions, Lanes, WIDTH};
use crate::tally::HitScoreboard;
use crate::trace::ray::Rays;

/// Exchange: one unit for each walk that an active side takes, in the row of that face's group.
pub(crate) struct Exchanged<'a> {
    board: &'a mut HitScoreboard<1>,
    group_of_face: &'a [u32],
    /// The row of the first group.
    first_row: u32,
}

impl<'a> Exchanged<'a> {
    pub(crate) fn new(board: &'a mut HitScoreboard<1>, group_of_face: &'a [u32], first_row: u32) -> Self {
        Exchanged { board, group_of_face, first_row }
    }
}

impl Scorer<1> for Exchanged<'_> {
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

/// One row of exchange factors: counts by column, and the columns that have any.
#[derive(Clone, Debug)]
pub(crate) struct RowCounts {
    counts: Vec<u32>,
    met: Vec<u32>,
}

impl RowCounts {
    pub(crate) fn new(columns: usize) -> Self {
        RowCounts { counts: vec![0; columns], met: Vec::new() }
    }

    /// Adds walks to a column.
    #[inline(always)]
    pub(crate) fn add(&mut self, column: u32, walks: u32) {
        let count = &mut self.counts[column as usize];
        if *count == 0 && walks > 0 {
            self.met.push(column);
        }
        *count += walks;
    }

    /// Hands over the columns that have walks, in ascending order, and empties all.
    pub(crate) fn take(&mut self) -> Vec<(u32, u32)> {
        self.met.sort_unstable();
        self.met.drain(..).map(|column| (column, std::mem::take(&mut self.counts[column as usize]))).collect()
    }
}

/// Exchange of one group: one unit for each walk that an active side takes, in the column of that face's group; and for each that
/// leaves the scene for a patch of the sky.
pub(crate) struct ExchangedRow<'a> {
    pub(crate) row: &'a mut RowCounts,
    pub(crate) group_of_face: &'a [u32],
    /// The division of the sky, and the column of its first patch; `None` where rays that leave are not distinguished.
    pub(crate) sky: Option<(&'a SkyPatches, u32)>,
    /// How many walks have left for a patch of it.
    pub(crate) to_sky: u32,
}

impl Scorer<1> for ExchangedRow<'_> {
    #[inline(always)]
    fn begin(&mut self, _: usize, _: u32) {}

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        decided.died.each(|lane| self.row.add(self.group_of_face[faces[lane] as usize], 1));
    }

    #[inline(always)]
    fn lose(&mut self, lanes: Lanes, rays: &Rays) {
        let Some((sky, first)) = self.sky else { return };
        lanes.each(|lane| {
            if let Some(patch) = sky.of(rays.direction.each_ref().map(|row| row[lane])) {
                self.row.add(first + patch, 1);
                self.to_sky += 1;
            }
        });
    }

    #[inline(always)]
    fn end(&mut self, _: usize, _: WalkRng) {}

    fn relocate(&mut self, _: usize, _: usize) {}
}
