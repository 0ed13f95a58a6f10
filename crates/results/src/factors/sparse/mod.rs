//! Sparse factors: rows of any number of groups, each counted by itself, kept in a journal as they are done, and written as matrices.

mod answer;
mod count;
mod journal;
mod matrix;

use std::path::Path;

pub use answer::{SparseAnswer, SparseFile, sparse_files};
pub use count::{RowWatcher, SparseCounted, count_rows};

/// The change of a job by which a mesh in its place is given no lamps where it has no light: it has a sky, and sparse factors leave skies out.
pub fn unlit(job: &Path) -> Option<String> {
    let is_toml = job.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    (!is_toml).then(|| "import.sky=1".to_owned())
}

/// What is asked of sparse factors, beside what is asked of all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparseAsked {
    /// Walks of each row; with a tolerance, the most.
    pub rays: u32,
    /// Factors below this are dropped from what is written.
    pub least: f64,
    /// The patches of the sky that rays which leave the scene are told apart by.
    pub sky: Option<u32>,
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
