//! The readings of sensors, from a tally.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use stats::Moments;

use super::Experiment;
use super::chains::{By, Student};
use super::unmet::{BrightFaces, balls_of_cells, seen_by_rays};
use crate::geometry::sensor::Sensors;
use crate::jacobi::UNITS;
use crate::jacobi::final_gather::SHADOW_SHARE;
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
    /// Half-width of the interval over the estimate; infinite where nothing was found, but where it is known that there is nothing.
    pub fn relative_error(&self) -> f64 {
        let half_width = 0.5 * (self.ci_high - self.ci_low);
        match self.irradiance {
            Some(_) if half_width == 0.0 => 0.0,
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
    /// The source whose light is read; `None`: that of all, each as much as the mixture has of it.
    source: Option<usize>,
    /// The brightest faces, channel by channel, found when they are first asked for.
    bright: Arc<OnceLock<Vec<BrightFaces>>>,
    /// By channel, the most radiosity that one walk may bring to a face, if all walks brought as much [W/m²]; found when it is first asked for.
    most_of_walk: Arc<OnceLock<Vec<f64>>>,
    /// What faces may reflect that gathering walks from there have not met, channel by channel; found when it is first asked for.
    unmet_by_walks: Arc<OnceLock<Option<Vec<BrightFaces>>>>,
}

impl<'a> Readings<'a> {
    /// The readings in a tally of the experiment; every interval has the level `confidence`. `None` where there are no sensors.
    pub fn new(experiment: &'a Experiment, tally: &'a Tally, confidence: f64) -> Option<Self> {
        let sensors = experiment.sensors()?;
        let samples = samples(experiment, tally);
        let student = Student::new(samples, confidence);
        let (bright, most_of_walk, unmet_by_walks) = (Arc::default(), Arc::default(), Arc::default());
        Some(Readings {
            experiment,
            sensors,
            tally,
            student,
            confidence,
            source: None,
            bright,
            most_of_walk,
            unmet_by_walks,
        })
    }

    /// The readings of one source's light, as much as there is of it; `None` where sources are not distinguished, or there is no such one.
    pub fn of_source(&self, source: usize) -> Option<Self> {
        let (student, bright) = (self.student.clone(), Arc::default());
        let (most_of_walk, unmet_by_walks) = (self.most_of_walk.clone(), self.unmet_by_walks.clone());
        let of_source =
            Readings { source: Some(source), student, bright, most_of_walk, unmet_by_walks, ..*self };
        (source < self.experiment.source_count()).then_some(of_source)
    }

    /// The same readings with intervals of another level.
    pub(super) fn at_level(&self, confidence: f64) -> Self {
        let (student, bright) = (Student::new(self.samples(), confidence), self.bright.clone());
        let (most_of_walk, unmet_by_walks) = (self.most_of_walk.clone(), Arc::default());
        Readings { student, confidence, bright, most_of_walk, unmet_by_walks, ..*self }
    }

    /// The level of the intervals.
    pub(super) fn confidence(&self) -> f64 {
        self.confidence
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
        self.read(cell, channel, self.direct(cell, channel))
    }

    /// What is known of the mean over the points of a plane in one channel.
    pub(super) fn plane_reading(&self, plane: usize, channel: usize) -> Reading {
        let sensor = self.sensors.planes().nth(plane).expect("a plane of the job");
        let cells = self.sensors.cells_of(sensor);
        let points = cells.len() as f64;
        let direct =
            cells.map(|cell| self.direct(cell, channel) / points).fold(0.0, |sum, light| sum + light);
        self.read(self.sensors.cell_count() + plane, channel, direct)
    }

    /// What is known of the light at a cell that does not come straight from lamps.
    pub(super) fn indirect(&self, cell: usize, channel: usize) -> Reading {
        self.read(cell, channel, 0.0)
    }

    /// What lamps bring to a cell, where it is known exactly [W/m²].
    fn direct(&self, cell: usize, channel: usize) -> f64 {
        // Not by `sum`, which says −0 of no lamps.
        self.lights_at(cell).fold(0.0, |sum, (_, light)| sum + light[channel])
    }

    /// What each of the lamps brings to a cell, where it is known exactly, channel by channel [W/m²].
    pub(super) fn lights_at(&self, cell: usize) -> impl Iterator<Item = (usize, [f64; 3])> {
        let groups = self.experiment.groups().filter(|groups| !groups.sources().is_empty());
        let factor = move |lamp: usize| match (groups, self.source) {
            (None, _) => 1.0,
            (Some(groups), Some(source)) if groups.source_of_lamp(lamp) != source => 0.0,
            (Some(groups), _) => self.experiment.factor_of(groups.source_of_lamp(lamp) as u32),
        };
        let lights = self.experiment.lamps_at_cells().of_cell(cell);
        lights.iter().map(move |&(lamp, light)| {
            let factor = factor(lamp as usize);
            (lamp as usize, light.map(|light| factor * light))
        })
    }

    /// The rows of a tally that tell of a cell's light in a channel, each with the factor of its light. The means of planes follow the cells, and sources
    /// follow all of them together: where all sources are as bright as in the scene, that is one row.
    fn rows_of(&self, cell: usize, channel: usize) -> Vec<(usize, f64)> {
        let first = self.experiment.first_row_of_sensors() + 1;
        let is_lit =
            |source: usize| self.experiment.groups().is_none_or(|groups| groups.is_lit(source, channel));
        let factor =
            |source: usize| if is_lit(source) { self.experiment.factor_of(source as u32) } else { 0.0 };
        let row = |source: usize| (first + (1 + source) * self.sensors.row_count() + cell, factor(source));
        match (self.source, self.experiment.mixture()) {
            (Some(source), _) if !is_lit(source) => Vec::new(),
            (Some(source), _) => vec![row(source)],
            (None, None) => vec![(first + cell, 1.0)],
            (None, Some(factors)) => {
                (0..factors.len()).filter(|&source| factor(source) > 0.0).map(row).collect()
            }
        }
    }

    /// What a unit of score is worth [W/m²].
    fn per_unit(&self, channel: usize) -> f64 {
        self.experiment.largest_at_sensors[channel] / UNITS
    }

    /// Σx and Σx² of a row of sensors.
    fn moments(&self, row: usize, channel: usize) -> Moments {
        let sums = self.tally.patch(row, channel);
        Moments { n: self.samples(), sum: sums[0], sum_sq: sums[1] }
    }

    /// The sample's own standard error of what is gathered at a cell [W/m²]; those of sources are added, as in [`Readings::read`].
    pub(super) fn sample_error(&self, cell: usize, channel: usize) -> f64 {
        let error =
            |(row, factor): (usize, f64)| factor * self.moments(row, channel).standard_error().unwrap_or(0.0);
        self.per_unit(channel) * self.rows_of(cell, channel).into_iter().map(error).sum::<f64>()
    }

    /// What samples have found, and the direct light that is known exactly. Rays of a sample gather the light of all sources, so that errors
    /// of the sources in a mixture go together; they are added, which is the most that they can come to. What may have stayed out of sources that
    /// have brought nothing here is bounded for all of them together.
    fn read(&self, cell: usize, channel: usize, direct: f64) -> Reading {
        let known = self.samples() > 0;
        if known && self.experiment.is_all_direct(channel) {
            let irradiance = Some(direct);
            return Reading { irradiance, std_error: Some(0.0), ci_low: direct, ci_high: direct };
        }
        // No irradiance by patches exceeds the largest radiosity there can be.
        let largest = self.experiment.largest_at_sensors[channel];
        let (mut mean, mut error, [mut low, mut high]) = (direct, Some(0.0), [direct; 2]);
        let (mut silent, mut has_scored) = (0.0_f64, false);
        let tells_sources_apart = self.source.is_some() || self.experiment.mixture().is_some();
        for (row, factor) in self.rows_of(cell, channel) {
            let moments = self.moments(row, channel);
            if moments.sum == 0 && tells_sources_apart {
                silent = silent.max(factor * self.most_of_silent(cell, channel));
                continue;
            }
            has_scored = true;
            let estimate =
                self.student.estimate(&moments, self.per_unit(channel), largest, By::Many { unmet: 0.0 });
            mean += factor * estimate.mean;
            error = error.zip(estimate.error).map(|(sum, own)| sum + factor * own);
            low += factor * estimate.low;
            high += factor * estimate.high;
        }
        if silent > 0.0 && !has_scored {
            error = None;
        }
        let unmet = self.unmet(cell, channel).hypot(silent).hypot(self.unmet_by_walks(cell, channel));
        let high = stats::with_unmet(high, mean, unmet);
        Reading { irradiance: known.then_some(mean), std_error: error, ci_low: low, ci_high: high }
    }

    /// What a source may bring to a cell, or to the mean of a plane, that has brought nothing [W/m²]: of N walks none has lit what its rays meet, and none of
    /// the rays has met an emitter.
    fn most_of_silent(&self, cell: usize, channel: usize) -> f64 {
        let chance = |n: f64| stats::unmet_chance(n, self.student.tail);
        let largest = self.experiment.largest_at_sensors[channel];
        let most_of_walk =
            self.most_of_walk.get_or_init(|| most_of_walk(self.experiment, self.tally))[channel];
        let walks = self.samples() * self.sensors.sample_walks();
        let by_walks = most_of_walk * chance(walks as f64);
        let by_rays = largest * chance(self.gathering_rays(self.cells_of_row(cell).len()));
        (largest * chance(self.samples() as f64)).min(by_walks + by_rays)
    }

    /// Rays that some cells have sent to gather light.
    fn gathering_rays(&self, cells: usize) -> f64 {
        let gathering = 1.0 - 1.0 / SHADOW_SHARE as f64;
        gathering * self.rays() as f64 * cells as f64 / self.sensors.cell_count() as f64
    }

    /// What bright faces may bring to a cell, or to the mean of a plane, that none of its rays has met [W/m²].
    pub(super) fn unmet(&self, cell: usize, channel: usize) -> f64 {
        let mean_of = |(row, factor): (usize, f64)| factor * self.moments(row, channel).mean().unwrap_or(0.0);
        let mean = self.per_unit(channel) * self.rows_of(cell, channel).into_iter().map(mean_of).sum::<f64>();
        let error = self.sample_error(cell, channel);
        if mean <= 0.0 || error <= 0.0 {
            return 0.0;
        }
        let cells = self.cells_of_row(cell);
        let rays = self.gathering_rays(cells.len());
        let bright = self.bright.get_or_init(|| {
            let factor = |source: usize| match self.source {
                Some(own) if own != source => 0.0,
                _ => self.experiment.factor_of(source as u32),
            };
            BrightFaces::of(self.experiment, self.tally, factor)
        });
        let places = balls_of_cells(self.sensors, cells);
        bright[channel].unmet(&places, seen_by_rays(mean, error, rays), (rays, self.student.tail))
    }

    /// What the light of faces may bring to a cell, or to the mean of a plane, that no gathering walk from there has met [W/m²]. Light of all sources counts as
    /// that of the one that a mixture has most of.
    fn unmet_by_walks(&self, cell: usize, channel: usize) -> f64 {
        let find = || BrightFaces::unmet_by_walks(self.experiment, self.tally, self.confidence);
        let Some(faces) = self.unmet_by_walks.get_or_init(find) else { return 0.0 };
        let factors = match self.source {
            Some(source) => source..source + 1,
            None => 0..self.experiment.source_count().max(1),
        };
        let factor = factors.map(|source| self.experiment.factor_of(source as u32)).fold(0.0, f64::max);
        factor * faces[channel].most_of_one(&balls_of_cells(self.sensors, self.cells_of_row(cell)))
    }

    /// The cells that a row tells of: one, or those of a plane.
    fn cells_of_row(&self, row: usize) -> Range<usize> {
        match row.checked_sub(self.sensors.cell_count()) {
            None => row..row + 1,
            Some(plane) => {
                self.sensors.cells_of(self.sensors.planes().nth(plane).expect("a plane of the job"))
            }
        }
    }

    fn counted(&self, column: usize) -> u128 {
        counted(self.experiment, self.tally, column)
    }
}

/// By channel, the most radiosity that one walk may bring to a face, if all walks brought as much [W/m²].
fn most_of_walk(experiment: &Experiment, tally: &Tally) -> Vec<f64> {
    let scene = experiment.scene();
    let of_face = |channel: usize, i: usize| {
        let meaning = experiment.meaning(i, channel, tally)?;
        let reflectance = scene.faces().get(i).reflectance[channel];
        Some(reflectance * meaning.irradiance_per_event? * meaning.ratio_bound)
    };
    let of_channel =
        |channel| (0..scene.faces().len()).filter_map(|i| of_face(channel, i)).fold(0.0, f64::max);
    (0..scene.channels()).map(of_channel).collect()
}

/// Whole samples in a tally.
fn samples(experiment: &Experiment, tally: &Tally) -> u64 {
    u64::try_from(counted(experiment, tally, 0)).unwrap_or(u64::MAX)
}

/// A number of the row that counts samples, and their rays.
fn counted(experiment: &Experiment, tally: &Tally, column: usize) -> u128 {
    tally.sums()[experiment.first_row_of_sensors() * tally.layout().columns() + column]
}
