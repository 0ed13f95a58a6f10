//! How walks ended, and what may go wrong when counts are added.

use thiserror::Error;

/// A sum left its range. It takes more than 10³⁸ units; the tally is to be thrown away.
///
/// ```
/// use radiosity::{Counts, Overflow};
///
/// let mut counts = Counts { walks: u64::MAX, ..Counts::default() };
/// assert_eq!(counts.add(&Counts { walks: 1, ..Counts::default() }), Err(Overflow));
/// ```
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("a sum of the tally overflowed (more than 2^128 units); use fewer walks")]
pub struct Overflow;

/// The error of merging tallies of different scenes or with different moments.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MergeError {
    /// The shapes of the tallies differ.
    #[error("tallies of different shape cannot be merged ({0} and {1} sums)")]
    Shape(usize, usize),
    /// A sum left its range.
    #[error(transparent)]
    Overflow(#[from] Overflow),
}

/// How walks ended, and what they cost.
///
/// ```
/// use radiosity::Counts;
///
/// let mut counts = Counts { walks: 3, rays: 5, absorbed: 3, ..Counts::default() };
/// counts.add(&Counts { walks: 1, rays: 1, escaped: 1, ..Counts::default() })?;
/// assert_eq!((counts.walks, counts.absorbed + counts.escaped), (4, 4), "each walk ends once");
/// # Ok::<(), radiosity::Overflow>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// The number of walks that began.
    pub walks: u64,
    /// The number of rays traced.
    pub rays: u64,
    /// Walks absorbed by an active side.
    pub absorbed: u64,
    /// Walks absorbed by the back of a one-sided surface.
    pub absorbed_back: u64,
    /// Walks that left the scene.
    pub escaped: u64,
    /// Walks that were cut off.
    pub truncated: u64,
    /// Weight of each channel that ended on backs, in 2⁻⁴⁰ of a walk's.
    pub absorbed_back_weight: [u128; 3],
    /// Weight of each channel that left the scene, in 2⁻⁴⁰ of a walk's.
    pub escaped_weight: [u128; 3],
    /// Weight of each channel that was cut off, in 2⁻⁴⁰ of a walk's.
    pub truncated_weight: [u128; 3],
}

impl Counts {
    /// Units of weight in a walk's.
    pub const WEIGHT_UNITS: f64 = (1_u64 << 40) as f64;

    /// Adds the counts of further walks.
    ///
    /// # Errors
    /// Where a count leaves its range.
    pub fn add(&mut self, further: &Counts) -> Result<(), Overflow> {
        let mut sums = self.to_array();
        for (mine, their) in sums.iter_mut().zip(further.to_array()) {
            *mine = mine.checked_add(their).ok_or(Overflow)?;
        }
        *self = Counts::from_array(sums).ok_or(Overflow)?;
        Ok(())
    }

    /// The counts in a fixed order, as messages, files and digests hold them.
    pub fn to_array(self) -> [u128; 15] {
        let counts = [self.walks, self.rays, self.absorbed, self.absorbed_back, self.escaped, self.truncated];
        let weights = [self.absorbed_back_weight, self.escaped_weight, self.truncated_weight];
        let mut array = [0; 15];
        array[..6].copy_from_slice(&counts.map(u128::from));
        array[6..].copy_from_slice(weights.as_flattened());
        array
    }

    /// The inverse of [`Counts::to_array`]; `None` where a count leaves its 64 bits.
    pub fn from_array(array: [u128; 15]) -> Option<Self> {
        let count = |i: usize| u64::try_from(array[i]).ok();
        let weight = |i: usize| [array[i], array[i + 1], array[i + 2]];
        Some(Counts {
            walks: count(0)?,
            rays: count(1)?,
            absorbed: count(2)?,
            absorbed_back: count(3)?,
            escaped: count(4)?,
            truncated: count(5)?,
            absorbed_back_weight: weight(6),
            escaped_weight: weight(9),
            truncated_weight: weight(12),
        })
    }
}
