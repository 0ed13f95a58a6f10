//! The measured points of a comparison: time and errors of the runs of one method and size.

use radiosity::{Estimates, Scene, Tally};
use serde::{Deserialize, Serialize};
use stats::Measured;

use super::contender::{Contender, Convergence, Trial};
use super::shoot::TrialRuns;
use super::truth::ReferenceSolution;
use crate::build::BUILD;

/// The part of the mean radiosity below which patches are left out of relative errors.
const DARK: f64 = 1e-3;

/// The result of a contender's runs: a row of `compare.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContenderResult {
    /// The build of the program that measured it.
    pub build: String,
    /// The name of the job.
    pub job: String,
    /// A key of everything else that the point depends on: scene, settings, seed and the reference.
    pub key: String,
    /// The name of the contender.
    pub method: String,
    /// The rays of a run that were asked for.
    pub rays: u64,
    /// The number of runs.
    pub runs: usize,
    /// The way in which its error falls.
    pub kind: Convergence,
    /// The paths of a run, as in a job's budget.
    pub paths: u64,
    /// The rays that a run traced.
    pub traced: u64,
    /// The processor time of a run's walks [s].
    pub seconds: f64,
    /// The mean squared relative error by area.
    pub squared_error: f64,
    /// The standard error of that mean, as the runs give it.
    pub squared_error_error: f64,
    /// The largest root mean square of a patch's relative error.
    pub worst: f64,
    /// The root mean square that 99 % of the area do not exceed.
    pub p99: f64,
    /// The most memory that a worker process took [bytes], if the system tells.
    pub memory: Option<u64>,
    /// The bytes that workers sent for a run.
    pub traffic: u64,
}

impl ContenderResult {
    /// The root mean square with its standard error.
    pub(crate) fn rms(&self) -> Measured {
        let value = self.squared_error.max(0.0).sqrt();
        Measured { value, standard_error: 0.5 * self.squared_error_error / value.max(f64::MIN_POSITIVE) }
    }

    /// The figure of merit 1/(MSE·s) [1/s], with a 95 % interval by Student's t on its logarithm.
    pub(super) fn merit(&self) -> [f64; 3] {
        let merit = 1.0 / (self.squared_error * self.seconds);
        let freedom = self.runs.saturating_sub(1).max(1) as u64;
        let spread = stats::student_quantile(0.975, freedom) * self.squared_error_error / self.squared_error;
        [merit, merit * (-spread).exp(), merit * spread.exp()]
    }
}

/// The estimates that are judged: those of reflecting patches that do not emit and are not dark, with weights by area
/// that sum to 1.
pub(super) struct JudgedPatches {
    estimates: Vec<usize>,
    weights: Vec<f64>,
}

impl JudgedPatches {
    /// The judged estimates of a scene.
    pub(super) fn new(scene: &Scene, truth: &ReferenceSolution) -> Self {
        let channels = scene.channels();
        let mean = |c: usize| {
            let patches = || scene.faces().iter().enumerate();
            let area: f64 = patches().map(|(_, patch)| patch.area).sum();
            patches().map(|(i, patch)| patch.area * truth.radiosity[i * channels + c]).sum::<f64>() / area
        };
        let means: Vec<f64> = (0..channels).map(mean).collect();
        let (mut estimates, mut weights) = (Vec::new(), Vec::new());
        for (i, patch) in scene.faces().iter().enumerate().filter(|(_, patch)| !patch.emittance.is_lit()) {
            for (c, mean) in means.iter().enumerate() {
                let bright = truth.radiosity[i * channels + c] > DARK * mean;
                if patch.reflectance[c] > 0.0 && bright {
                    estimates.push(i * channels + c);
                    weights.push(patch.area);
                }
            }
        }
        let total: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= total);
        JudgedPatches { estimates, weights }
    }

    /// The mean squared relative error of the truth itself.
    pub(super) fn own_error(&self, truth: &ReferenceSolution) -> f64 {
        let square = |&i: &usize| truth.variance[i] / truth.radiosity[i].powi(2);
        self.estimates.iter().map(square).zip(&self.weights).map(|(square, weight)| square * weight).sum()
    }
}

/// The point of a contender's runs.
pub(super) fn point(
    key: String,
    rays: u64,
    contender: &Contender,
    shot: &TrialRuns,
    (truth, judged): &(ReferenceSolution, JudgedPatches),
) -> ContenderResult {
    let Trial { job, experiment } = &contender.trial;
    let channels = experiment.scene().channels();
    let mut squares = vec![0.0; judged.estimates.len()];
    let squared_error = |tally: &Tally| {
        let estimates = Estimates::new(experiment, tally, 0.95);
        let mut mean = 0.0;
        for (k, (&i, weight)) in judged.estimates.iter().zip(&judged.weights).enumerate() {
            let known = estimates.face(i / channels).expect("every contender tells of every patch");
            let off = (known[i % channels].radiosity - truth.radiosity[i]) / truth.radiosity[i];
            let square = off * off - truth.variance[i] / truth.radiosity[i].powi(2);
            squares[k] += square;
            mean += weight * square;
        }
        mean
    };
    let runs: Vec<f64> = shot.tallies.iter().map(squared_error).collect();
    let n = runs.len() as f64;
    let squared_error = Measured::of(&runs);
    let errors = squares.iter().map(|sum| (sum / n).max(0.0).sqrt());
    let mut errors: Vec<(f64, f64)> = errors.zip(judged.weights.iter().copied()).collect();
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below = 0.0;
    let p99 = errors.iter().find(|(_, weight)| {
        below += weight;
        below >= 0.99
    });
    let traced: u128 = shot.tallies.iter().map(|tally| u128::from(tally.counts.rays)).sum();
    ContenderResult {
        build: BUILD.into(),
        job: job.name.clone(),
        key,
        method: contender.name.into(),
        rays,
        runs: runs.len(),
        kind: contender.kind(),
        paths: job.budget.paths,
        traced: (traced as f64 / n).round() as u64,
        seconds: shot.seconds,
        squared_error: squared_error.value,
        squared_error_error: squared_error.standard_error,
        worst: errors.last().map_or(0.0, |&(error, _)| error),
        p99: p99.map_or(0.0, |&(error, _)| error),
        memory: shot.memory,
        traffic: shot.traffic,
    }
}
