//! The figures of planes of points: mean, minimum, maximum and uniformities, each with its interval.

use serde::{Deserialize, Serialize};
use stats::{Interval, UncertainMean, minimum_interval, quotient_interval};

use super::readings::{Reading, Readings};

/// A figure of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// The estimate; `None` where no sample is whole.
    pub value: Option<f64>,
    /// The lower end of its interval.
    pub low: f64,
    /// The upper end of its interval.
    pub high: f64,
}

impl Figure {
    /// The part of what is above it that comes of its error, where h² = e² + u² and u is for light that is `unmet`.
    fn part_of_error(&self, unmet: f64) -> f64 {
        let above = self.high - self.value.unwrap_or(0.0);
        if unmet > 0.0 { (1.0 - (unmet / above).powi(2)).max(0.0).sqrt() } else { 1.0 }
    }
}

/// The least or the largest of some numbers.
pub(super) struct Extreme {
    pub(super) figure: Figure,
    /// The standard error of its estimate.
    error: f64,
    /// How much more light there may be that no ray has met.
    unmet: f64,
}

/// What is known of a plane of points in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneFigures {
    /// The mean of its irradiances [W/m², or lx]. Its error is that of the samples' means, so that what the errors of points have in common
    /// is in it.
    pub mean: Figure,
    /// The least of them [W/m², or lx].
    pub minimum: Figure,
    /// The largest of them [W/m², or lx].
    pub maximum: Figure,
    /// U₀: the minimum over the mean.
    pub uniformity: Figure,
    /// U_d: the minimum over the maximum.
    pub diversity: Figure,
}

/// A figure of a plane that something may be demanded of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlaneFigure {
    /// [`PlaneFigures::mean`].
    Mean,
    /// [`PlaneFigures::minimum`].
    Minimum,
    /// [`PlaneFigures::uniformity`].
    Uniformity,
    /// [`PlaneFigures::diversity`].
    Diversity,
    /// [`super::glare::Glare::largest`], where every eye is examined: the one figure that is demanded to be no larger.
    Ugr,
}

/// Whether what is demanded of a figure is met, and how sure that is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sufficiency {
    /// Whether the estimate meets it.
    pub is_met: bool,
    /// The largest confidence at which the figure lies on the side of its estimate, in steps of a part of what is left to 1; at most
    /// [`Sufficiency::SUREST`], and ½ where its interval holds the demand at every level.
    pub confidence: f64,
}

impl Sufficiency {
    /// The largest confidence that is looked for.
    pub const SUREST: f64 = 0.9999;
}

