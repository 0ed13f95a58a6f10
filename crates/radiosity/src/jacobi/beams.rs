//! Light of lamps without area, which no ray of a chain meets, straight on faces.
//!
//! A shadow ray from a uniform point of a face brings I cos θ/d², which varies without bound on a face that is near. There rays that are
//! born at the lamp bring its power in equal parts. Which of both lights a face is a matter of geometry alone, so that neither has a bias.

use glam::DVec3;

use super::cast::systematic;
use super::faces::FaceTable;
use super::numbers::RayNumbers;
use super::place::{LocalPoint, psi};
use crate::geometry::sensor::Response;
use crate::random::rng::WalkRng;
use crate::scene::Scene;
use crate::simd::batch::WIDTH;
use crate::trace::ray::{Hit, Ray};

/// One in this many rays of a chain is born at a lamp.
const BIRTH_SHARE: u64 = 16;

/// At most one in this many is a shadow ray.
const SHADOW_SHARE: u64 = 4;

/// What 32 random bits more would be in the mean.
const MIDDLE: u64 = 1 << 31;

/// Nearer than this many radii of a face its distances to a lamp differ much.
const NEAR: f64 = 2.0;

/// What lamps bring to the faces of one chain.
pub(super) struct DirectLight {
    /// H of every face, channel by channel [W/m²].
    pub(super) irradiance: Vec<Vec<f64>>,
    /// The means of H·ψ₁ and H·ψ₂ [W/m²], face-major and channel-minor.
    pub(super) slopes: Vec<[f64; 2]>,
    /// The power that escapes and that ends on backs, by channel [W].
    pub(super) lost: Vec<[f64; 2]>,
    /// The rays that it took.
    pub(super) rays: u64,
}

impl DirectLight {
    /// The light of the lamps of a scene, where it has any, for a chain of `rays` rays in all. `None` in place of an answer once `go_on`
    /// says no.
    pub(super) fn of(
        faces: &FaceTable,
        rng: &mut WalkRng,
        rays: u64,
        go_on: &dyn Fn() -> bool,
    ) -> Option<Option<Self>> {
        let (scene, count) = (faces.scene, faces.list.len());
        let lamps = scene.lamp_count() as u64;
        if lamps == 0 {
            return Some(None);
        }
        let channels = scene.channels();
        let mut light = DirectLight {
            irradiance: vec![vec![0.0; count]; channels],
            slopes: vec![[0.0; 2]; count * channels],
            lost: vec![[0.0; 2]; channels],
            rays: 0,
        };
        let mut numbers = RayNumbers::independent(rng);
        let mut shadow_numbers = RayNumbers::independent(rng);
        // Of very many lamps each face is lit by births alone.
        let pairs = count as u64 * lamps;
        let shadows = if pairs > rays / SHADOW_SHARE { 0 } else { rays / (2 * SHADOW_SHARE) / pairs + 1 };
        let spheres: Vec<(DVec3, f64)> = (0..count).map(|face| sphere(scene, face)).collect();
        let is_far = |lamp: usize, face: usize| {
            let (middle, radius) = spheres[face];
            shadows > 0 && scene.parts.lamps.distance(lamp, middle) > NEAR * radius
        };
        let part = |lamp: usize| {
            (0..channels)
                .map(|c| scene.lamp_power(lamp, c) / scene.total_power(c).max(f64::MIN_POSITIVE))
                .sum()
        };
        let parts: Vec<f64> = (0..scene.lamp_count()).map(part).collect();
        let births = systematic(&parts, rays / BIRTH_SHARE, 0.5);
        for lamp in (0..scene.lamp_count()).filter(|&lamp| parts[lamp] > 0.0) {
            numbers.leave(lamp as u32, 0);
            light.bear(
                faces,
                lamp,
                u64::from(births[lamp]) + 1,
                &mut numbers,
                &|face| is_far(lamp, face),
                go_on,
            )?;
            for face in (0..count).filter(|&face| is_far(lamp, face)) {
                shadow_numbers.leave((lamp * count + face) as u32, 0);
                light.shade(faces, [lamp, face], shadows, &mut shadow_numbers);
                if face % WIDTH == 0 && !go_on() {
                    return None;
                }
            }
        }
        Some(Some(light))
    }

