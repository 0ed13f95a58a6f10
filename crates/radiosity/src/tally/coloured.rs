//! Where the walks of a thread score in three channels.

use super::counts::{Counts, Overflow};
use super::scoreboard::NEAR_CACHE;
use super::sums::{Layout, Tally};
use super::word::rounded;
use crate::simd::isa::Simd;
use crate::simd::wide::{Quad, Wide};

/// Red, green and blue.
const CHANNELS: usize = 3;

/// Places among the sums of a patch: Σx of the channels, the number of events, Σx² of the channels.
const EVENTS: usize = 3;
const SQUARES: usize = 4;

/// Whether no sum of a patch can have wrapped: Σx² ≤ Σx·(largest score).
fn fits(cell: &Wide, largest: u128) -> bool {
    (0..CHANNELS).all(|c| cell.get(c).checked_mul(largest).is_some())
}

/// What each of N walks scores, computed side by side.
#[derive(Clone, Debug)]
pub(crate) struct VisitScores<const N: usize> {
    /// Units of the channels, and 1 event.
    units: [Quad; N],
    /// The halves of their squares.
    low: [Quad; N],
    high: [Quad; N],
}

impl<const N: usize> VisitScores<N> {
    pub(crate) const NONE: Self = VisitScores { units: [[0; 4]; N], low: [[0; 4]; N], high: [[0; 4]; N] };

    /// The units of a walk.
    #[inline(always)]
    pub(crate) fn units(&self, i: usize) -> [u64; CHANNELS] {
        let [red, green, blue, _] = self.units[i];
        [red, green, blue]
    }
}

/// The square of a number below 2⁶³, in halves: of (h·2³² + l)² = h²·2⁶⁴ + 2hl·2³² + l². Vectors multiply numbers of up to
/// 32 bits.
#[inline(always)]
fn square(y: u64) -> [u64; 2] {
    // The lower half of a word.
    const HALF: u64 = 0xFFFF_FFFF;
    let (h, l) = (y >> 32, y & HALF);
    let (hh, hl, ll) = (h * h, h * l, l * l);
    let low = ll.wrapping_add(hl << 33);
    [low, hh + (hl >> 31) + u64::from(low < ll)]
}

/// Where a thread's walks score in three channels, in fixed point: per patch the first two power sums of whole-walk scores, and
/// the number of events.
#[derive(Clone, Debug)]
pub(crate) struct ColouredBoard {
    /// How the walks ended.
    pub(crate) counts: Counts,
    cells: Vec<Wide>,
    /// The largest score of a walk, or more.
    largest: u128,
}

impl ColouredBoard {
    const LAYOUT: Layout = Layout { scores: CHANNELS, moments: 2, slopes: 0, events: true };

    /// A board of `patches` patches without scores.
    pub(crate) fn new(patches: usize) -> Self {
        ColouredBoard { counts: Counts::default(), cells: vec![Wide::default(); patches], largest: 0 }
    }

    /// What [`ColouredBoard::take`] hands over.
    pub(crate) fn layout(&self) -> Layout {
        Self::LAYOUT
    }

    /// Computes the visits of walks with these weights, of which a weight of 1 has `all` units, below 2⁵¹.
    #[inline(always)]
    pub(crate) fn set_visits<const N: usize>(
        &mut self,
        visits: &mut VisitScores<N>,
        weights: &[[f64; CHANNELS]; N],
        all: f64,
    ) {
        let VisitScores { units, low, high } = visits;
        // First as numbers of f64, of which the last will be one event.
        for (row, &[red, green, blue]) in units.iter_mut().zip(weights) {
            *row = [red, green, blue, 1.0 / all].map(f64::to_bits);
        }
        let (units, low, high) = (units.as_flattened_mut(), low.as_flattened_mut(), high.as_flattened_mut());
        let mut largest = 0;
        for i in 0..4 * N {
            units[i] = rounded(f64::from_bits(units[i]) * all);
            [low[i], high[i]] = square(units[i]);
            largest = largest.max(units[i]);
        }
        self.largest = self.largest.max(largest.into());
    }

    /// Counts an event of a walk on a patch, where it has not scored before, and adds what it scores.
    #[inline(always)]
    pub(crate) fn add_first<S: Simd, const N: usize>(
        &mut self,
        patch: u32,
        visits: &VisitScores<N>,
        i: usize,
    ) {
        let (low, high) = ([&visits.units[i], &visits.low[i]], [&[0; 4], &visits.high[i]]);
        S::add_wide(&mut self.cells[patch as usize], low, high);
    }

    /// Counts an event of a walk on a patch, where it has scored `before`, below 2⁶², and adds what it scores now.
    pub(crate) fn add_event(&mut self, patch: u32, before: [u64; CHANNELS], now: [u64; CHANNELS]) {
        self.count(patch);
        self.add_more(patch, before.map(u128::from), now.map(u128::from));
    }

    /// Adds what a walk scores on a patch, where it has scored `before`: Σx² grows by (x + y)² − x² = y·(2x + y).
    pub(crate) fn add_more(&mut self, patch: u32, before: [u128; CHANNELS], now: [u128; CHANNELS]) {
        let cell = &mut self.cells[patch as usize];
        for (c, (x, y)) in before.into_iter().zip(now).enumerate() {
            self.largest = self.largest.max(x.wrapping_add(y));
            cell.raise(c, y);
            cell.raise(SQUARES + c, y.wrapping_mul(x.wrapping_mul(2).wrapping_add(y)));
        }
    }

