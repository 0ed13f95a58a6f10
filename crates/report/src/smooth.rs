//! Radiosity at the corners of faces, for pictures without steps between patches.
//!
//! A face is drawn piece by piece, a piece being one side of a cell: most faces are one piece, groups are several. A corner of
//! a piece takes the mean, weighted by area, of the pieces that meet there and go on from it: on the same side
//! of a surface that bends by less than [`BEND`], of the same material, and not distinguished by the data. Two faces are told
//! apart where their radiosities differ by more than [`CERTAIN`] standard errors of the difference and by more than
//! [`STEP`] of the larger: there is the edge of a shadow, and the picture keeps it.
//!
//! A face whose gradients are known brings its linear fit to each of its corners, as far as the fit stands out from its noise. A
//! fit may fall below 0 at the edge of a shadow, a picture does not.

use std::collections::HashMap;
use std::ops::Range;

use glam::DVec3;
use parallel::on_all_cores;
use radiosity::{Estimate, Estimates, Scene, Side, surfaces::Corners};

use crate::bounds::Bounds;

/// The cosine of the largest angle between the normals of faces that are one surface to the eye: 20°.
const BEND: f64 = 0.94;

/// Differences above this many standard errors are no noise.
const CERTAIN: f64 = 3.0;

/// Differences below this part of the larger value are steps between patches and not in the light.
const STEP: f64 = 0.35;

/// Corners nearer to each other than this part of the scene's size are one.
const SAME_PLACE: f64 = 1e-7;

/// Faces, pieces or corners that a thread takes at once.
const AT_ONCE: usize = 1 << 14;

/// B [W/m²] at the corners of every piece of a face.
#[derive(Clone, Debug, PartialEq)]
pub struct Smooth {
    channels: usize,
    /// By piece of a face, corner (as [`radiosity::surfaces::Faces::piece_corners`] has them; a triangle's last one twice) and channel.
    values: Vec<f64>,
}

/// Reflectance and emittance, as bits.
type MaterialBits = [[u64; 3]; 2];

/// A piece of a face as its neighbours see it.
#[derive(Clone, Copy, Default)]
struct Shown {
    face: u32,
    /// Equal for equal materials.
    material: u32,
    area: f64,
    normal: DVec3,
}

/// What is known of some faces: their pieces by number, the fit of B at the four corners of each, and their light as [`Neighbours`] has it.
#[derive(Default)]
struct SomeFaces {
    pieces: Vec<(u32, Shown, MaterialBits)>,
    fitted: Vec<f64>,
    light: Vec<[f64; 2]>,
}

/// All pieces as their neighbours see them.
struct Neighbours {
    channels: usize,
    pieces: Vec<Shown>,
    /// By face and channel, B and its standard error [W/m²].
    light: Vec<[f64; 2]>,
}

/// A corner of a piece, and where it is on a grid whose points are one place: 4 times the piece, and the corner.
type Touch = ([i32; 3], u32);

impl Smooth {
    /// The corners of all pieces.
    pub fn new(estimates: &Estimates) -> Self {
        let scene = estimates.scene();
        let (faces, channels) = (scene.faces(), scene.channels());
        let (neighbours, fitted) = Neighbours::of(estimates);
        let mut values = fitted.clone();
        let corners = touches(scene);
        let places = parallel::parts(&corners, AT_ONCE, |a, b| a.0 == b.0);
        let means = parallel::map(&places, 1, |place| neighbours.means(place, &fitted));
        for ((_, corner), mean) in
            corners.iter().zip(means.iter().flat_map(|some| some.chunks_exact(channels)))
        {
            values[*corner as usize * channels..][..channels].copy_from_slice(mean);
        }
        let mut smooth = Smooth { channels, values };
        (0..faces.piece_count())
            .filter(|&piece| faces.is_triangle(piece as u32))
            .for_each(|piece| smooth.repeat_third(piece));
        smooth
    }

