//! What a chain or a batch of walks came to.

use super::cast::Caster;
use super::faces::{FaceTable, face_major};
use crate::tally::Counts;

/// What one chain came to.
pub(crate) struct ChainOutcome {
    /// H [W/m²], face-major, channel-minor.
    pub(crate) irradiance: Vec<f64>,
    /// The means of H·ψ₁ and H·ψ₂ over each face, in the same order; empty where they are not asked for.
    pub(crate) slopes: Vec<[f64; 2]>,
    /// Rays that landed on each face.
    pub(crate) landed: Vec<u64>,
    /// One walk, the chain; rays by their ends; the part of the power that was lost.
    pub(crate) counts: Counts,
}

impl ChainOutcome {
    /// What a chain has found: H of every face [W/m²], and the power that escaped and that ended on backs [W], in every
    /// channel.
    pub(super) fn new(
        faces: &FaceTable,
        caster: &Caster,
        irradiance: &[Vec<f64>],
        lost_power: &[[f64; 2]],
    ) -> Self {
        let lost = |way: usize| caster.lost.iter().map(|lost| u64::from(lost[way])).sum();
        let mut outcome = ChainOutcome {
            irradiance: face_major(irradiance),
            slopes: Vec::new(),
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

    /// This outcome with `rays` shadow rays counted beside those of links: each ends at an emitter, or at what hides it.
    pub(super) fn with_shadow_rays(mut self, rays: u64) -> Self {
        self.counts.rays += rays;
        self.counts.absorbed += rays;
        self
    }
}

/// A part of a channel's power in the units of [`Counts::WEIGHT_UNITS`].
fn weight(part: f64, power: f64) -> u128 {
    if power > 0.0 { (part / power * Counts::WEIGHT_UNITS + 0.5) as u128 } else { 0 }
}
