//! Daylight coefficients: walks born at sensors, counted by the patch of the sky that they leave for.
//!
//! A walk from a sensor carries the importance of its light: it leaves the sensor with the cosine about the normal as density, goes on from where it arrives
//! with probability R, and leaves the scene for patch j of the sky with probability p_j. Under a sky of the radiances L_j the sensor
//! receives E = π·Σ_j p_j·L_j (P. R. Tregenza & I. M. Waters, *Daylight coefficients*, Lighting Research and Technology 15 (1983)
//! 65–71). Counts are kept apart by whether the walk was reflected, so that the sun may be added exactly where it is seen straight.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::segments::{Segment, SegmentPart, Segments, WALKS_OF_A_GROUP};
use super::unfit::Unfit;
use crate::geometry::frame::Frames;
use crate::geometry::sensor::{SensorShape, SensorSpec, Sensors};
use crate::geometry::sky::SkyPatches;
use crate::random::rng::Sequence;
use crate::scene::Scene;
use crate::scene::births::SensorBirths;
use crate::tally::{Counts, HitScoreboard, Tally};
use crate::trace::ray::Ray;
use crate::walk::Space;
use crate::walk::batch::walk_all;
use crate::walk::collision::Analog;
use crate::walk::skies::SkyCounts;

/// Walks from the cells of sensors to patches of the sky.
#[derive(Clone, Debug)]
pub struct Coefficients {
    scene: Scene,
    sensors: Sensors,
    /// Frames of the scene's surfaces, and of the sensors behind them.
    frames: Frames,
    sky: SkyPatches,
}

/// What became of walks of one cell of a sensor.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SkyTally {
    /// How many left without a reflection, for below the horizon and for each patch of the sky.
    pub straight: Vec<u64>,
    /// How many left after reflections.
    pub reflected: Vec<u64>,
    /// All of them.
    pub walks: u64,
    /// How many ended on backs of one-sided surfaces.
    pub backs: u64,
}

impl SkyTally {
    /// The tally before the first walk, under a sky with this number of patches.
    pub fn new(patches: usize) -> Self {
        let none = vec![0; patches + 1];
        SkyTally { straight: none.clone(), reflected: none, walks: 0, backs: 0 }
    }

    /// Adds what became of other walks.
    pub fn add(&mut self, other: &SkyTally) {
        let counts = [(&mut self.straight, &other.straight), (&mut self.reflected, &other.reflected)];
        counts.into_iter().for_each(|(sums, more)| sums.iter_mut().zip(more).for_each(|(sum, n)| *sum += n));
        (self.walks, self.backs) = (self.walks + other.walks, self.backs + other.backs);
    }

    /// Whether it can be one of a sky with this number of patches.
    pub fn is_of(&self, patches: usize) -> bool {
        let mut all = self.straight.iter().chain(&self.reflected).chain([&self.backs]);
        let ended = all.try_fold(0_u64, |sum, &walks| sum.checked_add(walks));
        let sizes = [&self.straight, &self.reflected].map(Vec::len);
        sizes == [patches + 1; 2] && ended.is_some_and(|ended| ended <= self.walks)
    }
}

impl Coefficients {
    /// Walks in a scene from the cells of sensors, under a sky in patches.
    ///
    /// # Errors
    /// A scene in colour, no sensor or an impossible one.
    pub fn new(scene: Scene, specs: &[SensorSpec], sky: SkyPatches) -> Result<Self, Unfit> {
        if scene.channels() > 1 {
            return Err(Unfit::DaylightInColour);
        }
        let sensors = Sensors::new(&scene, specs)?.ok_or(Unfit::NoSensors)?;
        let is_no_plane = |spec: &&SensorSpec| {
            matches!(spec.shape, SensorShape::Cylinders { .. } | SensorShape::Eyes { .. })
        };
        if let Some(SensorSpec { name, .. }) = specs.iter().find(is_no_plane) {
            return Err(Unfit::DaylightOffPlanes { name: name.clone() });
        }
        let of_sensors = (0..specs.len()).flat_map(|sensor| sensors.frames_of(sensor).iter().copied());
        let frames = Frames::new(scene.surfaces().iter().map(|surface| surface.frame()).chain(of_sensors));
        Ok(Coefficients { scene, sensors, frames, sky })
    }

    /// The sensors.
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// The division of the sky.
    pub fn sky(&self) -> &SkyPatches {
        &self.sky
    }

    /// Walks some walks of a cell and adds what becomes of them.
    ///
    /// # Panics
    /// Where there is no such cell, or more walks than a cell has.
    pub fn walk(&self, sequence: &Sequence, cell: usize, walks: Range<u64>, tally: &mut SkyTally) {
        self.count(sequence, cell, walks, tally);
    }

