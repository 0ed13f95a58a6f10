//! Discrete walks that know nothing but form factors spread as predicted, estimator by estimator.

use std::sync::Arc;

use crate::common::{Numbers, cube_54, plain_box};
use exact::{Exact, ExchangeMatrix};
use glam::DVec3;
use radiosity::EstimatorKind;

/// Where the never-ending walk is cut: what is left cannot show.
const NOTHING: f64 = 1e-9;

/// Every estimator, that of direct light last.
const KINDS: [EstimatorKind; 5] = [
    EstimatorKind::Absorption,
    EstimatorKind::Survival,
    EstimatorKind::Collision,
    EstimatorKind::Infinite,
    EstimatorKind::Direct,
];

/// One walk: the patches it hits, for ever; a mortal one would die at hit number `mortal`.
struct Path {
    hits: Vec<usize>,
    mortal: usize,
}

/// A source of walks by the exact form factors.
struct Walks<'a> {
    exact: &'a Exact,
    /// Running sums of F_ij over j.
    rows: Vec<Vec<f64>>,
    numbers: Numbers,
}

impl<'a> Walks<'a> {
    fn new(exact: &'a Exact) -> Self {
        let n = exact.face_count();
        let row = |i: usize| running_sums((0..n).map(|j| exact.exchange().form_factor(i, j)));
        Walks { exact, rows: (0..n).map(row).collect(), numbers: Numbers(8) }
    }

    fn choose(numbers: &mut Numbers, sums: &[f64]) -> usize {
        let target = numbers.uniform() * sums[sums.len() - 1];
        sums.partition_point(|&sum| sum <= target)
    }

    fn path(&mut self, from: usize) -> Path {
        let (mut hits, mut mortal, mut weight, mut patch) = (vec![], None, 1.0, from);
        while mortal.is_none() || weight > NOTHING {
            patch = Self::choose(&mut self.numbers, &self.rows[patch]);
            hits.push(patch);
            let r = self.exact.reflectance()[patch];
            weight *= r;
            if mortal.is_none() && self.numbers.uniform() >= r {
                mortal = Some(hits.len());
            }
        }
        Path { hits, mortal: mortal.unwrap() }
    }

    /// Σ score … Σ score⁴ of B_i by estimator (shooting first) and patch.
    fn moments(&mut self, walks: u32) -> [Vec<[f64; 4]>; 2 * KINDS.len()] {
        let n = self.exact.face_count();
        let powers = self.exact.emittance().iter().zip(self.exact.areas()).map(|(e, a)| e * a);
        let (sources, births) = (running_sums(powers), running_sums(self.exact.areas().iter().copied()));
        let mut moments = [(); 2 * KINDS.len()].map(|_| vec![[0.0; 4]; n]);
        let mut whole = vec![0.0; n];
        for _ in 0..walks {
            let source = Self::choose(&mut self.numbers, &sources);
            let path = self.path(source);
            for (k, estimator) in KINDS.into_iter().enumerate() {
                for (patch, score) in self.shooting_scores(estimator, &path) {
                    whole[patch] += score;
                }
                for &patch in &path.hits {
                    add_powers(&mut moments[k][patch], std::mem::take(&mut whole[patch]));
                }
            }
            let birth = Self::choose(&mut self.numbers, &births);
            let path = self.path(birth);
            let p = self.exact.areas()[birth] / births[n - 1];
            for (k, estimator) in KINDS.into_iter().enumerate() {
                let score = self.gathering_score(estimator, birth, &path) / p;
                add_powers(&mut moments[KINDS.len() + k][birth], score);
            }
        }
        moments
    }

    /// Scores of B on the patches of a shooting walk, hit by hit.
    fn shooting_scores(&self, estimator: EstimatorKind, path: &Path) -> Vec<(usize, f64)> {
        let value = |&i: &usize| {
            let r = self.exact.reflectance()[i];
            let unit = r * self.exact.total_power() / self.exact.areas()[i];
            (i, r, unit)
        };
        let mortal = path.hits[..path.mortal].iter().map(value);
        match estimator {
            EstimatorKind::Absorption => {
                mortal.skip(path.mortal - 1).map(|(i, r, unit)| (i, unit / (1.0 - r))).collect()
            }
            EstimatorKind::Survival => {
                mortal.take(path.mortal - 1).map(|(i, r, unit)| (i, unit / r)).collect()
            }
            EstimatorKind::Collision => mortal.map(|(i, _, unit)| (i, unit)).collect(),
            EstimatorKind::Direct => mortal.take(1).map(|(i, _, unit)| (i, unit)).collect(),
            EstimatorKind::Infinite => {
                let mut weight = 1.0;
                let weighted = path.hits.iter().map(value).map(|(i, r, unit)| {
                    let score = unit * weight;
                    weight *= r;
                    (i, score)
                });
                weighted.collect()
            }
        }
    }