    /// Counts an event on a patch.
    #[inline(always)]
    pub(crate) fn count(&mut self, patch: u32) {
        self.cells[patch as usize].raise(EVENTS, 1);
    }

    /// Asks for the cells of patches ahead of time, where there are more than a cache holds.
    #[inline(always)]
    pub(crate) fn expect(&self, patches: &[u32]) {
        if size_of_val(&self.cells[..]) > NEAR_CACHE {
            for &patch in patches {
                crate::simd::prefetch::prefetch(self.cells.as_ptr().wrapping_add(patch as usize), 2);
            }
        }
    }

    /// Adds what later cells hold to the first `patches`: cell i + k·`patches`, for every k, to cell i. Where a sum wraps,
    /// the board is too full to be handed over, as it is where one score wraps a sum.
    pub(crate) fn total_first(&mut self, patches: usize) {
        let (first, others) = self.cells.split_at_mut(patches);
        for class in others.chunks_exact(patches) {
            for (total, cell) in first.iter_mut().zip(class) {
                total.add(cell.low.each_ref(), cell.high.each_ref());
            }
        }
    }

    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped.
    pub(crate) fn take(&mut self) -> Result<Tally, Overflow> {
        let mut tally = Tally::new(self.cells.len(), Self::LAYOUT);
        self.add_to(&mut tally)?;
        Ok(tally)
    }

    /// Adds all that was scored to a tally of this layout and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped or leaves its range; then the tally is unusable.
    pub(crate) fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        let columns = Self::LAYOUT.columns();
        for (row, cell) in tally.sums.chunks_exact_mut(columns).zip(&mut self.cells) {
            if !fits(cell, self.largest) {
                return Err(Overflow);
            }
            let channels = (0..CHANNELS).flat_map(|c| [c, SQUARES + c]);
            for (sum, part) in row.iter_mut().zip(channels.chain([EVENTS])) {
                *sum = sum.checked_add(cell.get(part)).ok_or(Overflow)?;
            }
            *cell = Wide::default();
        }
        self.largest = 0;
        tally.counts.add(&std::mem::take(&mut self.counts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::isa::{Isa, Kernel};
    use crate::tally::WeightScoreboard;

    #[test]
    fn squares_are_squares() {
        for y in [0, 1, (1 << 32) - 1, 1 << 32, 3 << 40, (1 << 41) - 1, (1 << 63) - 1] {
            let [low, high] = square(y).map(u128::from);
            assert_eq!(high << 64 | low, u128::from(y) * u128::from(y), "{y}");
        }
    }

    struct First<'a, const N: usize> {
        board: &'a mut ColouredBoard,
        patch: u32,
        visits: &'a VisitScores<N>,
        i: usize,
    }

    impl<const N: usize> Kernel for First<'_, N> {
        #[inline(always)]
        fn run<S: Simd>(self) {
            self.board.add_first::<S, N>(self.patch, self.visits, self.i);
        }
    }

    /// Walks that come back and walks that do not, up to the largest weight.
    #[test]
    fn the_sums_are_those_of_a_plain_board() {
        for isa in Isa::available() {
            let (mut board, mut judge) = (ColouredBoard::new(2), WeightScoreboard::<3>::new(2));
            let mut bits = 1_u64;
            for visit in 0..1000 {
                let units = [0; 3].map(|_: u64| {
                    bits =
                        bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    (bits >> 22).min(3 << 40)
                });
                let (patch, before) = (visit % 2, [5, 1 << 40, u64::from(visit) << 32]);
                judge.count(patch);
                if visit % 3 == 0 {
                    board.add_event(patch, before, units);
                    judge.add_more(patch, before.map(u128::from), units.map(u128::from));
                } else {
                    let mut visits = VisitScores::NONE;
                    board.set_visits(&mut visits, &[[0.1; 3], units.map(|x| x as f64)], 1.0);
                    assert_eq!(visits.units(1), units);
                    isa.run(First { board: &mut board, patch, visits: &visits, i: 1 });
                    judge.add(patch, units.map(u128::from));
                }
            }
            assert_eq!(board.take(), judge.take(), "{isa:?}");
        }
    }

    #[test]
    fn sums_that_may_have_wrapped_are_an_error() {
        let mut board = ColouredBoard::new(1);
        let (mut visits, all) = (VisitScores::NONE, (1_u64 << 40) as f64);
        board.set_visits(&mut visits, &[[1.0, 0.0, 1.0 / all]], all);
        Isa::best().run(First { board: &mut board, patch: 0, visits: &visits, i: 0 });
        board.add_event(0, [1 << 40, 0, 0], [1 << 40, 0, 0]);
        let tally = board.take().unwrap();
        assert_eq!((tally.patch(0, 0), tally.patch(0, 2)), (&[2 << 40, 4 << 80][..], &[1, 1][..]));
        assert_eq!(tally.events(0), 2);
        board.add_more(0, [0; 3], [0, 1 << 65, 0]);
        assert_eq!(board.take(), Err(Overflow));
    }
}
