//! Runs for the atlas: walked in this process, told of as `radwalk run` tells.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use job::Target;
use radiosity::{
    Birth, Direction, Estimate, Estimates, EstimatorKind, Experiment, IndexChoice, InfiniteEnd, Method,
    Scene, SceneSpec, Sequence, Solution, Space, Tally,
};
use report::Check;
use stats::Measured;

use super::entry::Failure;
use judge::checks::checks;
use judge::target::{Observer, looks};

/// The level of intervals.
pub const CONFIDENCE: f64 = 0.95;

/// Walks scored on one board before it is emptied.
const AT_A_TIME: u64 = 1 << 20;

/// How large studies are, and what they run on.
pub struct Lab {
    quick: bool,
    threads: usize,
}

impl Lab {
    /// One that uses all cores; `quick` for tests.
    pub fn new(quick: bool) -> Self {
        Lab { quick, threads: thread::available_parallelism().map_or(1, usize::from) }
    }

    /// One of two sizes.
    pub fn size<T>(&self, quick: T, full: T) -> T {
        if self.quick { quick } else { full }
    }

    /// Something for each of `runs` seeds, in the order of the seeds: threads have no part in the answer.
    pub fn each_seed<T: Send>(&self, runs: u64, of: impl Fn(u64) -> T + Sync) -> Vec<T> {
        let next = AtomicU64::new(0);
        let work = || {
            let mut done = Vec::new();
            loop {
                let seed = next.fetch_add(1, Ordering::Relaxed);
                if seed >= runs {
                    return done;
                }
                done.push((seed, of(1000 + seed)));
            }
        };
        let mut all: Vec<(u64, T)> = thread::scope(|scope| {
            let handles: Vec<_> = (0..self.threads).map(|_| scope.spawn(work)).collect();
            handles.into_iter().flat_map(|handle| handle.join().expect("a study does not panic")).collect()
        });
        all.sort_by_key(|&(seed, _)| seed);
        all.into_iter().map(|(_, value)| value).collect()
    }
}

/// Discrete shooting walks.
pub fn shooting(estimator: EstimatorKind) -> Method {
    method(Direction::Shooting, estimator)
}

/// Discrete gathering walks.
pub fn gathering(birth: Birth, estimator: EstimatorKind) -> Method {
    method(Direction::Gathering(birth), estimator)
}

/// Chains of so many rays.
pub fn chains(chain_rays: u64) -> Method {
    method(Direction::Jacobi { chain_rays, solve: Default::default() }, EstimatorKind::Collision)
}

fn method(direction: Direction, estimator: EstimatorKind) -> Method {
    Method {
        direction,
        estimator,
        infinite: InfiniteEnd::default(),
        space: Space::Discrete,
        mix: false,
        batch: None,
        final_gather: Vec::new(),
    }
}

/// A method in a scene.
///
/// # Errors
/// Where the scene or the method is refused.
pub fn experiment(spec: &SceneSpec, method: Method) -> Result<Experiment, Failure> {
    Ok(Experiment::new(Scene::build(spec, IndexChoice::Auto)?, method)?)
}

/// The tally of walks 0 … `walks` − 1, with M power sums.
pub fn walk<const M: usize>(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut tally = experiment.tally::<M>();
    advance::<M>(experiment, seed, walks, &mut tally);
    tally
}

fn advance<const M: usize>(experiment: &Experiment, seed: u64, walks: u64, tally: &mut Tally) {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board::<M>());
    while tally.counts.walks < walks {
        let first = tally.counts.walks;
        experiment.walk(&sequence, first..walks.min(first + AT_A_TIME), &mut board);
        board.add_to(tally).expect("the sums of an atlas are small");
    }
}

/// What walks 0 … `walks` − 1 say.
pub fn solve(experiment: &Experiment, seed: u64, walks: u64) -> Solution {
    Solution::new(experiment, &walk::<2>(experiment, seed, walks), CONFIDENCE)
}

/// The first channel of a patch.
///
/// # Panics
/// Where no walk could tell.
pub fn estimate(solution: &Solution, patch: usize) -> Estimate {
    solution.face(patch).expect("walks tell of this patch")[0]
}

/// The patches that reflect and do not emit.
pub fn receivers(experiment: &Experiment) -> Vec<usize> {
    let patches = experiment.scene().faces().iter().enumerate();
    let receives =
        |(_, patch): &(usize, radiosity::Face)| !patch.emittance.is_lit() && patch.reflectance.is_lit();
    patches.filter(receives).map(|(i, _)| i).collect()
}

/// A run that was looked at as jobs are.
pub struct Run {
    /// Where its walks ended.
    pub tally: Tally,
    /// What they say.
    pub solution: Solution,
    /// What was verified.
    pub checks: Vec<Check>,
    /// Whether its target, if any, ended it.
    pub reached: bool,
}

