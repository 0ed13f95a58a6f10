//! Tests whether a simulation agrees with theory.
//!
//! Every verdict ends in a z: about standard normal if theory and simulation agree, far from zero if not. A
//! test that asks for |z| < 4 raises a false alarm once in 16,000.

use crate::interval::Interval;
use crate::measured::Measured;

/// The mean of z² over independent z. It is 1 if they are standard normal, with the standard error √(2/n)
/// given here; the quotient of true and stated variance otherwise. `None` of no z.
pub fn mean_squared_z(z: impl IntoIterator<Item = f64>) -> Option<Measured> {
    let (n, sum) = z.into_iter().fold((0u64, 0.0), |(n, sum), z| (n + 1, sum + z * z));
    let n = (n > 0).then_some(n as f64)?;
    Some(Measured { value: sum / n, standard_error: (2.0 / n).sqrt() })
}

/// The number of intervals that held the truth, among a number of trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// The number of intervals that held the truth.
    pub covered: u64,
    /// The number of intervals that were tried.
    pub trials: u64,
}

impl Coverage {
    /// Counts one interval, and whether it holds the truth.
    pub fn record(&mut self, interval: &Interval, truth: f64) {
        self.covered += u64::from(interval.contains(truth));
        self.trials += 1;
    }

    /// Adds the counts of another coverage.
    pub fn merge(&mut self, other: &Coverage) {
        self.covered += other.covered;
        self.trials += other.trials;
    }

    /// The fraction that held the truth, with the standard error √(p(1 − p)/trials) which it has if
    /// `probability` p of holding it is true. `None` of no trials.
    pub fn rate(&self, probability: f64) -> Option<Measured> {
        let trials = (self.trials > 0).then_some(self.trials as f64)?;
        let standard_error = (probability * (1.0 - probability) / trials).sqrt();
        Some(Measured { value: self.covered as f64 / trials, standard_error })
    }
}

/// Pearson's statistic Σ(observed − expected)²/expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChiSquare {
    /// The value of the statistic.
    pub statistic: f64,
    /// The degrees of freedom, which are also the statistic's expectation.
    pub degrees: f64,
}

impl ChiSquare {
    /// About the standard normal deviate with the same upper tail, ((χ²/k)^⅓ − 1 + 2/(9k))/√(2/(9k)) for k
    /// degrees: while |z| ≤ 4, within 0.05 from 30 degrees on, 0.2 from 10, 0.5 from 5.
    ///
    /// Source: E. B. Wilson & M. M. Hilferty, "The distribution of chi-square", PNAS 17 (1931) 684–688.
    pub fn z(&self) -> f64 {
        let variance = 2.0 / (9.0 * self.degrees);
        ((self.statistic / self.degrees).cbrt() - 1.0 + variance) / variance.sqrt()
    }
}

/// Chi-square of counts against the hypothesis that all cells are equally likely; some five or more counts per
/// cell make it one. `None` of fewer than two cells or no counts.
pub fn chi_square_uniform(counts: &[u64]) -> Option<ChiSquare> {
    let total: u64 = counts.iter().sum();
    if counts.len() < 2 || total == 0 {
        return None;
    }
    let expected = total as f64 / counts.len() as f64;
    let statistic = counts.iter().map(|&count| (count as f64 - expected).powi(2) / expected).sum();
    Some(ChiSquare { statistic, degrees: (counts.len() - 1) as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn z_counts_standard_errors() {
        assert_eq!(Measured { value: 7.0, standard_error: 0.5 }.z(6.0), 2.0);
    }

    #[test]
    fn a_mean_knows_its_error() {
        // Squared deviations add up to 32; 32/(7·8) = 4/7.
        let measured = Measured::of(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]);
        assert!((measured.value - 5.0).abs() < 1e-15);
        assert!((measured.standard_error - (4.0 / 7.0f64).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn mean_squared_z_of_a_few() {
        let measured = mean_squared_z([1.0, -2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        assert_eq!(measured, Measured { value: 1.75, standard_error: 0.5 });
        assert_eq!(mean_squared_z([]), None);
    }

    #[test]
    fn coverage_counts_closed_intervals() {
        let mut coverage = Coverage::default();
        assert_eq!(coverage.rate(0.95), None);
        for truth in [0.9, 1.0, 1.5, 2.0, 2.1] {
            coverage.record(&Interval { low: 1.0, high: 2.0 }, truth);
        }
        coverage.merge(&Coverage { covered: 93, trials: 95 });
        assert_eq!(coverage, Coverage { covered: 96, trials: 100 });
        let rate = coverage.rate(0.8).unwrap();
        assert!((rate.value - 0.96).abs() < 1e-15 && (rate.standard_error - 0.04).abs() < 1e-15);
    }

    #[test]
    fn chi_square_of_known_counts() {
        let chi_square = chi_square_uniform(&[16, 18, 16, 14, 12, 12]).unwrap();
        assert!((chi_square.statistic - 2.0).abs() < 1e-12 && chi_square.degrees == 5.0, "{chi_square:?}");
        assert_eq!(chi_square_uniform(&[3]), None);
        assert_eq!(chi_square_uniform(&[0, 0]), None);
    }

    /// Upper tail points of chi-square (Abramowitz & Stegun, table 26.8) and the normal deviates of those tails.
    #[test]
    fn wilson_hilferty_agrees_with_tables() {
        for (degrees, statistic, deviate) in [
            (5.0, 11.0705, 1.644854),
            (5.0, 20.515, 3.090232),
            (30.0, 59.703, 3.090232),
            (100.0, 124.342, 1.644854),
            (100.0, 67.3276, -2.575829),
        ] {
            let z = ChiSquare { statistic, degrees }.z();
            assert!((z - deviate).abs() < 0.03, "{degrees} degrees: {z} for {deviate}");
        }
    }
}
