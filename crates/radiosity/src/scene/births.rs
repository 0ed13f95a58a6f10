//! Where walks are born.

use stats::Sizes;

use super::lamps::PointLamps;
use crate::geometry::face::Faces;
use crate::geometry::frame::Frames;
use crate::geometry::sensor::{SensorCell, Sensors};
use crate::geometry::spec::Side;
use crate::geometry::surface::Surface;
use crate::random::rng::unit_32;
use crate::random::sampling::AliasTable;
use crate::scene::Scene;
use crate::trace::ray::{Ray, Rays};

/// One side of consecutive cells of a surface, where walks begin with the same probability.
#[derive(Clone, Copy, Debug)]
struct SourceRun {
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
    /// At a lamp without area, by number.
    Lamp(usize),
}

/// A place on a plane where a walk begins.
pub(crate) struct BirthPoint {
    /// The number of the frame that it leaves: a surface, or what [`Nursery::frames`] has behind them.
    pub surface: u32,
    pub cell: u32,
    /// 1 where it is the front that the walk leaves, −1 where it is the back.
    pub facing: f64,
    pub uv: [f64; 2],
    /// What the walk is born on: a face, or a cell of a sensor.
    pub face: u32,
}

/// What bears walks.
pub(crate) trait Nursery<const C: usize> {
    /// The birth on a plane that four times 64 random bits choose, and the weights of the channels; the last bits are those of the direction.
    fn bear(&self, scene: &Scene, draws: [u64; 4]) -> (BirthPoint, [f64; C]);
    /// The number of the lamp without area at which a birth takes place whose first 64 random bits these are, if it does.
    #[inline(always)]
    fn lamp(&self, _source: u64) -> Option<u32> {
        None
    }
    /// The number of the lamp without area at which all births take place, if there is one.
    #[inline(always)]
    fn only_lamp(&self) -> Option<u32> {
        None
    }
    /// The weights of the channels of a birth at a lamp.
    #[inline(always)]
    fn weights_at(&self, _lamp: u32) -> [f64; C] {
        [1.0; C]
    }
    /// The frames that walks leave.
    #[inline(always)]
    fn frames<'a>(&'a self, scene: &'a Scene) -> &'a Frames {
        &scene.parts.frames
    }
    /// Says of rays that have left a frame which of them leave no surface.
    #[inline(always)]
    fn leave(_scene: &Scene, _rays: &mut Rays) {}
}

impl<const C: usize> Nursery<C> for Births {
    #[inline(always)]
    fn bear(&self, scene: &Scene, [source, cell, point, _]: [u64; 4]) -> (BirthPoint, [f64; C]) {
        let (birthplace, weights) = self.choose([source, cell]);
        let Birthplace::Cell(Origin { surface: number, cell, side }) = birthplace else {
            unreachable!("births at lamps are told apart before");
        };
        let uv = scene.surfaces()[number as usize]
            .point_in_cell(cell, [(point >> 32) as u32, point as u32].map(unit_32));
        let face = scene.face_at(number, cell, side);
        (BirthPoint { surface: number, cell, facing: side.sign(), uv, face }, weights)
    }

    #[inline(always)]
    fn lamp(&self, source: u64) -> Option<u32> {
        self.choice.choose(source).checked_sub(self.sources.len()).map(|lamp| lamp as u32)
    }

    #[inline(always)]
    fn only_lamp(&self) -> Option<u32> {
        (self.sources.is_empty() && self.choice.len() == 1).then_some(0)
    }

    #[inline(always)]
    fn weights_at(&self, lamp: u32) -> [f64; C] {
        self.weights_of(self.sources.len() + lamp as usize)
    }
}

/// Births in one cell of a sensor, uniformly.
pub(crate) struct SensorBirths<'a> {
    sensors: &'a Sensors,
    /// The frames of surfaces, and those of sensors behind them.
    frames: &'a Frames,
    /// The number of the sensor's frame there.
    frame: u32,
    number: u32,
    cell: SensorCell,
}

impl<'a> SensorBirths<'a> {
    pub(crate) fn new(sensors: &'a Sensors, frames: &'a Frames, surfaces: u32, cell: usize) -> Self {
        let number = cell as u32;
        let cell = sensors.cell(cell);
        SensorBirths { sensors, frames, frame: surfaces + cell.frame(), number, cell }
    }
}

