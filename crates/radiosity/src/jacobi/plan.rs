//! What chains make of their rays.

use serde::{Deserialize, Serialize};

use crate::random::Sampler;

/// How a chain finds the solution from its rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Solve {
    /// Every ray is kept as a link between two patches, and the system of all links is solved.
    #[default]
    Links,
    /// Power is propagated again and again, by fresh rays each time (BS §4).
    Iterations(Iterations),
}

/// Stochastic Jacobi iterations (BS §4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Iterations {
    /// How rays are shared out among patches.
    pub births: RayBirths,
    /// Regular iterations, at least 1: they share the rays that the incremental ones leave.
    pub regular: u32,
    /// Where the rays' numbers come from.
    pub sampler: Sampler,
}

impl Default for Iterations {
    fn default() -> Self {
        Iterations { births: RayBirths::default(), regular: 8, sampler: Sampler::default() }
    }
}

/// How the rays of an iteration are shared out among patches, each in proportion to its power.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RayBirths {
    /// Every patch shoots its share, rounded up or down at random.
    #[default]
    Systematic,
    /// Every ray chooses its patch for itself, as BS eq. (22) has it.
    Multinomial,
}
