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

#[cfg(test)]
mod tests {
    use super::*;

    /// The probability that the interval holds p: the binomial probabilities of all counts whose interval does.
    fn coverage(trials: u64, p: f64, confidence: f64) -> f64 {
        let (mut log, mut covered) = (trials as f64 * (-p).ln_1p(), 0.0);
        for hits in 0..=trials {
            if proportion_interval(hits, trials, confidence).contains(p) {
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