    /// The same B everywhere [W/m²].
    #[cfg(test)]
    pub(crate) fn even(scene: &radiosity::Scene, radiosity: f64) -> Self {
        let channels = scene.channels();
        Smooth { channels, values: vec![radiosity; 4 * channels * scene.faces().piece_count()] }
    }

    fn repeat_third(&mut self, piece: usize) {
        let third = (4 * piece + 2) * self.channels;
        self.values.copy_within(third..third + self.channels, third + self.channels);
    }

    /// B at a place in a piece, in three channels. `weights` are those of its corners.
    pub fn at(&self, piece: u32, weights: [f64; 4]) -> [f64; 3] {
        let mut light = [0.0; 3];
        for (corner, values) in self.corners(piece as usize).chunks_exact(self.channels).enumerate() {
            (0..self.channels).for_each(|c| light[c] += weights[corner] * values[c]);
        }
        if self.channels == 1 { [light[0]; 3] } else { light }
    }

    /// B at the four corners of a piece, the channels of a corner side by side.
    pub fn corners(&self, piece: usize) -> &[f64] {
        &self.values[4 * self.channels * piece..][..4 * self.channels]
    }
}

/// The corners of all pieces, those of one place next to each other, in the order of pieces.
fn touches(scene: &Scene) -> Vec<Touch> {
    let faces = scene.faces();
    let grid = 1.0 / (SAME_PLACE * Bounds::of(scene).size().max_element());
    let on_grid = |place: DVec3| ((place - scene.origin()) * grid).round().to_array().map(|x| x as i32);
    let of_piece = |piece: u32| (4 * piece..).zip(faces.piece_corners(piece).into_iter().map(on_grid));
    let some = on_all_cores(faces.piece_count().div_ceil(AT_ONCE), |part| {
        let pieces = part_of(faces.piece_count(), part).map(|piece| piece as u32);
        pieces.flat_map(of_piece).map(|(corner, place)| (place, corner)).collect::<Vec<Touch>>()
    });
    let mut touches = Vec::with_capacity(some.iter().map(Vec::len).sum());
    some.into_iter().for_each(|part| touches.extend(part));
    touches.sort_unstable();
    touches
}

/// One of the parts that threads take of some numbers.
fn part_of(count: usize, part: usize) -> Range<usize> {
    part * AT_ONCE..((part + 1) * AT_ONCE).min(count)
}

/// The standard error of B; where nothing was scored, a quarter of the interval's width [W/m²].
fn error(estimate: &Estimate) -> f64 {
    let bound = estimate.is_unsampled().then_some(0.25 * (estimate.ci_high - estimate.ci_low));
    estimate.std_error.or(bound).unwrap_or(f64::INFINITY)
}

impl Neighbours {
    /// All pieces, and the fit of B at their corners as [`Smooth`] has its values.
    fn of(estimates: &Estimates) -> (Self, Vec<f64>) {
        let (faces, channels) = (estimates.scene().faces(), estimates.scene().channels());
        let parts = on_all_cores(faces.len().div_ceil(AT_ONCE), |part| {
            let mut some = SomeFaces::default();
            part_of(faces.len(), part).for_each(|number| some.take(estimates, number));
            some
        });
        let mut fitted = vec![0.0; 4 * channels * faces.piece_count()];
        let mut pieces = vec![Shown::default(); faces.piece_count()];
        let mut materials = HashMap::new();
        let mut light = Vec::with_capacity(channels * faces.len());
        for some in parts {
            for ((piece, shown, material), fit) in
                some.pieces.into_iter().zip(some.fitted.chunks_exact(4 * channels))
            {
                let next = materials.len() as u32;
                let material = *materials.entry(material).or_insert(next);
                pieces[piece as usize] = Shown { material, ..shown };
                fitted[4 * channels * piece as usize..][..4 * channels].copy_from_slice(fit);
            }
            light.extend(some.light);
        }
        (Neighbours { channels, pieces, light }, fitted)
    }