    /// p_i times the whole score of a gathering walk.
    fn gathering_score(&self, estimator: EstimatorKind, birth: usize, path: &Path) -> f64 {
        let value = |&s: &usize| (self.exact.reflectance()[s], self.exact.emittance()[s]);
        let mortal = path.hits[..path.mortal].iter().map(value);
        let sum: f64 = match estimator {
            EstimatorKind::Absorption => mortal.skip(path.mortal - 1).map(|(r, e)| e / (1.0 - r)).sum(),
            EstimatorKind::Survival => mortal.take(path.mortal - 1).map(|(r, e)| e / r).sum(),
            EstimatorKind::Collision => mortal.map(|(_, e)| e).sum(),
            EstimatorKind::Direct => mortal.take(1).map(|(_, e)| e).sum(),
            EstimatorKind::Infinite => {
                let mut weight = 1.0;
                let weighted = path.hits.iter().map(value).map(|(r, e)| {
                    let score = e * weight;
                    weight *= r;
                    score
                });
                weighted.sum()
            }
        };
        sum * self.exact.reflectance()[birth]
    }
}

fn running_sums(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let sums = values.scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    });
    sums.collect()
}

fn add_powers(moments: &mut [f64; 4], score: f64) {
    let mut power = 1.0;
    for moment in moments {
        power *= score;
        *moment += power;
    }
}

/// How many standard errors of its own a sample's variance is off.
fn z_of_variance(sums: &[f64; 4], walks: f64, predicted: f64) -> f64 {
    let [m1, m2, m3, m4] = sums.map(|sum| sum / walks);
    let variance = m2 - m1 * m1;
    let fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4);
    (variance - predicted) / ((fourth - variance * variance) / walks).sqrt()
}

fn z_of_mean(sums: &[f64; 4], walks: f64, expected: f64) -> f64 {
    let (mean, square) = (sums[0] / walks, sums[1] / walks);
    (mean - expected) / ((square - mean * mean) / walks).sqrt()
}

/// Means and variances of all estimators, shooting and gathering. Some 1.9·10³ z-scores in all the tests together at |z| < 4.8:
/// false-alarm rate 3·10⁻³, once and for all with this seed.
#[track_caller]
fn assert_walks_spread_as_predicted(exact: &Exact) {
    const WALKS: u32 = 350_000;
    let total: f64 = exact.areas().iter().sum();
    let birth: Vec<f64> = exact.areas().iter().map(|a| a / total).collect();
    let shooting = KINDS.map(|e| (e, exact.shooting_variances(e)));
    let gathering = KINDS.map(|e| {
        (e, exact.gathering_variances(e, &birth).into_iter().map(Option::unwrap).collect::<Vec<f64>>())
    });
    let moments = Walks::new(exact).moments(WALKS);
    for ((estimator, predicted), moments) in shooting.iter().chain(&gathering).zip(&moments) {
        let name = estimator.word();
        let expected = match estimator {
            EstimatorKind::Direct => exact.direct(),
            _ => exact.solution().reflected.clone(),
        };
        let mut squares = 0.0;
        for (i, sums) in moments.iter().enumerate() {
            if expected[i] == 0.0 {
                // No light comes here straight from an emitter.
                assert_eq!((predicted[i], *sums), (0.0, [0.0; 4]), "{name} on patch {i}");
                continue;
            }
            let off_mean = z_of_mean(sums, f64::from(WALKS), expected[i]);
            let off = z_of_variance(sums, f64::from(WALKS), predicted[i]);
            assert!(off_mean.abs() < 4.8 && off.abs() < 4.8, "{name} on patch {i}: {off_mean}, {off}");
            squares += off * off;
        }
        // Patches are nearly independent but in the six-patch cube.
        let mean_square = squares / moments.len() as f64;
        assert!(mean_square < 1.0 + 6.0 * (2.0 / moments.len() as f64).sqrt(), "{name}: {mean_square}");
    }
}

#[test]
fn in_the_54_patch_cube() {
    assert_walks_spread_as_predicted(&Exact::of_scene(&cube_54()).unwrap());
}

/// Several emitters of unlike reflectance, some of them neighbours.
#[test]
fn among_several_emitters() {
    let mut spec = plain_box(DVec3::ZERO, DVec3::new(1.0, 2.0, 1.5), [2, 3], 0.0, 0.0);
    for (surface, r) in spec.surfaces.iter_mut().zip([0.2, 0.9, 0.5, 0.35, 0.7, 0.6]) {
        surface.reflectance = r.into();
    }
    spec.surfaces[0].cell_emittance = vec![(1, 2.0.into())];
    spec.surfaces[1].cell_emittance = vec![(0, 0.5.into()), (5, 1.0.into())];
    spec.surfaces[4].cell_emittance = vec![(3, 4.0.into())];
    assert_walks_spread_as_predicted(&Exact::of_scene(&spec).unwrap());
}

/// Here a walk meets a patch many times: squaring hits one by one would halve the variance.
#[test]
fn in_the_bright_six_patch_cube() {
    let matrix = ExchangeMatrix::new(vec![1.0; 6], |i, j| if i == j { 0.0 } else { 0.2 });
    let exact = Exact::new(Arc::new(matrix), vec![0.9; 6], vec![0.1; 6]).unwrap();
    assert_walks_spread_as_predicted(&exact);
}
