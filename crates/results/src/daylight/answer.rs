//! What the counts say: figures of every place, as tables and in words.

use std::f64::consts::PI;
use std::io::Write;

use parallel::on_threads;
use report::words::{counted, percent};
use report::{DaylightArrays, DaylightRow, DaylightSummary, DimPoints, LevelSummary, OutputFolder};
use sky::{BoundedValue, Encoding, Level, Matrix, Metrics, STANDARD_SKIES, Sky, SkyPatchCounts, TARGETS};

use super::count::{DaylightCounted, row};
use super::question::DaylightQuestion;
use super::stored::COUNTS;
use crate::error::Error;
use crate::rounds::ROUND;

const TABLE: &str = "annual.csv";
const COEFFICIENTS: &str = "coefficients.mtx";
const HOURS: &str = "annual.ill";
const ERRORS: &str = "annual-error.ill";
const SUMMARY: &str = "daylight.json";
const CALENDAR: &str = "calendar.svg";
const MAPS: &str = "maps.svg";
const NUMPY: &str = "daylight.npz";
const PARQUET: &str = "daylight.parquet";
const BINARY_COEFFICIENTS: &str = "coefficients.float.mtx";

/// All files that are written.
pub const FILES: [&str; 12] = [
    TABLE,
    COEFFICIENTS,
    HOURS,
    ERRORS,
    SUMMARY,
    COUNTS,
    CALENDAR,
    MAPS,
    NUMPY,
    PARQUET,
    BINARY_COEFFICIENTS,
    ROUND,
];

/// A file that is written where it is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DaylightFile {
    /// Arrays of coefficients and hours for NumPy.
    Npz,
    /// A row for each place and hour.
    Parquet,
    /// The coefficients in Radiance's 32-bit numbers.
    FloatMtx,
}

/// The figures of every place.
pub struct DaylightAnswer<'a> {
    question: &'a DaylightQuestion,
    counted: DaylightCounted,
    places: Vec<SensorFigures>,
}

/// The figures of a cell of a sensor.
struct SensorFigures {
    /// The daylight factor under the traditional overcast sky [%].
    factor: BoundedValue,
    metrics: Metrics,
    /// By what part the yearly mean changes where the sun's reflected light comes from one patch in place of four.
    smear: f64,
    /// The light of each hour and its standard error [lx].
    light: Vec<[f64; 2]>,
}

impl<'a> DaylightAnswer<'a> {
    /// The answer to a question by what was counted; it is worked out on some threads.
    pub fn of(question: &'a DaylightQuestion, counted: DaylightCounted, threads: usize) -> Self {
        let overcast = Sky::standard(STANDARD_SKIES, [0.0, 0.0, 1.0], 100.0).expect("there is such a sky");
        let mut vector = question.dome.vector(&overcast);
        vector[0] = question.ground / PI * 100.0;
        let of = |(): &mut (), cell: usize| place(question, cell, &row(&counted.tallies[cell]), &vector);
        let places = on_threads(threads, question.cells(), || (), of);
        DaylightAnswer { question, counted, places }
    }

