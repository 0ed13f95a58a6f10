//! What chains tell of a face: the mean of n of them, and an interval of Student's t that leans upwards where few links count.

use std::collections::HashSet;

use stats::Moments;

use crate::experiment::{Experiment, Meaning};
use crate::geometry::face::Face;
use crate::jacobi::plan::Solve;
use crate::method::{Chains, Method};
use crate::tally::Tally;

/// How much shorter the lower half of an interval is, by the relative standard error, as Garwood's limits of a Poisson number are.
const LEAN_BELOW: f64 = 0.5;

/// How much longer the upper half of an interval is, by contributions: measured (docs/theory/intervals.md).
const LEAN_ABOVE: f64 = 2.0;

/// The estimate from the mean of n independent chains: its error follows Student's t with n − 1 degrees of freedom.
#[derive(Clone, Debug)]
pub(super) struct Student {
    /// Half-width of the interval, in standard errors of the mean; `None` of a single chain.
    quantile: Option<f64>,
    /// √(ν/(ν − 2)): the standard deviation of t; `None` where that is infinite, of 3 chains or fewer.
    pub(super) deviation: Option<f64>,
}

impl Student {
    pub(super) fn new(chains: u64, confidence: f64) -> Self {
        let freedom = chains.saturating_sub(1);
        let quantile = (freedom > 0).then(|| stats::student_quantile(0.5 + 0.5 * confidence, freedom));
        let deviation = (freedom > 2).then(|| (freedom as f64 / (freedom - 2) as f64).sqrt());
        Student { quantile, deviation }
    }

    /// What scores of `per_unit` each tell of a mean that is at most `most`. The standard error is that of the whole
    /// distribution, √(ν/(ν − 2)) times s/√n: it would be too small by as much, had the sample's own been taken for the
    /// truth. What a single chain says, or chains that all say the same, is bounded by `most` alone. `one` is what a single
    /// contribution may bring, 0 where contributions are many: the fewer of these the mean is worth, the more the interval leans upwards.
    pub(super) fn told(&self, moments: &Moments, per_unit: f64, most: f64, one: f64) -> Told {
        let mean = per_unit * moments.mean().unwrap_or(0.0);
        let sample_error =
            moments.standard_error().map(|error| per_unit * error).filter(|&error| error > 0.0);
        let (low, high) = match sample_error.zip(self.quantile) {
            Some((error, quantile)) => {
                let half_width = quantile * error;
                let (few, relative) =
                    if one > 0.0 && mean > 0.0 { (one / mean, error / mean) } else { (0.0, 0.0) };
                let below = half_width * (1.0 - LEAN_BELOW * relative.min(1.0));
                let above = half_width * (1.0 + LEAN_ABOVE * few);
                ((mean - below).max(0.0), mean + above)
            }
            None => (0.0, most.max(mean)),
        };
        let error = sample_error.zip(self.deviation).map(|(error, deviation)| deviation * error);
        Told { mean, error, low, high }
    }
}

/// A mean, its standard error, and its interval.
pub(super) struct Told {
    pub(super) mean: f64,
    pub(super) error: Option<f64>,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// What one link brings. A patch in the dark that is lit by m links in all chains is brighter by 1/m for each link more to where it
/// is bright, and most runs have none of the rare links: their mean is too low, and so is their spread.
#[derive(Clone, Debug)]
pub(super) struct Links {
    /// The power of a link of common brightness, by channel \[W\]: A_T·ΣARH²/ΣARH over the rays of all chains.
    power: [f64; 3],
    /// Faces of patches that are lit by rays of their own.
    apart: HashSet<u32>,
}

impl Links {
    /// `None` where there are no links.
    pub(super) fn new(experiment: &Experiment, tally: &Tally) -> Option<Self> {
        let Method::Chains(Chains { solve: Solve::Links, final_gather, .. }) = experiment.method() else {
            return None;
        };
        let faces = experiment.scene().faces();
        let area: f64 = faces.iter().map(|face| face.area).sum();
        let power = |channel: usize| {
            let (mut light, mut squares) = (0.0, 0.0);
            for (i, face) in faces.iter().enumerate() {
                let irradiance = irradiance(experiment, tally, (i, &face), channel);
                let reflected = face.area * face.reflectance[channel] * irradiance;
                light += reflected;
                squares += reflected * irradiance;
            }
            if light > 0.0 { area * squares / light / tally.counts.rays as f64 } else { 0.0 }
        };
        let mut of_channels = [0.0; 3];
        (0..experiment.scene().channels()).for_each(|channel| of_channels[channel] = power(channel));
        let apart = final_gather.iter().flat_map(|&patch| faces.of_patch(patch)).collect();
        Some(Links { power: of_channels, apart })
    }

    /// What one link brings to a face [W/m²].
    pub(super) fn one(&self, (i, face): (usize, &Face), channel: usize) -> f64 {
        if self.apart.contains(&(i as u32)) { 0.0 } else { self.power[channel] / face.area }
    }
}

/// H of a face, by the mean of all chains [W/m²].
fn irradiance(experiment: &Experiment, tally: &Tally, (i, face): (usize, &Face), channel: usize) -> f64 {
    let per_unit = |meaning: Meaning| meaning.unit * meaning.irradiance_per_event.unwrap_or(0.0);
    let per_unit = experiment.meaning_of((i, face), channel, tally).map_or(0.0, per_unit);
    per_unit * tally.patch(i, channel)[0] as f64 / tally.counts.walks as f64
}
