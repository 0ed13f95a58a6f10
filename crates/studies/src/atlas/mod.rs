//! The atlas of failure: small scenes that drive each method to where it fails.

mod entries;
mod entry;
mod lab;
pub mod page;

pub use entries::ALL;
pub use entry::{Claim, Entry, Failure, Finding};
pub use lab::Lab;