    /// B at some corners, those of one place together: the means over what goes on from there.
    fn means(&self, corners: &[Touch], fitted: &[f64]) -> Vec<f64> {
        let channels = self.channels;
        let mut means = Vec::with_capacity(channels * corners.len());
        for touching in corners.chunk_by(|(a, _), (b, _)| a == b) {
            for &(_, own) in touching {
                let first = means.len();
                means.resize(first + channels, 0.0);
                let mut area = 0.0;
                for &(_, other) in touching.iter().filter(|(_, other)| self.goes_on(own / 4, other / 4)) {
                    let weight = self.pieces[other as usize / 4].area;
                    area += weight;
                    let light = &fitted[other as usize * channels..][..channels];
                    means[first..].iter_mut().zip(light).for_each(|(sum, light)| *sum += weight * light);
                }
                means[first..].iter_mut().for_each(|sum| *sum /= area);
            }
        }
        means
    }

    /// Whether another piece is the same surface to the eye, in the same light.
    fn goes_on(&self, own: u32, other: u32) -> bool {
        let [own, other] = [own, other].map(|piece| &self.pieces[piece as usize]);
        own.material == other.material
            && own.normal.dot(other.normal) >= BEND
            && !self.are_distinct(own.face, other.face)
    }

    fn are_distinct(&self, own: u32, other: u32) -> bool {
        let channels = self.channels;
        let [own, other] = [own, other].map(|face| &self.light[face as usize * channels..][..channels]);
        own.iter().zip(other).any(|(&[a, a_error], &[b, b_error])| {
            let difference = (a - b).abs();
            difference > CERTAIN * a_error.hypot(b_error) && difference > STEP * a.max(b)
        })
    }
}

impl SomeFaces {
    /// Takes what is known of a face.
    fn take(&mut self, estimates: &Estimates, number: usize) {
        let scene = estimates.scene();
        let (faces, channels) = (scene.faces(), scene.channels());
        let (known, slopes) = (estimates.face(number), estimates.slopes(number).unwrap_or_default());
        for piece in faces.pieces(number) {
            let own = faces.piece(piece);
            let corners = faces.piece_corners(piece);
            let shown = Shown {
                face: number as u32,
                material: 0,
                area: own.area,
                normal: (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize(),
            };
            let material = [own.reflectance, own.emittance].map(|of| of.channels().map(f64::to_bits));
            self.pieces.push((piece, shown, material));
            let places = if slopes.is_empty() { Corners::new() } else { scene.corners_on_fit(piece) };
            let first = self.fitted.len();
            self.fitted.resize(first + 4 * channels, 0.0);
            for channel in 0..channels {
                let mean = known.as_deref().map_or(own.emittance[channel], |known| known[channel].radiosity);
                let mut tilt = slopes.get(channel).map(|slopes| slopes.at(&places)).unwrap_or_default();
                if own.side == Side::Back {
                    // Its corners run the other way round.
                    tilt.reverse();
                }
                for corner in 0..corners.len() {
                    self.fitted[first + corner * channels + channel] =
                        tilt.get(corner).map_or(mean, |tilt| (mean + tilt).max(0.0));
                }
            }
        }
        self.light.extend((0..channels).map(|c| match known.as_deref() {
            Some(known) => [known[c].radiosity, error(&known[c])],
            None => [0.0, f64::INFINITY],
        }));
    }
}

#[cfg(test)]
mod tests {
    use radiosity::{IndexChoice, Scene, SceneSpec, Shape};

    use super::*;
    use crate::scenes::{cube, experiment, quad, shot};

    /// The weights of a face's middle.
    const MIDDLE: [f64; 4] = [0.25; 4];

