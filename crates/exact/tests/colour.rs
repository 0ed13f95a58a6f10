//! Walks that carry the weights of three channels, and know nothing but form factors, spread as predicted.

use std::sync::Arc;

use crate::common::{Numbers, assert_near, cube_54};
use crate::shapes::{grey, painted, quad, room};
use exact::{ESTIMATORS, Exact, ExchangeMatrix, SharedPath, WeightedWalk};
use radiosity::{EstimatorKind, Sides};

/// Where the never-ending walk is cut: what is left cannot show.
const NOTHING: f64 = 1e-9;

/// With one channel the paths are its own, and the variances those of grey walks; of two-sided patches, too.
#[test]
fn grey_is_the_case_of_one_channel() {
    let mut parted = painted(room([2.0, 1.0, 1.0], 1), 0.6, 0.0);
    let mut plate = grey(quad([0.9, 0.1, 0.2], [0.0, 0.5, 0.3], [0.4, 0.0, 0.2], [1, 1]), 0.8, 0.5);
    plate.sides = Sides::Both;
    parted.surfaces.push(plate);
    parted.surfaces[0].emittance = 1.0.into();
    parted.surfaces[3].reflectance = 0.0.into();
    for spec in [cube_54(), parted] {
        let exact = Exact::of_scene(&spec).unwrap();
        let path = SharedPath::of(&[&exact]);
        let walk = WeightedWalk::new(&exact, &path).unwrap();
        let birth = vec![1.0 / exact.face_count() as f64; exact.face_count()];
        for &estimator in EstimatorKind::ALL {
            let expected = exact.shooting_variances(estimator);
            for (variance, expected) in walk.shooting_variances(estimator).iter().zip(&expected) {
                assert_near(*variance, *expected, 1e-11 * expected.abs());
            }
        }
        for &estimator in EstimatorKind::ALL {
            let expected = exact.gathering_variances(estimator, &birth);
            for (variance, expected) in walk.gathering_variances(estimator, &birth).iter().zip(&expected) {
                assert_near(variance.unwrap(), expected.unwrap(), 1e-11 * expected.unwrap().abs());
            }
        }
    }
}

/// Three channels over the form factors of a box of 2 × 1 × 1 with 2 × 1 patches a wall: unlike reflectances,
/// one patch black in a channel and one in all, emitters of three colours, one of them black in a channel.
fn channels() -> [Exact; 3] {
    let box_scene = exact::BoxScene::recognise(&crate::common::plain_box(
        glam::DVec3::ZERO,
        glam::DVec3::new(2.0, 1.0, 1.0),
        [2, 1],
        0.5,
        1.0,
    ));
    let matrix = Arc::new(ExchangeMatrix::of_box(&box_scene.unwrap()));
    let n = matrix.face_count();
    let mut numbers = Numbers(21);
    [0, 1, 2].map(|channel| {
        let mut reflectance: Vec<f64> = (0..n).map(|_| numbers.between(0.2, 0.9)).collect();
        let mut emittance = vec![0.0; n];
        reflectance[4] = 0.0;
        reflectance[7 + channel] = 0.0;
        (emittance[0], emittance[5]) = ([1.0, 0.2, 0.5][channel], [0.0, 1.0, 0.3][channel]);
        emittance[9] = [0.4, 0.4, 0.0][channel];
        Exact::new(Arc::clone(&matrix), reflectance, emittance).unwrap()
    })
}

/// A hit of a walk.
struct Hit {
    patch: usize,
    /// The weight of every channel on arrival: `weight` of the mortal walk, `endless` of the one that is never absorbed.
    weight: [f64; 3],
    endless: [f64; 3],
    /// Whether the mortal walk arrives, and whether it goes on.
    alive: bool,
    survives: bool,
}

struct Walks<'a> {
    channels: &'a [Exact; 3],
    path: SharedPath,
    rows: Vec<Vec<f64>>,
    numbers: Numbers,
}

impl<'a> Walks<'a> {
    fn new(channels: &'a [Exact; 3]) -> Self {
        let exchange = channels[0].exchange();
        let n = exchange.face_count();
        let row = |i: usize| running_sums((0..n).map(|j| exchange.form_factor(i, j)));
        Walks {
            channels,
            path: SharedPath::of(&channels.each_ref()),
            rows: (0..n).map(row).collect(),
            numbers: Numbers(22),
        }
    }

    fn hits(&mut self, from: usize, born: [f64; 3]) -> Vec<Hit> {
        let (mut patch, mut weight, mut endless, mut alive) = (from, born, born, true);
        let mut hits = vec![];
        while alive || endless.iter().any(|&w| w > NOTHING) {
            patch = choose(&mut self.numbers, &self.rows[patch]);
            let sigma = self.path.survival[patch];
            let survives = alive && self.numbers.uniform() < sigma;
            hits.push(Hit { patch, weight, endless, alive, survives });
            for c in 0..3 {
                let r = self.channels[c].reflectance()[patch];
                weight[c] *= if r > 0.0 { r / sigma } else { 0.0 };
                endless[c] *= r;
            }
            alive = survives;
        }
        hits
    }

