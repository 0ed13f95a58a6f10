//! `planes.csv` and the figures of planes: one row per point, in the order of the scene file.

use std::io::{self, Write};

use radiosity::{Figure, Reading, Readings, SensorCell};
use serde::Serialize;

use crate::patches::per_channel;
use crate::words::quantity;

/// The figures of a plane, or a list, of points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaneSummary {
    /// The name of the plane.
    pub name: String,
    /// Its points, whose rows in `planes.csv` follow those of the planes before it.
    pub points: usize,
    /// The mean illuminance; one for each channel.
    pub mean: PerChannel,
    /// The least illuminance of a point.
    pub minimum: PerChannel,
    /// U₀: the minimum over the mean.
    pub uniformity: PerChannel,
    /// The largest half-width over the estimate of a point; `null` where nothing was found for one.
    pub relative_error: f64,
    /// What the target asks of every point; absent where it asks nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
}

/// A figure of a grey scene, or of every channel of a coloured one.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum PerChannel {
    /// Of a grey scene.
    Grey(Interval),
    /// Of red, green and blue.
    Coloured(Vec<Interval>),
}

/// A figure with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The estimate; `null` where there is none.
    pub value: Option<f64>,
    /// The lower end of its interval.
    pub low: f64,
    /// The upper end of its interval.
    pub high: f64,
}

impl PerChannel {
    fn of(figures: Vec<Figure>) -> Self {
        let mut each: Vec<Interval> =
            figures.into_iter().map(|Figure { value, low, high }| Interval { value, low, high }).collect();
        match each.len() {
            1 => PerChannel::Grey(each.remove(0)),
            _ => PerChannel::Coloured(each),
        }
    }

    fn each(&self) -> &[Interval] {
        match self {
            PerChannel::Grey(figure) => std::slice::from_ref(figure),
            PerChannel::Coloured(each) => each,
        }
    }

    /// The figures with their intervals, in words.
    pub fn words(&self) -> String {
        let one = |Interval { value, low, high }: &Interval| {
            let value = value.map_or("unknown".into(), quantity);
            format!("{value} ({} … {})", quantity(*low), quantity(*high))
        };
        self.each().iter().map(one).collect::<Vec<_>>().join(", ")
    }
}

/// The figures of every plane; `asked` is what the target asks of a sensor.
pub fn plane_summaries(readings: &Readings, asked: impl Fn(usize) -> Option<f64>) -> Vec<PlaneSummary> {
    let sensors = readings.sensors();
    let summary = |(number, sensor): (usize, usize)| {
        let figures: Vec<_> = (0..readings.channels()).map(|c| readings.plane(number, c)).collect();
        let per = |of: &dyn Fn(&radiosity::PlaneFigures) -> Figure| {
            PerChannel::of(figures.iter().map(of).collect())
        };
        PlaneSummary {
            name: sensors.specs()[sensor].name.clone(),
            points: sensors.cells_of(sensor).len(),
            mean: per(&|figures| figures.mean),
            minimum: per(&|figures| figures.minimum),
            uniformity: per(&|figures| figures.uniformity),
            relative_error: readings.worst_error(sensor, false),
            target: asked(sensor),
        }
    };
    sensors.planes().enumerate().map(summary).collect()
}

/// Writes what the points of planes read, in the order of Radiance: place, direction, light.
///
/// # Errors
/// Those of `writer`.
pub fn write_planes(writer: impl Write, readings: &Readings) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let channels = readings.channels();
    let place = ["x", "y", "z", "dx", "dy", "dz"].map(String::from);
    let light = ["illuminance", "std_error", "ci_low", "ci_high"];
    table.write_record(place.into_iter().chain(light.iter().flat_map(|name| per_channel(name, channels))))?;
    let columns: [fn(&Reading) -> Option<f64>; 4] =
        [|r| r.irradiance, |r| r.std_error, |r| Some(r.ci_low), |r| Some(r.ci_high)];
    let sensors = readings.sensors();
    for number in sensors.planes().flat_map(|plane| sensors.cells_of(plane)) {
        let SensorCell { middle, normal, .. } = sensors.cell(number);
        let known = readings.cell(number);
        let light: Vec<Option<f64>> = columns.iter().flat_map(|of| known.iter().map(of)).collect();
        table.serialize((middle.to_array(), normal.to_array(), light))?;
    }
    table.flush()
}
