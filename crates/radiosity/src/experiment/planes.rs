//! The figures of planes of points: mean, minimum, maximum and uniformities, each with its interval.

use serde::{Deserialize, Serialize};
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
    /// The largest of them [W/m², or lx].
    pub maximum: Figure,
    /// U₀: the minimum over the mean. Either interval fails with half the probability, however their errors hang together.
    pub uniformity: Figure,
    /// U_d: the minimum over the maximum, with an interval that holds as that of U₀ does.
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
}

impl PlaneFigures {
    /// One of the figures.
    pub fn get(&self, figure: PlaneFigure) -> Figure {
        match figure {
            PlaneFigure::Mean => self.mean,
            PlaneFigure::Minimum => self.minimum,
            PlaneFigure::Uniformity => self.uniformity,
            PlaneFigure::Diversity => self.diversity,
        }
    }
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
        let halved = self.at_level(0.5 * (1.0 + self.confidence()));
        let [minimum, half_minimum] = [self, &halved].map(|of| of.plane_extreme(plane, channel, 1.0));
        let [maximum, half_maximum] = [self, &halved].map(|of| of.plane_extreme(plane, channel, -1.0));
        let [mean, half_mean] = [self, &halved].map(|of| of.plane_mean(plane, channel));
        let ratio = |minimum: f64, mean: f64| if mean > 0.0 { (minimum / mean).min(1.0) } else { 1.0 };
        let over = |other: Figure, half: Figure| Figure {
            value: minimum.value.zip(other.value.filter(|&of| of > 0.0)).map(|(least, of)| ratio(least, of)),
            low: if half.high > 0.0 { ratio(half_minimum.low, half.high) } else { 0.0 },
            high: ratio(half_minimum.high, half.low),
        };
        let (uniformity, diversity) = (over(mean, half_mean), over(maximum, half_maximum));
        PlaneFigures { mean, minimum, maximum, uniformity, diversity }
    }

    /// Whether a figure of a plane is at least as large as demanded, in one channel.
    pub fn sufficiency(
        &self,
        (plane, channel): (usize, usize),
        figure: PlaneFigure,
        least: f64,
    ) -> Sufficiency {
        let known = self.plane(plane, channel).get(figure);
        let is_met = known.value.is_some_and(|value| value >= least);
        let is_sure = |one_sided: f64| {
            let Figure { low, high, .. } =
                self.at_level(2.0 * one_sided - 1.0).plane(plane, channel).get(figure);
            if is_met { low >= least } else { high < least }
        };
        // What is left to 1 falls by 2⁻¼ from step to step.
        let steps = (1..50).map(|k| 1.0 - 0.5 * 0.5_f64.powf(0.25 * f64::from(k)));
        let levels = steps.take_while(|&level| level < Sufficiency::SUREST).chain([Sufficiency::SUREST]);
        let confidence = levels.take_while(|&level| known.value.is_some() && is_sure(level)).last();
        Sufficiency { is_met, confidence: confidence.unwrap_or(0.5) }
    }

    fn plane_mean(&self, plane: usize, channel: usize) -> Figure {
        let Reading { irradiance, ci_low, ci_high, .. } = self.plane_reading(plane, channel);
        Figure { value: irradiance, low: ci_low, high: ci_high }
    }

    /// The least irradiance of a plane's points, or, with `sign` −1, the largest: the least with the signs turned round.
    fn plane_extreme(&self, plane: usize, channel: usize, sign: f64) -> Figure {
        let sensor = self.sensors().planes().nth(plane).expect("a plane of the job");
        let cells = self.sensors().cells_of(sensor);
        let readings: Vec<[f64; 4]> = cells
            .map(|cell| {
                let Reading { irradiance, std_error, ci_low, ci_high } = self.reading(cell, channel);
                let is_told = std_error.is_some_and(|error| error > 0.0);
                let error = if is_told { self.sample_error(cell, channel) } else { 0.0 };
                let [low, high] = if sign > 0.0 { [ci_low, ci_high] } else { [-ci_high, -ci_low] };
                [sign * irradiance.unwrap_or(0.0), error, low, high]
            })
            .collect();
        let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
        let value = (self.samples() > 0).then(|| sign * least(&mut readings.iter().map(|of| of[0])));
        // What no spread is known of stands by itself: it is exact, or bounded.
        let (told, alone): (Vec<[f64; 4]>, Vec<_>) = readings.iter().partition(|of| of[1] > 0.0);
        let [mut low, mut high] = [2, 3].map(|limit: usize| least(&mut alone.iter().map(|of| of[limit])));
        if !told.is_empty() {
            let estimates: Vec<[f64; 2]> = told.iter().map(|of| [of[0], of[1]]).collect();
            let of_told = minimum_interval(&estimates, self.confidence(), self.samples() - 1);
            (low, high) = (low.min(of_told.low), high.min(of_told.high));
        }
        let [low, high] = if sign > 0.0 { [low, high] } else { [-high, -low] };
        Figure { value, low: low.max(0.0), high }
    }
}
