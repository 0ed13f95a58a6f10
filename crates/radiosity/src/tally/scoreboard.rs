//! Where the walks of a thread score.

use super::counts::{Counts, Overflow};
use super::sums::{Layout, MOMENTS, Tally};
use super::word::{Word, raise_sums};

/// What one patch has collected.
#[derive(Clone, Copy, Debug)]
struct PatchScores<W, const E: usize, const S: usize> {
    events: [u64; E],
    sums: [[W; MOMENTS]; S],
}

impl<W: Word, const E: usize, const S: usize> PatchScores<W, E, S> {
    fn empty() -> Self {
        PatchScores { events: [0; E], sums: [[W::default(); MOMENTS]; S] }
    }

    /// Whether no sum can have wrapped. Σx cannot. Counts: Σx² ≤ (Σx)². Other scores: Σx² ≤ Σx·(largest score).
    fn fits(&self, largest: u128) -> bool {
        self.sums.iter().all(|sums| {
            if E == 0 {
                return sums[0].is_small();
            }
            let sum: u128 = sums[0].into();
            sum.checked_mul(largest).is_some()
        })
    }
}

#[inline(always)]
fn plus<W: Word, const S: usize>(a: [W; S], b: [W; S]) -> [W; S] {
    std::array::from_fn(|s| a[s].plus(b[s]))
}

/// Where a thread's walks score: per patch the power sums of S whole-walk scores, and E counts of events: one beside scores in fixed
/// point, none where scores are counts themselves.
#[derive(Clone, Debug)]
pub struct Scoreboard<W, const E: usize, const S: usize> {
    /// How the walks ended.
    pub counts: Counts,
    cells: Vec<PatchScores<W, E, S>>,
    /// The largest score of a walk; watched where scores are not counts.
    largest: u128,
}

/// Where walks score whole hits.
pub type HitScoreboard<const S: usize> = Scoreboard<u64, 0, S>;

/// Where walks score in fixed point.
pub type WeightScoreboard<const S: usize> = Scoreboard<u128, 1, S>;

/// Bytes that a core keeps at hand.
pub(super) const NEAR_CACHE: usize = 32 * 1024;

/// Paths up to this long are searched for earlier visits one by one, longer ones are sorted.
const SHORT_PATH: usize = 64;

impl<W: Word, const E: usize, const S: usize> Scoreboard<W, E, S> {
    const LAYOUT: Layout = Layout { scores: S, moments: MOMENTS, slopes: 0, events: E > 0 };

    /// A board of `patches` patches without scores.
    pub fn new(patches: usize) -> Self {
        Scoreboard { counts: Counts::default(), cells: vec![PatchScores::empty(); patches], largest: 0 }
    }

    /// What [`Scoreboard::take`] hands over.
    pub fn layout(&self) -> Layout {
        Self::LAYOUT
    }

    /// Adds what a whole walk scores on a patch.
    #[inline(always)]
    pub fn add(&mut self, patch: u32, scores: [W; S]) {
        self.raise(patch, [W::default(); S], scores);
    }

    /// Adds what a whole walk scores on its path: `units(i)` on the i-th of `patches`, which may repeat.
    #[inline(always)]
    pub fn add_path(&mut self, patches: &[u32], units: impl Fn(usize) -> [W; S]) {
        if patches.len() > SHORT_PATH {
            return self.add_long_path(patches, units);
        }
        for (i, &patch) in patches.iter().enumerate() {
            let mut before = [W::default(); S];
            for (j, _) in patches[..i].iter().enumerate().filter(|&(_, &earlier)| earlier == patch) {
                before = plus(before, units(j));
            }
            self.raise(patch, before, units(i));
        }
    }

    /// Adds one unit to each score of a walk that has `earlier` units on the patch already.
    #[inline(always)]
    pub(crate) fn add_one(&mut self, patch: u32, earlier: W) {
        self.raise(patch, [earlier; S], [W::from_units(1.0); S]);
    }

    /// Adds one unit to each score of `walks` walks, fewer than 2⁵³, that score nothing else on the patch: every power sum grows
    /// by their number.
    pub(crate) fn add_walks_of_one(&mut self, patch: u32, walks: u64) {
        self.largest = self.largest.max(1);
        for sum in self.cells[patch as usize].sums.as_flattened_mut() {
            *sum = sum.plus(W::from_units(walks as f64));
        }
    }

