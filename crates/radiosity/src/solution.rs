//! From a tally to radiosities with their confidence intervals.

use stats::Moments;

use crate::experiment::{Experiment, Meaning};
use crate::scene::{Patch, Scene};
use crate::tally::Tally;

/// Fewer scores than this, and an estimate says little beyond its interval: flag `rare`.
const RARE_SCORES: f64 = 10.0;

/// What is known of one patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// B = E + b [W/m²].
    pub radiosity: f64,
    /// Standard error of B for the whole run [W/m²]; `None` after a single walk, which cannot tell.
    pub std_error: Option<f64>,
    /// Confidence interval of B [W/m²].
    pub ci_low: f64,
    /// Its upper end [W/m²].
    pub ci_high: f64,
    /// H = φ/A [W/m²]; `None` where the estimator cannot tell it.
    pub irradiance: Option<f64>,
    /// Standard error of H [W/m²].
    pub irradiance_error: Option<f64>,
    /// Scored events; walks born here for gathering.
    pub hits: u128,
    /// (Σx)²/Σx² of the walks' scores x: how many equal scores would tell as much.
    pub effective_scores: f64,
    /// How much too small b may be because walks were cut off [W/m²]; 0 for unbiased methods.
    pub bias_bound: f64,
}

impl Estimate {
    /// Half-width of the interval over the estimate; infinite where nothing was scored.
    pub fn relative_error(&self) -> f64 {
        let half_width = 0.5 * (self.ci_high - self.ci_low);
        if half_width == 0.0 { 0.0 } else { half_width / self.radiosity }
    }

    /// Whether too few scores were seen for the standard error to mean much.
    pub fn is_rare(&self) -> bool {
        self.effective_scores < RARE_SCORES
    }
}

/// How well a solution is known, over its non-emitting patches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Precision {
    /// Area-weighted root mean square of the relative errors of the patches that were hit.
    pub rms_relative_error: f64,
    /// The largest relative error; infinite while a reflecting patch was never hit.
    pub max_relative_error: f64,
    /// The patch that has it.
    pub worst_patch: Option<u32>,
    /// Reflecting patches that no walk has hit.
    pub unhit_patches: u64,
}

/// The estimates of all patches.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// In patch order; `None` where no walk could tell.
    pub estimates: Vec<Option<Estimate>>,
    /// The level of every interval.
    pub confidence: f64,
    /// Whether walks were cut off, so that `bias_bound` has to be looked at.
    pub biased: bool,
}

impl Solution {
    /// What a tally of at least one walk says.
    pub fn new(experiment: &Experiment, tally: &Tally, confidence: f64) -> Self {
        let patches = experiment.scene().patches().iter().enumerate();
        let estimate = |(i, patch): (usize, &Patch)| {
            let meaning = experiment.meaning(i, tally)?;
            Some(estimate(patch, &moments(tally, i), tally.events(i), &meaning, confidence))
        };
        Solution { estimates: patches.map(estimate).collect(), confidence, biased: experiment.is_biased() }
    }

    /// The fraction of the area of the sampled non-emitting patches whose relative error is at most
    /// `relative_error`. A patch that was never hit has an infinite one; a patch of reflectance 0 is known exactly.
    pub fn fraction_within(&self, scene: &Scene, relative_error: f64) -> f64 {
        let (mut within, mut area) = (0.0, 0.0);
        for (patch, estimate) in scene.patches().iter().zip(&self.estimates) {
            let Some(estimate) = estimate else { continue };
            if patch.emittance == 0.0 {
                area += patch.area;
                if estimate.relative_error() <= relative_error {
                    within += patch.area;
                }
            }
        }
        if area > 0.0 { within / area } else { 1.0 }
    }

    /// How well the non-emitting patches are known. Patches of reflectance 0 are known exactly.
    pub fn precision(&self, scene: &Scene) -> Precision {
        let mut precision = Precision::default();
        let (mut weighted, mut area) = (0.0, 0.0);
        for (i, (patch, estimate)) in scene.patches().iter().zip(&self.estimates).enumerate() {
            let Some(estimate) = estimate else { continue };
            if patch.emittance > 0.0 || patch.reflectance == 0.0 {
                continue;
            }
            let error = estimate.relative_error();
            if estimate.effective_scores == 0.0 {
                precision.unhit_patches += 1;
            } else {
                weighted += patch.area * error * error;
                area += patch.area;
            }
            if precision.worst_patch.is_none() || error > precision.max_relative_error {
                precision.max_relative_error = error;
                precision.worst_patch = Some(i as u32);
            }
        }
        if area > 0.0 {
            precision.rms_relative_error = (weighted / area).sqrt();
        }
        precision
    }
}

/// b = R·H: the interval of the mean score, through the meaning of a unit.
fn estimate(patch: &Patch, moments: &Moments, hits: u128, meaning: &Meaning, confidence: f64) -> Estimate {
    let Meaning { unit, irradiance_per_event, ratio_bound, bias_bound } = *meaning;
    // A patch that the estimator cannot tell the irradiance of has R = 0, so that b = 0 all the same.
    let reflected_per_event = patch.reflectance * irradiance_per_event.unwrap_or(0.0);
    let interval = stats::mean_interval(moments, unit, confidence, ratio_bound);
    let mean = unit * moments.mean().unwrap_or(0.0);
    let error = moments.standard_error().map(|error| unit * error);
    let radiosity = |mean_score: f64| patch.emittance + reflected_per_event * mean_score;
    Estimate {
        radiosity: radiosity(mean),
        std_error: error.map(|error| reflected_per_event * error),
        ci_low: radiosity(interval.low),
        ci_high: radiosity(interval.high),
        irradiance: irradiance_per_event.map(|per_event| per_event * mean),
        irradiance_error: irradiance_per_event.zip(error).map(|(per_event, error)| per_event * error),
        hits,
        effective_scores: moments.sum as f64 / moments.sum_sq.max(1) as f64 * moments.sum as f64,
        bias_bound,
    }
}

/// The exact power sums of one patch.
fn moments(tally: &Tally, patch: usize) -> Moments {
    let sums = tally.patch(patch);
    Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] }
}
