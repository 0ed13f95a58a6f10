//! Stochastic Jacobi radiosity: single rays between patches in place of walks.
//!
//! A Jacobi iteration B ← E + R·F·B sends every patch's power one bounce on. Stochastic Jacobi samples it with rays. Two
//! ways to go on from there: `iterations.rs` is that of BS §4, which shoots fresh rays each time and averages; `linked.rs`
//! keeps every ray and iterates on all of them.
//!
//! A *chain* is one independent solution. What it does within says nothing of its own error; several chains tell it
//! chains.

pub(crate) mod aim;
mod beams;
mod board;
pub(crate) mod cast;
mod direct;
pub(crate) mod faces;
pub(crate) mod final_gather;
mod halves;
mod iterations;
pub(crate) mod lamps;
mod linked;
mod links;
mod near;
pub(crate) mod numbers;
mod outcome;
mod place;
pub(crate) mod plan;
mod reciprocity;
mod shadow;
mod shared;
mod solid_angle;
mod solve;
mod spread;

use std::sync::Arc;

use crate::random::rng::WalkRng;
use crate::scene::Scene;
use crate::thread_pool::ThreadPool;
pub use board::ChainBoard;
pub(crate) use board::{UNITS, largest_radiosity};
use faces::FaceTable;
pub(crate) use iterations::observed;
pub use iterations::{Iteration, IterationPhase, stochastic_iteration};
pub(crate) use outcome::ChainOutcome;
use plan::Solve;
pub use reciprocity::Reciprocity;
pub(crate) use solid_angle::most_of_unit_lamp;

/// One chain of `rays` rays, shared out as `aim` says where they are links. `None` once `pool`, which are asked now and then, no longer want it.
pub(crate) fn chain(
    scene: &Scene,
    rng: WalkRng,
    rays: u64,
    (solve, with_slopes): (Solve, bool),
    aim: impl FnOnce(&FaceTable) -> Option<Arc<[f64]>>,
    pool: &dyn ThreadPool,
) -> Option<ChainOutcome> {
    let faces = FaceTable::new(scene);
    match solve {
        Solve::Links => linked::chain(&faces, rng, (rays, &aim(&faces)?), with_slopes, pool),
        Solve::Iterations(plan) => {
            iterations::chain(&faces, rng, rays, plan, &mut |_, _, _| {}, &|| pool.go_on())
        }
    }
}

/// Whether shadow rays bring direct light in chains of `rays` rays.
pub(crate) fn has_shadow_rays(scene: &Scene, rays: u64) -> bool {
    let faces = FaceTable::new(scene);
    direct::Direct::where_it_pays(&faces, rays, &|| true).is_some_and(|direct| direct.is_some())
}

/// Whether `rays` rays see both ways.
pub(crate) fn reciprocity(scene: &Scene, rng: WalkRng, rays: u64) -> Reciprocity {
    reciprocity::reciprocity(&FaceTable::new(scene), rng, rays)
}