    fn add_long_path(&mut self, patches: &[u32], units: impl Fn(usize) -> [W; S]) {
        let mut order: Vec<usize> = (0..patches.len()).collect();
        order.sort_unstable_by_key(|&i| patches[i]);
        for visits in order.chunk_by(|&i, &j| patches[i] == patches[j]) {
            let scores = visits.iter().fold([W::default(); S], |sum, &i| plus(sum, units(i)));
            self.add(patches[visits[0]], scores);
        }
    }

    /// Raises what a walk scores on a patch: Σx² grows by (x + units)² − x².
    #[inline(always)]
    fn raise(&mut self, patch: u32, before: [W; S], units: [W; S]) {
        let cell = &mut self.cells[patch as usize];
        for ((before, sums), units) in before.into_iter().zip(&mut cell.sums).zip(units) {
            let after = before.plus(units);
            if E > 0 {
                self.largest = self.largest.max(after.into());
            }
            let grown = after.times(after).minus(before.times(before));
            *sums = [sums[0].plus(units), sums[1].plus(grown)];
        }
    }

    /// Asks for the cells of patches ahead of time, where there are more than a cache holds.
    #[inline(always)]
    pub(crate) fn expect(&self, patches: &[u32]) {
        if size_of_val(&self.cells[..]) > NEAR_CACHE {
            for &patch in patches {
                crate::simd::prefetch::prefetch(self.cells.as_ptr().wrapping_add(patch as usize), 1);
            }
        }
    }

    /// Counts an event on a patch.
    #[inline(always)]
    pub fn count(&mut self, patch: u32) {
        self.cells[patch as usize].events.iter_mut().for_each(|events| *events += 1);
    }

    /// Adds what later cells hold to the first `patches`: cell i + k·`patches`, for every k, to cell i. Where a sum wraps,
    /// the board is too full to be handed over, as it is where one score wraps a sum.
    pub(crate) fn total_first(&mut self, patches: usize) {
        let (first, others) = self.cells.split_at_mut(patches);
        for class in others.chunks_exact(patches) {
            for (total, cell) in first.iter_mut().zip(class) {
                total.events.iter_mut().zip(cell.events).for_each(|(total, events)| *total += events);
                for (total, sums) in total.sums.iter_mut().zip(&cell.sums) {
                    total.iter_mut().zip(sums).for_each(|(total, sum)| *total = total.plus(*sum));
                }
            }
        }
    }

    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped.
    pub fn take(&mut self) -> Result<Tally, Overflow> {
        let mut tally = Tally::new(self.cells.len(), Self::LAYOUT);
        self.add_to(&mut tally)?;
        Ok(tally)
    }

    /// Adds all that was scored to a tally of this layout and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped or leaves its range; then the tally is unusable.
    pub fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        let columns = Self::LAYOUT.columns();
        for (sums, cell) in tally.sums.chunks_exact_mut(columns).zip(&mut self.cells) {
            if !cell.fits(self.largest) {
                return Err(Overflow);
            }
            for (sum, part) in sums.iter_mut().zip(cell.sums.as_flattened()) {
                *sum = sum.checked_add((*part).into()).ok_or(Overflow)?;
            }
            for events in cell.events {
                sums[columns - 1] += u128::from(events);
            }
            *cell = PatchScores::empty();
        }
        self.largest = 0;
        tally.counts.add(&std::mem::take(&mut self.counts))
    }
}

impl<const S: usize> WeightScoreboard<S> {
    /// Counts an event of a walk on a patch, where it has scored `before`, below 2⁶², and adds what it scores now.
    #[inline(always)]
    pub(crate) fn add_event(&mut self, patch: u32, before: &[u64; S], now: &[u64; S]) {
        let cell = &mut self.cells[patch as usize];
        cell.events[0] += 1;
        let mut largest = 0;
        for ((sums, &x), &y) in cell.sums.iter_mut().zip(before).zip(now) {
            largest = largest.max(x + y);
            raise_sums(sums, x, y);
        }
        self.largest = self.largest.max(largest.into());
    }