impl Readings<'_> {
    /// The figures of plane number `plane` of [`crate::Sensors::planes`], in one channel.
    pub fn plane(&self, plane: usize, channel: usize) -> PlaneFigures {
        let errors = self.errors_of_plane(plane, channel);
        let common = self.correlation_of_points(plane, channel);
        let [minimum, maximum] = [1.0, -1.0].map(|sign| self.plane_extreme(plane, channel, common, sign));
        let mean = self.plane_mean(plane, channel);
        let unmet = self.unmet(self.sensors().cell_count() + plane, channel);
        let [of_minimum, of_maximum] = [&minimum, &maximum].map(|of| of.figure.part_of_error(of.unmet));
        let with_mean = errors.with_mean(minimum.error) * of_minimum * mean.part_of_error(unmet);
        let of_pair = errors.of_pair(minimum.error, maximum.error) * of_minimum * of_maximum;
        PlaneFigures {
            uniformity: quotient(&minimum.figure, &mean, with_mean),
            diversity: quotient(&minimum.figure, &maximum.figure, of_pair),
            mean,
            minimum: minimum.figure,
            maximum: maximum.figure,
        }
    }

    /// One of the figures of a plane in one channel.
    fn figure(&self, plane: usize, channel: usize, figure: PlaneFigure) -> Figure {
        let figures = || self.plane(plane, channel);
        match figure {
            PlaneFigure::Mean => figures().mean,
            PlaneFigure::Minimum => figures().minimum,
            PlaneFigure::Uniformity => figures().uniformity,
            PlaneFigure::Diversity => figures().diversity,
            PlaneFigure::Ugr => {
                let known = |at: f64| Figure { value: Some(at), low: at, high: at };
                match self.glare(plane) {
                    // Eyes that see no luminaire have no glare.
                    Some(glare) if glare.unexamined == 0 => glare.largest.unwrap_or(known(f64::NEG_INFINITY)),
                    // Those that are not examined may have any.
                    glare => {
                        let largest = glare.and_then(|glare| glare.largest);
                        let low = largest.map_or(f64::NEG_INFINITY, |largest| largest.low);
                        Figure { low, ..known(f64::INFINITY) }
                    }
                }
            }
        }
    }

    /// Whether a figure of a plane is at least as large as demanded, of UGR at most, in one channel.
    pub fn sufficiency(
        &self,
        plane: usize,
        channel: usize,
        figure: PlaneFigure,
        demanded: f64,
    ) -> Sufficiency {
        let known = self.figure(plane, channel, figure);
        let reaches =
            |value: f64| if figure == PlaneFigure::Ugr { value <= demanded } else { value >= demanded };
        let is_met = known.value.is_some_and(reaches);
        // One side of the interval of a mean fails with half of the probability, that of others with all of it.
        let level =
            |one_sided: f64| if figure == PlaneFigure::Mean { 2.0 * one_sided - 1.0 } else { one_sided };
        let is_sure = |one_sided: f64| {
            let Figure { low, high, .. } = self.at_level(level(one_sided)).figure(plane, channel, figure);
            [low, high].into_iter().all(|limit| reaches(limit) == is_met)
        };
        // What is left to 1 falls by 2⁻¼ from step to step.
        let steps = (1..50).map(|k| 1.0 - 0.5 * 0.5_f64.powf(0.25 * f64::from(k)));
        let levels = steps.take_while(|&level| level < Sufficiency::SUREST).chain([Sufficiency::SUREST]);
        let levels: Vec<f64> = levels.collect();
        // Intervals grow with their level.
        let sure = if known.value.is_some() { levels.partition_point(|&level| is_sure(level)) } else { 0 };
        Sufficiency { is_met, confidence: sure.checked_sub(1).map_or(0.5, |last| levels[last]) }
    }

    fn plane_mean(&self, plane: usize, channel: usize) -> Figure {
        let Reading { irradiance, ci_low, ci_high, .. } = self.plane_reading(plane, channel);
        Figure { value: irradiance, low: ci_low, high: ci_high }
    }

    /// The correlation of two points of a plane.
    pub(super) fn correlation_of_points(&self, plane: usize, channel: usize) -> f64 {
        self.errors_of_plane(plane, channel).of_pair(0.0, 0.0)
    }

    /// What the errors of a plane's points have in common.
    fn errors_of_plane(&self, plane: usize, channel: usize) -> PlaneErrors {
        let sensor = self.sensors().planes().nth(plane).expect("a plane of the job");
        let cells = self.sensors().cells_of(sensor);
        let points = cells.len() as f64;
        let mean = self.sample_error(self.sensors().cell_count() + plane, channel);
        let errors = cells.map(|cell| self.sample_error(cell, channel));
        let [sum, squares] = errors.fold([0.0; 2], |[sum, squares], s| [sum + s, squares + s * s]);
        let shared = (points * mean).powi(2) - squares;
        PlaneErrors { mean, typical: sum / points, shared: shared / (points * (points - 1.0)).max(1.0) }
    }

    /// The least irradiance of a plane's points, or, with `sign` −1, the largest: the least with the signs
    /// turned round.
    fn plane_extreme(&self, plane: usize, channel: usize, correlation: f64, sign: f64) -> Extreme {
        let sensor = self.sensors().planes().nth(plane).expect("a plane of the job");
        let points = self.sensors().cells_of(sensor).map(|cell| self.known_at(cell, channel));
        let Extreme { figure, error, unmet } = self.extreme(points, correlation, sign);
        let figure = Figure { value: figure.value.filter(|_| self.samples() > 0), ..figure };
        Extreme { figure, error, unmet }
    }

    /// What is known of the irradiance at a cell.
    fn known_at(&self, cell: usize, channel: usize) -> ValueWithError {
        let Reading { irradiance, std_error, ci_low, ci_high } = self.reading(cell, channel);
        let has_error = std_error.is_some_and(|error| error > 0.0);
        let error = if has_error { self.sample_error(cell, channel) } else { 0.0 };
        let unmet = self.unmet(cell, channel);
        ValueWithError { value: irradiance.unwrap_or(0.0), error, limits: [ci_low, ci_high], unmet }
    }

    /// Cylindrical over horizontal illuminance, the index of modelling (EN 12464-1), at the points of two planes: the least and the largest. The
    /// standard errors of a pair are taken to be independent, which makes their quotient's no smaller than it is: both have the noise
    /// of the same walks. Points without light are left out; `None` where all are.
    pub fn modelling(&self, cylinders: usize, plane: usize, channel: usize) -> Option<[Figure; 2]> {
        let sensor = |plane| self.sensors().planes().nth(plane).expect("a plane of the job");
        let [tops, bottoms] = [cylinders, plane].map(|plane| self.sensors().cells_of(sensor(plane)));
        let quotient = |(top, bottom): (usize, usize)| {
            let [top, bottom] = [top, bottom].map(|cell| self.known_at(cell, channel));
            let value = top.value / bottom.value;
            let error = value * (top.error / top.value).hypot(bottom.error / bottom.value);
            let limits = [top.limits[0] / bottom.limits[1], top.limits[1] / bottom.limits[0]];
            (top.value > 0.0 && bottom.value > 0.0).then_some(ValueWithError {
                value,
                error,
                limits,
                unmet: 0.0,
            })
        };
        let known: Vec<ValueWithError> = tops.zip(bottoms).filter_map(quotient).collect();
        (self.samples() > 0 && !known.is_empty())
            .then(|| [1.0, -1.0].map(|sign| self.extreme(known.iter().copied(), 0.0, sign).figure))
    }

    /// The least of some numbers, whose errors have this correlation in pairs, with the standard error of its estimate, or, with `sign` −1, the largest.
    pub(super) fn extreme(
        &self,
        known: impl Iterator<Item = ValueWithError>,
        correlation: f64,
        sign: f64,
    ) -> Extreme {
        let turned = |ValueWithError { value, error, limits: [low, high], unmet }: ValueWithError| {
            let [low, high] = if sign > 0.0 { [low, high] } else { [-high, -low] };
            ([sign * value, error, low, high], unmet)
        };
        let readings: Vec<([f64; 4], f64)> = known.map(turned).collect();
        let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let (first, unmet) =
            readings.iter().min_by(|(a, _), (b, _)| a[0].total_cmp(&b[0])).expect("a plane has points");
        // What no spread is known of stands by itself: it is exact, or bounded.
        let (uncertain, alone): (Vec<([f64; 4], f64)>, Vec<_>) =
            readings.iter().copied().partition(|(of, _)| of[1] > 0.0);
        let [mut low, mut high] =
            [2, 3].map(|limit: usize| least(&mut alone.iter().map(|(of, _)| of[limit])));
        if !uncertain.is_empty() {
            // Light that is unmet adds to the points: it lifts the least, and lowers what is turned round.
            let estimate = |&(of, unmet): &([f64; 4], f64)| UncertainMean {
                mean: of[0],
                error: of[1],
                unmet: if sign > 0.0 { [0.0, unmet] } else { [unmet, 0.0] },
            };
            let estimates: Vec<UncertainMean> = uncertain.iter().map(estimate).collect();
            let of_reported =
                minimum_interval(&estimates, correlation, self.confidence(), self.samples() - 1);
            (low, high) = (low.min(of_reported.low), high.min(of_reported.high));
        }
        let [low, high] = if sign > 0.0 { [low, high] } else { [-high, -low] };
        let value = sign * first[0];
        // Ratings of glare alone may be below 0.
        let figure = Figure { value: Some(value), low: low.max(value.min(0.0)), high };
        Extreme { figure, error: first[1], unmet: *unmet }
    }
}

