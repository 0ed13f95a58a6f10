//! Scores of sizes that are known beforehand: what walks may bring that none has brought yet.

use std::collections::BTreeMap;

use crate::interval::Interval;

/// The sizes of single scores and how likely a walk has one of each at most, the largest first.
///
/// Sums of walks tell of the sizes that they have met. A bright emitter that few walks meet, or a colour that few carry, is in none of
/// them: where the dim ones are many, their spread is small and says nothing of it. What is known is that no walk has met it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sizes {
    classes: Vec<SizeClass>,
}

/// Sizes that are nearly alike.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SizeClass {
    /// The largest of them.
    size: f64,
    /// The sum of the probabilities of these sizes and of all that are larger.
    probability: f64,
    /// The sum of their sizes, each times its probability.
    mean: f64,
}

/// The class of a positive number. A power of two has eight classes: three bits of the fraction are kept, and 49 are left out.
pub fn size_class(number: f64) -> u64 {
    number.to_bits() >> 49
}

/// The largest chance of what has stayed out of n trials with a probability of `tail`: p, where (1 − p)ⁿ = tail.
pub fn unmet_chance(n: f64, tail: f64) -> f64 {
    -(tail.ln() / n).exp_m1()
}

/// The upper end of an interval of a mean, with room for what is `unmet`: both go together as standard errors do.
pub fn with_unmet(high: f64, mean: f64, unmet: f64) -> f64 {
    if unmet > 0.0 { mean + (high - mean).hypot(unmet) } else { high }
}

impl Sizes {
    /// The sizes of scores, each with a probability that may be scaled later.
    pub fn new(scores: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut alike = BTreeMap::<u64, (f64, f64)>::new();
        for (size, probability) in scores.into_iter().filter(|&(size, probability)| size * probability > 0.0)
        {
            let class = alike.entry(size_class(size)).or_default();
            *class = (class.0.max(size), class.1 + probability);
        }
        let mut total = SizeClass { size: 0.0, probability: 0.0, mean: 0.0 };
        let running = alike.into_values().rev().map(|(size, probability)| {
            let mean = total.mean + size * probability;
            total = SizeClass { size, probability: total.probability + probability, mean };
            total
        });
        Sizes { classes: running.collect() }
    }

    /// The classes, the largest first. Each has its largest size, and the sums of p and of size × p over it and the classes before.
    pub fn classes(&self) -> impl Iterator<Item = [f64; 3]> {
        self.classes.iter().map(|class| [class.size, class.probability, class.mean])
    }

    /// The most that sizes above `seen` add to the mean, beyond `seen` for each, where they have a probability of `budget` together at most, and none of
    /// them more than `scale` times its own.
    pub fn beyond(&self, seen: f64, budget: f64, scale: f64) -> f64 {
        let larger = self.classes.partition_point(|class| class.size > seen);
        let within = self.classes[..larger].partition_point(|class| scale * class.probability <= budget);
        let (used, mean) = match self.classes[..within].last() {
            Some(class) => (scale * class.probability, scale * class.mean),
            None => (0.0, 0.0),
        };
        let rest =
            self.classes[..larger].get(within).map_or(0.0, |next| (budget - used) * (next.size - seen));
        mean - used * seen + rest
    }

    /// The interval of a mean, with room above for sizes that no walk has met: scores above `seen` that are as likely as (1 − p)ⁿ = ½(1 − confidence)
    /// allows. That they stay out and that the seen ones are few are two chances, so that what both add goes together as
    /// standard errors do.
    pub fn widen(
        &self,
        interval: Interval,
        mean: f64,
        (n, confidence): (u64, f64),
        seen: f64,
        scale: f64,
    ) -> Interval {
        let tail = 0.5 * (1.0 - confidence);
        let budget = unmet_chance(n as f64, tail);
        let unmet = self.beyond(seen, budget, scale);
        Interval { high: mean + (interval.high - mean).hypot(unmet), ..interval }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_sizes_come_first_and_no_size_is_more_likely_than_it_may_be() {
        let sizes = Sizes::new([(1.0, 0.5), (100.0, 0.001), (10.0, 0.01), (0.0, 0.3), (3.0, 0.0)]);
        let beyond = |seen, budget, scale| sizes.beyond(seen, budget, scale);
        assert_eq!(beyond(0.0, 0.0005, 1.0), 0.05);
        assert!((beyond(0.0, 0.006, 1.0) - (0.1 + 0.05)).abs() < 1e-15);
        assert!((beyond(4.0, 1.0, 1.0) - (96.0 * 0.001 + 6.0 * 0.01)).abs() < 1e-15);
        assert!((beyond(0.0, 0.006, 0.5) - (0.05 + 0.05 + 0.0005)).abs() < 1e-15);
        assert_eq!([beyond(100.0, 1.0, 1.0), Sizes::default().beyond(0.0, 1.0, 1.0)], [0.0; 2]);
    }

    /// Equal sizes are seen with the first score, and cost nothing.
    #[test]
    fn sizes_that_are_alike_do_not_widen() {
        let sizes = Sizes::new((0..1000).map(|_| (0.7, 1e-3)));
        let interval = Interval { low: 1.0, high: 3.0 };
        assert_eq!(sizes.widen(interval, 2.0, (100, 0.95), 0.7, 1.0), interval);
        assert!(sizes.widen(interval, 2.0, (100, 0.95), 0.5, 1.0).high > 3.0);
    }
}
