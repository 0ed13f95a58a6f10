//! A tally: the sums of any set of walks.

use crate::geometry::basis::SLOPE_UNITS;

use super::counts::{Counts, MergeError, Overflow};

/// Power sums of each score that walks and chains keep, Σx and Σx²: intervals need no more.
pub(crate) const MOMENTS: usize = 2;

/// What a tally keeps of each patch, in this order.
///
/// ```
/// use radiosity::Layout;
///
/// let grey = Layout { scores: 1, moments: 2, slopes: 0, events: false };
/// assert_eq!((grey.columns(), grey.without_squares().columns()), (2, 1));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Scores per walk and patch: one for each channel, or for each estimator that is compared.
    pub scores: usize,
    /// Σx … Σx^k of each score x, k = `moments`.
    pub moments: usize,
    /// Slopes of scores, two for each channel of a job with a linear basis, which follow the scores: of each Σ(x + d) and Σd²,
    /// with d the slope of a walk's score x, in slope units.
    pub slopes: usize,
    /// Whether events are counted beside the sums: where scores are not counts themselves.
    pub events: bool,
}

impl Layout {
    /// Of the same scores, sums without squares.
    pub fn without_squares(self) -> Self {
        Layout { moments: 1, ..self }
    }

    /// The number of columns per patch: sums, and the count of events.
    pub fn columns(self) -> usize {
        (self.scores + self.slopes) * self.moments + usize::from(self.events)
    }

    /// Slope units in a unit of score: a score in fixed point has units that are fine enough for its slopes.
    pub fn slope_units(self) -> u64 {
        if self.events { 1 } else { SLOPE_UNITS as u64 }
    }
}

/// The merged result of any set of walks.
///
/// ```
/// use radiosity::{Layout, Tally};
///
/// let layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };
/// let mut whole = Tally::new(54, layout);
/// whole.merge(&Tally::new(54, layout))?;
/// assert!(whole.merge(&Tally::new(53, layout)).is_err(), "of another scene");
/// # Ok::<(), radiosity::boards::MergeError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tally {
    /// How the walks ended.
    pub counts: Counts,
    pub(super) layout: Layout,
    /// Patch-major: the columns of patch 0, then of patch 1.
    pub(super) sums: Vec<u128>,
}

impl Tally {
    /// An empty tally of `patches` patches.
    pub fn new(patches: usize, layout: Layout) -> Self {
        Tally { counts: Counts::default(), layout, sums: vec![0; patches * layout.columns()] }
    }

    /// A tally from its parts, as messages and files hold them.
    ///
    /// # Errors
    /// Where the number of sums is not that of `patches` patches.
    pub fn from_parts(
        counts: Counts,
        patches: usize,
        layout: Layout,
        sums: Vec<u128>,
    ) -> Result<Self, MergeError> {
        if sums.len() != patches * layout.columns() {
            return Err(MergeError::Shape(sums.len(), patches * layout.columns()));
        }
        Ok(Tally { counts, layout, sums })
    }

    /// What it keeps of each patch.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// The number of patches.
    pub fn patches(&self) -> usize {
        self.sums.len() / self.layout.columns()
    }

    /// All sums in the order of patches, the columns of a patch side by side.
    pub fn sums(&self) -> &[u128] {
        &self.sums
    }

    /// Gives the sums away.
    pub fn into_sums(self) -> Vec<u128> {
        self.sums
    }

    /// Σx, Σx², … of one score on one patch, in units.
    #[inline]
    pub fn patch(&self, patch: usize, score: usize) -> &[u128] {
        let Layout { moments, .. } = self.layout;
        &self.columns(patch)[score * moments..][..moments]
    }

    /// Σd and Σd² of a slope of one channel's score on one patch, in slope units.
    pub fn slope(&self, patch: usize, channel: usize, k: usize) -> (i128, u128) {
        (self.slope_sum(patch, channel, k), self.patch(patch, self.layout.scores + 2 * channel + k)[1])
    }

    /// Σd of a slope of one channel's score on one patch, in slope units.
    #[inline]
    pub fn slope_sum(&self, patch: usize, channel: usize, k: usize) -> i128 {
        let sum = self.patch(patch, self.layout.scores + 2 * channel + k)[0];
        let scored = self.patch(patch, channel)[0].wrapping_mul(self.layout.slope_units().into());
        sum.wrapping_sub(scored) as i128
    }

