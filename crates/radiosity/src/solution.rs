//! From a tally to radiosities with their confidence intervals.

use stats::Moments;

use crate::scene::{Patch, Scene};
use crate::tally::Tally;

/// Fewer scores than this, and an estimate says little beyond its interval: flag `rare`.
const RARE_HITS: u128 = 10;

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
    /// H = φ/A [W/m²].
    pub irradiance: f64,
    /// Standard error of H [W/m²].
    pub irradiance_error: Option<f64>,
    /// Scored events.
    pub hits: u128,
}

impl Estimate {
    /// Half-width of the interval over the estimate; infinite where nothing was scored.
    pub fn relative_error(&self) -> f64 {
        let half_width = 0.5 * (self.ci_high - self.ci_low);
        if half_width == 0.0 { 0.0 } else { half_width / self.radiosity }
    }

    /// Whether too few scores were seen for the standard error to mean much.
    pub fn is_rare(&self) -> bool {
        self.hits < RARE_HITS
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
    /// In patch order.
    pub estimates: Vec<Estimate>,
    /// The level of every interval.
    pub confidence: f64,
}

impl Solution {
    /// The solution of collision shooting: b_i = (R_i/A_i)·φ_i, φ_i = Φ_T·(mean score) (S97 §2.4). The tally
    /// must hold at least one walk.
    pub fn of_shooting(scene: &Scene, tally: &Tally, confidence: f64) -> Self {
        let r_max = scene.max_reflectance();
        let estimate = |(i, patch): (usize, &Patch)| {
            let moments = moments(tally, i);
            let irradiance_per_hit = scene.total_power() / patch.active_area();
            let interval =
                stats::mean_interval(&moments, confidence, score_ratio_bound(patch.reflectance, r_max));
            let radiosity =
                |mean_score: f64| patch.emittance + patch.reflectance * irradiance_per_hit * mean_score;
            let irradiance_error = moments.standard_error().map(|error| irradiance_per_hit * error);
            Estimate {
                radiosity: radiosity(moments.mean().unwrap_or(0.0)),
                std_error: irradiance_error.map(|error| patch.reflectance * error),
                ci_low: radiosity(interval.low),
                ci_high: radiosity(interval.high),
                irradiance: irradiance_per_hit * moments.mean().unwrap_or(0.0),
                irradiance_error,
                hits: moments.sum,
            }
        };
        let estimates = scene.patches().iter().enumerate().map(estimate).collect();
        Solution { estimates, confidence }
    }

    /// The fraction of the area of the non-emitting patches whose relative error is at most `relative_error`.
    /// A patch that was never hit has an infinite one; a patch of reflectance 0 is known exactly.
    pub fn fraction_within(&self, scene: &Scene, relative_error: f64) -> f64 {
        let (mut within, mut area) = (0.0, 0.0);
        for (patch, estimate) in scene.patches().iter().zip(&self.estimates) {
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
            if patch.emittance > 0.0 || patch.reflectance == 0.0 {
                continue;
            }
            let error = estimate.relative_error();
            if estimate.hits == 0 {
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

/// The exact power sums of one patch.
fn moments(tally: &Tally, patch: usize) -> Moments {
    let sums = tally.patch(patch);
    Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] }
}

/// A bound on E[x²]/E[x] for the collision score x of a walk on a patch of reflectance R.
///
/// A planar patch cannot hit itself, so from one visit to the next a walk survives there and on another
/// patch: it returns with probability at most R·R_max. Visits after the first are then at most geometric:
/// E[x | x > 0] ≤ m = 1/(1 − R·R_max), and E[x²]/E[x] ≤ 2m − 1 (exactly 1 + 2Rξ, theory of the collision
/// estimator).
fn score_ratio_bound(reflectance: f64, r_max: f64) -> f64 {
    2.0 / (1.0 - reflectance * r_max) - 1.0
}
