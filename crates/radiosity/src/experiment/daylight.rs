//! Daylight coefficients: walks born at sensors, counted by the patch of the sky that they leave for.
//!
//! A walk from a sensor carries the importance of its light: it leaves the sensor with the cosine about the normal as density, goes on from where it arrives
//! with probability R, and leaves the scene for patch j of the sky with probability p_j. Under a sky of the radiances L_j the sensor
//! receives E = π·Σ_j p_j·L_j (P. R. Tregenza & I. M. Waters, *Daylight coefficients*, Lighting Research and Technology 15 (1983)
//! 65–71). Counts are kept apart by whether the walk was reflected, so that the sun may be added exactly where it is seen straight.

use std::ops::Range;

use super::unfit::Unfit;
use crate::geometry::frame::Frames;
use crate::geometry::sensor::{SensorShape, SensorSpec, Sensors};
use crate::geometry::sky::SkyPatches;
use crate::random::rng::Sequence;
use crate::scene::Scene;
use crate::scene::births::SensorBirths;
use crate::trace::ray::Ray;
use crate::walk::Space;
use crate::walk::batch::walk_all;
use crate::walk::fate::Analog;
use crate::walk::skies::SkyCounts;

/// Walk n of sensor cell i is walk i·2⁴⁰ + n of the sequence, whatever other cells walk.
const WALKS_OF_A_CELL: u64 = 1 << 40;

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
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkyTally {
    /// How many left without a reflection, for below the horizon and for each patch of the sky.
    pub straight: Vec<u64>,
    /// How many left after reflections.
    pub reflected: Vec<u64>,
    /// All of them.
    pub walks: u64,
    /// Their rays.
    pub rays: u64,
    /// How many ended on backs of one-sided surfaces.
    pub backs: u64,
}

impl SkyTally {
    /// The tally before the first walk, under a sky with this number of patches.
    pub fn new(patches: usize) -> Self {
        let none = vec![0; patches + 1];
        SkyTally { straight: none.clone(), reflected: none, walks: 0, rays: 0, backs: 0 }
    }

    /// Adds what became of other walks.
    pub fn add(&mut self, other: &SkyTally) {
        let counts = [(&mut self.straight, &other.straight), (&mut self.reflected, &other.reflected)];
        counts.into_iter().for_each(|(sums, more)| sums.iter_mut().zip(more).for_each(|(sum, n)| *sum += n));
        (self.walks, self.rays, self.backs) =
            (self.walks + other.walks, self.rays + other.rays, self.backs + other.backs);
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
        let is_cylinder = |spec: &&SensorSpec| matches!(spec.shape, SensorShape::Cylinders { .. });
        if let Some(SensorSpec { name, .. }) = specs.iter().find(is_cylinder) {
            return Err(Unfit::DaylightOnCylinders { name: name.clone() });
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
        assert!(walks.end <= WALKS_OF_A_CELL && cell < self.sensors.cell_count(), "there are such walks");
        let births = SensorBirths::new(&self.sensors, &self.frames, self.scene.surfaces().len() as u32, cell);
        let mut score = SkyCounts::new(&self.sky, (&mut tally.straight, &mut tally.reflected));
        let first = cell as u64 * WALKS_OF_A_CELL;
        let walks = first + walks.start..first + walks.end;
        let counts =
            walk_all(&self.scene, &births, Space::Continuous, sequence, walks, Analog::default(), &mut score);
        tally.walks += counts.walks;
        tally.rays += counts.rays;
        tally.backs += counts.absorbed_back;
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
