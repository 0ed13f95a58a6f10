//! Where walks are born.

use crate::method::Birth;
use crate::sampling::AliasTable;
use crate::scene::{Patch, Scene};
use crate::spec::Sides;
use crate::surface::{Side, Surface};

/// One side of a cell, where a walk may begin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin {
    pub surface: u32,
    pub cell: u32,
    pub side: Side,
}

/// Sides of cells, the probability of each, and the weights that walks set out with.
#[derive(Clone, Debug)]
pub(crate) struct Births {
    origins: Vec<Origin>,
    choice: AliasTable,
    /// Per origin; empty where every weight is 1.
    weights: Vec<[f64; 3]>,
}

impl Births {
    /// Births with a probability in proportion to `share` of each patch, both sides of a two-sided one alike.
    /// `None` where no share is above 0.
    pub(crate) fn new(
        surfaces: &[Surface],
        patch_count: usize,
        share: impl Fn(usize) -> f64,
    ) -> Option<Self> {
        let (mut origins, mut shares) = (Vec::new(), Vec::new());
        for (number, surface) in surfaces.iter().enumerate() {
            let first = surface.first_patch() as usize;
            let end = surfaces.get(number + 1).map_or(patch_count, |next| next.first_patch() as usize);
            let sides: &[Side] = match surface.sides() {
                Sides::Front => &[Side::Front],
                Sides::Both => &[Side::Front, Side::Back],
            };
            for patch in (first..end).filter(|&patch| share(patch) > 0.0) {
                for &side in sides {
                    origins.push(Origin { surface: number as u32, cell: (patch - first) as u32, side });
                    shares.push(share(patch) / sides.len() as f64);
                }
            }
        }
        (!origins.is_empty()).then(|| Births {
            choice: AliasTable::new(&shares),
            origins,
            weights: Vec::new(),
        })
    }

    /// Births on emitters. Grey: p_s = Φ_s/Φ_T. In colour p_s is the mean of what the channels that emit would
    /// each choose, and a walk sets out with w_c = (Φ_sc/Φ_Tc)/p_s in channel c: p_s·w_c is what channel c alone
    /// would have, and no weight exceeds the number of channels (the balance heuristic).
    pub(crate) fn of_emitters(
        surfaces: &[Surface],
        patches: &[Patch],
        channels: usize,
        total: [f64; 3],
    ) -> Option<Self> {
        if channels == 1 {
            return Births::new(surfaces, patches.len(), |i| patches[i].power(0));
        }
        let share = |patch: &Patch, c: usize| if total[c] > 0.0 { patch.power(c) / total[c] } else { 0.0 };
        let emitting = total.iter().filter(|&&power| power > 0.0).count() as f64;
        let probability = |patch: &Patch| (0..3).map(|c| share(patch, c)).sum::<f64>() / emitting;
        let mut births = Births::new(surfaces, patches.len(), |i| probability(&patches[i]))?;
        let weights = births.origins.iter().map(|origin| {
            let patch = &patches[(surfaces[origin.surface as usize].first_patch() + origin.cell) as usize];
            std::array::from_fn(|c| share(patch, c) / probability(patch))
        });
        births.weights = weights.collect();
        Some(births)
    }

    /// The origin that 64 random bits choose, and the weights of the channels there.
    #[inline(always)]
    pub(crate) fn choose<const C: usize>(&self, bits: u64) -> (Origin, [f64; C]) {
        let choice = self.choice.choose(bits);
        let weights = match self.weights.get(choice) {
            Some(weights) if C > 1 => std::array::from_fn(|c| weights[c]),
            _ => [1.0; C],
        };
        (self.origins[choice], weights)
    }

    /// The largest weight that a walk sets out with, channel by channel; 1 where a channel has no light at all.
    pub(crate) fn largest_weights(&self) -> [f64; 3] {
        let largest = |c: usize| self.weights.iter().map(|weights| weights[c]).fold(0.0, f64::max);
        [0, 1, 2].map(largest).map(|weight| if weight > 0.0 { weight } else { 1.0 })
    }
}

/// p_i: the probability that a gathering walk is born on patch i, for every patch.
pub fn birth_probabilities(scene: &Scene, birth: &Birth) -> Vec<f64> {
    let patches = scene.patches();
    match birth {
        Birth::Area => {
            let total: f64 = patches.iter().map(|patch| patch.active_area()).sum();
            patches.iter().map(|patch| patch.active_area() / total).collect()
        }
        Birth::Uniform => vec![1.0 / patches.len() as f64; patches.len()],
        Birth::Patches(chosen) => {
            let mut probabilities = vec![0.0; patches.len()];
            for &patch in chosen {
                probabilities[patch as usize] = 1.0 / chosen.len() as f64;
            }
            probabilities
        }
    }
}
