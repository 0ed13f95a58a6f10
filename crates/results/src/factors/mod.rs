//! Exchange factors between groups of faces, and the heat between them: what `radwalk factors` counts, keeps and writes.
//!
//! A [`FactorsQuestion`] is made of a job and of what is [`Asked`]; [`count`] walks, look by look, by processes of the caller; an
//! [`FactorsAnswer`] is made of the question and what was [`Counted`].

mod answer;
mod count;
mod counted;
mod fault;
mod kept;
mod question;
mod sparse;
mod subject;

pub use answer::{FILES, FactorsAnswer, MatrixFile, matrices_in};
pub use count::count;
pub use counted::Counted;
pub use fault::FactorsFault;
pub use kept::{FactorCounts, is_counted, merge};
pub use question::{Asked, FactorsQuestion};
pub use sparse::{
    RowWalks, RowWatcher, SparseAnswer, SparseAsked, SparseCounted, SparseFile, count_rows, sparse_files,
};
