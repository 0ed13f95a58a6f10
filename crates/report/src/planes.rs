//! `planes.csv` and the figures of planes: one row per point, in the order of the scene file.

use std::io::{self, Write};

use glam::DVec3;
use radiosity::{
    planes::{Figure, PlaneFigure, Sufficiency},
    precision::{Glare, Unexamined},
    sensors::{Reading, Readings, SensorCell, SensorShape},
};
use serde::Serialize;

use crate::patches::per_channel;
use crate::words::counted;

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
    /// The largest illuminance of a point.
    pub maximum: PerChannel,
    /// U₀: the minimum over the mean.
    pub uniformity: PerChannel,
    /// U_d: the minimum over the maximum.
    pub diversity: PerChannel,
    /// The points that hardly any light comes to; absent where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dim: Option<DimPoints>,
    /// Of cylinders at the points of another plane that faces up, their light over its; absent of others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modelling: Option<ModellingSummary>,
    /// Glare at the eyes of the plane; absent where its points are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ugr: Option<GlareSummary>,
    /// Whether the figures reach what is demanded of them; absent where nothing is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub demands: Vec<DemandSummary>,
    /// What each source brings to the mean; absent where sources are not distinguished.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<PlaneSource>,
    /// The largest half-width over the estimate of a point; `null` where nothing was found for one.
    pub relative_error: f64,
    /// What the target asks of every point; absent where it asks nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
}

/// Points that hardly any light comes to: less than [`DimPoints::PART`] of what comes to others. Most lie inside of furniture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DimPoints {
    /// How many there are.
    pub points: usize,
    /// The darkest of them [m].
    pub darkest: [f64; 3],
}

impl DimPoints {
    /// The part of the others' light below which a point is dim.
    pub const PART: f64 = 0.01;

    /// Those of a plane, by its mean in every channel.
    fn of(readings: &Readings, sensor: usize, means: &PerChannel) -> Option<Self> {
        let sensors = readings.sensors();
        // The light of a point, in the channel in which it has most of the mean.
        let part = |cell: usize| {
            let known = readings.cell(cell).into_iter().zip(means.each());
            let parts = known.map(|(at, mean)| at.irradiance.unwrap_or(0.0) / mean.value.unwrap_or(0.0));
            parts.filter(|part| part.is_finite()).reduce(f64::max)
        };
        let parts = sensors.cells_of(sensor).filter_map(|cell| Some((cell, part(cell)?)));
        let dim: Vec<(usize, f64)> = parts.filter(|&(_, part)| part < Self::PART).collect();
        let &(darkest, _) = dim.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(DimPoints { points: dim.len(), darkest: sensors.cell(darkest).middle.to_array() })
    }

    /// How many there are, by what light of others, and what to do about them.
    pub fn words(&self, others: &str, figures: &str) -> String {
        let [x, y, z] = self.darkest;
        let have = if self.points == 1 { "has" } else { "have" };
        format!(
            "{} {have} less than {} % of {others}, the darkest at [{x:.3}, {y:.3}, {z:.3}]; if it lies inside of furniture, {figures} that count it say little: move the plane, or list the points outside in [[points]]",
            counted(self.points as u64, "place"),
            100.0 * Self::PART
        )
    }
}

/// Whether a figure of a plane reaches what is demanded of it, in every channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DemandSummary {
    /// The figure.
    pub figure: PlaneFigure,
    /// What it is to be at least; of UGR at most.
    pub least: f64,
    /// Whether the estimate is so.
    pub met: bool,
    /// With what confidence, up to [`Sufficiency::SUREST`]; ½ where it is open.
    pub confidence: f64,
}

impl DemandSummary {
    /// The worst of the channels.
    fn of(readings: &Readings, plane: usize, (figure, least): (PlaneFigure, f64)) -> Self {
        let channels = (0..readings.channels()).map(|c| readings.sufficiency(plane, c, figure, least));
        let badness = |of: &Sufficiency| if of.is_met { -of.confidence } else { of.confidence };
        let worst = channels.max_by(|a, b| badness(a).total_cmp(&badness(b)));
        let Sufficiency { is_met: met, confidence } = worst.expect("there is a channel");
        DemandSummary { figure, least, met, confidence }
    }

