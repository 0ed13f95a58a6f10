//! Light that the rays of sensors and of a final gather may not have met yet: that of small bright faces.
//!
//! A ray brings what the face that it meets sends, B_j with probability F_j. Where few rays would meet a bright face, most runs have none of them,
//! and the spread of the others says nothing of it. Of these faces B_j is known by walks, and F_j has a bound by geometry.

use std::f64::consts::PI;

use glam::DVec3;

use super::Experiment;
use super::solution::Estimates;
use crate::geometry::sensor::{Response, SensorCell, Sensors};
use crate::jacobi::faces::FaceTable;
use crate::jacobi::final_gather::LIGHT_BY_SHADOW_RAYS;
use crate::jacobi::lamps::emitted_shares;
use crate::scene::Scene;
use crate::tally::Tally;

/// The most faces that are kept for each channel, the brightest; those that are left out count as the brightest of them with any form factor.
const MOST_FACES: usize = 4096;

/// A ball that holds a face, or the place that rays set out from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    middle: DVec3,
    radius: f64,
    /// The normal of the side that sends or takes light; `None` where it has several.
    normal: Option<DVec3>,
}

/// A parallelogram is taken in this many parts along each edge, so that what is near one end of it is not near all of it.
const PARTS: u32 = 8;

impl Ball {
    /// About the parts of a face.
    pub(super) fn of_parts_of(scene: &Scene, face: usize) -> Vec<Ball> {
        let whole = Ball::of_face(scene, face);
        let mut pieces = scene.faces().pieces(face).map(|piece| scene.faces().piece_corners(piece));
        match (pieces.next(), pieces.next()) {
            (Some(corners), None) if corners.len() == 4 => {
                let corners = std::array::from_fn(|i| corners[i]);
                Ball::of_parts(corners, whole.normal)
            }
            _ => vec![whole],
        }
    }

    /// About the parts of a parallelogram.
    fn of_parts([a, b, _, d]: [DVec3; 4], normal: Option<DVec3>) -> Vec<Ball> {
        let [u, v] = [b - a, d - a].map(|edge| edge / f64::from(PARTS));
        let radius = 0.5 * (u + v).length().max((u - v).length());
        let part = |i: u32| a + (f64::from(i / PARTS) + 0.5) * u + (f64::from(i % PARTS) + 0.5) * v;
        (0..PARTS * PARTS).map(|i| Ball { middle: part(i), radius, normal }).collect()
    }

    /// About a face.
    fn of_face(scene: &Scene, face: usize) -> Ball {
        let faces = scene.faces();
        let corners = || faces.pieces(face).flat_map(|piece| faces.piece_corners(piece).to_vec());
        let [low, high] = corners()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        let middle = 0.5 * (low + high);
        let radius = corners().fold(0.0, |radius: f64, at| radius.max(at.distance(middle)));
        let normal = || {
            let [a, b, c] = *faces.piece_corners(faces.pieces(face).next()?).first_chunk()?;
            (b - a).cross(c - a).try_normalize()
        };
        Ball { middle, radius, normal: if faces.may_see_itself(face) { None } else { normal() } }
    }

    /// About a point of a sensor, or the parts of one of its cells.
    fn of_cell(sensors: &Sensors, cell: usize) -> Vec<Ball> {
        let known @ SensorCell { middle, normal, .. } = sensors.cell(cell);
        let is_flat = matches!(sensors.response(&known), Response::Flat { .. });
        let normal = is_flat.then_some(normal);
        match sensors.corners(cell) {
            Some(corners) => Ball::of_parts(corners, normal),
            None => vec![Ball { middle, radius: 0.0, normal }],
        }
    }

    /// A bound on F from here to a face of this area in a ball: nothing is in the way, and both ends are as near and as upright as they can be.
    fn form_factor(&self, to: &Ball, area: f64) -> f64 {
        let way = to.middle - self.middle;
        let height = |normal: Option<DVec3>, way: DVec3, slack: f64| {
            normal.map_or(f64::INFINITY, |normal| normal.dot(way) + slack)
        };
        let leaves = height(self.normal, way, self.radius + to.radius);
        let arrives = height(to.normal, -way, self.radius);
        let nearest = way.length() - self.radius - to.radius;
        if leaves <= 0.0 || arrives <= 0.0 {
            0.0
        } else if nearest <= 0.0 {
            1.0
        } else {
            let cos = |height: f64| (height / nearest).min(1.0);
            (area * cos(leaves) * cos(arrives) / (PI * nearest * nearest)).min(1.0)
        }
    }
}

/// A face with what it sends in one way: what it reflects, or what it emits.
#[derive(Clone, Debug)]
struct BrightFace {
    /// What it sends [W/m²].
    radiosity: f64,
    /// Its area [m²].
    area: f64,
    ball: Ball,
    /// About its parts.
    parts: Vec<Ball>,
    /// The shadow rays that look for what it emits, for each gathering ray; 0 of what it reflects.
    shadow_rays: f64,
}

