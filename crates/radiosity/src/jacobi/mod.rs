//! Stochastic Jacobi radiosity that forgets no ray.
//!
//! A Jacobi iteration B ← E + R·F·B sends every patch's power one bounce on. Stochastic Jacobi (BS §4) samples it with
//! fresh rays each time and averages the iterations. Here each ray is remembered as a *link* between the face (side of
//! a patch) that shot it and the one it met, good for light in both directions, and iterations run on all links of the
//! chain until nothing changes: the same rays serve every bounce, energy is conserved to the last link, and what varies
//! is not B but its differences along links.
//!
//! A *chain* is one independent solution: its rays go out in three stages, each aimed by what the stages before have
//! found. Every face shoots along its own scrambled Sobol sequence, drawn anew for each chain. Solutions of one chain
//! say nothing of their own error; that is told by several chains.

mod board;
mod cast;
mod faces;
mod links;
mod solve;

use crate::rng::WalkRng;
use crate::scene::Scene;
use crate::tally::Counts;
pub use board::ChainBoard;
pub(crate) use board::{UNITS, largest_radiosity};
use cast::{Caster, systematic};
use faces::Faces;
use links::{LinkTable, Links};
use solve::solve;

/// Parts of a chain's rays that are out when each stage ends, in eighths. The first stage knows nothing; the second
/// knows where B differs, roughly; the last brings the whole to the density that is best.
const STAGES: [u64; 3] = [1, 3, 8];

/// Of all rays, this part is spread over all faces alike, so that also the smallest is known.
const ALIKE: f64 = 0.125;

/// Density of rays where B is at the median, over the mean density that differences of B ask for.
const FLOOR: f64 = 0.1;

/// Iterations of an early stage stop at this residual.
const ROUGH: f64 = 1e-3;

/// What one chain came to.
pub(crate) struct Outcome {
    /// H [W/m²], patch-major, channel-minor.
    pub(crate) irradiance: Vec<f64>,
    /// Rays that landed on each patch.
    pub(crate) landed: Vec<u64>,
    /// One walk, the chain; rays by their ends; the part of the power that was lost.
    pub(crate) counts: Counts,
}

/// One chain of `rays` rays. `go_on` is asked now and then; `None` once it says no.
pub(crate) fn chain(scene: &Scene, mut rng: WalkRng, rays: u64, go_on: &dyn Fn() -> bool) -> Option<Outcome> {
    let faces = Faces::new(scene);
    let mut caster = Caster::new(&faces, rng.bits());
    let mut table = LinkTable::new(faces.areas.len());
    let mut radiosity: Vec<Vec<f64>> = Vec::new();
    let mut outcome = None;
    for eighths in STAGES {
        let out = part(rays, eighths);
        let more = aimed(&faces.areas, &radiosity, &caster, out, rng.pair()[0]);
        caster.cast(&more, go_on, |from, to| table.count(from, to))?;
        table.end_row();
        let links = Links::new(&table, &caster, &faces);
        let residual = if out == rays { ROUGH / (rays as f64).sqrt() } else { ROUGH };
        let solve = |channel| solve(channel, &links, radiosity.get(channel), residual, go_on);
        radiosity = (0..scene.channels()).map(solve).collect::<Option<_>>()?;
        outcome = (out == rays).then(|| Outcome::new(&links, &caster, &radiosity));
    }
    outcome
}

/// How many more rays each face shoots so that `out` are out in all, near the best density.
fn aimed(areas: &[f64], radiosity: &[Vec<f64>], caster: &Caster, out: u64, offset: f64) -> Vec<u32> {
    let wanted = density(areas, radiosity);
    let missing = wanted.iter().zip(&caster.shot).map(|(part, &shot)| part * out as f64 - f64::from(shot));
    let missing: Vec<f64> = missing.map(|rays| rays.max(0.0)).collect();
    systematic(&missing, out - caster.rays(), offset)
}

