//! Replicates of the hours of a year: what other walks would have said.
//!
//! Counts of a row are multinomial. A replicate moves each hour by Σ_c √(n_c + a_c)·ξ_c·(x_c(t) − E_t)/N with independent standard normal ξ_c,
//! one for each class c of walks, those that end among them. With a = 0 the covariance of two hours is (Σ p_c·x_c·x′_c − E·E′)/N, that of the counts.
//!
//! Few reflected walks leave for a patch that holds the sun, and each of them brings much. Where none of them did, the counts alone would say that none
//! ever does. So a is ½ for the classes of reflected walks that bring the sun in some hour, the half of Jeffreys' prior of counts (H. Jeffreys, Proceedings of
//! the Royal Society A 186 (1946) 453–461), and 0 for all others. Numbers of replicates are fixed: the answer is a function of the counts.

use std::f64::consts::PI;

use radiosity::Sequence;
use stats::normal_quantile;

use crate::annual::{Hour, SkyPatchCounts};

/// Sums that grow side by side: one alone would wait for each addition.
const SUMS: usize = 8;

/// Replicates from which an interval is made, whose width then errs by 4 %.
pub(crate) const REPLICATES: usize = 399;

/// The seed of the numbers ξ.
const SEED: u64 = 0x5eed_0f5c_1e5a;

/// Walks that a class which brings the sun is given besides, a.
const UNSEEN: f64 = 0.5;

/// The hours of a sensor that replicates move.
pub(crate) struct Moved {
    /// Hour by hour, E.
    pub(crate) means: Vec<f64>,
    /// Hour by hour, the standard error of E: √((Σ p_c·x_c² − E²)/N).
    pub(crate) errors: Vec<f64>,
    /// Hour by hour, √(n_c + a_c)·(x_c − E)/N of each class.
    steps: Vec<Vec<f64>>,
    classes: usize,
}

impl Moved {
    /// Hours by what a row says of them.
    pub(crate) fn new<'a>(row: &SkyPatchCounts, hours: impl Iterator<Item = &'a Hour> + Clone) -> Self {
        let mut sunny = vec![false; row.reflected.len()];
        hours.clone().flat_map(|hour| &hour.sun).for_each(|&(patch, _)| sunny[patch] = true);
        let (numbers, mut counts): (Vec<(usize, bool)>, Vec<f64>) =
            row.classes(&sunny).map(|(number, reflected, n)| ((number, reflected), n as f64)).unzip();
        // The class of walks that were reflected and left for a number.
        let mut reflected = vec![None; row.reflected.len()];
        for (class, &(number, _)) in numbers.iter().enumerate().filter(|(_, (_, reflected))| *reflected) {
            reflected[number] = Some(class);
        }
        let walks = row.walks as f64;
        // Those that end score nothing.
        counts.push(walks - counts.iter().sum::<f64>());
        let unseen = numbers.iter().map(|&(number, reflected)| match reflected && sunny[number] {
            true => UNSEEN,
            false => 0.0,
        });
        let more: Vec<f64> = unseen.chain([0.0]).collect();
        let weights: Vec<f64> = counts.iter().zip(&more).map(|(n, more)| (n + more).sqrt() / walks).collect();
        let mut moved =
            Moved { means: Vec::new(), errors: Vec::new(), steps: Vec::new(), classes: counts.len() };
        for hour in hours {
            let mut scores: Vec<f64> =
                numbers.iter().map(|&(number, _)| PI * hour.sky[number]).chain([0.0]).collect();
            for &(patch, radiance) in &hour.sun {
                if let Some(class) = reflected[patch] {
                    scores[class] += PI * radiance;
                }
            }
            let mean = product(&counts, &scores) / walks;
            scores.iter_mut().zip(&weights).for_each(|(score, weight)| *score = weight * (*score - mean));
            // Without what classes are given besides.
            let besides: f64 = scores
                .iter()
                .zip(counts.iter().zip(&more))
                .filter(|(_, (_, more))| **more > 0.0)
                .map(|(step, (n, more))| step * step * more / (n + more))
                .sum();
            moved.means.push(mean);
            moved.errors.push((product(&scores, &scores) - besides).max(0.0).sqrt());
            moved.steps.push(scores);
        }
        moved
    }

    /// The standard deviation of an hour over replicates.
    pub(crate) fn spread(&self, hour: usize) -> f64 {
        product(&self.steps[hour], &self.steps[hour]).sqrt()
    }

    /// By how much a replicate moves each of some hours.
    pub(crate) fn replicate(&self, number: u64, hours: &[usize]) -> Vec<f64> {
        let mut rng = Sequence::new(SEED).walk(number);
        let xi: Vec<f64> = (0..self.classes)
            .map(|_| normal_quantile((rng.pair()[0] + 0.5_f64.powi(33)).min(1.0 - 1e-12)))
            .collect();
        hours.iter().map(|&hour| product(&self.steps[hour], &xi)).collect()
    }
}

