//! Confidence intervals of a probability.

use crate::interval::{Interval, mean_interval};
use crate::moments::Moments;

/// The two-sided interval that holds a probability with the probability `confidence`, from `hits` of `trials` independent
/// trials, each of which hits or misses.
///
/// It is [`mean_interval`] of what is rarer, hits or misses, whose scores are 0 or 1: E\[x²\]/E\[x\] is 1. So a proportion of 0
/// has an upper limit and a proportion of 1 a lower one, about 3.69/`trials` from it at 95 %.
///
/// # Panics
/// If there are more hits than trials, or `confidence` is not between 0 and 1.
pub fn proportion_interval(hits: u64, trials: u64, confidence: f64) -> Interval {
    assert!(hits <= trials, "{hits} of {trials} trials hit");
    let of = |count: u64| {
        let sum = u128::from(count);
        mean_interval(&Moments { n: trials, sum, sum_sq: sum }, 1.0, confidence, 1.0)
    };
    let misses = trials - hits;
    if hits <= misses {
        return of(hits);
    }
    let Interval { low, high } = of(misses);
    // The estimate lies inside, also after rounding.
    let estimate = hits as f64 / trials as f64;
    Interval { low: (1.0 - high).min(estimate), high: (1.0 - low).max(estimate) }
}

/// Hits, or misses, from which [`proportion_interval`] is as close.
const MANY: u64 = 64;

/// The two-sided interval of [`proportion_interval`] for one of very many probabilities: it holds them with the probability `confidence` in
/// the mean over probabilities, where that holds each at least so often, and is narrower where hits are few.
///
/// It is the mid-P interval of the binomial count (H. O. Lancaster, Biometrika 36 (1949) 370–382): the p at which fewer hits and half of
/// as many have the probability (1 − `confidence`)/2, and that at which more have. No hit has the upper limit of all of that tail.
///
/// # Panics
/// As [`proportion_interval`].
pub fn mid_p_interval(hits: u64, trials: u64, confidence: f64) -> Interval {
    let misses = trials - hits.min(trials);
    if hits.min(misses) >= MANY || hits == 0 || misses == 0 {
        return proportion_interval(hits, trials, confidence);
    }
    let tail = 0.5 * (1.0 - confidence);
    if hits <= misses {
        let at = |tail: f64| mid_p_quantile(hits, trials, tail);
        return Interval { low: at(1.0 - tail), high: at(tail) };
    }
    let at = |tail: f64| 1.0 - mid_p_quantile(misses, trials, tail);
    Interval { low: at(tail), high: at(1.0 - tail) }
}

