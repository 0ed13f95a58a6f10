//! From a tally to radiosities with their confidence intervals.

use std::ops::Deref;

use stats::Moments;

use crate::experiment::{Experiment, Meaning};
use crate::method::Direction;
use crate::patch::Patch;
use crate::scene::Scene;
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

/// What is known of the channels of one patch: one or three estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Channels {
    estimates: [Estimate; 3],
    count: usize,
}

impl Deref for Channels {
    type Target = [Estimate];

    fn deref(&self) -> &[Estimate] {
        &self.estimates[..self.count]
    }
}

impl Channels {
    /// `estimate` of each channel.
    fn new(count: usize, estimate: impl Fn(usize) -> Option<Estimate>) -> Option<Self> {
        let mut estimates = [estimate(0)?; 3];
        for (c, channel) in estimates[..count].iter_mut().enumerate().skip(1) {
            *channel = estimate(c)?;
        }
        Some(Channels { estimates, count })
    }
}

/// What a tally says of the patches of a scene, each estimated when it is asked for: of a million patches nothing is
/// kept but their tally.
#[derive(Clone, Debug)]
pub struct Estimates<'a> {
    experiment: &'a Experiment,
    tally: &'a Tally,
    confidence: f64,
    /// Where the tally is of chains.
    student: Option<Student>,
}

impl<'a> Estimates<'a> {
    /// Of a tally of at least one walk; every interval has the level `confidence`.
    pub fn new(experiment: &'a Experiment, tally: &'a Tally, confidence: f64) -> Self {
        let student = experiment.batch_paths().map(|_| Student::new(tally.counts.walks, confidence));
        Estimates { experiment, tally, confidence, student }
    }

    /// The scene.
    pub fn scene(&self) -> &'a Scene {
        self.experiment.scene()
    }

    /// The method in the scene.
    pub fn experiment(&self) -> &'a Experiment {
        self.experiment
    }

    /// What was scored.
    pub fn tally(&self) -> &'a Tally {
        self.tally
    }

    /// What is known of patch i; `None` where no walk could tell.
    pub fn patch(&self, i: usize) -> Option<Channels> {
        self.of(i, &self.scene().patches().get(i))
    }

    /// All patches in their order, with what is known of them.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Patch, Option<Channels>)> {
        let patches = self.scene().patches().iter().enumerate();
        patches.map(|(i, patch)| (i, patch, self.of(i, &patch)))
    }

    /// Patches that some walk could tell of.
    pub fn known(&self) -> impl Iterator<Item = (usize, Patch, Channels)> {
        self.iter().filter_map(|(i, patch, channels)| Some((i, patch, channels?)))
    }

    /// Absorption and survival mixed on patch i; `None` where no walk could tell, or nobody asked for it.
    pub fn mix(&self, i: usize) -> Option<Mix> {
        if self.experiment.method().mix { Mix::new(self.experiment, self.tally, i) } else { None }
    }

    fn of(&self, i: usize, patch: &Patch) -> Option<Channels> {
        Channels::new(self.scene().channels(), |channel| {
            let meaning = self.experiment.meaning(i, channel, self.tally)?;
            let (moments, events) = (moments(self.tally, i, channel), self.tally.events(i));
            Some(match &self.student {
                Some(student) => estimate_of_chains(patch, channel, &moments, events, &meaning, student),
                None => estimate(patch, channel, &moments, events, &meaning, self.confidence),
            })
        })
    }

    /// The fraction of the area of the sampled non-emitting patches whose relative error is at most
    /// `relative_error` in every channel. A patch that was never hit has an infinite one; a patch of reflectance 0
    /// is known exactly.
    pub fn fraction_within(&self, relative_error: f64) -> f64 {
        let (mut within, mut area) = (0.0, 0.0);
        for (_, patch, channels) in self.known().filter(|(_, patch, _)| !patch.emittance.is_lit()) {
            area += patch.area;
            if channels.iter().all(|estimate| estimate.relative_error() <= relative_error) {
                within += patch.area;
            }
        }
        if area > 0.0 { within / area } else { 1.0 }
    }

    /// How well the non-emitting patches are known, all channels alike. Where the reflectance is 0, or nothing
    /// emits, the radiosity is known exactly.
    pub fn precision(&self) -> Precision {
        let mut precision = Precision::default();
        let (mut weighted, mut area) = (0.0, 0.0);
        let lit = |channel: usize| self.scene().total_power(channel) > 0.0;
        for (i, patch, channels) in self.known().filter(|(_, patch, _)| !patch.emittance.is_lit()) {
            let estimated = channels.iter().enumerate();
            for (_, estimate) in estimated.filter(|&(c, _)| patch.reflectance[c] > 0.0 && lit(c)) {
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
        }
        if area > 0.0 {
            precision.rms_relative_error = (weighted / area).sqrt();
        }
        precision
    }
}