    fn smooth(scene: &Scene, see: impl Fn(&Estimates, &Smooth)) {
        let experiment = experiment(scene);
        let tally = shot(&experiment);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        see(&estimates, &Smooth::new(&estimates));
    }

    #[test]
    fn walls_are_smooth_within_and_lamps_and_edges_stay_sharp() {
        smooth(&cube(), |estimates, smooth| {
            let faces = estimates.scene().faces();
            let floor: Vec<usize> = (0..9).collect();
            let light = |face: usize| estimates.face(face).unwrap()[0].radiosity;
            // The middle of the floor's inner corner: the mean of four patches.
            let mean = [0, 1, 3, 4].map(light).iter().sum::<f64>() / 4.0;
            assert!((smooth.corners(0)[2] - mean).abs() < 1e-12);
            // Its outer corner belongs to walls, which are not the floor.
            assert_eq!(smooth.corners(0)[0], light(0));
            for face in floor {
                let [low, high] = floor_range(estimates);
                let middle = smooth.at(face as u32, MIDDLE)[0];
                assert!((low..=high).contains(&middle));
            }
            // The lamp in the middle of the ceiling is of another material.
            let lamp = (0..faces.len()).find(|&face| faces.get(face).emittance.is_lit()).unwrap();
            assert!(smooth.corners(lamp).iter().all(|&b| b == light(lamp)));
        });
    }

    fn floor_range(estimates: &Estimates) -> [f64; 2] {
        let light = (0..9).map(|face| estimates.face(face).unwrap()[0].radiosity);
        [light.clone().fold(f64::INFINITY, f64::min), light.fold(0.0, f64::max)]
    }

    /// Below a table the floor is dark: a step that the data are sure of stays a step.
    #[test]
    fn the_edge_of_a_shadow_stays_where_the_data_are_sure() {
        let mut lamp = quad("lamp", [[0., 0., 2.], [0., 4., 2.], [4., 0., 2.]], [1, 1], 0.0);
        lamp.emittance = 1.0.into();
        let floor = quad("floor", [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]], [4, 4], 0.5);
        let table = quad("table", [[0., 0., 1e-3], [2., 0., 1e-3], [0., 4., 1e-3]], [1, 1], 0.1);
        let scene = Scene::build(&SceneSpec::new(vec![floor, table, lamp]), IndexChoice::Auto).unwrap();
        smooth(&scene, |estimates, smooth| {
            let light = |face: usize| estimates.face(face).unwrap()[0].radiosity;
            // Patches 4 … 7 are under the table, 8 … 11 beside it.
            assert!(light(5) < 0.1 * light(9));
            assert!(
                smooth.corners(9)[0] > 5.0 * smooth.corners(5)[1],
                "{:?} {:?}",
                smooth.corners(9),
                smooth.corners(5)
            );
        });
    }

    #[test]
    fn triangles_share_corners_and_have_their_third_twice() {
        let mut plate = quad("plate", [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]], [1, 1], 0.5);
        plate.shape = Shape::Triangle { a: DVec3::ZERO, b: DVec3::X, c: DVec3::Y, rows: 2 };
        let mut lamp = quad("lamp", [[0., 0., 1.], [0., 1., 1.], [1., 0., 1.]], [1, 1], 0.0);
        lamp.emittance = 1.0.into();
        let scene = Scene::build(&SceneSpec::new(vec![plate, lamp]), IndexChoice::Auto).unwrap();
        smooth(&scene, |estimates, smooth| {
            let light = |face: usize| estimates.face(face).unwrap()[0].radiosity;
            for face in 0..4 {
                assert_eq!(smooth.corners(face)[2], smooth.corners(face)[3]);
            }
            // The middle of ab belongs to patches 0, 1 and 2 and is corner b of the first.
            let mean = (light(0) + light(1) + light(2)) / 3.0;
            assert!((smooth.corners(0)[1] - mean).abs() < 1e-12, "{:?}, not {mean}", smooth.corners(0));
        });
    }
}
