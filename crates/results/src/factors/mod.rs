//! Exchange factors between groups of faces, and the heat between them: what `radwalk factors` counts, keeps and writes.
//!
//! A [`FactorsQuestion`] is made of a job and of what is [`Asked`]; [`count`] walks, look by look, by processes of the caller; an
//! [`FactorsAnswer`] is made of the question and what was [`Counted`].

mod answer;
mod count;
mod counted;
mod fault;
mod question;
mod sparse;
mod stored;
mod subject;

pub use answer::{FILES, FactorsAnswer, MatrixFile, matrices_in};
pub use count::count;
pub(crate) use counted::COUNTS;
pub use counted::Counted;
pub use fault::FactorsFault;
pub use question::{Asked, FactorsQuestion};
pub(crate) use sparse::ROWS;
pub use sparse::{
    RowWalks, RowWatcher, SparseAnswer, SparseAsked, SparseCounted, SparseFile, count_rows, sparse_files,
};
pub use stored::{FactorCounts, is_counted, merge};
