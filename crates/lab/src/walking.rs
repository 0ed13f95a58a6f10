//! Walks that are shot in this process, and what their tallies say.

use radiosity::{Estimate, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Solution, Tally};
use stats::{Measured, Moments, variance_of_blocks};

use crate::arithmetic::{proportion, ratio};
use crate::lab::Lab;

/// The level of the intervals.
pub(crate) const CONFIDENCE: f64 = 0.95;

/// The walks scored on one board before it is emptied.
const AT_A_TIME: u64 = 1 << 20;

/// The error that keeps a study from being done.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// An experiment of a method in a scene.
///
/// # Errors
/// If the scene or the method is refused.
pub(crate) fn experiment(spec: &SceneSpec, method: impl Into<Method>) -> Result<Experiment, Failure> {
    Ok(Experiment::new(Scene::build(spec, IndexChoice::Auto)?, method)?)
}

/// The tally of walks 0 … `walks` − 1.
pub(crate) fn walk(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut tally = experiment.tally();
    advance(experiment, seed, walks, &mut tally);
    tally
}

/// Walks on, from the walks of `tally` up to `walks` in all.
pub(crate) fn advance(experiment: &Experiment, seed: u64, walks: u64, tally: &mut Tally) {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board());
    while tally.counts.walks < walks {
        let first = tally.counts.walks;
        experiment.walk(&sequence, first..walks.min(first + AT_A_TIME), &mut board);
        board.add_to(tally).expect("the sums of a study are small");
    }
}

/// The solution of walks 0 … `walks` − 1.
pub(crate) fn solve(experiment: &Experiment, seed: u64, walks: u64) -> Solution {
    Solution::new(experiment, &walk(experiment, seed, walks), CONFIDENCE)
}

/// The estimate of a patch's first channel.
///
/// # Panics
/// If no walk can tell of the patch.
pub(crate) fn estimate(solution: &Solution, patch: usize) -> Estimate {
    solution.face(patch).expect("walks tell of this patch")[0]
}

/// The patches that reflect and do not emit.
pub(crate) fn receivers(experiment: &Experiment) -> Vec<usize> {
    let patches = experiment.scene().faces().iter().enumerate();
    let receives = |(_, patch): &(usize, radiosity::surfaces::Face)| {
        !patch.emittance.is_lit() && patch.reflectance.is_lit()
    };
    patches.filter(receives).map(|(i, _)| i).collect()
}

/// The reader of a grey experiment's tallies.
pub(crate) struct TallyReader {
    /// The value of b per unit of mean score [W/m²], for every patch.
    per_unit: Vec<f64>,
}

impl TallyReader {
    /// The reader of an experiment whose walks tell of every patch.
    pub(crate) fn new(experiment: &Experiment) -> Self {
        let empty = experiment.tally();
        let worth = |(i, patch): (usize, radiosity::surfaces::Face)| {
            let meaning = experiment.meaning(i, 0, &empty).expect("walks are born everywhere");
            patch.reflectance[0] * meaning.unit * meaning.irradiance_per_event.unwrap_or(0.0)
        };
        TallyReader { per_unit: experiment.scene().faces().iter().enumerate().map(worth).collect() }
    }

    /// The b of every patch [W/m²].
    pub(crate) fn reflected(&self, tally: &Tally) -> Vec<f64> {
        let walks = tally.counts.walks as f64;
        let sums = (0..self.per_unit.len()).map(|i| tally.patch(i, 0)[0] as f64);
        sums.zip(&self.per_unit).map(|(sum, unit)| unit * sum / walks).collect()
    }
}

/// One number for each of several runs of different seeds, made from its solution.
fn of_runs(
    lab: &Lab,
    runs: u64,
    experiment: &Experiment,
    walks: u64,
    read: impl Fn(&Solution) -> f64 + Sync,
) -> Vec<f64> {
    lab.each_seed(runs, |seed| read(&solve(experiment, seed, walks)))
}

/// The mean over some patches of the squared relative error of B, over runs of different seeds.
pub(crate) fn squared_error(
    lab: &Lab,
    runs: u64,
    experiment: &Experiment,
    walks: u64,
    patches: &[usize],
    truth: &[f64],
) -> Measured {
    Measured::of(&of_runs(lab, runs, experiment, walks, |solution| {
        let square = |&i: &usize| (estimate(solution, i).radiosity / truth[i] - 1.0).powi(2);
        patches.iter().map(square).sum::<f64>() / patches.len() as f64
    }))
}

/// The part of the intervals of some patches that holds the truth, over runs of different seeds.
pub(crate) fn coverage(
    lab: &Lab,
    runs: u64,
    experiment: &Experiment,
    walks: u64,
    patches: &[usize],
    truth: &[f64],
) -> Measured {
    proportion(&of_runs(lab, runs, experiment, walks, |solution| covered(solution, patches, truth)))
}

/// The part of the intervals of some patches that holds the truth, as far as rounding allows.
pub(crate) fn covered(solution: &Solution, patches: &[usize], truth: &[f64]) -> f64 {
    let holds = |&&i: &&usize| {
        let Estimate { ci_low, ci_high, .. } = estimate(solution, i);
        let slack = 1e-12 * truth[i];
        (ci_low - slack..=ci_high + slack).contains(&truth[i])
    };
    patches.iter().filter(holds).count() as f64 / patches.len() as f64
}

/// The blocks of walks whose scatter tells the error of a variance.
const BLOCKS: u64 = 400;

/// A number of walks, and the seed of their sequence.
#[derive(Clone, Copy)]
pub(crate) struct SeededWalks {
    pub seed: u64,
    pub walks: u64,
}

/// The variance of B for one of `walks` walks on a patch over `expected`, judged by the scatter of blocks of walks.
pub(crate) fn variance_over(
    experiment: &Experiment,
    SeededWalks { seed, walks }: SeededWalks,
    patch: usize,
    expected: f64,
) -> Measured {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board());
    let size = walks / BLOCKS;
    let blocks = (0..BLOCKS).map(|block| {
        experiment.walk(&sequence, block * size..(block + 1) * size, &mut board);
        let tally = board.take().expect("the sums of a study are small");
        let sums = tally.patch(patch, 0);
        Moments { n: size, sum: sums[0], sum_sq: sums[1] }
    });
    let variance = variance_of_blocks(blocks).expect("there are many walks");

    let meaning = experiment.meaning(patch, 0, &experiment.tally()).expect("walks tell of this patch");
    let per_event = meaning.irradiance_per_event.expect("the estimator can tell");
    let unit = experiment.scene().faces().get(patch).reflectance[0] * per_event * meaning.unit;
    ratio(variance, expected / (unit * unit))
}
