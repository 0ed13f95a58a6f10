//! Where the walks of a thread score with slopes: how a score is spread over its patch.

use super::counts::{Counts, Overflow};
use super::sums::{Layout, Tally};
use super::word::{Word, raise_sums};

/// What a walk scores on a patch, in units, and the slopes of that: each unit times ψ₁ and ψ₂ where it was scored, in slope
/// units. A slope is signed (two's complement), and never exceeds its score.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearScore<W, const C: usize> {
    pub(crate) units: [W; C],
    pub(crate) slopes: [[W; 2]; C],
}

impl<W: Word, const C: usize> LinearScore<W, C> {
    /// The score of a walk that scored nothing.
    pub(crate) fn none() -> Self {
        LinearScore { units: [W::default(); C], slopes: [[W::default(); 2]; C] }
    }

    /// The sum of two scores, part by part.
    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        LinearScore {
            units: std::array::from_fn(|c| self.units[c].plus(other.units[c])),
            slopes: std::array::from_fn(|c| {
                std::array::from_fn(|k| self.slopes[c][k].plus(other.slopes[c][k]))
            }),
        }
    }
}

impl<const C: usize> LinearScore<u64, C> {
    /// The score in 128 bits.
    fn wide(self) -> LinearScore<u128, C> {
        let signed = |slope: u64| u128::from_signed(slope as i64);
        LinearScore {
            units: self.units.map(u128::from),
            slopes: self.slopes.map(|slopes| slopes.map(signed)),
        }
    }
}

/// What one patch has collected.
#[derive(Clone, Copy, Debug)]
struct SlopeScores<W, const E: usize, const C: usize> {
    events: [u64; E],
    /// Σx and Σx² of each channel's score x.
    scores: [[W; 2]; C],
    /// Σ(x + d), in slope units, and Σd² of each slope d of x: no sum is negative.
    slopes: [[[W; 2]; 2]; C],
}

impl<W: Word, const E: usize, const C: usize> SlopeScores<W, E, C> {
    fn empty() -> Self {
        SlopeScores { events: [0; E], scores: [[W::default(); 2]; C], slopes: [[[W::default(); 2]; 2]; C] }
    }

    /// Whether no sum can have wrapped: |d| ≤ x, in slope units. Of hits Σx² ≤ (Σx)²; of other scores Σx² ≤ Σx·(largest x).
    fn fits(&self, slope_bits: u32, largest: u128) -> bool {
        self.scores.iter().all(|&[sum, squares]| match E {
            0 => sum.is_small() && squares.into() >> (u64::BITS - 2 * slope_bits) == 0,
            _ => sum.into().checked_mul(largest.max(2)).is_some(),
        })
    }
}

/// Where a thread's walks score with slopes: per patch the power sums of C channels' whole-walk scores and of their slopes.
#[derive(Clone, Debug)]
pub(crate) struct LinearBoard<W, const E: usize, const C: usize> {
    /// How the walks ended.
    pub(crate) counts: Counts,
    cells: Vec<SlopeScores<W, E, C>>,
    /// The largest score of a walk; watched where scores are not counts.
    largest: u128,
}

impl<W: Word, const E: usize, const C: usize> LinearBoard<W, E, C> {
    const LAYOUT: Layout = Layout { scores: C, moments: 2, slopes: 2 * C, events: E > 0 };

    /// A board without scores, for `patches` patches.
    pub(crate) fn new(patches: usize) -> Self {
        LinearBoard { counts: Counts::default(), cells: vec![SlopeScores::empty(); patches], largest: 0 }
    }

    /// What [`LinearBoard::take`] hands over.
    pub(crate) fn layout(&self) -> Layout {
        Self::LAYOUT
    }

    /// Raises what a walk scores on a patch: Σx² grows by (x + y)² − x² = y·(2x + y), and Σd² in the same way.
    #[inline(always)]
    pub(crate) fn raise(&mut self, patch: u32, before: &LinearScore<W, C>, now: &LinearScore<W, C>) {
        let cell = &mut self.cells[patch as usize];
        let grown = |x: W, y: W| y.times(x.plus(x).plus(y));
        let slope_units = W::from_units(Self::LAYOUT.slope_units() as f64);
        for c in 0..C {
            let (x, y) = (before.units[c], now.units[c]);
            if E > 0 {
                self.largest = self.largest.max(x.plus(y).into());
            }
            let [sum, squares] = &mut cell.scores[c];
            (*sum, *squares) = (sum.plus(y), squares.plus(grown(x, y)));
            for k in 0..2 {
                let (d, e) = (before.slopes[c][k], now.slopes[c][k]);
                let [sum, squares] = &mut cell.slopes[c][k];
                *sum = sum.plus(y.times(slope_units)).plus(e);
                *squares = squares.plus(grown(d, e));
            }
        }
    }

    /// Asks for the cells of patches ahead of time, where there are more than a cache holds.
    #[inline(always)]
    pub(crate) fn expect(&self, patches: &[u32]) {
        if size_of_val(&self.cells[..]) > super::scoreboard::NEAR_CACHE {
            for &patch in patches {
                crate::simd::prefetch::prefetch(self.cells.as_ptr().wrapping_add(patch as usize), 1);
            }
        }
    }