/// The estimates of all patches at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// In patch order, the channels of a patch side by side; `None` where no walk could tell.
    pub estimates: Vec<Option<Estimate>>,
    /// 1 or 3.
    pub channels: usize,
}

impl Solution {
    /// What a tally of at least one walk says.
    pub fn new(experiment: &Experiment, tally: &Tally, confidence: f64) -> Self {
        let channels = experiment.scene().channels();
        let of_patch = |known: Option<Channels>| (0..channels).map(move |c| known.map(|known| known[c]));
        let estimates = Estimates::new(experiment, tally, confidence);
        Solution { estimates: estimates.iter().flat_map(|(_, _, known)| of_patch(known)).collect(), channels }
    }

    /// The estimates of one patch, channel by channel; `None` where no walk could tell.
    pub fn patch(&self, patch: usize) -> Option<Vec<Estimate>> {
        self.estimates[patch * self.channels..][..self.channels].iter().copied().collect()
    }
}

/// Absorption and survival of the same walks, mixed as the sample likes best (S97 §2.6, §3.7).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    /// α: the weight of survival that gives the least variance; 1 − α is that of absorption. `None` where nothing
    /// scored or the estimators agree walk by walk.
    pub alpha: Option<f64>,
    /// B by that mix [W/m²]. The weight was chosen by the same walks, which costs a bias of the order of 1/N.
    pub radiosity: f64,
    /// Its standard error for the whole run [W/m²].
    pub std_error: Option<f64>,
    /// Variance of collision over that of the mix: 1 where collision is the best.
    pub collision_excess: Option<f64>,
}

impl Mix {
    /// What a tally of related scores says of a patch; `None` where no walk could tell.
    fn new(experiment: &Experiment, tally: &Tally, i: usize) -> Option<Self> {
        let patch = experiment.scene().patches().get(i);
        let meaning = experiment.meaning(i, 0, tally)?;
        let reflectance = patch.reflectance[0];
        // A shooting walk scores hits, which are worth more the rarer the event is.
        let (absorbed, survived) = match experiment.method().direction {
            Direction::Shooting if reflectance == 0.0 => (1.0, 0.0),
            Direction::Shooting => (1.0 / (1.0 - reflectance), 1.0 / reflectance),
            Direction::Gathering(_) | Direction::Jacobi { .. } => (1.0, 1.0),
        };
        let [collision, absorption, survival, sum] = [0, 1, 2, 3].map(|score| moments(tally, i, score));
        let variance = |moments: &Moments| moments.standard_error().map_or(0.0, |error| error * error);
        let (var_a, var_s) = (variance(&absorption), variance(&survival));
        let covariance = 0.5 * (variance(&sum) - var_a - var_s) * absorbed * survived;
        let (var_a, var_s) = (var_a * absorbed * absorbed, var_s * survived * survived);
        let denominator = var_a + var_s - 2.0 * covariance;
        let alpha = (denominator > 0.0 && survived > 0.0).then(|| (var_a - covariance) / denominator);
        let weight = alpha.unwrap_or(0.0);
        let mixed = |a: f64, s: f64| weight * survived * s + (1.0 - weight) * absorbed * a;
        let mean = |moments: &Moments| moments.mean().unwrap_or(0.0);
        let rest = 1.0 - weight;
        let mix_variance = weight * weight * var_s + rest * rest * var_a + 2.0 * weight * rest * covariance;
        let per_unit = meaning.unit * meaning.irradiance_per_event.unwrap_or(0.0) * reflectance;
        Some(Mix {
            alpha,
            radiosity: patch.emittance[0] + per_unit * mixed(mean(&absorption), mean(&survival)),
            std_error: collision.standard_error().map(|_| per_unit * mix_variance.max(0.0).sqrt()),
            collision_excess: (mix_variance > 0.0).then(|| variance(&collision) / mix_variance),
        })
    }
}