/// The p at which fewer than `hits` of the trials hit, or half of the time as many, with this probability.
fn mid_p_quantile(hits: u64, trials: u64, probability: f64) -> f64 {
    let n = trials as f64;
    let below = |p: f64| {
        let (mut term, mut sum) = ((n * (-p).ln_1p()).exp(), 0.0);
        for k in 0..hits {
            sum += term;
            term *= (n - k as f64) / (k + 1) as f64 * p / (1.0 - p);
        }
        sum + 0.5 * term
    };
    // Far below a probability of 10⁻¹² lies at 2·hits + 64 hits in the mean.
    let (mut low, mut high) = (0.0, ((2 * hits + 64) as f64 / n).min(1.0));
    // Halving ends when no number lies between.
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        *(if below(middle) > probability { &mut low } else { &mut high }) = middle;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coverage(trials: u64, p: f64, confidence: f64) -> f64 {
        coverage_of(proportion_interval, trials, p, confidence)
    }

    /// The probability that an interval holds p: the binomial probabilities of all counts whose interval does.
    fn coverage_of(interval: fn(u64, u64, f64) -> Interval, trials: u64, p: f64, confidence: f64) -> f64 {
        let (mut log, mut covered) = (trials as f64 * (-p).ln_1p(), 0.0);
        for hits in 0..=trials {
            if interval(hits, trials, confidence).contains(p) {
                covered += log.exp();
            }
            log += ((trials - hits) as f64 / (hits + 1) as f64).ln() + p.ln() - (-p).ln_1p();
        }
        covered
    }

    /// Exact, by summing over all counts. With few trials the interval is cautious; it never covers less than it says by more
    /// than 0.5 %.
    #[test]
    fn the_interval_covers_what_it_says() {
        for (trials, most) in [(16, 0.995), (128, 0.97), (1024, 0.955)] {
            let covered: Vec<f64> = (1..400).map(|i| coverage(trials, f64::from(i) / 400.0, 0.95)).collect();
            let mean = covered.iter().sum::<f64>() / covered.len() as f64;
            let least = covered.iter().fold(1.0, |least: f64, &c| least.min(c));
            assert!((0.95..most).contains(&mean), "{trials} trials: {mean} in the mean");
            assert!(least > 0.945, "{trials} trials: {least} at worst");
        }
        // From a hundredth of an expected hit on, of many trials, and from a hundredth of an expected miss.
        for expected in [0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0] {
            for covered in
                [coverage(100_000, expected / 1e5, 0.95), coverage(1000, 1.0 - expected / 1e3, 0.95)]
            {
                assert!(covered > 0.95, "{expected} expected: {covered}");
            }
        }
    }

    /// Exact, in the mean over probabilities that expect fewer than ten hits, or any number.
    #[test]
    fn mid_p_intervals_cover_what_they_say_in_the_mean() {
        for trials in [64, 512, 4096] {
            for (from, to) in [(0.0, 10.0), (5.0, 10.0), (0.0, trials as f64)] {
                let p = (0..200).map(|i| (from + (to - from) * (f64::from(i) + 0.5) / 200.0) / trials as f64);
                let covered: Vec<f64> = p.map(|p| coverage_of(mid_p_interval, trials, p, 0.95)).collect();
                let mean = covered.iter().sum::<f64>() / covered.len() as f64;
                let least = covered.iter().fold(1.0, |least: f64, &c| least.min(c));
                assert!((0.945..0.968).contains(&mean), "{trials} trials, {from} to {to}: {mean}");
                assert!(least > 0.92, "{trials} trials, {from} to {to}: {least}");
            }
        }
    }

    /// The limits of 1, 5 and 20 hits of very many trials are those of a Poisson count, found with gamma functions.
    #[test]
    fn mid_p_intervals_are_those_of_the_tables() {
        for (hits, low, high) in [(1, 0.05002, 4.93186), (5, 1.83199, 11.08242), (20, 12.55974, 30.33960)] {
            let interval = mid_p_interval(hits, 100_000_000, 0.95);
            let [found_low, found_high] = [interval.low, interval.high].map(|p| p * 1e8);
            assert!((found_low - low).abs() < 1e-4, "{hits}: {found_low}");
            assert!((found_high - high).abs() < 1e-4, "{hits}: {found_high}");
            let all = mid_p_interval(1000 - hits, 1000, 0.95);
            let few = mid_p_interval(hits, 1000, 0.95);
            assert!((all.low - (1.0 - few.high)).abs() + (all.high - (1.0 - few.low)).abs() < 1e-15);
        }
    }

    #[test]
    fn no_hit_and_no_miss_have_honest_limits() {
        let none = proportion_interval(0, 1000, 0.95);
        assert!(none.low == 0.0 && (none.high - 3.69e-3).abs() < 1e-4, "{none:?}");
        let all = proportion_interval(1000, 1000, 0.95);
        assert!(all.high == 1.0 && (all.low - (1.0 - none.high)).abs() < 1e-15, "{all:?}");
        assert_eq!(proportion_interval(0, 0, 0.95), Interval { low: 0.0, high: 1.0 });
    }

    #[test]
    #[should_panic(expected = "3 of 2 trials")]
    fn more_hits_than_trials_are_refused() {
        proportion_interval(3, 2, 0.95);
    }
}
