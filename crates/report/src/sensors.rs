//! `sensors.csv`: one row per patch of a sensor, in the order of the scene file.

use std::io::{self, Write};

use radiosity::sensors::{Reading, Readings, SensorCell};
use serde::Serialize;

use crate::patches::per_channel;

/// The summary of the sensors of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorsSummary {
    /// Independent samples that their intervals come from.
    pub samples: u64,
    /// Rays that they sent, beside those of the walks.
    pub rays: u64,
    /// Whether all are known as well as the target asks; absent where it asks nothing of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reached: Option<bool>,
    /// In the order of the scene file.
    pub list: Vec<SensorSummary>,
}

/// The summary of one sensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorSummary {
    /// The name of the sensor.
    pub name: String,
    /// How many patches it has.
    pub patches: usize,
    /// The largest half-width over the estimate of a patch of it; `null` where nothing was found for one.
    pub relative_error: f64,
    /// What the target asks of it; absent where it asks nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
}

/// Writes what sensors read, but for planes of points, which have a table of their own.
///
/// # Errors
/// Those of `writer`.
pub fn write_sensors(writer: impl Write, readings: &Readings) -> io::Result<()> {
    let sensors = readings.sensors();
    let is_plane = |cell: &usize| sensors.specs()[sensors.cell(*cell).sensor].shape.is_plane();
    write_cells(writer, readings, (0..sensors.cell_count()).filter(|cell| !is_plane(cell)))
}

/// Writes what some cells read.
pub(crate) fn write_cells(
    writer: impl Write,
    readings: &Readings,
    cells: impl Iterator<Item = usize>,
) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let channels = readings.channels();
    let place = ["sensor", "u", "v", "x", "y", "z"].map(String::from);
    let light = ["irradiance", "std_error", "ci_low", "ci_high"];
    table.write_record(place.into_iter().chain(light.iter().flat_map(|name| per_channel(name, channels))))?;
    let columns: [fn(&Reading) -> Option<f64>; 4] =
        [|r| r.irradiance, |r| r.std_error, |r| Some(r.ci_low), |r| Some(r.ci_high)];
    let sensors = readings.sensors();
    for number in cells {
        let SensorCell { sensor, cell, middle, .. } = sensors.cell(number);
        let known = readings.cell(number);
        let light: Vec<Option<f64>> = columns.iter().flat_map(|of| known.iter().map(of)).collect();
        table.serialize((&sensors.specs()[sensor].name, cell, middle.to_array(), light))?;
    }
    table.flush()
}
