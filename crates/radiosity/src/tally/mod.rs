//! Exact tallies: sums of whole numbers, so that merging is associative and commutative and no order of
//! arrival can change a bit.
//!
//! A score is a whole number of units: hits for analog walks (weighted walks score in fixed point). Per
//! patch a tally keeps Σx^k for k = 1 … M, x the *whole* score of a walk there (theory: a walk that visits a
//! patch k times contributes k², not k single squares). M is 2.
//! Merged sums are 128 bits wide: 10¹⁵ walks of 10⁴ units each leave room to spare in Σx⁴; a merge that
//! would overflow is an error, never a wrap.

mod coloured;
mod counts;
mod linear;
mod scoreboard;
mod sums;
mod word;

pub(crate) use coloured::{ColouredBoard, VisitScores as ColouredVisits};
pub use counts::{Counts, MergeError, Overflow};
pub(crate) use linear::{LinearBoard, Mark};
pub use scoreboard::{Events, Scoreboard};
pub use sums::{Layout, Tally};
pub use word::Word;
pub(crate) use word::rounded;