impl BrightFace {
    /// Bounds on F from a place to it, by its parts where it is near: of the whole, and of the whole if all of it were as its nearest part.
    fn form_factor_from(&self, place: &Ball) -> [f64; 2] {
        if place.middle.distance(self.ball.middle) > 4.0 * (place.radius + self.ball.radius) {
            return [place.form_factor(&self.ball, self.area); 2];
        }
        let parts = self.parts.len() as f64;
        let [sum, largest] = self.parts.iter().fold([0.0, 0.0_f64], |[sum, largest], part| {
            let factor = place.form_factor(part, self.area / parts);
            [sum + factor, largest.max(factor)]
        });
        [sum.min(1.0), (parts * largest).min(1.0)]
    }

    /// What one ray brings that meets it from one of some places, at most, and how likely a ray of theirs does, at most. By the balance heuristic a ray that
    /// meets what is emitted brings B·F/(F + σ), σ being the shadow rays that go there for each gathering ray.
    fn size_and_chance(&self, places: &[Ball]) -> (f64, f64) {
        let [sum, largest] = places.iter().fold([0.0, 0.0_f64], |[sum, largest], place| {
            let [factor, of_nearest] = self.form_factor_from(place);
            [sum + factor, largest.max(of_nearest)]
        });
        if largest <= 0.0 {
            return (0.0, 0.0);
        }
        let size = self.radiosity * largest / (largest + self.shadow_rays);
        (size, self.radiosity * sum / places.len() as f64 / size)
    }
}

/// The brightest faces of a scene in one channel, the brightest first.
#[derive(Clone, Debug)]
pub(super) struct BrightFaces {
    faces: Vec<BrightFace>,
    /// The radiosity of the brightest face that is left out [W/m²].
    rest: f64,
}

impl BrightFaces {
    /// Those of a tally, channel by channel; a source, where sources are distinguished, counts as much as `factor` says.
    pub(super) fn of(experiment: &Experiment, tally: &Tally, factor: impl Fn(usize) -> f64) -> Vec<Self> {
        let (scene, channels) = (experiment.scene(), experiment.scene().channels());
        let reflected = experiment.reflected_by_tally(tally);
        let of_face = reflected.len() / scene.faces().len();
        let sources = experiment.sources_of_light();
        let shares = emitted_shares(&FaceTable::new(scene));
        let of_channel = |c: usize| {
            let light = scene.faces().iter().enumerate().flat_map(|(i, face)| {
                let by_source = reflected[i * of_face..][..of_face].iter().skip(c).step_by(channels);
                let reflected = by_source.enumerate().map(|(source, light)| factor(source) * light).sum();
                let source = sources.as_ref().map_or(0, |sources| sources.of_emitter[i]);
                let shadow_rays = LIGHT_BY_SHADOW_RAYS * shares.get(i).copied().unwrap_or(0.0);
                [(i, reflected, 0.0), (i, factor(source) * face.emittance[c], shadow_rays)]
            });
            BrightFaces::new(scene, light.filter(|&(_, radiosity, _)| radiosity > 0.0).collect())
        };
        (0..channels).map(of_channel).collect()
    }

    /// What faces may reflect that gathering walks from there have not met, channel by channel; `None` of other methods, whose light comes from emitters.
    pub(super) fn unmet_by_walks(
        experiment: &Experiment,
        tally: &Tally,
        confidence: f64,
    ) -> Option<Vec<Self>> {
        experiment.gathers().then(|| {
            let (scene, estimates) = (&experiment.scene, Estimates::new(experiment, tally, confidence));
            let of_channel = |c: usize| {
                let faces = scene.faces().iter().enumerate();
                let light =
                    faces.filter_map(|(i, face)| Some((i, estimates.unmet_by_walks((i, &face), c)?, 0.0)));
                BrightFaces::new(scene, light.filter(|&(_, unmet, _)| unmet > 0.0).collect())
            };
            (0..scene.channels()).map(of_channel).collect()
        })
    }

