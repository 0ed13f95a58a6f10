//! Where walks are born.

use super::lamps::Lamps;
use crate::geometry::face::Faces;
use crate::geometry::sensor::{SensorCell, Sensors};
use crate::geometry::spec::Side;
use crate::geometry::surface::Surface;
use crate::random::sampling::{AliasTable, cosine_direction};
use crate::scene::Scene;
use crate::trace::ray::Ray;

/// One side of consecutive cells of a surface, where walks begin with the same probability.
#[derive(Clone, Copy, Debug)]
struct Cradle {
    surface: u32,
    side: Side,
    first_cell: u32,
    cells: u32,
}

/// One side of a cell, where a walk begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin {
    pub surface: u32,
    pub cell: u32,
    pub side: Side,
}

/// Where a walk begins.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Birthplace {
    /// On one side of a cell.
    Cell(Origin),
    /// On no surface, where rays are known: at a lamp without area, or at a sensor, by number.
    Free(usize),
}

/// What bears walks.
pub(crate) trait Nursery {
    /// The birthplace that twice 64 random bits choose, and the weights of the channels there.
    fn choose<const C: usize>(&self, bits: [u64; 2]) -> (Birthplace, [f64; C]);
    /// The number that scores know a free birthplace by, and the ray from it that random bits choose: for the point, and for the direction.
    fn free(&self, scene: &Scene, place: usize, bits: [u64; 2]) -> (u32, Ray);
}

/// Births in one cell of a sensor, uniformly.
pub(crate) struct SensorBirths<'a> {
    sensors: &'a Sensors,
    cell: SensorCell,
}

impl<'a> SensorBirths<'a> {
    pub(crate) fn new(sensors: &'a Sensors, cell: usize) -> Self {
        SensorBirths { sensors, cell: sensors.cell(cell) }
    }
}

impl Nursery for SensorBirths<'_> {
    #[inline(always)]
    fn choose<const C: usize>(&self, _: [u64; 2]) -> (Birthplace, [f64; C]) {
        (Birthplace::Free(0), [1.0; C])
    }

    #[inline(always)]
    fn free(&self, _: &Scene, _: usize, [point, direction]: [u64; 2]) -> (u32, Ray) {
        let frame = self.sensors.frame(&self.cell);
        let place = self.sensors.place(&self.cell, [(point >> 32) as u32, point as u32]);
        let direction = frame.direction(1.0, cosine_direction(direction)).into();
        (0, Ray { origin: frame.point(place).into(), direction, from: Ray::FREE })
    }
}

/// Sides of cells, then lamps without area, the probability of each, and the weights that walks set out with.
#[derive(Clone, Debug)]
pub(crate) struct Births {
    cradles: Vec<Cradle>,
    choice: AliasTable,
    /// Per cradle, then per lamp; empty where every weight is 1.
    weights: Vec<[f64; 3]>,
    /// The largest of them, channel by channel; 1 where a channel has no light at all.
    largest_weights: [f64; 3],
}

