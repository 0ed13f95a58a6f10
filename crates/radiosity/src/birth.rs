//! Where walks are born.

use crate::method::Birth;
use crate::patch::{Patch, Patches};
use crate::sampling::AliasTable;
use crate::scene::Scene;
use crate::spec::Sides;
use crate::surface::{Side, Surface};

/// One side of consecutive cells of a surface, where walks begin with the same probability.
#[derive(Clone, Copy, Debug)]
struct Cradle {
    surface: u32,
    side: Side,
    first_cell: u32,
    cells: u32,
}

/// One side of a cell, where a walk begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin {
    pub surface: u32,
    pub cell: u32,
    pub side: Side,
}

/// Sides of cells, the probability of each, and the weights that walks set out with.
#[derive(Clone, Debug)]
pub(crate) struct Births {
    cradles: Vec<Cradle>,
    choice: AliasTable,
    /// Per cradle; empty where every weight is 1.
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
        Births::in_cradles(surfaces, patch_count, &share, |a, b| share(a) == share(b))
    }

    /// The same, given which neighbours are alike in all that matters at a birth.
    fn in_cradles(
        surfaces: &[Surface],
        patch_count: usize,
        share: impl Fn(usize) -> f64,
        alike: impl Fn(usize, usize) -> bool,
    ) -> Option<Self> {
        let (mut cradles, mut shares) = (Vec::new(), Vec::new());
        for (number, surface) in surfaces.iter().enumerate() {
            let first = surface.first_patch() as usize;
            let end = surfaces.get(number + 1).map_or(patch_count, |next| next.first_patch() as usize);
            let sides: &[Side] = match surface.sides() {
                Sides::Front => &[Side::Front],
                Sides::Both => &[Side::Front, Side::Back],
            };
            let mut next = first;
            while next < end {
                let patch = next;
                next += (patch..end).take_while(|&other| alike(patch, other)).count();
                let cells = (next - patch) as u32;
                for &side in sides.iter().filter(|_| share(patch) > 0.0) {
                    let first_cell = (patch - first) as u32;
                    cradles.push(Cradle { surface: number as u32, side, first_cell, cells });
                    shares.push(share(patch) * f64::from(cells) / sides.len() as f64);
                }
            }
        }
        (!cradles.is_empty()).then(|| Births {
            choice: AliasTable::new(&shares),
            cradles,
            weights: Vec::new(),
        })
    }

    /// Births on emitters. Grey: p_s = Φ_s/Φ_T. In colour p_s is the mean of what the channels that emit would
    /// each choose, and a walk sets out with w_c = (Φ_sc/Φ_Tc)/p_s in channel c: p_s·w_c is what channel c alone
    /// would have, and no weight exceeds the number of channels (the balance heuristic).
    pub(crate) fn of_emitters(
        surfaces: &[Surface],
        patches: &Patches,
        channels: usize,
        total: [f64; 3],
    ) -> Option<Self> {
        if channels == 1 {
            return Births::new(surfaces, patches.len(), |i| patches.get(i).power(0));
        }
        let share = |patch: &Patch, c: usize| if total[c] > 0.0 { patch.power(c) / total[c] } else { 0.0 };
        let emitting = total.iter().filter(|&&power| power > 0.0).count() as f64;
        let probability = |patch: &Patch| (0..3).map(|c| share(patch, c)).sum::<f64>() / emitting;
        let alike = |a: usize, b: usize| patches.get(a).emittance == patches.get(b).emittance;
        let mut births =
            Births::in_cradles(surfaces, patches.len(), |i| probability(&patches.get(i)), alike)?;
        let weights = births.cradles.iter().map(|cradle| {
            let first_patch = surfaces[cradle.surface as usize].first_patch();
            let patch = patches.get((first_patch + cradle.first_cell) as usize);
            std::array::from_fn(|c| share(&patch, c) / probability(&patch))
        });
        births.weights = weights.collect();
        Some(births)
    }

    /// The origin that twice 64 random bits choose, and the weights of the channels there.
    #[inline(always)]
    pub(crate) fn choose<const C: usize>(&self, bits: [u64; 2]) -> (Origin, [f64; C]) {
        let choice = self.choice.choose(bits[0]);
        let weights = match self.weights.get(choice) {
            Some(weights) if C > 1 => std::array::from_fn(|c| weights[c]),
            _ => [1.0; C],
        };
        let Cradle { surface, side, first_cell, cells } = self.cradles[choice];
        let cell = first_cell + ((u128::from(bits[1]) * u128::from(cells)) >> 64) as u32;
        (Origin { surface, cell, side }, weights)
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
