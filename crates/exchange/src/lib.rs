//! What counted walks between groups of faces say: exchange factors with intervals, smoothed factors, and net heat.
//!
//! Data flows one way: a [`WalkPlan`] says how many walks each group is given, walks become [`ExchangeCounts`], and [`Factors`] are read off
//! them. [`smooth`] adjusts all factors together; [`Balance`] solves for temperatures and heat. Everything is a pure function.
//!
//! A group always walks a power of two of walks: so every factor n/N is a binary fraction, and the factors of a row add up to
//! exactly 1, in whatever order they are added.

#![warn(unreachable_pub, unnameable_types)]

mod counts;
mod effort;
mod factors;
mod linear;
mod matrix;
mod pairs;
mod row;
mod smooth;
mod smooth_rows;
mod system;
mod thermal;

pub use counts::ExchangeCounts;
pub use effort::{Tolerance, WalkPlan};
pub use factors::{Factor, Factors};
pub use matrix::SparseFactors;
pub use row::{Dropped, Intervals, SparseRow};
pub use smooth::{Smoothed, smooth};
pub use smooth_rows::{PairedRows, SmoothedRows};
pub use thermal::{Balance, BoundaryCondition, HeatEstimate, SIGMA, Thermal, ThermalFault};
