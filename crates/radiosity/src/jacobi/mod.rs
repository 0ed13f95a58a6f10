//! Stochastic Jacobi radiosity: single rays between patches in place of walks.
//!
//! A Jacobi iteration B ← E + R·F·B sends every patch's power one bounce on. Stochastic Jacobi samples it with rays. Two
//! ways to go on from there: `iterations.rs` is that of BS §4, which shoots fresh rays each time and averages; `linked.rs`
//! keeps every ray and iterates on all of them.
//!
//! A *chain* is one independent solution. What it does within says nothing of its own error; that is told by several
//! chains.

mod board;
pub(crate) mod cast;
pub(crate) mod faces;
mod iterations;
mod linked;
mod links;
pub(crate) mod numbers;
mod reciprocity;
mod solve;

use crate::method::Solve;
use crate::rng::WalkRng;
use crate::scene::Scene;
use crate::tally::Counts;
pub use board::ChainBoard;
pub(crate) use board::{UNITS, largest_radiosity};
use cast::Caster;
use faces::{FaceTable, face_major};
pub(crate) use iterations::observed;
pub use iterations::{Iteration, Phase, stochastic_iteration};
pub use reciprocity::Reciprocity;

/// What one chain came to.
pub(crate) struct Outcome {
    /// H [W/m²], face-major, channel-minor.
    pub(crate) irradiance: Vec<f64>,
    /// Rays that landed on each face.
    pub(crate) landed: Vec<u64>,
    /// One walk, the chain; rays by their ends; the part of the power that was lost.
    pub(crate) counts: Counts,
}

/// One chain of `rays` rays. `go_on` is asked now and then; `None` once it says no.
pub(crate) fn chain(
    scene: &Scene,
    rng: WalkRng,
    rays: u64,
    solve: Solve,
    go_on: &dyn Fn() -> bool,
) -> Option<Outcome> {
    let faces = FaceTable::new(scene);
    match solve {
        Solve::Links => linked::chain(&faces, rng, rays, go_on),
        Solve::Iterations(plan) => iterations::chain(&faces, rng, rays, plan, &mut |_, _, _| {}, go_on),
    }
}

/// Whether `rays` rays see both ways.
pub(crate) fn reciprocity(scene: &Scene, rng: WalkRng, rays: u64) -> Reciprocity {
    reciprocity::reciprocity(&FaceTable::new(scene), rng, rays)
}

impl Outcome {
    /// What a chain has found: H of every face [W/m²], and the power that escaped and that ended on backs [W], in every
    /// channel.
    fn new<N>(
        faces: &FaceTable,
        caster: &Caster<N>,
        irradiance: &[Vec<f64>],
        lost_power: &[[f64; 2]],
    ) -> Self {
        let lost = |way: usize| caster.lost.iter().map(|lost| u64::from(lost[way])).sum();
        let mut outcome = Outcome {
            irradiance: face_major(irradiance),
            landed: caster.landed.clone(),
            counts: Counts {
                walks: 1,
                rays: caster.shot.iter().map(|&shot| u64::from(shot)).sum(),
                absorbed: caster.landed.iter().sum(),
                escaped: lost(0),
                absorbed_back: lost(1),
                ..Counts::default()
            },
        };
        for (channel, &[escaped, absorbed_back]) in lost_power.iter().enumerate() {
            let power = faces.scene.total_power(channel);
            outcome.counts.escaped_weight[channel] = weight(escaped, power);
            outcome.counts.absorbed_back_weight[channel] = weight(absorbed_back, power);
        }
        outcome
    }
}

/// A part of a channel's power in the units of [`Counts::WEIGHT_UNITS`].
fn weight(part: f64, power: f64) -> u128 {
    if power > 0.0 { (part / power * Counts::WEIGHT_UNITS + 0.5) as u128 } else { 0 }
}
