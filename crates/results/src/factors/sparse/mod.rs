//! Sparse factors: rows of any number of groups, each counted by itself, kept in a journal as they are done, and written as matrices.

mod answer;
mod count;
mod journal;
mod matrix;

pub use answer::{SparseAnswer, SparseFile, sparse_files};
pub use count::{RowWatcher, SparseCounted, count_rows};
pub(crate) use journal::ROWS;

/// The walks of rows; with a tolerance, the most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowWalks {
    /// The walks of each row.
    Each(u32),
    /// At most this many of all rows. Each has a share in proportion to the root of its weight; without a tolerance, it takes as much of the
    /// share as its variance asks for.
    Shared(u64),
}

impl RowWalks {
    /// The most walks of each row, by the weights of groups.
    fn of_rows(self, weights: &[f64]) -> Vec<u32> {
        match self {
            RowWalks::Each(walks) => vec![walks; weights.len()],
            RowWalks::Shared(walks) => {
                let all: f64 = weights.iter().map(|weight| weight.sqrt()).sum();
                let spare = walks.saturating_sub(weights.len() as u64) as f64;
                // One walk of each, and a part of the rest, rounded down.
                weights
                    .iter()
                    .map(|weight| ((spare * weight.sqrt() / all) as u32).saturating_add(1))
                    .collect()
            }
        }
    }
}

/// The options of sparse factors, beside the options of all factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparseAsked {
    /// The walks of rows.
    pub walks: RowWalks,
    /// Factors below this are dropped from what is written.
    pub least: f64,
    /// The patches of the sky that rays which leave the scene are distinguished by.
    pub sky: Option<u32>,
    /// The steps at which the scene repeats along x and y [m], 0 along an axis where it does not; `None` where there is one copy of it.
    pub periods: Option<[f64; 2]>,
    /// Of how many parts of the rows this is which, counted from 1.
    pub part: [u32; 2],
}

impl SparseAsked {
    /// Walks of each row where nothing is said of them.
    pub const RAYS: u32 = 10_000;

    /// The rows of the part, of this many.
    pub(super) fn rows(&self, groups: usize) -> std::ops::Range<usize> {
        let [part, parts] = self.part.map(|number| number as usize);
        groups * (part - 1) / parts..groups * part / parts
    }
}