impl Outcome {
    /// What a chain has found, given B of every face in every channel.
    fn new(links: &Links, caster: &Caster, radiosity: &[Vec<f64>]) -> Self {
        let (faces, channels) = (links.faces, radiosity.len());
        let patches = faces.scene.patches().len();
        let lost = |way: usize| caster.lost.iter().map(|lost| u64::from(lost[way])).sum();
        let mut outcome = Outcome {
            irradiance: vec![0.0; patches * channels],
            landed: vec![0; patches],
            counts: Counts {
                walks: 1,
                rays: caster.rays(),
                absorbed: caster.landed.iter().sum(),
                escaped: lost(0),
                absorbed_back: lost(1),
                ..Counts::default()
            },
        };
        for (face, landed) in faces.list.iter().zip(&caster.landed) {
            outcome.landed[face.patch as usize] += landed;
        }
        for (channel, radiosity) in radiosity.iter().enumerate() {
            for (face, h) in faces.list.iter().zip(links.irradiance(channel, radiosity)) {
                // The mean of the sides.
                outcome.irradiance[face.patch as usize * channels + channel] += h / face.sides;
            }
            let power = faces.scene.total_power(channel);
            let [escaped, absorbed_back] = links.lost_power(radiosity);
            outcome.counts.escaped_weight[channel] = weight(escaped, power);
            outcome.counts.absorbed_back_weight[channel] = weight(absorbed_back, power);
        }
        outcome
    }
}

/// `eighths` of `rays`, rounded down.
fn part(rays: u64, eighths: u64) -> u64 {
    (u128::from(rays) * u128::from(eighths) / 8) as u64
}

/// A part of a channel's power in the units of [`Counts::WEIGHT_UNITS`].
fn weight(part: f64, power: f64) -> u128 {
    if power > 0.0 { (part / power * Counts::WEIGHT_UNITS + 0.5) as u128 } else { 0 }
}

/// Which part of the rays each face should shoot, given the radiosity of each channel as far as it is known; the
/// parts sum to 1.
///
/// A link (i, j) errs in proportion to |B_i − B_j|/(d_i + d_j), d being rays per area. What makes that large is mostly
/// one bright end, so that rays per area follow |B − β|, β the median: a face like most others needs few.
fn density(areas: &[f64], radiosity: &[Vec<f64>]) -> Vec<f64> {
    let mut contrast = vec![0.0; areas.len()];
    for radiosity in radiosity {
        let median = area_median(areas, radiosity);
        let differences: Vec<f64> = radiosity.iter().map(|b| (b - median).abs()).collect();
        let mean = area_mean(areas, &differences);
        if mean > 0.0 {
            contrast.iter_mut().zip(&differences).for_each(|(sum, difference)| *sum += difference / mean);
        }
    }
    // Nothing is known yet, or all is equal: rays by area.
    let known = area_mean(areas, &contrast);
    let floor = if known > 0.0 { FLOOR * known } else { 1.0 };
    let by_contrast: Vec<f64> = areas.iter().zip(contrast).map(|(area, c)| area * (c + floor)).collect();
    let total: f64 = by_contrast.iter().sum();
    let alike = ALIKE / areas.len() as f64;
    by_contrast.iter().map(|share| (1.0 - ALIKE) * share / total + alike).collect()
}

/// Σ A x / Σ A.
fn area_mean(areas: &[f64], values: &[f64]) -> f64 {
    let sum: f64 = areas.iter().zip(values).map(|(area, value)| area * value).sum();
    sum / areas.iter().sum::<f64>()
}

/// The value that half of the area does not exceed.
fn area_median(areas: &[f64], values: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|&i, &j| values[i].total_cmp(&values[j]).then(i.cmp(&j)));
    let half = 0.5 * areas.iter().sum::<f64>();
    let mut below = 0.0;
    let middle = order.iter().find(|&&i| {
        below += areas[i];
        below >= half
    });
    middle.or(order.last()).map_or(0.0, |&i| values[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_by_area() {
        assert_eq!(area_median(&[1.0, 1.0, 1.0], &[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(area_median(&[5.0, 1.0, 1.0], &[3.0, 1.0, 2.0]), 3.0);
    }

    #[test]
    fn rays_go_by_area_until_differences_are_known() {
        let areas = [1.0, 3.0];
        let blind = density(&areas, &[]);
        assert_eq!(blind, [0.875 * 0.25 + 0.0625, 0.875 * 0.75 + 0.0625]);
        assert_eq!(density(&areas, &[vec![2.0, 2.0]]), blind);
        // β = 1: contrast (9, 0), mean 9/4; floor a tenth of the mean of contrast/mean, which is 1.
        let aimed = density(&areas, &[vec![10.0, 1.0]]);
        let share = |by_contrast: f64| 0.875 * by_contrast / (4.1 + 0.3) + 0.0625;
        assert!((aimed[0] - share(4.1)).abs() < 1e-15 && (aimed[1] - share(0.3)).abs() < 1e-15, "{aimed:?}");
    }
}
