//! Patches that a pilot has chosen, as `summary.json` shows them.

use serde::Serialize;

/// How the program solves a job that does not say it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ChoiceSummary {
    /// `shooting`, `gathering` or `jacobi`, the space and, of walks, the estimator.
    pub method: String,
    /// `constant` or `linear`.
    pub basis: &'static str,
    /// `random` or `sobol`.
    pub sampler: String,
    /// Why, and how to have the same again.
    pub why: String,
}

/// What was chosen, and what was predicted of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PartitionSummary {
    /// Surfaces whose cells were chosen.
    pub surfaces: u64,
    /// Whether patches are groups of neighbouring cells of meshes.
    pub grouped: bool,
    /// Patches of the whole scene.
    pub patches: u64,
    /// `constant` or `linear`: the basis of the light on a patch, for the least error.
    pub basis: &'static str,
    /// Walks of the pilot, which are no part of the result.
    pub pilot_paths: u64,
    /// Rays of the pilot.
    pub pilot_rays: u64,
    /// Walks that the errors are predicted for.
    pub for_paths: u64,
    /// The predicted relative error over the area that is due to the number of walks.
    pub noise: f64,
    /// The predicted relative error over the area that is due to the size of the patches.
    pub discretisation: f64,
    /// The root of the sum of both squares.
    pub total: f64,
}