    /// Writes all files, and those that are asked for besides. There are no maps where no sensor is a grid.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn write(&self, folder: &OutputFolder, exports: &[DaylightFile]) -> Result<(), Error> {
        let rows: Vec<DaylightRow<'_>> = (0..self.places.len()).map(|cell| self.row(cell)).collect();
        folder.write(TABLE, |file| report::write_daylight(file, &rows))?;
        let matrix = self.matrix();
        folder.write(COEFFICIENTS, |file| matrix.write(Encoding::Ascii, file))?;
        for (name, which) in [(HOURS, 0), (ERRORS, 1)] {
            let light = self.places.iter().map(|place| place.light.iter().map(move |hour| hour[which]));
            folder.write(name, |file| report::write_ill(file, light))?;
        }
        self.export(folder, (&rows, &matrix), exports)?;
        let summary = self.summary();
        Ok(folder.write(SUMMARY, |file| summary.write(file))?)
    }

    /// Writes the arrays for NumPy alone.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write_arrays(&self, folder: &OutputFolder) -> Result<(), Error> {
        let rows: Vec<DaylightRow<'_>> = (0..self.places.len()).map(|cell| self.row(cell)).collect();
        let matrix = self.matrix();
        self.with_arrays((&rows, &matrix), |arrays| Ok(folder.write(NUMPY, |file| arrays.write_npz(file))?))
    }

    /// Writes the drawings and what is asked for besides.
    fn export(
        &self,
        folder: &OutputFolder,
        (rows, matrix): (&[DaylightRow<'_>], &Matrix),
        exports: &[DaylightFile],
    ) -> Result<(), Error> {
        self.with_arrays((rows, matrix), |arrays| {
            let drawings = [(CALENDAR, Some(arrays.calendar_svg())), (MAPS, arrays.maps_svg())];
            for (name, drawing) in drawings {
                let Some(drawing) = drawing else { continue };
                folder.write(name, |file| file.write_all(drawing.as_bytes()))?;
            }
            for export in exports {
                match export {
                    DaylightFile::Npz => folder.write(NUMPY, |file| arrays.write_npz(file))?,
                    DaylightFile::Parquet => folder.write(PARQUET, |file| arrays.write_parquet(file))?,
                    DaylightFile::FloatMtx => {
                        folder.write(BINARY_COEFFICIENTS, |file| matrix.write(Encoding::Float, file))?;
                    }
                }
            }
            Ok(())
        })
    }

    /// Does something with all that places have received.
    fn with_arrays<T>(
        &self,
        (rows, matrix): (&[DaylightRow<'_>], &Matrix),
        with: impl FnOnce(&DaylightArrays<'_>) -> T,
    ) -> T {
        let errors = Matrix {
            numbers: self.counted.tallies.iter().flat_map(|tally| row(tally).coefficient_errors()).collect(),
            ..*matrix
        };
        let hours: Vec<[u32; 3]> = self.question.year.hours.iter().map(|hour| hour.time).collect();
        let light: Vec<&[[f64; 2]]> = self.places.iter().map(|place| &place.light[..]).collect();
        with(&DaylightArrays { rows, coefficients: [matrix, &errors], hours: &hours, light: &light })
    }

    fn row(&self, cell: usize) -> DaylightRow<'_> {
        let sensors = self.question.coefficients.sensors();
        let at = sensors.cell(cell);
        let SensorFigures { factor, metrics, .. } = &self.places[cell];
        DaylightRow {
            sensor: &sensors.specs()[at.sensor].name,
            cell: at.cell,
            middle: at.middle.to_array(),
            walks: self.counted.tallies[cell].walks,
            daylight_factor: *factor,
            metrics: *metrics,
        }
    }

    /// ∂E/∂L of every place and patch [sr].
    fn matrix(&self) -> Matrix {
        let rows = self.counted.tallies.iter().map(row);
        let numbers = rows.flat_map(|row| row.coefficients().collect::<Vec<f64>>()).collect();
        Matrix { rows: self.places.len(), columns: self.question.dome.size(), numbers }
    }

    /// The level by EN 17037 of each sensor that faces up, as the planes of the standard do: by the lower ends of intervals, and by the upper ones.
    fn levels(&self) -> Vec<LevelSummary> {
        /// The cosine of a degree.
        const FACES_UP: f64 = 0.999_847_7;
        let sensors = self.question.coefficients.sensors();
        let faces_up =
            |sensor: usize| sensors.cells_of(sensor).all(|cell| sensors.cell(cell).normal.z >= FACES_UP);
        let level = |sensor: usize, end: fn(BoundedValue) -> f64| {
            let plane: Vec<[f64; TARGETS.len()]> =
                sensors.cells_of(sensor).map(|cell| self.places[cell].metrics.daylight.map(end)).collect();
            Level::of(&plane).word()
        };
        let summary = |(number, spec): (usize, &radiosity::sensors::SensorSpec)| LevelSummary {
            sensor: spec.name.clone(),
            low: level(number, |known| known.low),
            high: level(number, |known| known.high),
        };
        sensors.specs().iter().enumerate().filter(|(number, _)| faces_up(*number)).map(summary).collect()
    }

    fn summary(&self) -> DaylightSummary {
        let DaylightQuestion { job, weather, dome, wanted, tolerance, ground, .. } = self.question;
        let sum =
            |of: fn(&radiosity::daylight::SkyTally) -> u64| self.counted.tallies.iter().map(of).sum::<u64>();
        DaylightSummary {
            version: env!("CARGO_PKG_VERSION").into(),
            seed: job.seed,
            city: weather.city.clone(),
            hours: weather.hours.len(),
            patches: dome.patches().count(),
            ground: *ground,
            places: self.places.len(),
            walks: sum(|tally| tally.walks),
            rays: self.counted.cost.rays,
            back: sum(|tally| tally.backs) as f64 / sum(|tally| tally.walks) as f64,
            confidence: wanted.confidence,
            tolerance: *tolerance,
            reached: self.counted.reached,
            enough: wanted.enough,
            useful: wanted.useful,
            occupied: wanted.occupied,
            sun_smear: self.smear(),
            levels: self.levels(),
            seconds: self.counted.cost.seconds,
            cpu_seconds: self.counted.cost.cpu_seconds,
        }
    }

    /// The median and the largest smear of the sun [part of the yearly mean].
    fn smear(&self) -> [f64; 2] {
        let mut all: Vec<f64> = self.places.iter().map(|place| place.smear).collect();
        all.sort_by(f64::total_cmp);
        [all[all.len() / 2], all[all.len() - 1]]
    }

    /// Whether every place is known as well as was asked.
    pub fn reached(&self) -> bool {
        self.counted.reached
    }

    /// A few lines for people.
    pub fn lines(&self) -> Vec<String> {
        let summary = self.summary();
        let range = |of: &dyn Fn(&SensorFigures) -> f64| {
            let values = self.places.iter().map(of);
            let (low, high) =
                values.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
            [low, high]
        };
        let factors = range(&|place| place.factor.value);
        let autonomy = range(&|place| place.metrics.enough.value);
        let mut lines = vec![
            format!(
                "daylight of {} in {}: {} in {:.1} s",
                counted(summary.places as u64, "place"),
                counted(summary.hours as u64, "hour"),
                counted(summary.walks, "walk"),
                summary.seconds
            ),
            format!("daylight factor (overcast sky) {:.2} to {:.2} %", factors[0], factors[1]),
            format!(
                "{:.0} lx in {} to {} of the hours from {}:00 to {}:00",
                summary.enough,
                percent(autonomy[0]),
                percent(autonomy[1]),
                summary.occupied[0] - 1,
                summary.occupied[1]
            ),
        ];
        lines.extend(summary.levels.iter().filter(|level| level.high != "none").map(|level| {
            match level.low == level.high {
                true => format!("{}: EN 17037 level {}", level.sensor, level.low),
                false => {
                    format!("{}: EN 17037 level {} at least, {} at most", level.sensor, level.low, level.high)
                }
            }
        }));
        lines
    }

    /// What people should know before they use the figures.
    pub fn warnings(&self) -> Vec<String> {
        let summary = self.summary();
        let [median, most] = summary.sun_smear;
        let smear = (median > 0.02).then(|| {
            format!(
                "reflected sun is smeared over patches of the sky: with one patch in place of four the yearly means change by {} in the median, {} at most, beside the intervals; choose more patches (--sky-patches 577 or 2305)",
                percent(median),
                percent(most)
            )
        });
        let backs = (summary.back > 0.0)
            .then(|| format!("{} of the walks end on backs of one-sided surfaces", percent(summary.back)));
        let dark = self.counted.dark.first().map(|&darkest| {
            let darkest = self.question.coefficients.sensors().cell(darkest).middle.to_array();
            let dim = DimPoints { points: self.counted.dark.len(), darkest };
            format!("{}; the tolerance leaves them out", dim.words("the median's light", "levels"))
        });
        let missed = (!summary.reached).then(|| {
            format!(
                "the budget ended before the yearly mean of every place was known to {}; give more --paths, with --resume",
                percent(summary.tolerance)
            )
        });
        let cut = self.question.weather.cut().map(|[[month, day], [last_month, last_day]]| {
            format!("the weather ends on {month}/{day}, and its header says {last_month}/{last_day}: it seems to be cut off, and figures are of what is left; give the whole file")
        });
        let hidden = self.question.weather.hours_of_hidden_sun().map(|hours| {
            format!("the sun shines far below the horizon in {hours} hours of the weather, and that light is left out: latitude, longitude and time zone of the file's first line do not fit its hours; correct them")
        });
        [cut, hidden, smear, backs, dark, missed].into_iter().flatten().collect()
    }
}

/// The figures of a cell, of which the walks are counted.
fn place(question: &DaylightQuestion, cell: usize, row: &SkyPatchCounts, overcast: &[f64]) -> SensorFigures {
    let DaylightQuestion { coefficients, year, mean, wanted, .. } = question;
    let straight = |hour: &sky::Hour| match hour.beam > 0.0 {
        true => hour.beam * coefficients.receives(cell, hour.direction),
        false => 0.0,
    };
    let beam: Vec<f64> = year.hours.iter().map(straight).collect();
    let year = year.at(row, &beam);
    let metrics = year.metrics((&mean.0, &mean.1), wanted);
    SensorFigures {
        factor: row.light(overcast, &[], wanted.confidence),
        smear: smear(question, row) / metrics.mean.value.max(f64::MIN_POSITIVE),
        metrics,
        light: year.light(),
    }
}

/// By how much the yearly mean of reflected sun changes where it comes from the patch that holds the sun alone [lx].
fn smear(question: &DaylightQuestion, row: &SkyPatchCounts) -> f64 {
    let angles = question.dome.patches().solid_angles();
    let reflected =
        |patch: usize, radiance: f64| PI * radiance * row.reflected[patch] as f64 / row.walks as f64;
    let change = |hour: &sky::Hour| {
        let spread: f64 = hour.sun.iter().map(|&(patch, radiance)| reflected(patch, radiance)).sum();
        let own = question.dome.patches().of(hour.direction).map_or(0, |patch| patch as usize + 1);
        let alone = if own > 0 { reflected(own, hour.beam / angles[own - 1]) } else { 0.0 };
        spread - alone
    };
    let lit = question.year.hours.iter().filter(|hour| hour.beam > 0.0);
    (lit.map(change).sum::<f64>() / question.year.hours.len() as f64).abs()
}
