//! Where walks are born.

use crate::method::Birth;
use crate::sampling::AliasTable;
use crate::scene::Scene;
use crate::spec::Sides;
use crate::surface::{Side, Surface};

/// One side of a cell, where a walk may begin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin {
    pub surface: u32,
    pub cell: u32,
    pub side: Side,
}

/// Sides of cells and the probability of each.
#[derive(Clone, Debug)]
pub(crate) struct Births {
    origins: Vec<Origin>,
    choice: AliasTable,
    /// Sum of the weights: Φ_T where they are powers [W].
    total: f64,
}

impl Births {
    /// Births with a probability in proportion to `weight` of each patch, both sides of a two-sided one alike.
    /// `None` where no weight is above 0.
    pub(crate) fn new(
        surfaces: &[Surface],
        patch_count: usize,
        weight: impl Fn(usize) -> f64,
    ) -> Option<Self> {
        let (mut origins, mut weights) = (Vec::new(), Vec::new());
        for (number, surface) in surfaces.iter().enumerate() {
            let first = surface.first_patch() as usize;
            let end = surfaces.get(number + 1).map_or(patch_count, |next| next.first_patch() as usize);
            let sides: &[Side] = match surface.sides() {
                Sides::Front => &[Side::Front],
                Sides::Both => &[Side::Front, Side::Back],
            };
            for patch in (first..end).filter(|&patch| weight(patch) > 0.0) {
                for &side in sides {
                    origins.push(Origin { surface: number as u32, cell: (patch - first) as u32, side });
                    weights.push(weight(patch) / sides.len() as f64);
                }
            }
        }
        let total = weights.iter().sum();
        (!origins.is_empty()).then(|| Births { choice: AliasTable::new(&weights), origins, total })
    }

    pub(crate) fn total(&self) -> f64 {
        self.total
    }

    /// The origin that 64 random bits choose.
    #[inline(always)]
    pub(crate) fn choose(&self, bits: u64) -> Origin {
        self.origins[self.choice.choose(bits)]
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