    /// [`Coefficients::walk`], which also says how the walks have ended.
    fn count(&self, sequence: &Sequence, cell: usize, walks: Range<u64>, tally: &mut SkyTally) -> Counts {
        assert!(walks.end <= WALKS_OF_A_GROUP && cell < self.sensors.cell_count(), "there are such walks");
        let births = SensorBirths::new(&self.sensors, &self.frames, self.scene.surfaces().len() as u32, cell);
        let mut score = SkyCounts::new(&self.sky, (&mut tally.straight, &mut tally.reflected));
        let first = cell as u64 * WALKS_OF_A_GROUP;
        let walks = first + walks.start..first + walks.end;
        let counts =
            walk_all(&self.scene, &births, Space::Continuous, sequence, walks, Analog::default(), &mut score);
        tally.walks += counts.walks;
        tally.backs += counts.absorbed_back;
        counts
    }

    /// What the middle of a cell receives through panes of light from a direction of length 1: the cosine between this and the cell's normal
    /// times the part that passes; 0 where something stands between.
    pub fn receives(&self, cell: usize, direction: [f64; 3]) -> f64 {
        let cell = self.sensors.cell(cell);
        let frame = self.sensors.frame(&cell);
        let cosine = frame.normal().dot(direction.into());
        if cosine <= 0.0 {
            return 0.0;
        }
        let middle = self.sensors.place(&cell, [1 << 31; 2]);
        let ray = Ray { origin: frame.point(middle).into(), direction: direction.into(), from: Ray::FREE };
        match self.scene.closest_hit(&ray) {
            None => cosine * self.scene.passed_panes(&ray, f64::INFINITY),
            Some(_) => 0.0,
        }
    }
}

/// Daylight coefficients as an experiment counts them: of which places, under which sky, by which walks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DaylightSpec {
    /// The places.
    pub sensors: Vec<SensorSpec>,
    /// The number of patches that the sky is divided into.
    pub patches: u32,
    /// The walks of cells: each segment has rows of its own in the tally.
    pub segments: Vec<Segment>,
}

/// How many rows of a tally the walks of a segment have, under a sky with this number of patches: those that leave straight, for below the horizon
/// and for each patch, those that leave after reflections, and those that end on backs.
pub fn sky_rows(patches: usize) -> usize {
    2 * (patches + 1) + 1
}

/// What an experiment that counts daylight coefficients needs beyond its scene.
#[derive(Clone, Debug)]
pub(super) struct Daylight {
    coefficients: Coefficients,
    segments: Segments,
}

impl Daylight {
    pub(super) fn new(scene: &Scene, spec: DaylightSpec) -> Result<Self, Unfit> {
        let sky = SkyPatches::new(spec.patches).ok_or(Unfit::NoSuchSky { patches: spec.patches })?;
        let coefficients = Coefficients::new(scene.clone(), &spec.sensors, sky)?;
        let cells = coefficients.sensors().cell_count() as u32;
        let segments = Segments::new(spec.segments, cells).ok_or(Unfit::NoSuchCells)?;
        Ok(Daylight { coefficients, segments })
    }

    pub(super) fn rows(&self) -> usize {
        self.segments.len() * sky_rows(self.coefficients.sky.count())
    }

    /// Some walks of a sequence onto a board with these rows.
    pub(super) fn walk(&self, (sequence, walks): (&Sequence, Range<u64>), board: &mut HitScoreboard<1>) {
        let patches = self.coefficients.sky.count();
        for SegmentPart { segment, group, walks } in self.segments.parts(walks) {
            let mut tally = SkyTally::new(patches);
            let counts = self.coefficients.count(sequence, group as usize, walks, &mut tally);
            board.counts.add(&counts).expect("64 bits outlast any process");
            let first = segment * sky_rows(patches);
            let all = tally.straight.iter().chain(&tally.reflected).chain([&tally.backs]);
            all.zip(first..)
                .filter(|&(&walks, _)| walks > 0)
                .for_each(|(&walks, row)| board.add_walks_of_one(row as u32, walks));
        }
    }
}

/// What a tally of daylight coefficients says of each segment, in their order.
///
/// # Panics
/// Where the tally has other rows.
pub fn sky_tallies(tally: &Tally, spec: &DaylightSpec) -> Vec<SkyTally> {
    let (patches, rows) = (spec.patches as usize, sky_rows(spec.patches as usize));
    assert_eq!(tally.patches(), spec.segments.len() * rows, "the rows are those of daylight coefficients");
    let count = |row| u64::try_from(tally.patch(row, 0)[0]).expect("there are fewer walks than 2⁶⁴");
    let of = |(number, segment): (usize, &Segment)| {
        let straight = number * rows;
        let reflected = straight + patches + 1;
        let backs = reflected + patches + 1;
        SkyTally {
            straight: (straight..reflected).map(count).collect(),
            reflected: (reflected..backs).map(count).collect(),
            walks: segment.walks,
            backs: count(backs),
        }
    };
    spec.segments.iter().enumerate().map(of).collect()
}
