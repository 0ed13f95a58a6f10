//! Exact tallies: sums of whole numbers, so that merging is associative and commutative and no order of
//! arrival can change a bit.
//!
//! A score is a whole number of units: hits for analog walks (weighted walks score in fixed point). Per
//! patch a tally keeps Σx^k for k = 1 … M, x the *whole* score of a walk there (theory: a walk that visits a
//! patch k times contributes k², not k single squares). M is 2; checks that judge the variance ask for 4.
//! Merged sums are 128 bits wide: 10¹⁵ walks of 10⁴ units each leave room to spare in Σx⁴; a merge that
//! would overflow is an error, never a wrap.

use thiserror::Error;

/// A sum left its range. It takes more than 10³⁸ units; the tally is to be thrown away.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("a sum of the tally overflowed (more than 2^128 units); use fewer walks")]
pub struct Overflow;

/// Tallies of different scenes or moments were to be merged.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MergeError {
    /// The shapes differ.
    #[error("tallies of different shape cannot be merged ({0} and {1} sums)")]
    Shape(usize, usize),
    /// A sum left its range.
    #[error(transparent)]
    Overflow(#[from] Overflow),
}

/// How walks ended, and what they cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Walks that began.
    pub walks: u64,
    /// Rays traced.
    pub rays: u64,
    /// Walks absorbed by an active side.
    pub absorbed: u64,
    /// Walks absorbed by the back of a one-sided surface.
    pub absorbed_back: u64,
    /// Walks that left the scene.
    pub escaped: u64,
}

impl Counts {
    fn fields(&mut self) -> [&mut u64; 5] {
        [&mut self.walks, &mut self.rays, &mut self.absorbed, &mut self.absorbed_back, &mut self.escaped]
    }

    /// Adds the counts of further walks of one board; 64 bits outlast any process.
    pub fn add(&mut self, mut further: Counts) {
        for (mine, their) in self.fields().into_iter().zip(further.fields()) {
            *mine += *their;
        }
    }

    /// The counts in a fixed order, as messages, files and digests hold them.
    pub fn to_array(mut self) -> [u64; 5] {
        self.fields().map(|field| *field)
    }

    /// The inverse of [`Counts::to_array`].
    pub fn from_array(array: [u64; 5]) -> Self {
        let mut counts = Counts::default();
        for (field, value) in counts.fields().into_iter().zip(array) {
            *field = value;
        }
        counts
    }
}

/// The merged result of any set of walks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tally {
    /// How the walks ended.
    pub counts: Counts,
    moments: usize,
    /// Patch-major: Σx, Σx², … of patch 0, then of patch 1.
    sums: Vec<u128>,
}

impl Tally {
    /// An empty tally of `patches` patches and Σx … Σx^`moments`.
    pub fn new(patches: usize, moments: usize) -> Self {
        Tally { counts: Counts::default(), moments, sums: vec![0; patches * moments] }
    }

    /// A tally from its parts, as messages and files hold them.
    ///
    /// # Errors
    /// Where the number of sums is not that of `patches` patches.
    pub fn from_parts(
        counts: Counts,
        patches: usize,
        moments: usize,
        sums: Vec<u128>,
    ) -> Result<Self, MergeError> {
        if sums.len() != patches * moments {
            return Err(MergeError::Shape(sums.len(), patches * moments));
        }
        Ok(Tally { counts, moments, sums })
    }

    /// How many power sums each patch keeps.
    pub fn moments(&self) -> usize {
        self.moments
    }

    /// All sums, patch-major.
    pub fn sums(&self) -> &[u128] {
        &self.sums
    }

    /// Gives the sums away.
    pub fn into_sums(self) -> Vec<u128> {
        self.sums
    }

    /// Σx, Σx², … of one patch, in units.
    pub fn patch(&self, patch: usize) -> &[u128] {
        &self.sums[patch * self.moments..][..self.moments]
    }

    /// Adds the walks of another tally.
    ///
    /// # Errors
    /// Where shapes differ or a sum overflows; then `self` is unusable.
    pub fn merge(&mut self, other: &Tally) -> Result<(), MergeError> {
        if (self.moments, self.sums.len()) != (other.moments, other.sums.len()) {
            return Err(MergeError::Shape(self.sums.len(), other.sums.len()));
        }
        let mut theirs = other.counts;
        for (mine, their) in self.counts.fields().into_iter().zip(theirs.fields()) {
            *mine = mine.checked_add(*their).ok_or(Overflow)?;
        }
        for (mine, &their) in self.sums.iter_mut().zip(&other.sums) {
            *mine = mine.checked_add(their).ok_or(Overflow)?;
        }
        Ok(())
    }

    /// A digest of everything the tally holds.
    pub fn hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(self.moments as u64).to_le_bytes());
        for count in self.counts.to_array() {
            hasher.update(&count.to_le_bytes());
        }
        for sum in &self.sums {
            hasher.update(&sum.to_le_bytes());
        }
        *hasher.finalize().as_bytes()
    }
}