/// Runs a job of `walks` at most, with its looks and checks.
pub fn run(experiment: &Experiment, seed: u64, walks: u64, target: Option<Target>) -> Run {
    let mut observer = Observer::new(experiment.clone(), CONFIDENCE, target);
    let (mut tally, mut seen, mut reached) = (experiment.tally::<2>(), Vec::new(), false);
    for mark in looks(experiment, walks) {
        advance::<2>(experiment, seed, mark, &mut tally);
        let look = observer.look(&tally, &seen);
        reached = look.reached;
        seen.push(look);
        if reached {
            break;
        }
    }
    let estimates = Estimates::new(experiment, &tally, CONFIDENCE);
    let checks = checks(&estimates, None, &estimates.precision(), &seen);
    let solution = Solution::new(experiment, &tally, CONFIDENCE);
    Run { tally, solution, checks, reached }
}

impl Run {
    /// The checks that did not pass, as summaries have them.
    pub fn told(&self) -> Vec<String> {
        let failed = self.checks.iter().filter(|check| !check.ok);
        failed.map(|check| format!("check `{}`: {}", check.name, check.message)).collect()
    }

    /// Whether a check failed.
    pub fn fails(&self, name: &str) -> bool {
        self.checks.iter().any(|check| check.name == name && !check.ok)
    }

    /// The flags of a patch in `patches.csv`.
    pub fn flags(&self, experiment: &Experiment, patch: usize) -> String {
        let known = self.solution.face(patch);
        report::flags(&experiment.scene().faces().get(patch), known.as_deref())
    }
}

/// The mean of independent values, with the standard error that they tell.
pub fn mean(values: &[f64]) -> Measured {
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (n - 1.0);
    Measured { value, standard_error: (variance / n).sqrt() }
}

/// The same, over what is expected of it.
pub fn ratio(measured: Measured, expected: f64) -> Measured {
    Measured { value: measured.value / expected, standard_error: measured.standard_error / expected }
}

/// The root of a mean square, with its standard error.
pub fn root(square: Measured) -> Measured {
    let value = square.value.sqrt();
    Measured { value, standard_error: 0.5 * square.standard_error / value }
}

/// The mean over some patches of the squared relative error of B, over runs of different seeds.
pub fn squared_error(
    lab: &Lab,
    runs: u64,
    experiment: &Experiment,
    walks: u64,
    patches: &[usize],
    truth: &[f64],
) -> Measured {
    let squares = lab.each_seed(runs, |seed| {
        let solution = solve(experiment, seed, walks);
        let square = |&i: &usize| (estimate(&solution, i).radiosity / truth[i] - 1.0).powi(2);
        patches.iter().map(square).sum::<f64>() / patches.len() as f64
    });
    mean(&squares)
}

/// Which part of the intervals of some patches holds the truth, over runs of different seeds.
pub fn coverage(
    lab: &Lab,
    runs: u64,
    experiment: &Experiment,
    walks: u64,
    patches: &[usize],
    truth: &[f64],
) -> Measured {
    let covered = lab.each_seed(runs, |seed| {
        let solution = solve(experiment, seed, walks);
        covered(&solution, patches, truth)
    });
    proportion(&covered)
}

/// Which part of the intervals of some patches holds the truth, as far as rounding lets it tell.
pub fn covered(solution: &Solution, patches: &[usize], truth: &[f64]) -> f64 {
    let holds = |&&i: &&usize| {
        let Estimate { ci_low, ci_high, .. } = estimate(solution, i);
        let slack = 1e-12 * truth[i];
        (ci_low - slack..=ci_high + slack).contains(&truth[i])
    };
    patches.iter().filter(holds).count() as f64 / patches.len() as f64
}

/// The mean of parts of runs. Where all runs say the same, the error is that of the rule of three.
pub fn proportion(parts: &[f64]) -> Measured {
    let measured = mean(parts);
    Measured { standard_error: measured.standard_error.max(1.0 / parts.len() as f64), ..measured }
}

/// Mean and variance of the score of a walk on a patch: B [W/m²], and the variance of B for one walk over `expected`,
/// judged by the sample's own fourth moment.
pub fn variance_over(experiment: &Experiment, tally: &Tally, patch: usize, expected: f64) -> Measured {
    let meaning = experiment.meaning(patch, 0, tally).expect("walks tell of this patch");
    let per_event = meaning.irradiance_per_event.expect("the estimator can tell");
    let unit = experiment.scene().faces().get(patch).reflectance[0] * per_event * meaning.unit;
    let sums = tally.patch(patch, 0).try_into().expect("four power sums");
    let variance = stats::PowerSums { n: tally.counts.walks, sums }.variance();
    let variance = variance.expect("there are many walks");
    ratio(variance, expected / (unit * unit))
}