    /// The verdict in words; `unit` is that of illuminance.
    pub fn words(&self, unit: &str) -> String {
        let DemandSummary { figure, least, met, confidence } = *self;
        let what = match figure {
            PlaneFigure::Mean => format!("mean of {least} {unit}"),
            PlaneFigure::Minimum => format!("minimum of {least} {unit}"),
            PlaneFigure::Uniformity => format!("U₀ of {least}"),
            PlaneFigure::Diversity => format!("U_d of {least}"),
            PlaneFigure::Ugr => format!("UGR of {least}"),
        };
        // Rounded down: the confidence is never more than said.
        let percent = (1e4 * confidence + 1e-9).floor() / 100.0;
        match (met, confidence > 0.5) {
            (_, false) => format!("{what} open"),
            (true, true) => format!("{what} met with {percent} %"),
            (false, true) => format!("{what} missed with {percent} %"),
        }
    }
}

/// The cylindrical over the horizontal illuminance of points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModellingSummary {
    /// The name of the plane of horizontal illuminance.
    pub plane: String,
    /// The least of the points.
    pub least: PerChannel,
    /// The largest of the points.
    pub largest: PerChannel,
}

impl ModellingSummary {
    /// That of a plane of cylinders, where another plane has the same points and faces up.
    fn of(readings: &Readings, number: usize, sensor: usize) -> Option<Self> {
        let specs = readings.sensors().specs();
        let SensorShape::Cylinders { points, half: false, .. } = &specs[sensor].shape else { return None };
        let is_same = |&(_, other): &(usize, usize)| match &specs[other].shape {
            SensorShape::Points { points: others, .. } => {
                let pair =
                    |(a, b): (&[DVec3; 2], &[DVec3; 2])| a[0] == b[0] && b[1].x == 0.0 && b[1].y == 0.0;
                others.len() == points.len() && points.iter().zip(others).all(pair)
            }
            _ => false,
        };
        let (plane, other) = readings.sensors().planes().enumerate().find(is_same)?;
        let each = (0..readings.channels()).map(|channel| readings.modelling(number, plane, channel));
        let each = each.collect::<Option<Vec<_>>>()?;
        let [least, largest] = [0, 1].map(|k| PerChannel::of(each.iter().map(|both| both[k]).collect()));
        Some(ModellingSummary { plane: specs[other].name.clone(), least, largest })
    }

    /// Both in words.
    pub fn words(&self) -> String {
        format!("modelling over {:?} from {} to {}", self.plane, self.least.words(), self.largest.words())
    }
}

/// The unified glare rating at the eyes of a plane.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GlareSummary {
    /// The largest of the eyes that see a luminaire and are examined; `null` where none is.
    pub largest: Option<FigureInterval>,
    /// The eyes that see no luminaire.
    pub undisturbed: usize,
    /// The eyes at which the formula does not hold.
    pub unexamined: usize,
    /// Why it does not at the first of these; `null` where it holds at all.
    pub because: Option<Unexamined>,
}

impl GlareSummary {
    fn of(Glare { largest, undisturbed, unexamined, because }: Glare) -> Self {
        let largest = largest.map(|Figure { value, low, high }| FigureInterval { value, low, high });
        GlareSummary { largest, undisturbed, unexamined, because }
    }

    /// The rating in words.
    pub fn words(&self) -> String {
        let largest = match self.largest {
            Some(largest) => format!("UGR up to {}", PerChannel::Grey(largest).words()),
            None if self.unexamined == 0 => "no luminaire is seen".into(),
            None => "UGR not examined".into(),
        };
        match self.because {
            Some(because) if self.largest.is_some() => {
                format!("{largest}, not examined at {} of the eyes: {}", self.unexamined, because.words())
            }
            Some(because) => format!("{largest}: {}", because.words()),
            None => largest,
        }
    }
}

/// The part of a source in the mean of a plane.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlaneSource {
    /// The name of the source.
    pub name: String,
    /// The mean illuminance by its light alone.
    pub mean: PerChannel,
}

/// A figure of a grey scene, or of every channel of a coloured one.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum PerChannel {
    /// Of a grey scene.
    Grey(FigureInterval),
    /// Of red, green and blue.
    Coloured(Vec<FigureInterval>),
}

/// A figure with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FigureInterval {
    /// The estimate; `null` where there is none.
    pub value: Option<f64>,
    /// The lower end of its interval.
    pub low: f64,
    /// The upper end of its interval.
    pub high: f64,
}