    fn columns(&self, patch: usize) -> &[u128] {
        &self.sums[patch * self.layout.columns()..][..self.layout.columns()]
    }

    /// Scored events of a patch (shooting), or walks born there (gathering).
    pub fn events(&self, patch: usize) -> u128 {
        let columns = self.columns(patch);
        if self.layout.events { columns[columns.len() - 1] } else { columns[0] }
    }

    /// Adds the walks of another tally.
    ///
    /// # Errors
    /// Where shapes differ or a sum overflows; then `self` is unusable.
    pub fn merge(&mut self, other: &Tally) -> Result<(), MergeError> {
        if (self.layout, self.sums.len()) != (other.layout, other.sums.len()) {
            return Err(MergeError::Shape(self.sums.len(), other.sums.len()));
        }
        Ok(self.add_sums(&other.counts, other.sums.iter().copied())?)
    }

    /// Adds the walks of a tally that keeps squares too to one without.
    ///
    /// # Errors
    /// Where shapes differ or a sum overflows; then `self` is unusable.
    pub fn add_without_squares(&mut self, other: &Tally) -> Result<(), MergeError> {
        if self.layout != other.layout.without_squares() || self.patches() != other.patches() {
            return Err(MergeError::Shape(self.sums.len(), other.sums.len()));
        }
        let Layout { moments, .. } = other.layout;
        // Every `moments`-th column from the first on; the last of them counts events.
        let columns = other.sums.chunks_exact(other.layout.columns());
        Ok(self
            .add_sums(&other.counts, columns.flat_map(|columns| columns.iter().step_by(moments).copied()))?)
    }

    /// Empties it.
    pub fn clear(&mut self) {
        self.counts = Counts::default();
        self.sums.fill(0);
    }

    /// Adds the walks of a tally of the same shape, by its parts.
    ///
    /// # Errors
    /// Where a sum overflows; then `self` is unusable.
    pub fn add_sums(&mut self, counts: &Counts, sums: impl Iterator<Item = u128>) -> Result<(), Overflow> {
        self.counts.add(counts)?;
        for (mine, their) in self.sums.iter_mut().zip(sums) {
            *mine = mine.checked_add(their).ok_or(Overflow)?;
        }
        Ok(())
    }

    /// A digest of everything the tally holds.
    pub fn hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        let Layout { scores, moments, slopes, events } = self.layout;
        hasher.update(&[scores as u8, moments as u8, u8::from(events) | (slopes as u8) << 1]);
        for count in self.counts.to_array() {
            hasher.update(&count.to_le_bytes());
        }
        for sum in &self.sums {
            hasher.update(&sum.to_le_bytes());
        }
        *hasher.finalize().as_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One score of two powers, two slopes and a count of events.
    const LAYOUT: Layout = Layout { scores: 1, moments: 2, slopes: 2, events: true };

    #[test]
    fn sums_without_squares_are_those_of_the_tally() {
        let sums: Vec<u128> = vec![3, 5, 7, 11, 2, 13, 4, 30, 50, 70, 110, 20, 130, 40];
        let tally = Tally::from_parts(Counts { walks: 6, ..Counts::default() }, 2, LAYOUT, sums).unwrap();
        let mut plain = Tally::new(2, LAYOUT.without_squares());
        (0..2).for_each(|_| plain.add_without_squares(&tally).unwrap());
        assert_eq!(plain.counts.walks, 12);
        for patch in 0..2 {
            assert_eq!(plain.patch(patch, 0), [2 * tally.patch(patch, 0)[0]]);
            assert_eq!(plain.events(patch), 2 * tally.events(patch));
            for k in 0..2 {
                assert_eq!(plain.slope_sum(patch, 0, k), 2 * tally.slope(patch, 0, k).0);
            }
        }
        assert!(plain.add_without_squares(&plain.clone()).is_ok(), "it has no squares to leave out");
        assert!(plain.merge(&tally).is_err());
        assert!(tally.clone().add_without_squares(&tally).is_err());
        plain.clear();
        assert_eq!(plain, Tally::new(2, LAYOUT.without_squares()));
    }
}
