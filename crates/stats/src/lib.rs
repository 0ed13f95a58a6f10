//! Statistics of walks: exact moments of integer scores, confidence intervals that hold from no hit to many, and the
//! tests by which simulations are judged.
//!
//! A score `x` is a walk's whole score on one patch, counted in hits. Its power sums are integers, so they
//! merge in any order without a trace; floating point begins where an answer is read off.

#![warn(unreachable_pub, unnameable_types)]

mod interval;
mod judge;
mod measured;
mod minimum;
mod moments;
mod normal;
mod proportion;
mod sizes;
mod stopping;
mod student;

pub use interval::{Interval, batches_interval, beyond_of_count, mean_interval};
pub use judge::{ChiSquare, Coverage, chi_square_uniform, mean_squared_z};
pub use measured::Measured;
pub use minimum::{UncertainMean, minimum_interval, quotient_interval};
pub use moments::{Moments, Sample, variance_of_blocks};
pub use normal::{normal_cdf, normal_quantile};
pub use proportion::{mid_p_interval, proportion_interval};
pub use sizes::{Sizes, size_class, unmet_chance, with_unmet};
pub use stopping::{DoubleSampling, foresight};
pub use student::student_quantile;
