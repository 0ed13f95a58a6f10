//! How many rays each face shoots.
//!
//! A pilot finds out where radiosity differs. It is a chain of its own, whose numbers do not depend on the job's seed, and its rays serve
//! nothing else: the rays of a chain are shared out without regard to what they find, so that its links have no bias.

use super::beams::DirectLight;
use super::cast::{Caster, systematic};
use super::direct::Direct;
use super::faces::FaceTable;
use super::halves::Half;
use super::linked::straight;
use super::near::LandingCounts;
use super::numbers::RayNumbers;
use super::solve::solve;
use crate::random::rng::{Sequence, WalkRng};
use crate::thread_pool::ThreadPool;

/// Parts of a chain's rays that a pilot has shot when each of its stages ends, in eighths: the first knows nothing, the second knows
/// where B differs, roughly.
const STAGES: [u64; 2] = [1, 3];

/// A pilot needs no more rays than a chain of this number of rays a face would give it.
const MOST_RAYS: u64 = 256;

/// The numbers of pilots are those of the first walks of this seed's sequence: that of shadow rays (`direct.rs`), and this one.
pub(super) const PILOT_SEED: u64 = 0;
const PILOT: u64 = 1;

/// The part of all rays that is spread over all faces alike, so that the smallest face is known, too.
const ALIKE: f64 = 0.125;

/// Density of rays where B is at the median, over the mean density that differences of B ask for.
const FLOOR: f64 = 0.1;

/// Iterations of a pilot stop at this residual.
const ROUGH: f64 = 1e-3;

/// The numbers of a chain of links: those of the walk of its number, but of the pilots' own sequence those after theirs. Links of rays that
/// have decided how many there are have a bias, of 0.06 standard deviations of a chain where it was measured.
pub(crate) fn numbers_of_chain(sequence: &Sequence, chain: u64) -> WalkRng {
    let first = if sequence.is_of(PILOT_SEED) { PILOT + 1 } else { 0 };
    sequence.walk(first + chain)
}

/// Which part of the rays each face of chains of `rays` rays should shoot; the parts sum to 1. `None` once `pool` no longer want it.
pub(crate) fn aim(faces: &FaceTable, rays: u64, pool: &dyn ThreadPool) -> Option<Vec<f64>> {
    let mut caster = Caster::new(faces, RayNumbers::sobol(Sequence::new(PILOT_SEED).walk(PILOT)));
    let mut direct = Direct::where_it_pays(faces, rays, pool)?;
    if let Some(direct) = &mut direct {
        direct.cast(caster.rng(), false, pool)?;
    }
    let lamps = DirectLight::of(faces, caster.rng(), rays, &|| pool.go_on())?;
    let rays = rays - direct.as_ref().map_or(0, Direct::rays) - lamps.as_ref().map_or(0, |lamps| lamps.rays);
    let rays = rays.min(MOST_RAYS * faces.list.len() as u64);
    let mut sample = Half::new(
        LandingCounts::new(faces.areas.len(), direct.as_ref().map(Direct::bounds)),
        faces.areas.len(),
    );
    let mut wanted = density(&faces.areas, &[]);
    let mut radiosity: Vec<Vec<f64>> = Vec::new();
    for eighths in STAGES {
        let more = aimed(&wanted, &caster.shot, rays * eighths / 8, 0.5);
        sample.cast(&mut caster, &more, pool)?;
        let rays = sample.rays();
        let straight = straight(direct.as_ref().map(|direct| direct.irradiance(&rays)), lamps.as_ref());
        radiosity = solve(&rays.links(faces), &straight, &radiosity, ROUGH, pool)?;
        let along = direct.as_ref().map(|direct| direct.along_links(&rays, &radiosity));
        wanted = density(&faces.areas, along.as_ref().unwrap_or(&radiosity));
    }
    Some(wanted)
}

/// How many more rays each face shoots so that `out` are out in all, in the wanted parts as nearly as can be.
pub(super) fn aimed(wanted: &[f64], shot: &[u32], out: u64, offset: f64) -> Vec<u32> {
    let missing = wanted.iter().zip(shot).map(|(part, &shot)| part * out as f64 - f64::from(shot));
    let missing: Vec<f64> = missing.map(|rays| rays.max(0.0)).collect();
    let before: u64 = shot.iter().map(|&shot| u64::from(shot)).sum();
    systematic(&missing, out - before, offset)
}

/// Which part of the rays each face should shoot, given the radiosity of each channel as far as it is known; the
/// parts sum to 1.
///
/// A link (i, j) errs in proportion to |B_i − B_j|/(d_i + d_j), d being rays per area. What makes that large is mostly
/// one bright end, so that rays per area follow |B − β|, β the median: a face like most others needs few.
pub(crate) fn density(areas: &[f64], radiosity: &[Vec<f64>]) -> Vec<f64> {
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
    fn no_chain_has_the_numbers_of_a_pilot() {
        let bits = |mut rng: WalkRng| rng.bits();
        for seed in [PILOT_SEED, 1] {
            let sequence = Sequence::new(seed);
            let pilots: Vec<u64> =
                (0..=PILOT).map(|walk| bits(Sequence::new(PILOT_SEED).walk(walk))).collect();
            let chains: Vec<u64> = (0..4).map(|chain| bits(numbers_of_chain(&sequence, chain))).collect();
            assert!(chains.iter().all(|chain| !pilots.contains(chain)), "seed {seed}");
            assert!(seed == PILOT_SEED || chains[0] == bits(sequence.walk(0)));
        }
    }

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
