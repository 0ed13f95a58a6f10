//! The readings of sensors, from a tally.

use stats::Moments;

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
}

impl<'a> Readings<'a> {
    /// The readings in a tally of the experiment; every interval has the level `confidence`. `None` where there are no sensors.
    pub fn new(experiment: &'a Experiment, tally: &'a Tally, confidence: f64) -> Option<Self> {
        let sensors = experiment.sensors()?;
        let samples = samples(experiment, tally);
        Some(Readings { experiment, sensors, tally, student: Student::new(samples, confidence) })
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

    fn reading(&self, cell: usize, channel: usize) -> Reading {
        let row = self.experiment.scene().faces().len() + 1 + cell;
        let sums = self.tally.patch(row, channel);
        let moments = Moments { n: self.samples(), sum: sums[0], sum_sq: sums[1] };
        // No irradiance exceeds the largest radiosity there can be.
        let largest = self.experiment.largest_radiosity[channel];
        let per_unit = largest / units(self.tally.layout().moments);
        let Told { mean, error, low, high } = self.student.told(&moments, per_unit, largest, By::Many);
        Reading { irradiance: (moments.n > 0).then_some(mean), std_error: error, ci_low: low, ci_high: high }
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
