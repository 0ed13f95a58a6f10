//! `annual.csv`, `annual.ill` and `daylight.json`: the daylight of a year, place by place.

use std::io::{self, Write};

use serde::Serialize;
use sky::{BoundedValue, Metrics, TARGETS};

/// A row of `annual.csv`.
#[derive(Clone, Debug)]
pub struct DaylightRow<'a> {
    /// The name of the sensor.
    pub sensor: &'a str,
    /// The cell of it.
    pub cell: [u32; 2],
    /// The middle of the cell [m].
    pub middle: [f64; 3],
    /// Walks that were born there.
    pub walks: u64,
    /// The daylight factor [%].
    pub daylight_factor: BoundedValue,
    /// The figures of the year.
    pub metrics: Metrics,
}

/// Writes the figures of every place, each with the ends of its interval.
///
/// # Errors
/// Those of `writer`.
pub fn write_daylight(writer: impl Write, rows: &[DaylightRow<'_>]) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let known = ["daylight_factor", "mean", "autonomy", "useful", "excess"].map(String::from);
    let daylight = TARGETS.map(|target| format!("daylight_{target}"));
    let figures = known.iter().chain(&daylight);
    let place = ["sensor", "u", "v", "x", "y", "z", "walks"].map(String::from);
    let columns = figures.flat_map(|name| [name.clone(), format!("{name}_low"), format!("{name}_high")]);
    table.write_record(place.into_iter().chain(columns))?;
    for DaylightRow { sensor, cell, middle, walks, daylight_factor, metrics } in rows {
        let Metrics { mean, enough, useful, excess, daylight } = metrics;
        let all = [daylight_factor, mean, enough, useful, excess].into_iter().chain(daylight);
        let numbers: Vec<f64> = all.flat_map(|known| [known.value, known.low, known.high]).collect();
        table.serialize((sensor, cell, middle, walks, numbers))?;
    }
    table.flush()
}

/// Writes the light of every place in a line, hour by hour, to a hundredth.
///
/// # Errors
/// Those of `writer`.
pub fn write_ill(
    mut writer: impl Write,
    places: impl Iterator<Item = impl Iterator<Item = f64>>,
) -> io::Result<()> {
    for place in places {
        let line: Vec<String> = place.map(|light| format!("{light:.2}")).collect();
        writeln!(writer, "{}", line.join(" "))?;
    }
    Ok(())
}

/// `daylight.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DaylightSummary {
    /// Of the program.
    pub version: String,
    /// Of the walks.
    pub seed: u64,
    /// The place of the weather.
    pub city: String,
    /// Hours of the weather file.
    pub hours: usize,
    /// Patches of the sky.
    pub patches: usize,
    /// The reflectance of the ground.
    pub ground: f64,
    /// Places where light is measured.
    pub places: usize,
    /// All walks.
    pub walks: u64,
    /// Their rays.
    pub rays: u64,
    /// The part of the walks that ended on backs.
    pub back: f64,
    /// The level of intervals.
    pub confidence: f64,
    /// The relative half-width that is asked of yearly means.
    pub tolerance: f64,
    /// Whether every place meets it.
    pub reached: bool,
    /// The illuminance that is enough [lx].
    pub enough: f64,
    /// Between these daylight is useful [lx].
    pub useful: [f64; 2],
    /// The first and the last of the occupied hours, by their ends.
    pub occupied: [u32; 2],
    /// By what part of themselves yearly means change where reflected sun comes from one patch in place of four: the median and the most.
    pub sun_smear: [f64; 2],
    /// The level of each sensor by EN 17037.
    pub levels: Vec<LevelSummary>,
    /// Wall time of walking [s].
    pub seconds: f64,
    /// Processor time of walking [s].
    pub cpu_seconds: f64,
}

/// The level of a sensor by EN 17037: `none`, `minimum`, `medium` or `high`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelSummary {
    /// The name of the sensor.
    pub sensor: String,
    /// By the lower ends of intervals.
    pub low: &'static str,
    /// By the upper ends.
    pub high: &'static str,
}

impl DaylightSummary {
    /// Writes the summary as JSON.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write(&self, writer: &mut dyn Write) -> io::Result<()> {
        serde_json::to_writer_pretty(&mut *writer, self)?;
        writer.write_all(b"\n")
    }
}