    /// Counts an event on a patch.
    #[inline(always)]
    pub(crate) fn count(&mut self, patch: u32) {
        self.cells[patch as usize].events.iter_mut().for_each(|events| *events += 1);
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
        let slope_bits = Self::LAYOUT.slope_units().ilog2();
        for (sums, cell) in tally.sums.chunks_exact_mut(columns).zip(&mut self.cells) {
            if !cell.fits(slope_bits, self.largest) {
                return Err(Overflow);
            }
            let parts = cell.scores.iter().chain(cell.slopes.as_flattened()).flatten();
            for (sum, &part) in sums.iter_mut().zip(parts) {
                *sum = sum.checked_add(part.into()).ok_or(Overflow)?;
            }
            for events in cell.events {
                sums[columns - 1] += u128::from(events);
            }
            *cell = SlopeScores::empty();
        }
        self.largest = 0;
        tally.counts.add(&std::mem::take(&mut self.counts))
    }
}

impl<const C: usize> LinearBoard<u128, 1, C> {
    /// Counts an event of a walk on a patch, where it has scored `before`, below 2⁶², and adds what it scores now.
    #[inline(always)]
    pub(crate) fn add_event(&mut self, patch: u32, before: &LinearScore<u64, C>, now: &LinearScore<u64, C>) {
        let cell = &mut self.cells[patch as usize];
        cell.events[0] += 1;
        let mut largest = 0;
        for c in 0..C {
            let (x, y) = (before.units[c], now.units[c]);
            largest = largest.max(x + y);
            raise_sums(&mut cell.scores[c], x, y);
            for k in 0..2 {
                let (d, e) = (before.slopes[c][k] as i64, now.slopes[c][k] as i64);
                let [sum, squares] = &mut cell.slopes[c][k];
                *sum = sum.wrapping_add(u128::from(y.wrapping_add_signed(e)));
                *squares = squares.wrapping_add_signed(i128::from(e) * i128::from(2 * d + e));
            }
        }
        self.largest = self.largest.max(largest.into());
    }

    /// Adds what a walk scores on a patch by visits, after some that were added already.
    pub(crate) fn add_more(
        &mut self,
        patch: u32,
        before: impl Iterator<Item = LinearScore<u64, C>>,
        now: impl Iterator<Item = LinearScore<u64, C>>,
    ) {
        let plus = |sum: LinearScore<u128, C>, score: LinearScore<u64, C>| sum.plus(score.wide());
        self.raise(patch, &before.fold(LinearScore::none(), plus), &now.fold(LinearScore::none(), plus));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score<W: Word>(units: f64, slopes: [i64; 2]) -> LinearScore<W, 1> {
        LinearScore { units: [W::from_units(units)], slopes: [slopes.map(W::from_signed)] }
    }

    #[test]
    fn slopes_of_a_whole_walk_are_squared() {
        let mut board = LinearBoard::<u64, 0, 1>::new(2);
        let mut before = LinearScore::none();
        for slopes in [[5, -7], [-11, 4095], [2, -4095]] {
            board.raise(0, &before, &score(1.0, slopes));
            before = before.plus(score(1.0, slopes));
        }
        board.raise(1, &LinearScore::none(), &score(1.0, [100, 3]));
        board.raise(0, &LinearScore::none(), &score(1.0, [-1, 1]));
        let tally = board.take().unwrap();
        // Patch 0: scores 3 and 1; slopes −4, −7 and −1, 1.
        assert_eq!(tally.patch(0, 0), [4, 10]);
        assert_eq!(tally.slope(0, 0, 0), (-5, 17));
        assert_eq!(tally.slope(0, 0, 1), (-6, 50));
        assert_eq!(tally.slope(1, 0, 0), (100, 10_000));
        assert_eq!(tally.events(0), 4);
    }

    #[test]
    fn fixed_point_slopes_have_the_units_of_their_scores() {
        let one = (1_u64 << 40) as f64;
        let scores = [[-(1 << 40), 1 << 39], [1 << 38, 1 << 39]].map(|slopes| score::<u64>(one, slopes));
        let visits = |board: &mut LinearBoard<u128, 1, 1>| {
            board.add_event(0, &LinearScore::none(), &scores[0]);
            board.add_event(0, &scores[0], &scores[1]);
        };
        let at_once = |board: &mut LinearBoard<u128, 1, 1>| {
            board.add_more(0, std::iter::empty(), scores.into_iter());
            (0..2).for_each(|_| board.count(0));
        };
        for add in [&visits as &dyn Fn(&mut _), &at_once] {
            let mut board = LinearBoard::new(1);
            add(&mut board);
            let tally = board.take().unwrap();
            assert_eq!(tally.patch(0, 0), [2 << 40, 4 << 80]);
            assert_eq!(tally.slope(0, 0, 0), (-(3 << 38), 9 << 76));
            assert_eq!(tally.slope(0, 0, 1), (1 << 40, 1 << 80));
            assert_eq!(tally.events(0), 2);
        }
    }

    /// 2²⁰ visits of one walk have squares of slopes of up to 2⁶⁴.
    #[test]
    fn squares_that_may_have_wrapped_are_an_error() {
        let mut board = LinearBoard::<u64, 0, 1>::new(1);
        board.raise(0, &LinearScore::none(), &score((1 << 19) as f64, [0, 0]));
        assert!(board.take().is_ok());
        board.raise(0, &LinearScore::none(), &score((1 << 20) as f64, [0, 0]));
        assert_eq!(board.take(), Err(Overflow));
    }
}