impl Nursery<1> for SensorBirths<'_> {
    #[inline(always)]
    fn bear(&self, _: &Scene, [_, _, point, _]: [u64; 4]) -> (BirthPoint, [f64; 1]) {
        let uv = self.sensors.place(&self.cell, [(point >> 32) as u32, point as u32]);
        let birth = BirthPoint { surface: self.frame, cell: 0, facing: 1.0, uv, face: self.number };
        (birth, [1.0])
    }

    #[inline(always)]
    fn frames<'a>(&'a self, _: &'a Scene) -> &'a Frames {
        self.frames
    }

    #[inline(always)]
    fn leave(scene: &Scene, rays: &mut Rays) {
        let surfaces = scene.surfaces().len() as u32;
        rays.from.iter_mut().filter(|from| **from >= surfaces).for_each(|from| *from = Ray::FREE);
    }
}

/// Sides of cells, then lamps without area, the probability of each, and the weights that walks set out with.
#[derive(Clone, Debug)]
pub(crate) struct Births {
    sources: Vec<SourceRun>,
    choice: AliasTable,
    /// Per source, then per lamp; empty where every weight is 1.
    weights: Vec<[f64; 3]>,
    /// The largest of them, channel by channel; 1 where a channel has no light at all.
    largest_weights: [f64; 3],
    /// The weights with the probabilities of their births, channel by channel.
    sizes: [Sizes; 3],
}

