//! The light at points of all faces, by two references of independent walks on small patches. Products of what both say have no bias.

use std::path::Path;
use std::{fs, thread};

use radiosity::{Estimates, Experiment, Scene, Side};

use super::runs::{ChoiceRoom, experiment, on_chosen, walk};
use crate::walking::Failure;

/// Points on all faces together.
const POINTS: f64 = 100_000.0;

/// The patches of a reference are chosen for this many times its walks: cells of one size are too large beside lamps.
const FINER: u64 = 8;

/// Light below this part of the mean counts as this part, where errors are relative to the light of a place.
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
}

impl RoomReference {
    /// The references of a room, as they are kept in a folder, or walked and kept there.
    pub fn cached(room: &ChoiceRoom, walks: u64, folder: &Path) -> Result<Self, Failure> {
        // Points do not depend on how surfaces are cut.
        let (coarse, _) = experiment(room, room.even(f64::INFINITY, true), &[])?;
        let (points, channels) = (points(coarse.scene()), coarse.scene().channels());
        let file = folder.join(format!("{}-{walks}.light", room.name));
        let light = match fs::read(&file) {
            Ok(bytes) if bytes.len() == 2 * size_of::<f64>() * channels * points.len() => {
                let (numbers, _) = bytes.as_chunks();
                let all: Vec<f64> = numbers.iter().map(|number| f64::from_le_bytes(*number)).collect();
                let (one, other) = all.split_at(all.len() / 2);
                [one.to_vec(), other.to_vec()]
            }
            _ => {
                let keys = [format!("budget.paths={}", FINER * walks), "seed=97".into()];
                let (fine, ..) = on_chosen(room, &keys)?;
                let light = walked(&fine, &points, walks);
                let bytes: Vec<u8> = light.iter().flatten().flat_map(|light| light.to_le_bytes()).collect();
                fs::create_dir_all(folder)?;
                fs::write(&file, bytes)?;
                light
            }
        };
        Ok(RoomReference { points, light, channels })
    }

    /// Errors of the reported light: root mean squares over the area, relative to the light, and relative to the light of each place or
    /// [`DIM`] of the mean light, where that is more; there no place counts for more than all of its light.
    pub fn errors(&self, reported: &Estimates<'_>) -> [f64; 2] {
        let reported = light_at(&self.points, reported);
        let dim = DIM * self.mean();
        let (mut off, mut all) = ([0.0; 2], [0.0; 2]);
        for (k, reported) in reported.iter().enumerate() {
            let [one, other] = [self.light[0][k], self.light[1][k]];
            let area = self.points[k / self.channels].area;
            let square = area * (reported - one) * (reported - other);
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

/// The light at points by two references, walked side by side.
fn walked(fine: &Experiment, points: &[RoomPoint], walks: u64) -> [Vec<f64>; 2] {
    let tallies = thread::scope(|scope| {
        let threads = [101, 102].map(|seed| scope.spawn(move || walk(fine, seed, walks)));
        threads.map(|thread| thread.join().expect("walks do not panic"))
    });
    tallies.map(|tally| light_at(points, &Estimates::new(fine, &tally, 0.95)))
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
fn light_at(points: &[RoomPoint], reported: &Estimates<'_>) -> Vec<f64> {
    let scene = reported.scene();
    let mut light = Vec::with_capacity(points.len() * scene.channels());
    for &RoomPoint { surface: number, side, uv, .. } in points {
        let surface = &scene.surfaces()[number as usize];
        let piece = surface.piece(surface.cell_at(uv), side);
        let face = scene.faces().face_of(piece) as usize;
        let (known, slopes) = (reported.face_estimate(face), reported.slopes(face));
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
