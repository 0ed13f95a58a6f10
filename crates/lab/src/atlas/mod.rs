//! The atlas of failure: small scenes that drive each method to where it fails.

mod entries;
mod entry;
pub mod page;

pub use entries::ALL;
pub use entry::{Entry, StudyFinding};