/// What one patch has collected, and the running score of the walk that scored there last.
#[derive(Clone, Copy, Debug)]
struct Cell<const M: usize> {
    /// 1 + the number of that walk; 0 for none.
    walk: u64,
    score: u64,
    sums: [u64; M],
}

/// Where a thread's walks score: per patch the power sums of whole-walk scores, kept right after every
/// score, so that the end of a walk costs nothing however many patches it met.
#[derive(Clone, Debug)]
pub struct Scoreboard<const M: usize> {
    /// How the walks ended.
    pub counts: Counts,
    cells: Vec<Cell<M>>,
}

impl<const M: usize> Scoreboard<M> {
    /// An empty board.
    pub fn new(patches: usize) -> Self {
        Scoreboard {
            counts: Counts::default(),
            cells: vec![Cell { walk: 0, score: 0, sums: [0; M] }; patches],
        }
    }

    /// Adds `units` to what walk number `walk` scores on a patch: Σx^k grows by (x + units)^k − x^k.
    #[inline(always)]
    pub fn add(&mut self, walk: u64, patch: u32, units: u64) {
        let cell = &mut self.cells[patch as usize];
        let before = if cell.walk == walk + 1 { cell.score } else { 0 };
        let after = before + units;
        cell.walk = walk + 1;
        cell.score = after;
        let (mut power_before, mut power_after) = (1_u64, 1_u64);
        for sum in &mut cell.sums {
            power_before = power_before.wrapping_mul(before);
            power_after = power_after.wrapping_mul(after);
            *sum = sum.wrapping_add(power_after.wrapping_sub(power_before));
        }
    }

    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a 64-bit sum may have wrapped. Σx ≤ rays cannot; Σx² ≤ (Σx)² and Σx³, Σx⁴ ≤ (Σx²)² tell of the
    /// others beforehand.
    pub fn take(&mut self) -> Result<Tally, Overflow> {
        let safe = |sum: Option<&u64>| sum.is_none_or(|&sum| sum < 1 << 32);
        let mut tally = Tally::new(self.cells.len(), M);
        for (sums, cell) in tally.sums.chunks_exact_mut(M).zip(&mut self.cells) {
            if !safe(cell.sums.first()) || (M > 2 && !safe(cell.sums.get(1))) {
                return Err(Overflow);
            }
            for (sum, part) in sums.iter_mut().zip(cell.sums) {
                *sum = u128::from(part);
            }
            *cell = Cell { walk: 0, score: 0, sums: [0; M] };
        }
        tally.counts = std::mem::take(&mut self.counts);
        Ok(tally)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_score_of_a_walk_is_raised_to_the_power() {
        let mut board = Scoreboard::<4>::new(2);
        for (walk, patch) in [(0, 0), (0, 1), (0, 0), (0, 0), (1, 0), (2, 1), (2, 1)] {
            board.add(walk, patch, 1);
        }
        let tally = board.take().unwrap();
        // Patch 0: scores 3 and 1; patch 1: scores 1 and 2.
        assert_eq!(tally.patch(0), [4, 10, 28, 82]);
        assert_eq!(tally.patch(1), [3, 5, 9, 17]);
    }

    #[test]
    fn a_board_forgets_what_it_handed_over() {
        let mut board = Scoreboard::<2>::new(1);
        board.add(7, 0, 1);
        board.take().unwrap();
        board.add(7, 0, 1);
        assert_eq!(board.take().unwrap().patch(0), [1, 1]);
    }

    #[test]
    fn merging_is_commutative_and_refuses_other_shapes() {
        let counts = |walks| Counts { walks, rays: 2 * walks, ..Counts::default() };
        let a = Tally::from_parts(counts(3), 2, 2, vec![1, 2, 3, 4]).unwrap();
        let b = Tally::from_parts(counts(5), 2, 2, vec![10, 20, 30, 40]).unwrap();
        let (mut ab, mut ba) = (a.clone(), b.clone());
        ab.merge(&b).unwrap();
        ba.merge(&a).unwrap();
        assert_eq!(ab, ba);
        assert_eq!(ab.hash(), ba.hash());
        assert_ne!(ab.hash(), a.hash());
        assert!(matches!(ab.merge(&Tally::new(3, 2)), Err(MergeError::Shape(4, 6))));
    }

    #[test]
    fn overflow_is_an_error_and_never_a_wrap() {
        let full = Tally::from_parts(Counts::default(), 1, 2, vec![u128::MAX, 0]).unwrap();
        let one = Tally::from_parts(Counts::default(), 1, 2, vec![1, 0]).unwrap();
        assert_eq!(full.clone().merge(&one), Err(MergeError::Overflow(Overflow)));
        let mut board = Scoreboard::<2>::new(1);
        board.add(0, 0, 1 << 32);
        assert_eq!(board.take(), Err(Overflow));
    }
}