impl Births {
    /// What the births take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.cradles[..]) + size_of_val(&self.weights[..]) + self.choice.bytes()
    }

    /// Births with a probability in proportion to `share` of each face, and on a face that is a group in proportion to area.
    /// `None` where no share is above 0.
    pub(crate) fn new(surfaces: &[Surface], faces: &Faces, share: impl Fn(usize) -> f64) -> Option<Self> {
        let share = |piece: usize| share_of_piece(faces, piece, &share);
        let cradles = cradles(surfaces, faces, |_| true, |a, b| share(a) == share(b));
        Births::in_cradles(cradles, share, &[])
    }

    /// Births with a probability in proportion to `share` of each piece, in runs of pieces that are alike in all that matters at a birth,
    /// and to that of each lamp.
    fn in_cradles(
        cradles: impl Iterator<Item = (usize, Cradle)>,
        share: impl Fn(usize) -> f64,
        of_lamps: &[f64],
    ) -> Option<Self> {
        let chosen = cradles.filter(|&(piece, _)| share(piece) > 0.0);
        let cradles = chosen.map(|(piece, cradle)| (cradle, share(piece) * f64::from(cradle.cells)));
        Births::choosing(cradles, of_lamps)
    }

    /// The births of each of `count` groups of faces: within a group with a probability in proportion to `share`. `None` for a
    /// group in which no share is above 0.
    pub(crate) fn of_groups(
        surfaces: &[Surface],
        faces: &Faces,
        (group_of_face, count): (&[u32], u32),
        share: impl Fn(usize) -> f64,
    ) -> Vec<Option<Self>> {
        let group = |piece: usize| group_of_face[faces.face_of(piece as u32) as usize];
        let share = |piece: usize| share_of_piece(faces, piece, &share);
        let alike = |a, b| (group(a), share(a)) == (group(b), share(b));
        let mut groups = vec![Vec::new(); count as usize];
        for (piece, cradle) in
            cradles(surfaces, faces, |_| true, alike).filter(|&(piece, _)| share(piece) > 0.0)
        {
            groups[group(piece) as usize].push((cradle, share(piece) * f64::from(cradle.cells)));
        }
        groups.into_iter().map(|chosen| Births::choosing(chosen.into_iter(), &[])).collect()
    }

    /// Births in cradles and at lamps that are chosen in proportion to their shares; `None` where there is no share.
    fn choosing(chosen: impl Iterator<Item = (Cradle, f64)>, of_lamps: &[f64]) -> Option<Self> {
        let (cradles, mut shares): (Vec<_>, Vec<_>) = chosen.unzip();
        shares.extend(of_lamps);
        shares.iter().any(|&share| share > 0.0).then(|| Births {
            choice: AliasTable::new(&shares),
            cradles,
            weights: Vec::new(),
            largest_weights: [1.0; 3],
        })
    }

    /// Births on emitters. Grey: p_s = Φ_s/Φ_T. In colour p_s is the mean of what the channels that emit would
    /// each choose, and a walk sets out with w_c = (Φ_sc/Φ_Tc)/p_s in channel c: p_s·w_c is what channel c alone
    /// would have, and no weight exceeds the number of channels (the balance heuristic).
    pub(crate) fn of_emitters(
        (surfaces, faces, lamps): (&[Surface], &Faces, &Lamps),
        channels: usize,
        total: [f64; 3],
    ) -> Option<Self> {
        let may_emit = |surface: u32| faces.may_emit(surface);
        if channels == 1 {
            let power = |piece: usize| faces.piece(piece as u32).power(0);
            let cradles = cradles(surfaces, faces, may_emit, |a, b| power(a) == power(b));
            let of_lamps: Vec<f64> = (0..lamps.len()).map(|lamp| lamps.power(lamp, 0)).collect();
            return Births::in_cradles(cradles, power, &of_lamps);
        }
        let share = |power: f64, c: usize| if total[c] > 0.0 { power / total[c] } else { 0.0 };
        let emitting = total.iter().filter(|&&power| power > 0.0).count() as f64;
        let chance =
            |power: &dyn Fn(usize) -> f64| (0..3).map(|c| share(power(c), c)).sum::<f64>() / emitting;
        let weights = |power: &dyn Fn(usize) -> f64| {
            let chance = chance(power);
            std::array::from_fn(|c| if chance > 0.0 { share(power(c), c) / chance } else { 0.0 })
        };
        let piece = |piece: usize| faces.piece(piece as u32);
        let light = |i: usize| (piece(i).emittance, piece(i).area);
        let alike = |a: usize, b: usize| light(a) == light(b);
        let cradles = cradles(surfaces, faces, may_emit, alike);
        let of_lamps: Vec<f64> = (0..lamps.len()).map(|lamp| chance(&|c| lamps.power(lamp, c))).collect();
        let mut births = Births::in_cradles(cradles, |i| chance(&|c| piece(i).power(c)), &of_lamps)?;
        let of_cradle = |cradle: &Cradle| {
            let surface = &surfaces[cradle.surface as usize];
            let face = faces.piece(surface.piece(cradle.first_cell, cradle.side));
            weights(&|c| face.power(c))
        };
        let of_lamps = (0..lamps.len()).map(|lamp| weights(&|c| lamps.power(lamp, c)));
        births.weights = births.cradles.iter().map(of_cradle).chain(of_lamps).collect();
        births.largest_weights = std::array::from_fn(|c| {
            let largest = births.weights.iter().map(|weights| weights[c]).fold(0.0, f64::max);
            if largest > 0.0 { largest } else { 1.0 }
        });
        Some(births)
    }

    /// The largest weight that a walk sets out with, channel by channel; 1 where a channel has no light at all.
    pub(crate) fn largest_weights(&self) -> [f64; 3] {
        self.largest_weights
    }
}

impl Nursery for Births {
    #[inline(always)]
    fn choose<const C: usize>(&self, bits: [u64; 2]) -> (Birthplace, [f64; C]) {
        let choice = self.choice.choose(bits[0]);
        let weights = match self.weights.get(choice) {
            Some(weights) if C > 1 => std::array::from_fn(|c| weights[c]),
            _ => [1.0; C],
        };
        let Some(&Cradle { surface, side, first_cell, cells }) = self.cradles.get(choice) else {
            return (Birthplace::Free(choice - self.cradles.len()), weights);
        };
        let cell = first_cell + ((u128::from(bits[1]) * u128::from(cells)) >> 64) as u32;
        (Birthplace::Cell(Origin { surface, cell, side }), weights)
    }

    #[inline(always)]
    fn free(&self, scene: &Scene, lamp: usize, [point, direction]: [u64; 2]) -> (u32, Ray) {
        // Lamps are numbered behind faces.
        ((scene.faces().len() + lamp) as u32, scene.parts.lamps.birth(lamp, point, direction))
    }
}

/// What a piece has of the share of its face: the part of the face that it is, by area.
fn share_of_piece(faces: &Faces, piece: usize, share: impl Fn(usize) -> f64) -> f64 {
    let face = faces.face_of(piece as u32) as usize;
    match faces.are_grouped() {
        false => share(face),
        true => share(face) * (faces.piece(piece as u32).area / faces.get(face).area),
    }
}

/// The cells of some surfaces, each run of them that are alike at a birth with its first piece.
fn cradles(
    surfaces: &[Surface],
    faces: &Faces,
    of: impl Fn(u32) -> bool,
    alike: impl Fn(usize, usize) -> bool,
) -> impl Iterator<Item = (usize, Cradle)> {
    let sides = (0..)
        .zip(surfaces.iter().map(Surface::cell_count))
        .filter(move |&(surface, _)| of(surface))
        .flat_map(|(surface, cells)| [Side::Front, Side::Back].map(|side| (surface, side, cells as usize)));
    let runs = sides.filter_map(|(surface, side, cells)| {
        let first = faces.first_piece_on(surface, side)? as usize;
        Some((surface, side, first, first + cells))
    });
    runs.flat_map(move |(surface, side, first, end)| {
        let mut cradles = Vec::new();
        let mut next = first;
        while next < end {
            let piece = next;
            next += (piece..end).take_while(|&other| alike(piece, other)).count();
            let (first_cell, cells) = ((piece - first) as u32, (next - piece) as u32);
            cradles.push((piece, Cradle { surface, side, first_cell, cells }));
        }
        cradles
    })
}
