//! The readings of sensors, from a tally.

use super::Experiment;
use super::board::units;
use super::chains::{By, Student, Told};
use crate::geometry::sensor::Sensors;
use crate::scene::Scene;
use crate::tally::Tally;

/// What is known of the irradiance of one cell of a sensor, in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// H, the mean over the cell [W/m²]; `None` where no sample is whole.
    pub irradiance: Option<f64>,
    /// The standard error of H for the whole run [W/m²]; `None` where there are fewer than four samples, or all samples agree.
    pub std_error: Option<f64>,
    /// The lower end of the confidence interval of H [W/m²].
    pub ci_low: f64,
    /// The upper end of the interval [W/m²].
    pub ci_high: f64,
}

impl Reading {
    /// Half-width of the interval over the estimate; infinite where nothing was found.
    pub fn relative_error(&self) -> f64 {
        let half_width = 0.5 * (self.ci_high - self.ci_low);
        match self.irradiance {
            Some(irradiance) if irradiance > 0.0 => half_width / irradiance,
            _ => f64::INFINITY,
        }
    }
}

/// The readings that a tally gives for the sensors of an experiment.
#[derive(Clone, Debug)]
pub struct Readings<'a> {
    experiment: &'a Experiment,
    sensors: &'a Sensors,
    tally: &'a Tally,
    student: Student,
    confidence: f64,
}

impl<'a> Readings<'a> {
    /// The readings in a tally of the experiment; every interval has the level `confidence`. `None` where there are no sensors.
    pub fn new(experiment: &'a Experiment, tally: &'a Tally, confidence: f64) -> Option<Self> {
        let sensors = experiment.sensors()?;
        let samples = samples(experiment, tally);
        Some(Readings { experiment, sensors, tally, student: Student::new(samples, confidence), confidence })
    }

    /// The same readings with intervals of another level.
    pub(super) fn at_level(&self, confidence: f64) -> Self {
        Readings { student: Student::new(self.samples(), confidence), confidence, ..*self }
    }

    /// The level of the intervals.
    pub(super) fn confidence(&self) -> f64 {
        self.confidence
    }

    pub(super) fn tally(&self) -> &'a Tally {
        self.tally
    }

    /// The sensors that are read.
    pub fn sensors(&self) -> &'a Sensors {
        self.sensors
    }

    /// The scene that they stand in.
    pub fn scene(&self) -> &'a Scene {
        self.experiment.scene()
    }

    /// 1 where the scene is grey, else 3.
    pub fn channels(&self) -> usize {
        self.experiment.scene().channels()
    }

    /// Independent samples that the intervals come from.
    pub fn samples(&self) -> u64 {
        samples(self.experiment, self.tally)
    }

    /// Rays that sensors have sent, beside those of walks and chains.
    pub fn rays(&self) -> u64 {
        u64::try_from(self.counted(1)).unwrap_or(u64::MAX)
    }

    /// What is known of a cell, channel by channel.
    pub fn cell(&self, number: usize) -> Vec<Reading> {
        (0..self.experiment.scene().channels()).map(|channel| self.reading(number, channel)).collect()
    }

    /// The largest relative error of a sensor's cells, in channels that have light; cells that nothing was found for are left
    /// out where `ignore_dark`. Infinite where nothing is left.
    pub fn worst_error(&self, sensor: usize, ignore_dark: bool) -> f64 {
        self.errors(sensor, ignore_dark).reduce(f64::max).unwrap_or(f64::INFINITY)
    }

    /// The relative errors of a sensor's cells, in channels that have light; cells that nothing was found for are left out
    /// where `ignore_dark`.
    pub fn errors(&self, sensor: usize, ignore_dark: bool) -> impl Iterator<Item = f64> {
        let scene = self.experiment.scene();
        let lit = move |&c: &usize| scene.total_power(c) > 0.0;
        let readings = self.sensors.cells_of(sensor).flat_map(move |cell| {
            (0..scene.channels()).filter(lit).map(move |channel| self.reading(cell, channel))
        });
        let counts = move |reading: &Reading| !ignore_dark || reading.irradiance.is_some_and(|h| h > 0.0);
        readings.filter(counts).map(|reading| reading.relative_error())
    }

    /// What is known of a cell in one channel.
    pub(super) fn reading(&self, cell: usize, channel: usize) -> Reading {
        let direct = self.experiment.lamps_at_cells().of_cell(cell)[channel];
        self.read(self.row_of(cell), channel, direct)
    }

    /// What is known of the mean over the points of a plane in one channel.
    pub(super) fn plane_reading(&self, plane: usize, channel: usize) -> Reading {
        let sensor = self.sensors.planes().nth(plane).expect("a plane of the job");
        let cells = self.sensors.cells_of(sensor);
        let points = cells.len() as f64;
        let direct: f64 =
            cells.map(|cell| self.experiment.lamps_at_cells().of_cell(cell)[channel] / points).sum();
        self.read(self.row_of(self.sensors.cell_count() + plane), channel, direct)
    }

    /// The row of a cell in a tally; the means of planes follow the cells.
    pub(super) fn row_of(&self, cell: usize) -> usize {
        self.experiment.scene().faces().len() + 1 + cell
    }

    /// What a unit of score is worth [W/m²].
    pub(super) fn per_unit(&self, channel: usize) -> f64 {
        self.experiment.largest_radiosity[channel] / units(self.tally.layout().moments)
    }

    /// What samples have found, and the direct light that is known exactly.
    fn read(&self, row: usize, channel: usize, direct: f64) -> Reading {
        let moments = self.moments(row, channel);
        if moments.n > 0 && self.experiment.is_all_direct(channel) {
            let irradiance = Some(direct);
            return Reading { irradiance, std_error: Some(0.0), ci_low: direct, ci_high: direct };
        }
        // No irradiance by patches exceeds the largest radiosity there can be.
        let largest = self.experiment.largest_radiosity[channel];
        let told = self.student.told(&moments, self.per_unit(channel), largest, By::Many);
        let Told { mean, error, low, high } = told;
        Reading {
            irradiance: (moments.n > 0).then_some(direct + mean),
            std_error: error,
            ci_low: direct + low,
            ci_high: direct + high,
        }
    }

    fn counted(&self, column: usize) -> u128 {
        counted(self.experiment, self.tally, column)
    }
}

/// Whole samples in a tally.
fn samples(experiment: &Experiment, tally: &Tally) -> u64 {
    u64::try_from(counted(experiment, tally, 0)).unwrap_or(u64::MAX)
}

/// A number of the row that counts samples, and their rays.
fn counted(experiment: &Experiment, tally: &Tally, column: usize) -> u128 {
    tally.sums()[experiment.scene().faces().len() * tally.layout().columns() + column]
}