impl Births {
    /// What the births take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.sources[..]) + size_of_val(&self.weights[..]) + self.choice.bytes()
    }

    /// Births with a probability in proportion to `share` of each face, and on a face that is a group in proportion to area.
    /// `None` where no share is above 0.
    pub(crate) fn new(surfaces: &[Surface], faces: &Faces, share: impl Fn(usize) -> f64) -> Option<Self> {
        let share = |piece: usize| share_of_piece(faces, piece, &share);
        let sources = sources(surfaces, faces, |_| true, |a, b| share(a) == share(b));
        Births::at_sources(sources, share, &[])
    }

    /// Births with a probability in proportion to `share` of each piece, in runs of pieces that are alike in all that matters at a birth,
    /// and to that of each lamp.
    fn at_sources(
        sources: impl Iterator<Item = (usize, SourceRun)>,
        share: impl Fn(usize) -> f64,
        of_lamps: &[f64],
    ) -> Option<Self> {
        let chosen = sources.filter(|&(piece, _)| share(piece) > 0.0);
        let sources = chosen.map(|(piece, source)| (source, share(piece) * f64::from(source.cells)));
        Births::choosing(sources, of_lamps)
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
        for (piece, source) in
            sources(surfaces, faces, |_| true, alike).filter(|&(piece, _)| share(piece) > 0.0)
        {
            groups[group(piece) as usize].push((source, share(piece) * f64::from(source.cells)));
        }
        groups.into_iter().map(|chosen| Births::choosing(chosen.into_iter(), &[])).collect()
    }

    /// Births at sources and at lamps that are chosen in proportion to their shares; `None` where there is no share.
    fn choosing(chosen: impl Iterator<Item = (SourceRun, f64)>, of_lamps: &[f64]) -> Option<Self> {
        let (sources, mut shares): (Vec<_>, Vec<_>) = chosen.unzip();
        shares.extend(of_lamps);
        shares.iter().any(|&share| share > 0.0).then(|| Births {
            choice: AliasTable::new(&shares),
            sources,
            weights: Vec::new(),
            largest_weights: [1.0; 3],
            sizes: Default::default(),
        })
    }

    /// Births on emitters. Grey: p_s = Φ_s/Φ_T. In colour p_s is the mean of what the channels that emit would
    /// each choose, and a walk sets out with w_c = (Φ_sc/Φ_Tc)/p_s in channel c: p_s·w_c is what channel c alone
    /// would have, and no weight exceeds the number of channels (the balance heuristic).
    pub(crate) fn of_emitters(
        surfaces: &[Surface],
        faces: &Faces,
        lamps: &PointLamps,
        channels: usize,
        total: [f64; 3],
    ) -> Option<Self> {
        let may_emit = |surface: u32| faces.may_emit(surface);
        if channels == 1 {
            let power = |piece: usize| faces.piece(piece as u32).power(0);
            let sources = sources(surfaces, faces, may_emit, |a, b| power(a) == power(b));
            let of_lamps: Vec<f64> = (0..lamps.len()).map(|lamp| lamps.power(lamp, 0)).collect();
            return Births::at_sources(sources, power, &of_lamps);
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
        let sources = sources(surfaces, faces, may_emit, alike);
        let chances_of_lamps: Vec<f64> =
            (0..lamps.len()).map(|lamp| chance(&|c| lamps.power(lamp, c))).collect();
        let share_of_piece = |i: usize| chance(&|c| piece(i).power(c));
        let mut births = Births::at_sources(sources, share_of_piece, &chances_of_lamps)?;
        let first_piece = |source: &SourceRun| {
            faces.piece(surfaces[source.surface as usize].piece(source.first_cell, source.side))
        };
        let of_source = |source: &SourceRun| weights(&|c| first_piece(source).power(c));
        let chance_of_source =
            |source: &SourceRun| chance(&|c| first_piece(source).power(c)) * f64::from(source.cells);
        let of_lamps = (0..lamps.len()).map(|lamp| weights(&|c| lamps.power(lamp, c)));
        births.weights = births.sources.iter().map(of_source).chain(of_lamps).collect();
        births.largest_weights = std::array::from_fn(|c| {
            let largest = births.weights.iter().map(|weights| weights[c]).fold(0.0, f64::max);
            if largest > 0.0 { largest } else { 1.0 }
        });
        let chances = births.sources.iter().map(chance_of_source).chain(chances_of_lamps);
        let weighted: Vec<_> = births.weights.iter().zip(chances).collect();
        births.sizes = std::array::from_fn(|c| {
            Sizes::new(weighted.iter().map(|&(weights, chance)| (weights[c], chance)))
        });
        Some(births)
    }

    /// The weights of the channels of a source or of a lamp behind all sources.
    #[inline(always)]
    fn weights_of<const C: usize>(&self, choice: usize) -> [f64; C] {
        match self.weights.get(choice) {
            Some(weights) if C > 1 => std::array::from_fn(|c| weights[c]),
            _ => [1.0; C],
        }
    }

    /// The birthplace that twice 64 random bits choose, and the weights of the channels there.
    #[inline(always)]
    pub(crate) fn choose<const C: usize>(&self, bits: [u64; 2]) -> (Birthplace, [f64; C]) {
        let choice = self.choice.choose(bits[0]);
        let weights = self.weights_of(choice);
        let Some(&SourceRun { surface, side, first_cell, cells }) = self.sources.get(choice) else {
            return (Birthplace::Lamp(choice - self.sources.len()), weights);
        };
        let cell = first_cell + ((u128::from(bits[1]) * u128::from(cells)) >> 64) as u32;
        (Birthplace::Cell(Origin { surface, cell, side }), weights)
    }

    /// The largest weight that a walk sets out with, channel by channel; 1 where a channel has no light at all.
    pub(crate) fn largest_weights(&self) -> [f64; 3] {
        self.largest_weights
    }

    /// The weights that walks set out with in a channel, each with the probability of a birth with it; `None` where all weights are 1.
    pub(crate) fn sizes(&self, channel: usize) -> Option<&Sizes> {
        (!self.weights.is_empty()).then(|| &self.sizes[channel])
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
fn sources(
    surfaces: &[Surface],
    faces: &Faces,
    of: impl Fn(u32) -> bool,
    alike: impl Fn(usize, usize) -> bool,
) -> impl Iterator<Item = (usize, SourceRun)> {
    let sides = (0..)
        .zip(surfaces.iter().map(Surface::cell_count))
        .filter(move |&(surface, _)| of(surface))
        .flat_map(|(surface, cells)| [Side::Front, Side::Back].map(|side| (surface, side, cells as usize)));
    let runs = sides.filter_map(|(surface, side, cells)| {
        let first = faces.first_piece_on(surface, side)? as usize;
        Some((surface, side, first, first + cells))
    });
    runs.flat_map(move |(surface, side, first, end)| {
        let mut sources = Vec::new();
        let mut next = first;
        while next < end {
            let piece = next;
            next += (piece..end).take_while(|&other| alike(piece, other)).count();
            let (first_cell, cells) = ((piece - first) as u32, (next - piece) as u32);
            sources.push((piece, SourceRun { surface, side, first_cell, cells }));
        }
        sources
    })
}
