//! The figures of planes of points: mean, minimum and uniformity, each with its interval.

use stats::minimum_interval;

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

/// What is known of a plane of points in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneFigures {
    /// The mean of its irradiances [W/m², or lx]. Its error is that of the samples' means, so that what the errors of points have in common
    /// is in it.
    pub mean: Figure,
    /// The least of them [W/m², or lx].
    pub minimum: Figure,
    /// U₀: the minimum over the mean. Either interval fails with half the probability, however their errors hang together.
    pub uniformity: Figure,
}

impl Readings<'_> {
    /// The figures of plane number `plane` of [`crate::Sensors::planes`], in one channel.
    pub fn plane(&self, plane: usize, channel: usize) -> PlaneFigures {
        let [half_mean, half_minimum] = {
            let halved = self.at_level(0.5 * (1.0 + self.confidence()));
            [halved.plane_mean(plane, channel), halved.plane_minimum(plane, channel)]
        };
        let (mean, minimum) = (self.plane_mean(plane, channel), self.plane_minimum(plane, channel));
        let ratio = |minimum: f64, mean: f64| if mean > 0.0 { (minimum / mean).min(1.0) } else { 1.0 };
        let values = minimum.value.zip(mean.value).filter(|&(_, mean)| mean > 0.0);
        let uniformity = Figure {
            value: values.map(|(minimum, mean)| ratio(minimum, mean)),
            low: if half_mean.high > 0.0 { ratio(half_minimum.low, half_mean.high) } else { 0.0 },
            high: ratio(half_minimum.high, half_mean.low),
        };
        PlaneFigures { mean, minimum, uniformity }
    }

    fn plane_mean(&self, plane: usize, channel: usize) -> Figure {
        let Reading { irradiance, ci_low, ci_high, .. } = self.plane_reading(plane, channel);
        Figure { value: irradiance, low: ci_low, high: ci_high }
    }

    fn plane_minimum(&self, plane: usize, channel: usize) -> Figure {
        let sensor = self.sensors().planes().nth(plane).expect("a plane of the job");
        let cells = self.sensors().cells_of(sensor);
        let readings: Vec<Reading> = cells.clone().map(|cell| self.reading(cell, channel)).collect();
        let least = |of: &dyn Fn(&Reading) -> f64| readings.iter().map(of).fold(f64::INFINITY, f64::min);
        let value = (self.samples() > 0).then(|| least(&|reading| reading.irradiance.unwrap_or(0.0)));
        // What no spread is known of stands by itself: it is exact, or bounded.
        let (told, alone): (Vec<_>, Vec<_>) =
            cells.zip(&readings).partition(|(_, reading)| reading.std_error.is_some_and(|error| error > 0.0));
        let limits = |of: fn(&Reading) -> f64| alone.iter().map(move |(_, reading)| of(reading));
        let mut low = limits(|reading| reading.ci_low).fold(f64::INFINITY, f64::min);
        let mut high = limits(|reading| reading.ci_high).fold(f64::INFINITY, f64::min);
        let estimate = |&(cell, reading): &(usize, &Reading)| {
            [reading.irradiance.unwrap_or(0.0), self.sample_error(cell, channel)]
        };
        let estimates: Vec<[f64; 2]> = told.iter().map(estimate).collect();
        if !estimates.is_empty() {
            let of_told = minimum_interval(&estimates, self.confidence(), self.samples() - 1);
            (low, high) = (low.min(of_told.low), high.min(of_told.high));
        }
        Figure { value, low: low.max(0.0), high }
    }
}
