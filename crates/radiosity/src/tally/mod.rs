//! Exact tallies: sums of whole numbers, so that merging is associative and commutative and no order of
//! arrival can change a bit.
//!
//! A score is a whole number of units: hits for analog walks (weighted walks score in fixed point). Per
//! patch a tally keeps Σx and Σx², x the *whole* score of a walk there (theory: a walk that visits a
//! patch k times contributes k², not k single squares).
//! Merged sums are 128 bits wide; a merge that would overflow is an error, never a wrap.

mod coloured;
mod counts;
mod linear;
mod scoreboard;
mod sums;
mod word;

pub(crate) use coloured::{ColouredBoard, VisitScores as ColouredVisits};
pub use counts::{Counts, MergeError, Overflow};
pub(crate) use linear::{LinearBoard, LinearScore};
pub use scoreboard::{HitScoreboard, Scoreboard, WeightScoreboard};
pub(crate) use sums::MOMENTS;
pub use sums::{Layout, Tally};
pub use word::Word;
pub(crate) use word::rounded;