impl PerChannel {
    fn of(figures: Vec<Figure>) -> Self {
        let mut each: Vec<FigureInterval> = figures
            .into_iter()
            .map(|Figure { value, low, high }| FigureInterval { value, low, high })
            .collect();
        match each.len() {
            1 => PerChannel::Grey(each.remove(0)),
            _ => PerChannel::Coloured(each),
        }
    }

    fn each(&self) -> &[FigureInterval] {
        match self {
            PerChannel::Grey(figure) => std::slice::from_ref(figure),
            PerChannel::Coloured(each) => each,
        }
    }

    /// The figures with their intervals, in words; in colour each after the name of its channel.
    pub fn words(&self) -> String {
        let one = |figure: &FigureInterval| {
            let FigureInterval { value, low, high } = *figure;
            let decimals = decimals(figure);
            let value = value.map_or("unknown".into(), |value| format!("{value:.decimals$}"));
            format!("{value} ({low:.decimals$} … {high:.decimals$})")
        };
        let names: &[&str] = if self.each().len() == 1 { &[""] } else { &["red ", "green ", "blue "] };
        let each = self.each().iter().zip(names).map(|(figure, name)| format!("{name}{}", one(figure)));
        each.collect::<Vec<_>>().join(", ")
    }
}

/// Decimals that show two digits of half of an interval, or four of a number without one.
fn decimals(&FigureInterval { value, low, high }: &FigureInterval) -> usize {
    let shown = match 0.5 * (high - low) {
        half if half > 0.0 => 0.1 * half,
        _ => 1e-3 * value.unwrap_or(1.0).abs(),
    };
    (-shown.max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize
}

/// The figures of every plane, where the `names` are those of sources that are distinguished; `asked` is what the target asks of a sensor, and
/// `demanded` of the figures of one.
pub fn plane_summaries<D: Iterator<Item = (PlaneFigure, f64)>>(
    readings: &Readings,
    names: &[String],
    asked: impl Fn(usize) -> Option<f64>,
    demanded: impl Fn(usize) -> D,
) -> Vec<PlaneSummary> {
    let sensors = readings.sensors();
    let of_source = |name: &String, source: usize, number: usize| {
        let own = readings.of_source(source)?;
        let means = (0..own.channels()).map(|c| own.plane(number, c).mean).collect();
        Some(PlaneSource { name: name.clone(), mean: PerChannel::of(means) })
    };
    let summary = |(number, sensor): (usize, usize)| {
        let figures: Vec<_> = (0..readings.channels()).map(|c| readings.plane(number, c)).collect();
        let per = |of: &dyn Fn(&radiosity::planes::PlaneFigures) -> Figure| {
            PerChannel::of(figures.iter().map(of).collect())
        };
        let mean = per(&|figures| figures.mean);
        PlaneSummary {
            name: sensors.specs()[sensor].name.clone(),
            points: sensors.cells_of(sensor).len(),
            dim: DimPoints::of(readings, sensor, &mean),
            mean,
            minimum: per(&|figures| figures.minimum),
            maximum: per(&|figures| figures.maximum),
            uniformity: per(&|figures| figures.uniformity),
            diversity: per(&|figures| figures.diversity),
            modelling: ModellingSummary::of(readings, number, sensor),
            ugr: readings.glare(number).map(GlareSummary::of),
            demands: demanded(sensor).map(|demand| DemandSummary::of(readings, number, demand)).collect(),
            sources: names
                .iter()
                .zip(0..)
                .filter_map(|(name, source)| of_source(name, source, number))
                .collect(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_show_two_digits_of_their_intervals() {
        let words = |value: f64, half: f64| {
            let figure = FigureInterval { value: Some(value), low: value - half, high: value + half };
            PerChannel::Grey(figure).words()
        };
        assert_eq!(words(389.652, 0.1208), "389.65 (389.53 … 389.77)");
        assert_eq!(words(1272.4, 34.0), "1272 (1238 … 1306)");
        let coloured = PerChannel::Coloured(vec![FigureInterval { value: None, low: 0.0, high: 1.0 }; 3]);
        assert!(
            coloured.words().starts_with("red unknown (0.00 … 1.00), green unknown"),
            "{}",
            coloured.words()
        );
        assert_eq!(words(0.74244, 0.0), "0.7424 (0.7424 … 0.7424)");
    }
}
