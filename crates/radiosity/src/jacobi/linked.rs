//! Chains that forget no ray: each is remembered as a *link* between the face that shot it and the one it met, good for
//! light in both directions, and iterations run on all links of the chain until nothing changes: the same rays serve
//! every bounce, energy is conserved to the last link, and what varies is not B but its differences along links.
//!
//! How many rays each face shoots is known before the chain begins (`aim.rs`): were it chosen by what the chain's own rays have found, these
//! would weigh less where they have found much, and links would have a bias.

use super::aim::aimed;
use super::beams::DirectLight;
use super::board::largest_radiosity;
use super::cast::Caster;
use super::direct::Direct;
use super::faces::{FaceTable, face_major};
use super::halves::{Half, LinkRays, cast_halves, extrapolated};
use super::lamps::emitted_power;
use super::links::Links;
use super::near::LandingCounts;
use super::numbers::RayNumbers;
use super::outcome::ChainOutcome;
use super::solve::{Straight, solve};
use super::spread::{SlopeInputs, slopes};
use crate::random::rng::WalkRng;
use crate::thread_pool::ThreadPool;

/// A chain is solved to this residual, over the square root of its rays.
const RESIDUAL: f64 = 1e-3;

/// The noise of links is in proportion to the largest difference of the light of faces, relative to the most of it. At this difference [`RESIDUAL`] is some hundredth of
/// the noise. Below it a chain is solved to [`FINEST`], as far as roundings let it: what conjugate gradients leave undone is of one sign.
const EVEN: f64 = 0.1;
const FINEST: f64 = 1e-15;

/// One chain of `rays` rays, each face's along its own Sobol sequence, of which each face shoots the part `aim`. `None` once `pool`, which
/// share the rays and the solution, no longer want it.
pub(crate) fn chain(
    faces: &FaceTable,
    rng: WalkRng,
    (rays, aim): (u64, &[f64]),
    with_slopes: bool,
    pool: &dyn ThreadPool,
) -> Option<ChainOutcome> {
    let mut caster = Caster::new(faces, RayNumbers::sobol(rng));
    let mut direct = Direct::where_it_pays(faces, rays, pool)?;
    if let Some(direct) = &mut direct {
        direct.cast(caster.rng(), with_slopes, pool)?;
    }
    let lamps = DirectLight::of(faces, caster.rng(), rays, &|| pool.go_on())?;
    let beside = direct.as_ref().map_or(0, Direct::rays) + lamps.as_ref().map_or(0, |lamps| lamps.rays);
    let rays = rays - beside;
    let bounds = direct.as_ref().map(Direct::bounds);
    let mut halves =
        [0, 1].map(|_| Half::new(LandingCounts::new(faces.areas.len(), bounds), faces.areas.len()));
    let offset = caster.rng().pair()[0];
    let more = aimed(aim, &caster.shot, rays, offset);
    cast_halves(&mut halves, &mut caster, &more, pool)?;
    let whole = LinkRays::of_both(&halves, &caster);
    let (links, residual) = (whole.links(faces), RESIDUAL / (rays as f64).sqrt());
    let of_links = |links: &Links, rays: &LinkRays, start: &[Vec<f64>]| {
        solved(links, rays, (direct.as_ref(), lamps.as_ref()), (start, residual), pool)
    };
    let mut found = of_links(&links, &whole, &[])?;
    let radiosity = std::mem::take(&mut found.radiosity);
    let of_half = |half: &Half| {
        let half = half.rays();
        of_links(&half.links(faces), &half, &radiosity)
    };
    let found = found.beyond([of_half(&halves[0])?, of_half(&halves[1])?], faces, direct.is_some());
    let mut outcome = ChainOutcome::new(faces, &caster, &found.irradiance, &found.lost);
    outcome = outcome.with_shadow_rays(beside);
    if with_slopes {
        outcome.slopes = spread_of((&links, &caster), &radiosity, (direct.as_ref(), lamps.as_ref()), pool)?;
    }
    Some(outcome)
}

/// How the light is spread over faces, given the radiosity that goes along the links.
fn spread_of(
    (links, caster): (&Links, &Caster),
    radiosity: &[Vec<f64>],
    (direct, lamps): (Option<&Direct>, Option<&DirectLight>),
    pool: &dyn ThreadPool,
) -> Option<Vec<[f64; 2]>> {
    let incoming: Vec<Vec<f64>> = radiosity.iter().map(|b| links.incoming(b, pool)).collect();
    let (along, incoming) = (face_major(radiosity), face_major(&incoming));
    let mut largest = largest_radiosity(links.faces.scene);
    if lamps.is_some() {
        let brightest = radiosity.iter().map(|b| b.iter().copied().fold(0.0, f64::max));
        largest.iter_mut().zip(brightest).for_each(|(largest, b)| *largest = largest.max(b));
    }
    let solved = SlopeInputs { along: &along, incoming: &incoming, largest, direct };
    let mut slopes = slopes(links.faces, caster, &solved, pool)?;
    let of_lamps = lamps.map_or(&[][..], |lamps| &lamps.slopes);
    slopes.iter_mut().zip(of_lamps).for_each(|(sum, of_lamps)| *sum = [0, 1].map(|k| sum[k] + of_lamps[k]));
    Some(slopes)
}

