//! Chains that forget no ray: each is remembered as a *link* between the face that shot it and the one it met, good for
//! light in both directions, and iterations run on all links of the chain until nothing changes: the same rays serve
//! every bounce, energy is conserved to the last link, and what varies is not B but its differences along links.
//!
//! How many rays each face shoots is known before the chain begins (`aim.rs`): were it chosen by what the chain's own rays have found, these
//! would weigh less where they have found much, and links would have a bias.

use super::aim::aimed;
use super::board::largest_radiosity;
use super::cast::Caster;
use super::direct::Direct;
use super::faces::{FaceTable, face_major};
use super::halves::{Half, LinkRays, cast_halves, extrapolated};
use super::links::Links;
use super::near::Landed;
use super::numbers::SobolNumbers;
use super::outcome::ChainOutcome;
use super::solve::solve;
use super::spread::{SlopeInputs, slopes};
use crate::hands::Hands;
use crate::random::rng::WalkRng;

/// A chain is solved to this residual, over the square root of its rays.
const RESIDUAL: f64 = 1e-3;

/// One chain of `rays` rays, each face's along its own Sobol sequence, of which each face shoots the part `aim`. `None` once `hands`, which
/// share the rays and the solution, no longer want it.
pub(crate) fn chain(
    faces: &FaceTable,
    rng: WalkRng,
    (rays, aim): (u64, &[f64]),
    with_slopes: bool,
    hands: &dyn Hands,
) -> Option<ChainOutcome> {
    let mut caster = Caster::new(faces, SobolNumbers::new(rng));
    let mut direct = Direct::where_it_pays(faces, rays, hands)?;
    if let Some(direct) = &mut direct {
        direct.cast(caster.rng(), with_slopes, hands)?;
    }
    let rays = rays - direct.as_ref().map_or(0, Direct::rays);
    let bounds = direct.as_ref().map(Direct::bounds);
    let mut halves = [0, 1].map(|_| Half::new(Landed::new(faces.areas.len(), bounds), faces.areas.len()));
    let offset = caster.rng().pair()[0];
    let more = aimed(aim, &caster.shot, rays, offset);
    cast_halves(&mut halves, &mut caster, &more, hands)?;
    let whole = LinkRays::of_both(&halves, &caster);
    let (links, residual) = (whole.links(faces), RESIDUAL / (rays as f64).sqrt());
    let of_links = |links: &Links, rays: &LinkRays, start: &[Vec<f64>]| {
        solved(links, rays, direct.as_ref(), (start, residual), hands)
    };
    let mut found = of_links(&links, &whole, &[])?;
    let radiosity = std::mem::take(&mut found.radiosity);
    let of_half = |half: &Half| {
        let half = half.rays();
        of_links(&half.links(faces), &half, &radiosity)
    };
    let found = found.beyond([of_half(&halves[0])?, of_half(&halves[1])?], faces, direct.is_some());
    let mut outcome = ChainOutcome::new(faces, &caster, &found.irradiance, &found.lost);
    if let Some(direct) = &direct {
        outcome = outcome.with_shadow_rays(direct.rays());
    }
    if with_slopes {
        outcome.slopes = spread_of((&links, &caster), &radiosity, direct.as_ref(), hands)?;
    }
    Some(outcome)
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
    let solved = SlopeInputs { along: &along, incoming: &incoming, largest, direct };
    slopes(links.faces, caster, &solved, hands)
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
    /// What all rays have found, without the bias that the halves tell. No irradiance is below 0 or above `largest`.
    fn beyond(mut self, halves: [Self; 2], faces: &FaceTable, beside: bool) -> Self {
        let largest = largest_radiosity(faces.scene);
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
    direct: Option<&Direct>,
    (start, residual): (&[Vec<f64>], f64),
    hands: &dyn Hands,
) -> Option<LinkEstimates> {
    let FaceTable { scene, list, areas } = links.faces;
    let straight = direct.map(|direct| direct.irradiance(rays));
    let radiosity = solve(links, straight.as_deref(), start, residual, hands)?;
    let channels = || radiosity.iter().enumerate();
    let (irradiance, lost) = match &straight {
        None => {
            let irradiance = channels().map(|(c, b)| links.irradiance(c, b, hands)).collect();
            (irradiance, channels().map(|(_, b)| links.lost_power(b)).collect())
        }
        Some(straight) => {
            let irradiance =
                channels().map(|(c, b)| links.irradiance_beside(c, &straight[c], b, hands)).collect();
            let lost = channels().map(|(c, b)| {
                let arrives: f64 = straight[c].iter().zip(areas).map(|(h, area)| h * area).sum();
                let emittance: Vec<f64> = list.iter().map(|face| face.emittance[c]).collect();
                let of_emitted = shared_out(scene.total_power(c) - arrives, links.lost_power(&emittance));
                let of_reflected = links.lost_power(b);
                [0, 1].map(|way| of_emitted[way] + of_reflected[way])
            });
            (irradiance, lost.collect())
        }
    };
    Some(LinkEstimates { radiosity, irradiance, lost })
}

/// The power that does not arrive, in proportion to what the rays of emitters say of the two ways in which it is lost.
fn shared_out(lost: f64, ways: [f64; 2]) -> [f64; 2] {
    match (lost.max(0.0), ways[0] + ways[1]) {
        (lost, sum) if sum > 0.0 => ways.map(|way| lost * way / sum),
        (lost, _) => [lost, 0.0],
    }
}