    fn new(scene: &Scene, mut light: Vec<(usize, f64, f64)>) -> Self {
        let brighter = |a: &(usize, f64, f64), b: &(usize, f64, f64)| {
            b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)).then(a.2.total_cmp(&b.2))
        };
        let mut rest = 0.0;
        if light.len() > MOST_FACES {
            light.select_nth_unstable_by(MOST_FACES, brighter);
            rest = light[MOST_FACES].1;
            light.truncate(MOST_FACES);
        }
        light.sort_unstable_by(brighter);
        let bright = |(i, radiosity, shadow_rays)| {
            let area = scene.faces().get(i).area;
            let (ball, parts) = (Ball::of_face(scene, i), Ball::of_parts_of(scene, i));
            BrightFace { radiosity, area, ball, parts, shadow_rays }
        };
        BrightFaces { faces: light.into_iter().map(bright).collect(), rest }
    }

    /// The most that one of the faces may bring to the mean of some places. Where walks from many faces have met none of some light, all that they may have
    /// missed together is as much as one of them may have missed alone: chances add up to one chance.
    pub(super) fn most_of_one(&self, places: &[Ball]) -> f64 {
        let mut most = self.rest;
        for face in &self.faces {
            if face.radiosity <= most {
                break;
            }
            let sum: f64 = places.iter().map(|place| face.form_factor_from(place)[0]).sum();
            most = most.max(face.radiosity * sum / places.len() as f64);
        }
        most
    }

    /// What faces may bring to the mean of some places, beyond `seen` for each ray, that no ray of M has met: max Σ(s_j − x)⁺q_j over the sizes s_j of what one
    /// ray brings and chances q_j, each no more than geometry allows, with Σq_j ≤ p, where (1 − p)^M is `tail`.
    pub(super) fn unmet(&self, places: &[Ball], seen: f64, (rays, tail): (f64, f64)) -> f64 {
        let least = self.rest.max(seen);
        let bright = self.faces.iter().take_while(|face| face.radiosity > least);
        let mut sizes: Vec<(f64, f64)> =
            bright.map(|face| face.size_and_chance(places)).filter(|&(size, _)| size > least).collect();
        sizes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let (mut budget, mut light) = (stats::unmet_chance(rays, tail), 0.0);
        for (size, chance) in sizes {
            let chance = chance.min(budget);
            light += (size - seen) * chance;
            budget -= chance;
        }
        // What is left of the budget is that of faces that are left out.
        light + (least - seen) * budget
    }
}

/// Where the rays of some cells of sensors set out from.
pub(super) fn balls_of_cells(sensors: &Sensors, cells: std::ops::Range<usize>) -> Vec<Ball> {
    cells.flat_map(|cell| Ball::of_cell(sensors, cell)).collect()
}

/// Faces that are brighter than the mean by no more than this are too common to be missed, or too dim to matter. A choice: with 1, intervals of a coloured
/// cube's patches cover in 96.7 %, with 4 in 96.4 ± 0.4 % (`tests/suite/final_gather.rs`).
const COMMON: f64 = 4.0;

/// What rays have seen: Σx²/Σx of the single rays that a mean is of, given its standard error and their number, and [`COMMON`] times the mean at
/// least.
pub(super) fn seen_by_rays(mean: f64, error: f64, rays: f64) -> f64 {
    (mean + error * error * rays / mean).max(COMMON * mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(middle: [f64; 3], radius: f64, normal: [f64; 3]) -> Ball {
        Ball { middle: middle.into(), radius, normal: Some(normal.into()) }
    }

    /// From a point a disc of radius r at height h has F = r²/(r² + h²); a bound is above that, and near it where the disc is small.
    #[test]
    fn bounds_of_form_factors_are_above_them_and_near_those_of_small_faces() {
        let floor = ball([0.0; 3], 0.0, [0.0, 0.0, 1.0]);
        for r in [0.01, 0.1, 0.5, 1.0, 3.0] {
            let disc = ball([0.0, 0.0, 2.0], r, [0.0, 0.0, -1.0]);
            let (bound, exact) = (floor.form_factor(&disc, PI * r * r), r * r / (r * r + 4.0));
            assert!(bound >= exact && (r > 0.1 || bound < 1.2 * exact), "{r}: {bound}, {exact}");
        }
        let behind = ball([0.0, 0.0, -2.0], 0.1, [0.0, 0.0, 1.0]);
        let away = ball([0.0, 0.0, 2.0], 0.1, [0.0, 0.0, 1.0]);
        assert_eq!([behind, away].map(|face| floor.form_factor(&face, 0.03)), [0.0; 2]);
    }

    /// The brightest face takes what it may of the budget, the next one the rest; shadow rays bring less each.
    #[test]
    fn what_is_unmet_is_the_brightest_that_rays_may_have_missed() {
        let floor = ball([0.0; 3], 0.0, [0.0, 0.0, 1.0]);
        let face = |radiosity, r: f64, shadow_rays| BrightFace {
            radiosity,
            area: PI * r * r,
            ball: ball([0.0, 0.0, 2.0], r, [0.0, 0.0, -1.0]),
            parts: vec![ball([0.0, 0.0, 2.0], r, [0.0, 0.0, -1.0])],
            shadow_rays,
        };
        let unmet = |faces, seen| BrightFaces { faces, rest: 0.0 }.unmet(&[floor], seen, (1000.0, 0.025));
        let budget = -(0.025_f64.ln() / 1000.0).exp_m1();
        assert!((unmet(vec![face(100.0, 1.0, 0.0)], 10.0) - 90.0 * budget).abs() < 1e-12);
        let small = face(100.0, 0.01, 0.0);
        let [chance, _] = small.form_factor_from(&floor);
        let both = unmet(vec![small, face(50.0, 1.0, 0.0)], 10.0);
        assert!((both - 90.0 * chance - 40.0 * (budget - chance)).abs() < 1e-12, "{both}");
        assert_eq!(unmet(vec![face(100.0, 1.0, 0.0)], 100.0), 0.0);
        let lamp = unmet(vec![face(100.0, 0.01, 1.0)], 0.0);
        let size = 100.0 * chance / (chance + 1.0);
        assert!((lamp - size * budget).abs() < 1e-12 && lamp < 0.02 * 100.0 * chance, "{lamp}");
    }
}