    /// Rays that are born at a lamp light the faces that are not far from it.
    fn bear(
        &mut self,
        faces: &FaceTable,
        lamp: usize,
        rays: u64,
        numbers: &mut RayNumbers,
        is_far: &dyn Fn(usize) -> bool,
        go_on: &dyn Fn() -> bool,
    ) -> Option<()> {
        let scene = faces.scene;
        self.rays += rays;
        for first in (0..rays).step_by(WIDTH) {
            let len = (rays - first).min(WIDTH as u64) as usize;
            (0..len).for_each(|i| numbers.draw(i));
            let [a, b, c, d] = numbers.points(scene.parts.isa);
            let bits =
                |i: usize| [(a[i], b[i]), (c[i], d[i])].map(|(x, y)| u64::from(x) << 32 | u64::from(y));
            // Of tables the first number chooses the cell, and the second where in it; of distant discs both choose the place.
            let cell = |i: usize| u64::from(a[i]) << 32 | MIDDLE;
            let born = |i: usize| scene.lamp_birth(lamp, [cell(i), bits(i)[0], bits(i)[1]]);
            let born: Vec<Ray> = (0..len).map(born).collect();
            for hit in scene.closest_hits(&born) {
                let lost = match hit {
                    Some(hit) if scene.surfaces()[hit.surface as usize].is_active(hit.side) => {
                        let Hit { surface, uv, side, .. } = hit;
                        let cell = scene.surfaces()[surface as usize].cell_at(uv);
                        let face = scene.face_at(surface, cell, side) as usize;
                        if !is_far(face) {
                            let per_area = 1.0 / (rays as f64 * faces.areas[face]);
                            self.add(scene, (face, (surface, uv)), |c| scene.lamp_power(lamp, c) * per_area);
                        }
                        continue;
                    }
                    Some(_) => 1,
                    None => 0,
                };
                for (c, ways) in self.lost.iter_mut().enumerate() {
                    ways[lost] += scene.lamp_power(lamp, c) / rays as f64;
                }
            }
            if !go_on() {
                return None;
            }
        }
        Some(())
    }

    /// Shadow rays from uniform points of a face to a lamp.
    fn shade(&mut self, faces: &FaceTable, [lamp, number]: [usize; 2], rays: u64, numbers: &mut RayNumbers) {
        let (scene, face) = (faces.scene, &faces.list[number]);
        self.rays += rays;
        for first in (0..rays).step_by(WIDTH) {
            let len = (rays - first).min(WIDTH as u64) as usize;
            (0..len).for_each(|i| numbers.draw(i));
            let [across, along, polar, turn] = numbers.points(scene.parts.isa);
            for i in 0..len {
                let bits = |x: u32, y: u32| u64::from(x) << 32 | u64::from(y);
                let cell = scene.cell_of(face);
                let (surface, uv) = scene.scatter(cell, number as u32, bits(across[i], along[i]));
                let of_surface = &scene.surfaces()[surface as usize];
                let response = Response::Flat { facing: of_surface.normal() * face.side.sign() };
                let (point, bits) = (of_surface.point(uv), bits(polar[i], turn[i]));
                if let Some(light) = scene.lamp_light(lamp, point, response, surface, bits) {
                    self.add(scene, (number, (surface, uv)), |c| light[c] / rays as f64);
                }
            }
        }
    }

    fn add(&mut self, scene: &Scene, (face, place): (usize, LocalPoint), light: impl Fn(usize) -> f64) {
        let (channels, psi) = (self.irradiance.len(), psi(scene, place));
        for (c, irradiance) in self.irradiance.iter_mut().enumerate() {
            let light = light(c);
            irradiance[face] += light;
            let slopes = self.slopes[face * channels + c].iter_mut();
            slopes.zip(psi).for_each(|(slope, psi)| *slope += light * psi);
        }
    }
}

/// A sphere about a face, in the coordinates of the scene: its middle, and its radius [m].
fn sphere(scene: &Scene, face: usize) -> (DVec3, f64) {
    let corners = || scene.faces().pieces(face).flat_map(|piece| scene.faces().piece_corners(piece));
    let (sum, count) = corners().fold((DVec3::ZERO, 0.0), |(sum, count), corner| (sum + corner, count + 1.0));
    let middle = sum / count;
    let radius = corners().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
    (middle - scene.origin(), radius)
}
