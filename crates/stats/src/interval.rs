//! Confidence intervals of the mean score per walk.

use crate::moments::Sample;
use crate::normal::normal_quantile;

/// A closed interval of the mean score, in hits per walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower end of the interval.
    pub low: f64,
    /// The upper end of the interval.
    pub high: f64,
}

impl Interval {
    /// Whether the value lies inside or at an end.
    pub fn contains(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// The number of telling walks at which half of the caution due to few of them is gone.
const CAUTIOUS_WALKS: f64 = 20.0;

/// The two-sided interval that holds the expected score per walk with probability `confidence` (0.95, say),
/// from the moments of a patch in units of `unit` hits and a bound on E\[x²\]/E\[x\] known beforehand, in hits.
/// The unit is 1 for scores that count hits; for others, and for weighted ones, a hit is taken to be of the size Σx²/Σx.
///
/// Collision scores are zero, or geometric once the patch is reached. If a walk returns to it with
/// probability at most r, then E\[x²\]/E\[x\] ≤ `ratio_bound` = 2m − 1 with m = 1/(1 − r). A bound that is
/// too large costs width where hits are few, nothing where they are many; one that is too small costs truth.
/// The estimate itself always lies inside. The mean cannot exceed `ratio_bound`, since E\[x\]² ≤ E\[x²\].
///
/// **Many hits.** The interval becomes mean ± z·s/√n.
///
/// **Some hits.** Σx is taken for c times a Poisson count k = Σx/c, where c = S²/Σx and S² = n·s². Byar
/// approximates the limits of such a count in closed form (N. E. Breslow & N. E. Day, *Statistical Methods in
/// Cancer Research* II, 1987, eq. 2.10). Three things keep that true down to one hit. Two of them fade, by the
/// caution a = 1/(1 + t/20), with the number t of walks that tell something: those that hit, about Σx/d with
/// d = Σx²/Σx, or, where nearly all score the same, the 4·S² that differ.
/// - c is drawn towards `ratio_bound` by the weight w = a²d of one more walk as large as those seen:
///   c = (S² + w·ratio_bound)/(Σx + w).
/// - Exact Poisson limits use the counts k and k + 1, mid-P limits k + ½ for both (H. O. Lancaster, Biometrika
///   36 (1949) 370–382): half a step to either side is taken in full at first and fades as a.
/// - A Poisson count times c has the third cumulant c²·Σx. The scores' own, κ₃ per hit, is estimated from c and
///   the mean, and (2z² + 1)/6·κ₃/κ₂, the second-order term in the limits of a studentised mean (P. Hall,
///   J. R. Statist. Soc. B 54 (1992) 221–228), is moved by the difference, outwards only; that of the lower limit
///   by a(c − 1) if this is more, the difference for scores of one hit which few walks miss.
///
/// **No hits.** By Cauchy and Schwarz E\[x\]² ≤ P(x > 0)·E\[x²\]: a walk hits with probability
/// P ≥ mean/`ratio_bound`, and all n miss with probability (1 − P)ⁿ at most. The upper limit is the mean at
/// which that falls to (1 − confidence)/2: at 95 %, nearly 3.69·`ratio_bound`/n. It holds for any scores.
///
/// **One walk,** or sums that no scores have: the lower limit is Markov's, (1 − confidence)·x, the upper
/// `ratio_bound`. No walk: \[0, `ratio_bound`\].
///
/// # Panics
/// If `confidence` is not between 0 and 1 or `ratio_bound` not finite and at least 1.
pub fn mean_interval(sample: impl Into<Sample>, unit: f64, confidence: f64, ratio_bound: f64) -> Interval {
    assert!(confidence > 0.0 && confidence < 1.0, "confidence {confidence} is not between 0 and 1");
    assert!((1.0..f64::INFINITY).contains(&ratio_bound), "no scores have E[x²]/E[x] ≤ {ratio_bound}");
    let sample = sample.into();
    let tail = 0.5 * (1.0 - confidence);
    let n = sample.n as f64;
    if sample.sum == 0.0 {
        return Interval { low: 0.0, high: -ratio_bound * (tail.ln() / n).exp_m1() };
    }
    // The size of one hit: 1 for counts; for other scores, the size that the seen scores have where it matters.
    let hit = if unit == 1.0 && sample.counts { 1.0 } else { unit * sample.sum_sq / sample.sum };
    let per_hit = unit / hit;
    let ratio_bound = (ratio_bound / hit).max(1.0);
    let hits = per_hit * sample.sum;
    let squares = per_hit * per_hit * sample.sum_sq;
    let mean = hits / n;
    let most = ratio_bound.max(mean);
    let Some(variance) = sample.variance else {
        return Interval { low: hit * 2.0 * tail * mean, high: hit * most };
    };

    // The dispersion c: variance per hit.
    let spread = n * per_hit * per_hit * variance;
    let size = squares / hits;
    let caution = 1.0 / (1.0 + (hits / size).min(4.0 * spread) / CAUTIOUS_WALKS);
    let weight = size * caution * caution;
    let c = (spread + weight * ratio_bound) / (hits + weight);

    // The skewness κ₃/κ₂ that a scaled Poisson count lacks, or has too much.
    let z = -normal_quantile(tail);
    let shift_per_skewness = (2.0 * z * z + 1.0) / 6.0;
    let skewness = third_cumulant(c, mean) / c - c;
    let skewness_of_misses = caution * (c - 1.0);

    let count = hits / c + 0.5;
    let half_step = 0.5 * caution * c.max(1.0);
    let low =
        c * byar(count, -z) - half_step + shift_per_skewness * skewness.min(skewness_of_misses).min(0.0);
    let high = c * byar(count, z) + half_step + shift_per_skewness * skewness.max(0.0);
    Interval { low: hit * (low / n).clamp(0.0, mean), high: hit * (high / n).clamp(mean, most) }
}

/// The interval of the mean of batches of walks, from the standard error that the batches tell and Student's quantile for as many. `hit` is what
/// one hit adds to the mean. Hits of Sobol walks spread less than a Poisson count, or more where walks return: the mean is taken for c times such
/// a count, c = error²/mean, so that the relative error says how many they are worth. Byar's limits of that count lean upwards as it does, and
/// half a hit to either side fades with the hits, as in [`mean_interval`]. Where all batches say the same, c is a hit.
pub fn batches_interval(mean: f64, error: f64, quantile: f64, hit: f64) -> Interval {
    let c = if error > 0.0 { error * error / mean } else { hit };
    let count = mean / c;
    let half_step = 0.5 * c.max(hit) / (1.0 + mean / hit / CAUTIOUS_WALKS);
    let [low, high] = [-quantile, quantile].map(|z| c * byar(count + 0.5, z));
    Interval { low: (low - half_step).clamp(0.0, mean), high: (high + half_step).max(mean) }
}

/// By how many standard errors, times the relative standard error 1/√k, Garwood's upper limit of a Poisson number k exceeds k + z√k: the
/// first terms of χ²'s quantile with 2k + 2 degrees of freedom.
pub fn beyond_of_count(quantile: f64) -> f64 {
    (quantile * quantile + 2.0) / 3.0
}

/// Byar's approximation of the mean at which a Poisson count is z standard deviations away (Breslow & Day 1987, eq. 2.10).
fn byar(count: f64, z: f64) -> f64 {
    let root = 1.0 - 1.0 / (9.0 * count) + z / (3.0 * count.sqrt());
    count * root.max(0.0).powi(3)
}

/// The third cumulant per hit, κ₃/E\[x\], of scores of mean μ and variance cμ: zero, or geometric of mean m. They
/// have E\[x²\] = (2m − 1)μ = dμ with d = c + μ, and E\[x³\] = (6m² − 6m + 1)μ = (3d² − 1)/2·μ.
fn third_cumulant(c: f64, mean: f64) -> f64 {
    let d = c + mean;
    1.5 * d * d - 0.5 - 3.0 * mean * d + 2.0 * mean * mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moments::Moments;

    fn close(a: f64, b: f64, relative: f64) -> bool {
        (a - b).abs() <= relative * b.abs()
    }

    #[test]
    fn many_hits_give_the_normal_interval() {
        // a tenth of 10¹² walks hit once, a tenth thrice
        let moments = Moments { n: 1_000_000_000_000, sum: 400_000_000_000, sum_sq: 1_000_000_000_000 };
        let interval = mean_interval(&moments, 1.0, 0.95, 9.5);
        let half_width = 1.959964 * moments.standard_error().unwrap();
        assert!(close(0.4 - interval.low, half_width, 1e-4), "{interval:?}");
        assert!(close(interval.high - 0.4, half_width, 1e-4), "{interval:?}");
    }

    #[test]
    fn no_hits_leave_the_upper_bound_of_cauchy_and_schwarz() {
        let none = |n| mean_interval(&Moments { n, sum: 0, sum_sq: 0 }, 1.0, 0.95, 3.0);
        assert_eq!(none(0), Interval { low: 0.0, high: 3.0 });
        assert!(close(none(1).high, 3.0 * 0.975, 1e-12));
        assert!(close(none(2).high, 3.0 * (1.0 - 0.025f64.sqrt()), 1e-12));
        assert!(close(none(1 << 50).high, 3.0 * 3.688879454113936 / 2f64.powi(50), 1e-12));
    }

    /// Garwood's exact limits of 1, 3 and 10 rare single hits at 95 % lie within; Byar and the pseudo-walk cost
    /// at most a tenth of the width.
    #[test]
    fn few_rare_hits_give_about_garwoods_limits() {
        for (hits, low, high) in [(1, 0.025318, 5.571643), (3, 0.618672, 8.767273), (10, 4.795389, 18.390356)]
        {
            let moments = Moments { n: 1_000_000, sum: hits, sum_sq: hits };
            let interval = mean_interval(&moments, 1.0, 0.95, 1.0);
            let width = 1e6 * (interval.high - interval.low);
            assert!((0.9..1.1).contains(&(width / (high - low))), "{hits} hits: {interval:?}");
            assert!(close(1e6 * interval.high, high, 0.1), "{hits} hits: {interval:?}");
        }
    }

    /// The width that caution adds at few hits is gone at many: the width at 2,000 rare single hits is 2z√2000. Half a
    /// step to either side would be 1.1 % more.
    #[test]
    fn caution_fades_with_the_hits() {
        let moments = Moments { n: 1_000_000_000_000, sum: 2000, sum_sq: 2000 };
        let interval = mean_interval(&moments, 1.0, 0.95, 9.5);
        let width = 1e12 * (interval.high - interval.low);
        assert!(close(width, 2.0 * 1.959964 * 2000f64.sqrt(), 2e-3), "{interval:?}");
    }

    /// Scores of 2 and of 1, weighted by 0.5 and by 1, are scores of 1.
    #[test]
    fn weighted_scores_have_the_interval_of_their_products() {
        let weighted = Sample::weighted(1_000_000, [(0.5, 20_000, 40_000), (1.0, 10_000, 10_000)]);
        let counted = Moments { n: 1_000_000, sum: 20_000, sum_sq: 20_000 };
        assert!(close(weighted.standard_error().unwrap(), counted.standard_error().unwrap(), 1e-12));
        let [weighted, counted] =
            [weighted, (&counted).into()].map(|sample: Sample| mean_interval(sample, 1.0, 0.95, 3.0));
        assert!(close(weighted.low, counted.low, 1e-12) && close(weighted.high, counted.high, 1e-12));
    }

    #[test]
    fn one_walk_is_bounded_by_markov_and_the_ratio() {
        let one = |x| mean_interval(&Moments { n: 1, sum: x, sum_sq: x * x }, 1.0, 0.9, 7.0);
        let interval = one(4);
        assert!(close(interval.low, 0.4, 1e-12) && interval.high == 7.0);
        assert!(one(8).contains(8.0));
    }

    /// Tests every pair of sums that few walks can have, with bounds from tight to absurd.
    #[test]
    fn the_estimate_lies_inside_and_the_interval_within_its_bounds() {
        for n in [1, 2, 3, 10, 1_000_000] {
            for hits in 0..60u128 {
                for squares in (hits..=hits * hits).filter(|squares| u128::from(n) * squares >= hits * hits) {
                    let moments = Moments { n, sum: hits, sum_sq: squares };
                    let mean = moments.mean().unwrap();
                    for (confidence, ratio_bound) in [(1e-6, 1.0), (0.5, 3.8), (0.95, 1.0), (0.9999, 199.0)] {
                        let interval = mean_interval(&moments, 1.0, confidence, ratio_bound);
                        assert!(interval.contains(mean) && interval.low >= 0.0, "{moments:?}: {interval:?}");
                        assert!(interval.low < interval.high, "{moments:?}, {confidence}: {interval:?}");
                        assert!(interval.high <= ratio_bound.max(mean), "{moments:?}: {interval:?}");
                    }
                }
            }
        }
    }

    #[test]
    #[should_panic(expected = "confidence 95 is not between 0 and 1")]
    fn confidence_in_percent_is_refused() {
        mean_interval(&Moments::default(), 1.0, 95.0, 1.0);
    }

    #[test]
    #[should_panic(expected = "no scores have")]
    fn ratio_below_one_hit_is_refused() {
        mean_interval(&Moments::default(), 1.0, 0.95, 0.5);
    }
}