/// b = R·H: the interval of the mean score, through the meaning of a unit.
fn estimate(
    patch: &Patch,
    channel: usize,
    moments: &Moments,
    hits: u128,
    meaning: &Meaning,
    confidence: f64,
) -> Estimate {
    let Meaning { unit, irradiance_per_event, ratio_bound, bias_bound } = *meaning;
    // A patch that the estimator cannot tell the irradiance of has R = 0, so that b = 0 all the same.
    let reflected_per_event = patch.reflectance[channel] * irradiance_per_event.unwrap_or(0.0);
    let interval = stats::mean_interval(moments, unit, confidence, ratio_bound);
    let mean = unit * moments.mean().unwrap_or(0.0);
    let error = moments.standard_error().map(|error| unit * error);
    let radiosity = |mean_score: f64| patch.emittance[channel] + reflected_per_event * mean_score;
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

/// What the mean of n independent chains says: it errs as Student's t of n − 1 degrees of freedom.
#[derive(Clone, Debug)]
struct Student {
    /// Half-width of the interval, in standard errors of the mean; `None` of a single chain.
    quantile: Option<f64>,
    /// √(ν/(ν − 2)): the standard deviation of t; `None` where that is infinite, of 3 chains or fewer.
    deviation: Option<f64>,
}

impl Student {
    fn new(chains: u64, confidence: f64) -> Self {
        let freedom = chains.saturating_sub(1);
        let quantile = (freedom > 0).then(|| stats::student_quantile(0.5 + 0.5 * confidence, freedom));
        let deviation = (freedom > 2).then(|| (freedom as f64 / (freedom - 2) as f64).sqrt());
        Student { quantile, deviation }
    }
}

/// The mean of the chains and its Student interval. The standard error is that of the whole distribution, √(ν/(ν − 2))
/// times s/√n: it would be too small by as much, had the sample's own been taken for the truth. What a single chain
/// says, or chains that all say the same, is bounded by the largest radiosity alone.
fn estimate_of_chains(
    patch: &Patch,
    channel: usize,
    moments: &Moments,
    landed: u128,
    meaning: &Meaning,
    student: &Student,
) -> Estimate {
    let per_event = meaning.irradiance_per_event.unwrap_or(0.0);
    let per_unit = meaning.unit * per_event;
    let (emitted, reflectance) = (patch.emittance[channel], patch.reflectance[channel]);
    let mean = per_unit * moments.mean().unwrap_or(0.0);
    let sample_error = moments.standard_error().map(|error| per_unit * error).filter(|&error| error > 0.0);
    let (low, high) = match sample_error.zip(student.quantile) {
        Some((error, quantile)) => ((mean - quantile * error).max(0.0), mean + quantile * error),
        None => (0.0, per_event.max(mean)),
    };
    let error = sample_error.zip(student.deviation).map(|(error, deviation)| deviation * error);
    Estimate {
        radiosity: emitted + reflectance * mean,
        std_error: error.map(|error| reflectance * error),
        ci_low: emitted + reflectance * low,
        ci_high: emitted + reflectance * high,
        irradiance: meaning.irradiance_per_event.map(|_| mean),
        irradiance_error: meaning.irradiance_per_event.and(error),
        hits: landed,
        effective_scores: landed as f64,
        bias_bound: meaning.bias_bound,
    }
}

/// The exact power sums of one score on one patch.
fn moments(tally: &Tally, patch: usize, score: usize) -> Moments {
    let sums = tally.patch(patch, score);
    Moments { n: tally.counts.walks, sum: sums[0], sum_sq: sums[1] }
}
