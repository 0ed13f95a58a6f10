//! Whether answers and intervals of batches and chains are true: mean squared z and coverage over many seeds.
#![allow(dead_code, reason = "each test file uses its own part")]

use exact::Exact;
use radiosity::{Experiment, SceneSpec, Sequence, Solution, Tally};

/// Chains of a run, as jobs have them.
pub const CHAINS: u64 = 8;

/// The level of intervals.
pub const CONFIDENCE: f64 = 0.95;

pub fn run(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let mut board = experiment.board();
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
        let (mut square, mut estimated, mut covered) = (0.0, 0_u64, 0_u64);
        for &i in &judged {
            let (estimate, (truth, error)) = (estimates[i].unwrap(), truth[i]);
            // Where nothing landed only the interval says anything.
            if let Some(own) = estimate.std_error {
                square += (estimate.radiosity - truth).powi(2) / (own.powi(2) + error * error);
                estimated += 1;
            }
            covered += u64::from((estimate.ci_low..=estimate.ci_high).contains(&truth));
        }
        squares.push(square / estimated as f64);
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

/// Patches of a range of expected hits: how often their intervals cover, and how wide these are.
#[derive(Debug)]
pub struct Class {
    /// Expected hits, or rays that land.
    pub hits: std::ops::Range<f64>,
    pub patches: usize,
    /// Over runs of different seeds.
    pub coverage: Mean,
    /// For each patch, by size: the reported median half-width over the error that a twentieth of the runs exceed. It is 1 where widths are
    /// known, 1.17 in the middle for Student's intervals of eight chains.
    pub told_over_real: Vec<f64>,
}

impl Class {
    pub fn median(&self) -> f64 {
        self.told_over_real[self.told_over_real.len() / 2]
    }
}

/// The bounds between [`Class`]es.
const CLASSES: [f64; 7] = [0.0, 4.0, 40.0, 150.0, 400.0, 1500.0, f64::INFINITY];

/// Patches that reflect and do not emit, by classes of hits, over `seeds` runs of `walks` walks, chains or batches each.
pub fn classes(experiment: &Experiment, truth: &Truth, (seeds, walks): (u64, u64)) -> Vec<Class> {
    let channels = experiment.scene().channels();
    let judged = |i: &usize| {
        let face = experiment.scene().faces().get(i / channels);
        !face.emittance.is_lit() && face.reflectance[i % channels] > 0.0
    };
    let judged: Vec<usize> = (0..truth.len()).filter(judged).collect();
    let runs: Vec<Vec<_>> = (0..seeds)
        .map(|seed| solve(experiment, 7000 + seed, walks).estimates.into_iter().flatten().collect())
        .collect();
    let hits = |i: usize| runs.iter().map(|run| run[i].hits as f64).sum::<f64>() / seeds as f64;
    let ranges = CLASSES.windows(2).map(|ends| ends[0]..ends[1]);
    let class = |range: std::ops::Range<f64>| {
        let patches: Vec<usize> = judged.iter().copied().filter(|&i| range.contains(&hits(i))).collect();
        if patches.is_empty() {
            return None;
        }
        let covers = |run: &Vec<radiosity::Estimate>| {
            let covered = patches.iter().filter(|&&i| (run[i].ci_low..=run[i].ci_high).contains(&truth[i].0));
            covered.count() as f64 / patches.len() as f64
        };
        let at = |mut values: Vec<f64>, part: f64| {
            values.sort_by(f64::total_cmp);
            values[(part * (values.len() - 1) as f64).round() as usize]
        };
        let ratio = |&i: &usize| {
            let widths = runs.iter().map(|run| 0.5 * (run[i].ci_high - run[i].ci_low)).collect();
            let real = runs.iter().map(|run| (run[i].radiosity - truth[i].0).abs()).collect();
            at(widths, 0.5) / at(real, 0.95)
        };
        let mut told_over_real: Vec<f64> = patches.iter().map(ratio).collect();
        told_over_real.sort_by(f64::total_cmp);
        let coverage = Mean::of(&runs.iter().map(covers).collect::<Vec<_>>());
        let class = Class { hits: range, patches: patches.len(), coverage, told_over_real };
        println!(
            "| {} … {} | {} | {:.1} ± {:.1} | {:.2} ({:.2} … {:.2}) |",
            class.hits.start,
            class.hits.end,
            class.patches,
            100.0 * class.coverage.value,
            100.0 * class.coverage.error,
            class.median(),
            class.told_over_real[0],
            class.told_over_real[class.patches - 1],
        );
        Some(class)
    };
    ranges.filter_map(class).collect()
}

/// The errors of the mean of `seeds` runs in their own standard errors, of every patch and channel.
pub fn biases(experiment: &Experiment, truth: &Truth, seeds: u64) -> Vec<f64> {
    let runs: Vec<Vec<f64>> = (0..seeds)
        .map(|seed| {
            solve(experiment, 9000 + seed, CHAINS).estimates.iter().flatten().map(|e| e.radiosity).collect()
        })
        .collect();
    let of_patch = |i: usize| {
        let mean = Mean::of(&runs.iter().map(|run| run[i]).collect::<Vec<_>>());
        (mean.value - truth[i].0) / mean.error
    };
    (0..truth.len()).map(of_patch).collect()
}
