//! The light at points of all faces, by two references of independent walks on small cells. Products of what both say have no bias.

use std::thread;

use radiosity::{Estimates, Scene, Side};

use super::runs::{ChoiceRoom, experiment, walk};
use crate::walking::Failure;

/// Points on all faces together.
const POINTS: f64 = 100_000.0;

/// The cells of a reference, all faces together, and the shortest of their edges [m].
const CELLS: f64 = 200_000.0;

/// Light below this part of the mean counts as so much, where errors are relative to the light of a place.
const DIM: f64 = 0.1;

/// A place on one side of a surface.
struct RoomPoint {
    surface: u32,
    side: Side,
    uv: [f64; 2],
    /// The area that it stands for [m²].
    area: f64,
}

/// What is known of the light of a room.
pub struct RoomReference {
    points: Vec<RoomPoint>,
    /// The reflected light, by point and channel, as each reference tells [W/m²].
    light: [Vec<f64>; 2],
    channels: usize,
    /// Walks of a reference.
    pub walks: u64,
}

impl RoomReference {
    /// Walks the references of a room, side by side.
    pub fn new(room: &ChoiceRoom, walks: u64) -> Result<Self, Failure> {
        let size = (room.area / CELLS).sqrt();
        let (fine, _) = experiment(room, room.even(size, true), &[])?;
        let points = points(fine.scene());
        let tallies = thread::scope(|scope| {
            let fine = &fine;
            let threads = [101, 102].map(|seed| scope.spawn(move || walk(fine, seed, walks)));
            threads.map(|thread| thread.join().expect("walks do not panic"))
        });
        let estimates = tallies.each_ref().map(|tally| Estimates::new(&fine, tally, 0.95));
        let light = estimates.each_ref().map(|estimates| light_at(&points, estimates));
        Ok(RoomReference { points, light, channels: fine.scene().channels(), walks })
    }

    /// Errors of what is told of the light: root mean squares over the area, relative to the light, and relative to the light of each place or
    /// [`DIM`] of the mean light, where that is more; there no place counts for more than all of its light.
    pub fn errors(&self, told: &Estimates<'_>) -> [f64; 2] {
        let told = light_at(&self.points, told);
        let dim = DIM * self.mean();
        let (mut off, mut all) = ([0.0; 2], [0.0; 2]);
        for (k, told) in told.iter().enumerate() {
            let [one, other] = [self.light[0][k], self.light[1][k]];
            let area = self.points[k / self.channels].area;
            let square = area * (told - one) * (told - other);
            let light = (0.5 * (one + other)).max(dim);
            for (k, [part, whole]) in [
                [square, area * one * other],
                [area * (square / (area * light * light)).clamp(-1.0, 1.0), area],
            ]
            .iter()
            .enumerate()
            {
                off[k] += part;
                all[k] += if one + other > 0.0 { *whole } else { 0.0 };
            }
        }
        [0, 1].map(|k| (off[k].max(0.0) / all[k]).sqrt())
    }

    /// The mean light over all places that have some.
    fn mean(&self) -> f64 {
        let (mut light, mut area) = (0.0, 0.0);
        for (k, both) in self.light[0].iter().zip(&self.light[1]).enumerate() {
            let here = self.points[k / self.channels].area;
            light += 0.5 * here * (both.0 + both.1);
            area += if both.0 + both.1 > 0.0 { here } else { 0.0 };
        }
        light / area
    }
}

/// Points of all faces that reflect, by a sequence of even spread (R₂) on each.
fn points(scene: &Scene) -> Vec<RoomPoint> {
    let area: f64 = scene.surfaces().iter().map(|surface| surface.area()).sum();
    let mut points = Vec::new();
    for (number, surface) in (0..).zip(scene.surfaces()) {
        let count = (POINTS * surface.area() / area).ceil();
        for side in [Side::Front, Side::Back].into_iter().filter(|&side| surface.is_active(side)) {
            for k in 0..count as u32 {
                let [mut u, mut v] =
                    [0.754_877_666, 0.569_840_290].map(|step: f64| (0.5 + step * f64::from(k)).fract());
                if surface.is_triangle() && u + v > 1.0 {
                    [u, v] = [1.0 - u, 1.0 - v];
                }
                points.push(RoomPoint { surface: number, side, uv: [u, v], area: surface.area() / count });
            }
        }
    }
    points
}

/// The reflected light at points, as pictures show it.
fn light_at(points: &[RoomPoint], told: &Estimates<'_>) -> Vec<f64> {
    let scene = told.scene();
    let mut light = Vec::with_capacity(points.len() * scene.channels());
    for &RoomPoint { surface: number, side, uv, .. } in points {
        let surface = &scene.surfaces()[number as usize];
        let piece = surface.piece(surface.cell_at(uv), side);
        let face = scene.faces().face_of(piece) as usize;
        let (known, slopes) = (told.told(face), told.slopes(face));
        let place =
            slopes.as_ref().map(|_| on_fit(scene, surface.piece(surface.cell_at(uv), Side::Front), uv));
        light.extend((0..scene.channels()).map(|channel| {
            let mean =
                known.1.map_or(0.0, |known| known[channel].radiosity - face_emittance(scene, face, channel));
            let slope =
                slopes.as_ref().zip(place).map_or(0.0, |(slopes, place)| slopes[channel].at(&[place])[0]);
            if mean.is_finite() { mean + slope } else { 0.0 }
        }));
    }
    light
}

fn face_emittance(scene: &Scene, face: usize, channel: usize) -> f64 {
    scene.faces().get(face).emittance[channel]
}

/// By what factors the gradients of a face count at a point of a piece.
fn on_fit(scene: &Scene, piece: u32, uv: [f64; 2]) -> [f64; 2] {
    let weights = scene.faces().corner_weights(piece, uv);
    let corners = scene.corners_on_fit(piece);
    [0, 1].map(|k| corners.iter().zip(weights).map(|(corner, weight)| weight * corner[k]).sum())
}
