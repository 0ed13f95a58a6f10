//! Results in words.

mod comparison;
mod summary;

pub use summary::summary_lines;
