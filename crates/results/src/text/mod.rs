//! Puts summaries and comparisons in words, line by line.

mod comparison;
mod summary;

pub use summary::summary_lines;