/// Σ a·b.
fn product(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; SUMS];
    let (a, b) = (a.chunks_exact(SUMS), b.chunks_exact(SUMS));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        (0..SUMS).for_each(|i| sums[i] += a[i] * b[i]);
    }
    sums.iter().sum::<f64>() + rest
}

/// Half the width of the interval of a number by its replicates: their root mean square distance from the estimate, as many times as the level asks
/// for.
///
/// Replicates lie on average beside the estimate, and the truth does, too. Where one error moves all hours alike they lie on the same side, where each
/// hour has an error of its own on opposite ones. The root mean square holds that distance for either side.
pub(crate) fn half_width(value: f64, replicates: &[f64], confidence: f64) -> f64 {
    let squares: f64 = replicates.iter().map(|other| (other - value).powi(2)).sum();
    normal_quantile(0.5 + 0.5 * confidence) * (squares / replicates.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::annual::tests::{counted, weather, window};
    use crate::dome::Dome;
    use radiosity::daylight::SkyPatches;

    /// Standard errors are those of the multinomial; the covariance of replicates is that of counts with half a walk more for each class that
    /// brings the sun: within 4 standard errors of 4,000 replicates.
    #[test]
    fn replicates_have_the_covariance_of_counts() {
        let dome = Dome::new(SkyPatches::new(145).unwrap());
        let (year, p) = (weather(&dome, 2), window(&dome));
        let row = counted(&p, 1 << 14, 3);
        let means: Vec<f64> =
            year.hours.iter().map(|hour| row.light(&hour.sky, &hour.sun, 0.95).value).collect();
        let moved = Moved::new(&row, year.hours.iter());
        for (mean, light) in moved.means.iter().zip(&means) {
            assert!((mean / light - 1.0).abs() < 1e-12, "{mean} {light}");
        }
        let product =
            |a: usize, b: usize| moved.steps[a].iter().zip(&moved.steps[b]).map(|(x, y)| x * y).sum::<f64>();
        let n = 4000;
        let (mut both, mut first) = (0.0, 0.0);
        for number in 0..n {
            let moves = moved.replicate(number, &[0, 1]);
            both += moves[0] * moves[1] / n as f64;
            first += moves[0] * moves[0] / n as f64;
        }
        let squares = [product(0, 0), product(1, 1)];
        assert!((first / squares[0] - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt());
        let error = ((squares[0] * squares[1] + product(0, 1).powi(2)) / n as f64).sqrt();
        assert!((both - product(0, 1)).abs() < 4.0 * error, "{both}, {}", product(0, 1));

        // (Σ p x² − E²)/N; all of the patches around the sun, also those that no walk has found.
        let walks = row.walks as f64;
        for (i, hour) in year.hours.iter().enumerate() {
            let sun_of = |j: usize| hour.sun.iter().find(|&&(lit, _)| lit == j).map_or(0.0, |&(_, sun)| sun);
            let score =
                |j: usize, reflected: bool| PI * (hour.sky[j] + if reflected { sun_of(j) } else { 0.0 });
            let scores =
                row.classes(&[false; 146]).map(|(j, reflected, n)| n as f64 * score(j, reflected).powi(2));
            let expected = (scores.sum::<f64>() / walks - means[i] * means[i]) / walks;
            assert!((moved.errors[i].powi(2) / expected - 1.0).abs() < 1e-9);
            let mut sunny: Vec<usize> =
                year.hours.iter().flat_map(|hour| hour.sun.iter().map(|&(patch, _)| patch)).collect();
            sunny.sort_unstable();
            sunny.dedup();
            let besides =
                sunny.iter().map(|&j| 0.5 * ((score(j, true) - means[i]) / walks).powi(2)).sum::<f64>();
            assert!(besides > 0.0 && (product(i, i) / (expected + besides) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn widths_count_what_replicates_lie_beside_the_estimate() {
        let replicates = [3.0, 5.0, 5.0, 7.0];
        assert!((half_width(5.0, &replicates, 0.95) - 1.959964 * 2.0_f64.sqrt()).abs() < 1e-5);
        assert!((half_width(4.0, &replicates, 0.95) - 1.959964 * 3.0_f64.sqrt()).abs() < 1e-5);
        assert_eq!(half_width(7.0, &[7.0; 9], 0.95), 0.0);
    }
}
