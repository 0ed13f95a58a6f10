//! Whether answers and intervals of batches and chains are true: mean squared z and coverage over many seeds.
#![allow(dead_code, reason = "each test file uses its own part")]

use exact::Exact;
use radiosity::{Experiment, SceneSpec, Sequence, Solution, Tally};

/// Chains of a run, as jobs have them.
pub const CHAINS: u64 = 8;

/// The level of intervals.
pub const CONFIDENCE: f64 = 0.95;

pub fn run(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut board = experiment.board::<2>();
    experiment.walk(&Sequence::new(seed), 0..walks, &mut board);
    board.take().unwrap()
}

pub fn solve(experiment: &Experiment, seed: u64, walks: u64) -> Solution {
    Solution::new(experiment, &run(experiment, seed, walks), CONFIDENCE)
}

/// B of every patch and channel, and the standard error that it is known by [W/m²].
pub type Truth = Vec<(f64, f64)>;

pub fn exactly(spec: &SceneSpec) -> Truth {
    Exact::of_scene(spec).unwrap().solution().radiosity.iter().map(|&b| (b, 0.0)).collect()
}

/// What a much longer run says.
pub fn long_run(experiment: &Experiment, walks: u64) -> Truth {
    let estimates = solve(experiment, 99, walks).estimates;
    estimates
        .into_iter()
        .flatten()
        .map(|estimate| (estimate.radiosity, estimate.std_error.unwrap()))
        .collect()
}

/// A mean and its standard error, both from what independent values say.
#[derive(Clone, Copy, Debug)]
pub struct Mean {
    pub value: f64,
    pub error: f64,
}

impl Mean {
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (n - 1.0);
        Mean { value, error: (variance / n).sqrt() }
    }

    /// Whether it is `expected` within `z` standard errors.
    pub fn is(self, expected: f64, z: f64) -> bool {
        (self.value - expected).abs() <= z * self.error
    }
}

/// z² of the patches that reflect and do not emit, and how many of their intervals cover: means over runs of different
/// seeds, since the patches of one run err together.
pub struct Verdict {
    pub squared_z: Mean,
    pub coverage: Mean,
}

/// Judges the estimates of all patches of the truth.
pub fn judge(experiment: &Experiment, truth: &Truth, seeds: u64) -> Verdict {
    judge_those(experiment, truth, seeds, |_| true)
}

/// Judges the estimates of the patches that are `wanted`, by number.
pub fn judge_those(
    experiment: &Experiment,
    truth: &Truth,
    seeds: u64,
    wanted: impl Fn(u32) -> bool,
) -> Verdict {
    let scene = experiment.scene();
    let judged = |i: usize| {
        let patch = scene.faces().get(i / scene.channels());
        let unknown = !patch.emittance.is_lit() && patch.reflectance[i % scene.channels()] > 0.0;
        unknown && wanted((i / scene.channels()) as u32)
    };
    let judged: Vec<usize> = (0..truth.len()).filter(|&i| judged(i)).collect();
    let (mut squares, mut coverages) = (Vec::new(), Vec::new());
    for seed in 0..seeds {
        let estimates = solve(experiment, 7000 + seed, CHAINS).estimates;
        let (mut square, mut told, mut covered) = (0.0, 0_u64, 0_u64);
        for &i in &judged {
            let (estimate, (truth, error)) = (estimates[i].unwrap(), truth[i]);
            // Where nothing landed only the interval says anything.
            if let Some(own) = estimate.std_error {
                square += (estimate.radiosity - truth).powi(2) / (own.powi(2) + error * error);
                told += 1;
            }
            covered += u64::from((estimate.ci_low..=estimate.ci_high).contains(&truth));
        }
        squares.push(square / told as f64);
        coverages.push(covered as f64 / judged.len() as f64);
    }
    let verdict = Verdict { squared_z: Mean::of(&squares), coverage: Mean::of(&coverages) };
    let Verdict { squared_z, coverage } = &verdict;
    println!("z² {:.3} ± {:.3}", squared_z.value, squared_z.error);
    println!("coverage {:.4} ± {:.4}", coverage.value, coverage.error);
    verdict
}

impl Verdict {
    /// Two means at 4 standard errors: false-alarm rate 10⁻⁴ for these seeds, once and for all. `error` bounds the
    /// standard error of z², lest a test that knows nothing passes.
    pub fn agrees(&self, error: f64) {
        assert!(self.squared_z.error < error, "the test is blunt: {:?}", self.squared_z);
        assert!(self.squared_z.is(1.0, 4.0), "mean squared z {:?}", self.squared_z);
        assert!(self.coverage.is(CONFIDENCE, 4.0), "coverage {:?}", self.coverage);
    }

    /// What every method has to keep: mean squared z within 0.07 of 1, coverage within 0.01 of 0.95.
    pub fn is_true(&self) {
        assert!((self.squared_z.value - 1.0).abs() <= 0.07, "mean squared z {:?}", self.squared_z);
        assert!((self.coverage.value - CONFIDENCE).abs() <= 0.01, "coverage {:?}", self.coverage);
    }
}