/// A number with its standard error, which is 0 where none is known, and the interval of itself alone.
#[derive(Clone, Copy)]
pub(super) struct ValueWithError {
    pub(super) value: f64,
    pub(super) error: f64,
    pub(super) limits: [f64; 2],
    /// How much more light there may be that no ray has met.
    pub(super) unmet: f64,
}

/// A figure over a larger one, given the correlation of their errors; 1 where there is no light.
fn quotient(least: &Figure, of: &Figure, correlation: f64) -> Figure {
    let Some((top, bottom)) = least.value.zip(of.value).filter(|&(_, bottom)| bottom > 0.0) else {
        return Figure { value: None, low: 0.0, high: 1.0 };
    };
    let limits = |figure: &Figure| Interval { low: figure.low, high: figure.high };
    let known = quotient_interval((top, limits(least)), (bottom, limits(of)), correlation);
    Figure { value: Some((top / bottom).min(1.0)), low: known.low.min(1.0), high: known.high.min(1.0) }
}

/// What standard errors of points and of their mean tell of correlations: the covariances of all points with the mean have the variance of
/// the mean as their mean, and those of two points the rest of it. Single ones are not known; a point whose error is above the
/// others' is taken to have no more of it in common with them.
struct PlaneErrors {
    /// The standard error of the mean.
    mean: f64,
    /// The mean of the points' standard errors.
    typical: f64,
    /// The mean covariance of two points.
    shared: f64,
}

impl PlaneErrors {
    /// The correlation of the mean with a point of this standard error.
    fn with_mean(&self, error: f64) -> f64 {
        let larger = error.max(self.typical);
        if larger > 0.0 { (self.mean / larger).min(1.0) } else { 0.0 }
    }

    /// The correlation of two points of these standard errors.
    fn of_pair(&self, a: f64, b: f64) -> f64 {
        let product = a.max(self.typical) * b.max(self.typical);
        if product > 0.0 { (self.shared / product).clamp(0.0, 1.0) } else { 0.0 }
    }
}
