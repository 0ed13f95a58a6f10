//! Random numbers: one sequence for a job, a place in it for every walk; Sobol sequences; what is drawn from them.

pub(crate) mod quasi;
pub(crate) mod rng;
pub(crate) mod sampling;
pub(crate) mod sobol;

use serde::{Deserialize, Serialize};

/// Where random numbers come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampler {
    /// A permuted congruential generator.
    #[default]
    Random,
    /// Randomised quasi-Monte Carlo: a Sobol sequence.
    Sobol,
}
