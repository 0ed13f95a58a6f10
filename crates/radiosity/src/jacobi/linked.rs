//! Chains that forget no ray: each is remembered as a *link* between the face that shot it and the one it met, good for
//! light in both directions, and iterations run on all links of the chain until nothing changes: the same rays serve
//! every bounce, energy is conserved to the last link, and what varies is not B but its differences along links.
//!
//! Rays go out in three stages, each aimed by what the stages before have found.

use super::board::largest_radiosity;
use super::cast::{Caster, systematic};
use super::direct::Direct;
use super::faces::{FaceTable, face_major};
use super::links::Links;
use super::near::Landed;
use super::numbers::{Numbers, SobolNumbers};
use super::outcome::Outcome;
use super::shared::cast;
use super::solve::solve;
use super::spread::{Solved, slopes};
use crate::hands::Hands;
use crate::random::rng::WalkRng;

/// Parts of a chain's rays that are out when each stage ends, in eighths. The first stage knows nothing; the second
/// knows where B differs, roughly; the last brings the whole to the density that is best.
const STAGES: [u64; 3] = [1, 3, 8];

/// The part of all rays that is spread over all faces alike, so that the smallest face is known, too.
const ALIKE: f64 = 0.125;

/// Density of rays where B is at the median, over the mean density that differences of B ask for.
const FLOOR: f64 = 0.1;

/// Iterations of an early stage stop at this residual.
const ROUGH: f64 = 1e-3;

/// One chain of `rays` rays, each face's along its own Sobol sequence. `None` once `hands`, which share the rays and the
/// solution, no longer want it.
pub(crate) fn chain(
    faces: &FaceTable,
    rng: WalkRng,
    rays: u64,
    with_slopes: bool,
    hands: &dyn Hands,
) -> Option<Outcome> {
    let mut caster = Caster::new(faces, SobolNumbers::new(rng));
    let mut direct = Direct::where_it_pays(faces, rays, &density(&faces.areas, &[]), hands)?;
    if let Some(direct) = &mut direct {
        direct.cast(caster.rng(), with_slopes, hands)?;
    }
    let rays = rays - direct.as_ref().map_or(0, Direct::rays);
    let mut landed = Landed::new(faces.areas.len(), direct.as_ref().map(Direct::bounds));
    let mut radiosity: Vec<Vec<f64>> = Vec::new();
    let mut outcome = None;
    for eighths in STAGES {
        let out = part(rays, eighths);
        let offset = caster.rng().pair()[0];
        let along = direct.as_ref().map(|direct| direct.along_links(&landed, &caster, &radiosity));
        let more = aimed(&faces.areas, along.as_ref().unwrap_or(&radiosity), &caster, out, offset);
        cast(&mut caster, &more, &mut landed, hands)?;
        let links = Links::new(&landed.links, &caster, faces);
        let residual = if out == rays { ROUGH / (rays as f64).sqrt() } else { ROUGH };
        let straight = direct.as_ref().map(|direct| direct.irradiance(&landed, &caster));
        radiosity = solve(&links, straight.as_deref(), &radiosity, residual, hands)?;
        if out < rays {
            continue;
        }
        let mut solved = match (&straight, &direct) {
            (Some(straight), Some(direct)) => {
                let outcome = solved_beside(&links, &caster, straight, &radiosity, hands);
                outcome.with_shadow_rays(direct.rays())
            }
            _ => solved(&links, &caster, &radiosity, hands),
        };
        if with_slopes {
            solved.slopes = spread_of((&links, &caster), &radiosity, direct.as_ref(), hands)?;
        }
        outcome = Some(solved);
    }
    outcome
}

/// How the light is spread over faces, given the radiosity that goes along the links.
fn spread_of(
    (links, caster): (&Links, &Caster<SobolNumbers>),
    radiosity: &[Vec<f64>],
    direct: Option<&Direct>,
    hands: &dyn Hands,
) -> Option<Vec<[f64; 2]>> {
    let incoming: Vec<Vec<f64>> = radiosity.iter().map(|b| links.incoming(b, hands)).collect();
    let (along, incoming) = (face_major(radiosity), face_major(&incoming));
    let largest = largest_radiosity(links.faces.scene);
    let solved = Solved { along: &along, incoming: &incoming, largest, direct };
    slopes(links.faces, caster, &solved, hands)
}

/// How many more rays each face shoots so that `out` are out in all, near the best density.
fn aimed<N: Numbers>(
    areas: &[f64],
    radiosity: &[Vec<f64>],
    caster: &Caster<N>,
    out: u64,
    offset: f64,
) -> Vec<u32> {
    let wanted = density(areas, radiosity);
    let missing = wanted.iter().zip(&caster.shot).map(|(part, &shot)| part * out as f64 - f64::from(shot));
    let missing: Vec<f64> = missing.map(|rays| rays.max(0.0)).collect();
    systematic(&missing, out - caster.rays(), offset)
}

/// What a chain has found, given B of every face in every channel.
fn solved<N: Numbers>(
    links: &Links,
    caster: &Caster<N>,
    radiosity: &[Vec<f64>],
    hands: &dyn Hands,
) -> Outcome {
    let irradiance = radiosity.iter().enumerate().map(|(channel, b)| links.irradiance(channel, b, hands));
    let lost = radiosity.iter().map(|b| links.lost_power(b));
    Outcome::new(links.faces, caster, &irradiance.collect::<Vec<_>>(), &lost.collect::<Vec<_>>())
}

/// What a chain has found, given H_d and b of every face in every channel.
fn solved_beside<N: Numbers>(
    links: &Links,
    caster: &Caster<N>,
    direct: &[Vec<f64>],
    reflected: &[Vec<f64>],
    hands: &dyn Hands,
) -> Outcome {
    let FaceTable { scene, list, areas } = links.faces;
    let channels = || direct.iter().zip(reflected).enumerate();
    let irradiance =
        channels().map(|(channel, (direct, b))| links.irradiance_beside(channel, direct, b, hands));
    let lost = channels().map(|(channel, (direct, b))| {
        let arrives: f64 = direct.iter().zip(areas).map(|(h, area)| h * area).sum();
        let emittance: Vec<f64> = list.iter().map(|face| face.emittance[channel]).collect();
        let of_emitted = shared_out(scene.total_power(channel) - arrives, links.lost_power(&emittance));
        let of_reflected = links.lost_power(b);
        [0, 1].map(|way| of_emitted[way] + of_reflected[way])
    });
    Outcome::new(links.faces, caster, &irradiance.collect::<Vec<_>>(), &lost.collect::<Vec<_>>())
}

/// The power that does not arrive, in proportion to what the rays of emitters say of the two ways in which it is lost.
fn shared_out(lost: f64, ways: [f64; 2]) -> [f64; 2] {
    match (lost.max(0.0), ways[0] + ways[1]) {
        (lost, sum) if sum > 0.0 => ways.map(|way| lost * way / sum),
        (lost, _) => [lost, 0.0],
    }
}

/// `eighths` of `rays`, rounded down.
fn part(rays: u64, eighths: u64) -> u64 {
    (u128::from(rays) * u128::from(eighths) / 8) as u64
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