    /// What a hit is worth where a walk scores `unit` (Φ_T or E_s) times its weight, by estimator.
    fn scores(&self, hit: &Hit, channel: usize, unit: f64) -> [f64; 4] {
        let (sigma, value) = (self.path.survival[hit.patch], unit * hit.weight[channel]);
        [
            if hit.alive && !hit.survives { value / (1.0 - sigma) } else { 0.0 },
            if hit.survives { value / sigma } else { 0.0 },
            if hit.alive { value } else { 0.0 },
            unit * hit.endless[channel],
        ]
    }
}

fn choose(numbers: &mut Numbers, sums: &[f64]) -> usize {
    let target = numbers.uniform() * sums[sums.len() - 1];
    sums.partition_point(|&sum| sum <= target)
}

fn running_sums(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let sums = values.scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    });
    sums.collect()
}

/// Σ score … Σ score⁴ by channel, estimator and patch.
type Moments = Vec<[f64; 4]>;

fn at(channel: usize, estimator: usize, patch: usize, n: usize) -> usize {
    (channel * 4 + estimator) * n + patch
}

fn add_powers(moments: &mut [f64; 4], score: f64) {
    let mut power = 1.0;
    for moment in moments {
        power *= score;
        *moment += power;
    }
}

/// Shooting walks' and gathering walks' scores of B.
fn moments(channels: &[Exact; 3], walks: u32) -> [Moments; 2] {
    let mut random = Walks::new(channels);
    let n = channels[0].face_count();
    let areas = channels[0].areas();
    let sources = running_sums(random.path.source.iter().copied());
    let [mut shot, mut gathered] = [(); 2].map(|()| vec![[0.0; 4]; 12 * n]);
    let mut whole = vec![0.0; 12 * n];
    for _ in 0..walks {
        let source = choose(&mut random.numbers, &sources);
        let born = [0, 1, 2].map(|c| {
            let share = channels[c].emittance()[source] * areas[source] / channels[c].total_power();
            share / random.path.source[source]
        });
        let hits = random.hits(source, born);
        for hit in &hits {
            for c in 0..3 {
                let unit =
                    channels[c].total_power() * channels[c].reflectance()[hit.patch] / areas[hit.patch];
                for (k, score) in random.scores(hit, c, unit).into_iter().enumerate() {
                    whole[at(c, k, hit.patch, n)] += score;
                }
            }
        }
        for hit in &hits {
            for ck in 0..12 {
                let place = ck * n + hit.patch;
                add_powers(&mut shot[place], std::mem::take(&mut whole[place]));
            }
        }
        let birth = random.numbers.below(n as u32) as usize;
        let hits = random.hits(birth, [1.0; 3]);
        for c in 0..3 {
            let mut sums = [0.0; 4];
            for hit in &hits {
                let scores = random.scores(hit, c, channels[c].emittance()[hit.patch]);
                sums = std::array::from_fn(|k| sums[k] + scores[k]);
            }
            for (k, sum) in sums.into_iter().enumerate() {
                let score = channels[c].reflectance()[birth] * sum * n as f64;
                add_powers(&mut gathered[at(c, k, birth, n)], score);
            }
        }
    }
    [shot, gathered]
}

/// How many standard errors of its own a sample's mean and variance are off; `None` where all scores are 0.
fn z(sums: &[f64; 4], walks: f64, mean: f64, variance: f64) -> Option<[f64; 2]> {
    let [m1, m2, m3, m4] = sums.map(|sum| sum / walks);
    let measured = m2 - m1 * m1;
    let fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4);
    let spread = ((fourth - measured * measured) / walks).sqrt();
    (m2 > 0.0).then(|| [(m1 - mean) / (measured / walks).sqrt(), (measured - variance) / spread])
}

/// Means and variances of all eight estimators in three channels. 480 z-scores at |z| < 4.9: false-alarm rate
/// 5·10⁻⁴, once and for all with this seed.
#[test]
fn coloured_walks_spread_as_predicted() {
    const WALKS: u32 = 500_000;
    let channels = channels();
    let path = SharedPath::of(&channels.each_ref());
    let n = channels[0].face_count();
    let birth = vec![1.0 / n as f64; n];
    let [shot, gathered] = moments(&channels, WALKS);
    let mut count = 0;
    for (c, channel) in channels.iter().enumerate() {
        let walk = WeightedWalk::new(channel, &path).unwrap();
        let shooting =
            ESTIMATORS.map(|e| (format!("shooting {}", e.word()), &shot, walk.shooting_variances(e)));
        let gathering = ESTIMATORS.map(|e| {
            let variances = walk.gathering_variances(e, &birth).into_iter().map(Option::unwrap).collect();
            (format!("gathering {}", e.word()), &gathered, variances)
        });
        for (k, (name, moments, predicted)) in shooting.iter().chain(&gathering).enumerate() {
            for i in 0..n {
                let mean = channel.solution().reflected[i];
                let sums = &moments[at(c, k % 4, i, n)];
                let Some([z_mean, z_variance]) = z(sums, f64::from(WALKS), mean, predicted[i]) else {
                    assert_near(mean, 0.0, 1e-15);
                    assert_near(predicted[i], 0.0, 1e-15);
                    continue;
                };
                let worst = z_mean.abs().max(z_variance.abs());
                assert!(worst < 4.9, "{name}, channel {c}, patch {i}: {z_mean} {z_variance}");
                count += 2;
            }
        }
    }
    assert_eq!(count, 480, "two patches of every channel are black");
}