    /// Adds what a walk scores on a patch, where it has scored `before`.
    pub(crate) fn add_more(&mut self, patch: u32, before: [u128; S], now: [u128; S]) {
        self.raise(patch, before, now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tally::MergeError;

    const PAIR: Layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };

    #[test]
    fn the_whole_score_of_a_walk_is_raised_to_the_power() {
        let mut board = HitScoreboard::<1>::new(2);
        for path in [&[0, 1, 0, 0][..], &[0], &[1, 1]] {
            board.add_path(path, |_| [1]);
        }
        let tally = board.take().unwrap();
        // Patch 0: scores 3 and 1; patch 1: scores 1 and 2.
        assert_eq!(tally.patch(0, 0), [4, 10]);
        assert_eq!(tally.patch(1, 0), [3, 5]);
    }

    #[test]
    fn fixed_point_scores_and_their_events_are_kept_apart() {
        let mut board = WeightScoreboard::<1>::new(1);
        board.add_path(&[0, 0], |i| [[1_u128 << 40, 3 << 38][i]]);
        board.count(0);
        board.count(0);
        let tally = board.take().unwrap();
        assert_eq!(tally.patch(0, 0), [7 << 38, 49 << 76]);
        assert_eq!(tally.events(0), 2);
    }

    #[test]
    fn long_paths_score_as_short_ones_do() {
        let path: Vec<u32> = (0..1000).map(|i| i * i % 7).collect();
        let mut board = HitScoreboard::<1>::new(7);
        board.add_path(&path, |i| [i as u64 % 3]);
        let tally = board.take().unwrap();
        for patch in 0..7 {
            let visits = path.iter().enumerate().filter(|&(_, &visited)| visited == patch);
            let score: u128 = visits.map(|(i, _)| i as u128 % 3).sum();
            assert_eq!(tally.patch(patch as usize, 0), [score, score.pow(2)]);
        }
    }

    #[test]
    fn a_board_forgets_what_it_handed_over() {
        let mut board = HitScoreboard::<1>::new(1);
        board.add(0, [1]);
        board.take().unwrap();
        board.add(0, [1]);
        assert_eq!(board.take().unwrap().patch(0, 0), [1, 1]);
    }

    #[test]
    fn merging_is_commutative_and_refuses_other_shapes() {
        let counts = |walks| Counts { walks, rays: 2 * walks, ..Counts::default() };
        let a = Tally::from_parts(counts(3), 2, PAIR, vec![1, 2, 3, 4]).unwrap();
        let b = Tally::from_parts(counts(5), 2, PAIR, vec![10, 20, 30, 40]).unwrap();
        let (mut ab, mut ba) = (a.clone(), b.clone());
        ab.merge(&b).unwrap();
        ba.merge(&a).unwrap();
        assert_eq!(ab, ba);
        assert_eq!(ab.hash(), ba.hash());
        assert_ne!(ab.hash(), a.hash());
        assert!(matches!(ab.merge(&Tally::new(3, PAIR)), Err(MergeError::Shape(4, 6))));
    }

    #[test]
    fn overflow_is_an_error_and_never_a_wrap() {
        let full = Tally::from_parts(Counts::default(), 1, PAIR, vec![u128::MAX, 0]).unwrap();
        let one = Tally::from_parts(Counts::default(), 1, PAIR, vec![1, 0]).unwrap();
        assert_eq!(full.clone().merge(&one), Err(MergeError::Overflow(Overflow)));
        let mut board = HitScoreboard::<1>::new(1);
        board.add(0, [1 << 32]);
        assert_eq!(board.take(), Err(Overflow));
    }

    #[test]
    fn a_board_does_not_hand_over_squares_that_may_have_wrapped() {
        let mut fixed = WeightScoreboard::<1>::new(1);
        fixed.add(0, [1 << 40]);
        assert_eq!(fixed.take().unwrap().patch(0, 0), [1 << 40, 1 << 80]);
        fixed.add(0, [1 << 65]);
        assert_eq!(fixed.take(), Err(Overflow));
    }

    #[test]
    fn every_count_is_merged_hashed_and_kept_from_wrapping() {
        let empty = Tally::new(1, PAIR);
        let array: [u128; 15] = std::array::from_fn(|i| i as u128 + 1);
        let mut full = empty.clone();
        full.counts = Counts::from_array(array).unwrap();
        assert_eq!(full.counts.to_array(), array);
        full.merge(&full.clone()).unwrap();
        assert_eq!(full.counts.to_array(), array.map(|count| 2 * count));
        for i in 0..15 {
            let mut one = [0; 15];
            one[i] = 1;
            let most = if i < 6 { u64::MAX.into() } else { u128::MAX };
            let [one, mut most] = [one, one.map(|one| one * most)]
                .map(|array| Tally { counts: Counts::from_array(array).unwrap(), ..empty.clone() });
            assert_ne!(one.hash(), empty.hash());
            assert_eq!(most.merge(&one), Err(MergeError::Overflow(Overflow)), "count {i}");
        }
    }
}
