//! What kind of walk, and what it scores: the choices of a job.

use serde::{Deserialize, Serialize};

/// Where a surviving walk goes on from (BS §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Space {
    /// A fresh uniform point of the patch that was hit: the expectation solves the radiosity system.
    #[default]
    Discrete,
    /// The hit point: the expectation is the average of the integral equation's solution.
    Continuous,
}

/// Which events of a walk score (S97 §2, §3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EstimatorKind {
    /// The absorption at its end.
    Absorption,
    /// Every hit that it survives.
    Survival,
    /// Every hit.
    #[default]
    Collision,
    /// Every hit of a walk that is never absorbed, by weight (SInf).
    Infinite,
    /// The first hit alone: direct light (Sh91's first stage).
    Direct,
}

/// How walks of the infinite estimator end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InfiniteEnd {
    /// Below a weight they go on as collision walks of that weight; unbiased.
    Roulette {
        /// The weight, in (0, 1).
        threshold: f64,
    },
    /// At once below a weight; biased.
    Cutoff {
        /// The weight, in (0, 1).
        threshold: f64,
    },
    /// After a number of hits; biased.
    Length {
        /// The number, at least 1.
        length: u32,
    },
}

impl InfiniteEnd {
    /// The weight of a job that names none.
    pub const DEFAULT_THRESHOLD: f64 = 0.001;
}

impl Default for InfiniteEnd {
    fn default() -> Self {
        InfiniteEnd::Roulette { threshold: Self::DEFAULT_THRESHOLD }
    }
}

/// Where gathering walks are born.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Birth {
    /// On each patch in proportion to its active area.
    #[default]
    Area,
    /// On each patch alike.
    Uniform,
    /// On each of these patches alike (by number), nowhere else.
    Patches(Vec<u32>),
}

/// Which way walks run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the emitters, carrying power.
    Shooting,
    /// From patches, looking for emitters.
    Gathering(Birth),
    /// No walks but chains of single rays between patches: stochastic Jacobi. A chain takes the place of a walk.
    Jacobi {
        /// Rays of a chain.
        chain_rays: u64,
        /// What a chain makes of them.
        solve: Solve,
    },
}

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

/// A kind of walk and what it scores.
#[derive(Clone, Debug, PartialEq)]
pub struct Method {
    /// Shooting or gathering.
    pub direction: Direction,
    /// What scores.
    pub estimator: EstimatorKind,
    /// How walks of the infinite estimator end; no other looks at it.
    pub infinite: InfiniteEnd,
    /// Where surviving walks go on from.
    pub space: Space,
    /// Whether collision walks are scored by absorption and survival too, to find the best mix of both.
    pub mix: bool,
    /// Of shooting walks: how many make a batch, which takes the place of a walk. `None`: each is a sample of its own, and
    /// every number is random.
    pub batch: Option<Batch>,
    /// Patches whose light is gathered by rays of their own from what a batch or chain has found elsewhere (final gather).
    pub final_gather: Vec<u32>,
}

/// Shooting walks that are one sample together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// How many.
    pub walks: u64,
    /// Where their numbers come from: one randomised Sobol sequence for all of them, or independent ones.
    pub sampler: Sampler,
}