/// What comes straight from emitters, where shadow rays bring it, and from lamps.
pub(super) fn straight(emitted: Option<Vec<Vec<f64>>>, lamps: Option<&DirectLight>) -> Straight {
    let has_emitted = emitted.is_some();
    let sum = |emitted: Vec<f64>, lamps: &Vec<f64>| emitted.iter().zip(lamps).map(|(a, b)| a + b).collect();
    let irradiance = match (emitted, lamps) {
        (emitted, None) => emitted,
        (None, Some(lamps)) => Some(lamps.irradiance.clone()),
        (Some(emitted), Some(lamps)) => Some(
            emitted.into_iter().zip(&lamps.irradiance).map(|(emitted, lamps)| sum(emitted, lamps)).collect(),
        ),
    };
    Straight { irradiance, has_emitted }
}

/// What links say.
struct LinkEstimates {
    /// B, or b beside direct light, channel by channel [W/m²].
    radiosity: Vec<Vec<f64>>,
    /// H, channel by channel [W/m²].
    irradiance: Vec<Vec<f64>>,
    /// The power that escapes and that ends on backs, by channel [W].
    lost: Vec<[f64; 2]>,
}

impl LinkEstimates {
    /// What all rays have found, without the bias that the halves tell. No irradiance is below 0, or above the largest where all light is
    /// emitted by faces.
    fn beyond(mut self, halves: [Self; 2], faces: &FaceTable, beside: bool) -> Self {
        let is_bounded = faces.scene.lamp_count() == 0;
        let largest = if is_bounded { largest_radiosity(faces.scene) } else { [f64::INFINITY; 3] };
        for (c, irradiance) in self.irradiance.iter_mut().enumerate() {
            for (i, h) in irradiance.iter_mut().enumerate() {
                let met = !beside && faces.list[i].emittance[c] > 0.0;
                let of_halves = halves.each_ref().map(|half| half.irradiance[c][i]);
                *h = extrapolated(*h, of_halves, met).clamp(0.0, largest[c]);
            }
        }
        for (c, lost) in self.lost.iter_mut().enumerate() {
            for (way, lost) in lost.iter_mut().enumerate() {
                *lost = extrapolated(*lost, halves.each_ref().map(|half| half.lost[c][way]), false).max(0.0);
            }
        }
        self
    }
}

/// Solves the system of links.
fn solved(
    links: &Links,
    rays: &LinkRays,
    (direct, lamps): (Option<&Direct>, Option<&DirectLight>),
    (start, residual): (&[Vec<f64>], f64),
    pool: &dyn ThreadPool,
) -> Option<LinkEstimates> {
    let FaceTable { list, areas, .. } = links.faces;
    let emitted = direct.map(|direct| direct.irradiance(rays));
    let lost_of_emitted = emitted.as_ref().map(|emitted| {
        let of_channel = |(c, straight): (usize, &Vec<f64>)| {
            let arrives: f64 = straight.iter().zip(areas).map(|(h, area)| h * area).sum();
            let emittance: Vec<f64> = list.iter().map(|face| face.emittance[c]).collect();
            shared_out(emitted_power(links.faces, c) - arrives, links.lost_power(&emittance))
        };
        emitted.iter().enumerate().map(of_channel).collect::<Vec<_>>()
    });
    let straight = straight(emitted, lamps);
    let mut radiosity = solve(links, &straight, start, residual, pool)?;
    if radiosity.iter().any(|b| differences(b) < EVEN) {
        radiosity = solve(links, &straight, &radiosity, FINEST, pool)?;
    }
    let irradiance =
        radiosity.iter().enumerate().map(|(c, b)| links.irradiance(c, &straight, b, pool)).collect();
    let lost = radiosity.iter().enumerate().map(|(c, b)| {
        let of_emitted = lost_of_emitted.as_ref().map_or([0.0; 2], |lost| lost[c]);
        let (of_lamps, of_links) = (lamps.map_or([0.0; 2], |lamps| lamps.lost[c]), links.lost_power(b));
        [0, 1].map(|way| of_emitted[way] + of_links[way] + of_lamps[way])
    });
    let lost = lost.collect();
    Some(LinkEstimates { radiosity, irradiance, lost })
}

/// The largest difference of the light of faces, relative to the most of it; 1 where there is none.
fn differences(radiosity: &[f64]) -> f64 {
    let (low, high) =
        radiosity.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &b| (low.min(b), high.max(b)));
    if high > 0.0 { (high - low) / high } else { 1.0 }
}

/// The power that does not arrive, in proportion to what the rays of emitters say of the two ways in which it is lost.
fn shared_out(lost: f64, ways: [f64; 2]) -> [f64; 2] {
    match (lost.max(0.0), ways[0] + ways[1]) {
        (lost, sum) if sum > 0.0 => ways.map(|way| lost * way / sum),
        (lost, _) => [lost, 0.0],
    }
}
