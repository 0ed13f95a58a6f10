//! Exact power sums of integer scores, and the statistics that follow from them.

use crate::measured::Measured;

/// The sums of one patch's scores x over n walks. Whole numbers of hits, so that they merge exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moments {
    /// The number n of walks, those that scored nothing included.
    pub n: u64,
    /// The sum Σx of the scores.
    pub sum: u128,
    /// The sum Σx² of each walk's whole score squared.
    pub sum_sq: u128,
}

impl Moments {
    /// The mean score per walk; `None` of no walks.
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum as f64 / self.n as f64)
    }

    /// The unbiased variance of one walk's score, (n·Σx² − (Σx)²)/(n(n − 1)). The numerator is exact, in 256
    /// bits: nothing cancels, whatever the sums. `None` of fewer than two walks, and of sums that no scores
    /// have (n·Σx² < (Σx)²).
    pub fn variance(&self) -> Option<f64> {
        if self.n < 2 {
            return None;
        }
        let n = u128::from(self.n);
        let spread = U256::product(n, self.sum_sq).checked_sub(U256::product(self.sum, self.sum))?;
        Some(spread.to_f64() / (n * (n - 1)) as f64)
    }

    /// The standard error of the mean score per walk, √(variance/n); `None` if the variance is `None`.
    pub fn standard_error(&self) -> Option<f64> {
        Some((self.variance()? / self.n as f64).sqrt())
    }
}

/// What an interval is made from: the moments of scores that count, or of scores that have weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Walks, those that scored nothing included.
    pub n: u64,
    /// The sum of scores, Σx.
    pub sum: f64,
    /// The sum of squared scores, Σx².
    pub sum_sq: f64,
    /// The unbiased variance of one walk's score; `None` of fewer than two walks.
    pub variance: Option<f64>,
    /// Whether x has no weights.
    pub counts: bool,
}

impl Sample {
    /// The moments of n walks in classes, each of which has a weight f, its Σx and its Σx². A walk belongs to one class, so that the sums
    /// are Σ f·Σx and Σ f²·Σx².
    pub fn weighted(n: u64, classes: impl IntoIterator<Item = (f64, u128, u128)>) -> Self {
        let (mut sum, mut sum_sq) = (0.0, 0.0);
        for (weight, scores, squares) in classes {
            sum += weight * scores as f64;
            sum_sq += weight * weight * squares as f64;
        }
        let walks = n as f64;
        let spread = (sum_sq - sum * (sum / walks)).max(0.0);
        Sample { n, sum, sum_sq, variance: (n >= 2).then(|| spread / (walks - 1.0)), counts: false }
    }

    /// The mean score per walk; `None` of no walks.
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / self.n as f64)
    }

    /// The standard error of the mean score per walk; `None` where the variance is.
    pub fn standard_error(&self) -> Option<f64> {
        Some((self.variance? / self.n as f64).sqrt())
    }
}

impl From<&Moments> for Sample {
    fn from(moments: &Moments) -> Self {
        let &Moments { n, sum, sum_sq } = moments;
        Sample { n, sum: sum as f64, sum_sq: sum_sq as f64, variance: moments.variance(), counts: true }
    }
}

/// The sums of the first four powers of whole scores, for tests of their variance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PowerSums {
    /// The number n of walks.
    pub n: u64,
    /// The sums Σx, Σx², Σx³, Σx⁴.
    pub sums: [u128; 4],
}

impl PowerSums {
    /// The sums of the first two powers.
    pub fn moments(&self) -> Moments {
        Moments { n: self.n, sum: self.sums[0], sum_sq: self.sums[1] }
    }

    /// The unbiased variance s² of one walk's score with its standard error
    /// √((m₄ − s⁴(n − 3)/(n − 1))/n), m₄ being the fourth central moment of the scores themselves (Mood,
    /// Graybill & Boes, *Introduction to the Theory of Statistics*, 1974, VI.2.3 theorem 4, with the sample's
    /// moments for the population's). `None` where the variance is. Σx⁴ must be below 2¹²⁷.
    pub fn variance(&self) -> Option<Measured> {
        let variance = self.moments().variance()?;
        let n = self.n as f64;
        let of_variance = (self.fourth_central_moment() - variance * variance * (n - 3.0) / (n - 1.0)) / n;
        Some(Measured { value: variance, standard_error: of_variance.max(0.0).sqrt() })
    }

    /// The fourth central moment Σ(x − x̄)⁴/n of at least one walk.
    ///
    /// The sums are first moved to the whole number a nearest the mean. That is exact: arithmetic modulo 2¹²⁸
    /// gives every Σ(x − a)ᵏ that fits. What is left to subtract in floating point is |δ| ≤ ½ away, and as
    /// |y − δ| ≥ |y|/2 for whole y, no more than 4 bits can cancel.
    fn fourth_central_moment(&self) -> f64 {
        let n = u128::from(self.n);
        let a = (self.sums[0] + n / 2) / n;

        // Σ(x − a)ᵏ = Σ_j C(k, j) (−a)ᵏ⁻ʲ Σxʲ
        let b = a.wrapping_neg();
        let [s1, s2, s3, s4] = self.sums;
        let combine = |terms: &[(u128, u128, u32)]| {
            let term = |sum: u128, &(binomial, s, power): &(u128, u128, u32)| {
                sum.wrapping_add(binomial.wrapping_mul(s).wrapping_mul(b.wrapping_pow(power)))
            };
            terms.iter().fold(0, term) as i128 as f64 / self.n as f64
        };
        let delta = combine(&[(1, s1, 0), (1, n, 1)]);
        let m2 = combine(&[(1, s2, 0), (2, s1, 1), (1, n, 2)]);
        let m3 = combine(&[(1, s3, 0), (3, s2, 1), (3, s1, 2), (1, n, 3)]);
        let m4 = combine(&[(1, s4, 0), (4, s3, 1), (6, s2, 2), (4, s1, 3), (1, n, 4)]);

        m4 - 4.0 * delta * m3 + 6.0 * delta.powi(2) * m2 - 3.0 * delta.powi(4)
    }
}

/// An unsigned integer of 256 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
struct U256 {
    high: u128,
    low: u128,
}

impl U256 {
    /// The product a·b, by long multiplication in halves of 64 bits.
    fn product(a: u128, b: u128) -> Self {
        let halves = |x: u128| (x >> 64, x & u128::from(u64::MAX));
        let ((a1, a0), (b1, b0)) = (halves(a), halves(b));
        let (carry, low) = halves(a0 * b0);
        let (carry_1, middle) = halves(a1 * b0 + carry);
        let (carry_2, middle) = halves(a0 * b1 + middle);
        U256 { high: a1 * b1 + carry_1 + carry_2, low: (middle << 64) | low }
    }

    fn checked_sub(self, other: Self) -> Option<Self> {
        let (low, borrow) = self.low.overflowing_sub(other.low);
        let high = self.high.checked_sub(other.high)?.checked_sub(u128::from(borrow))?;
        Some(U256 { high, low })
    }

    /// The nearest f64. Bits below the top 128 only count as "some", which is all that rounding needs.
    fn to_f64(self) -> f64 {
        if self.high == 0 {
            return self.low as f64;
        }
        let zeros = self.high.leading_zeros();
        let top = if zeros == 0 { self.high } else { (self.high << zeros) | (self.low >> (128 - zeros)) };
        let some_below = self.low << zeros != 0;
        (top | u128::from(some_below)) as f64 * 2f64.powi(128 - zeros as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power_sums(scores: impl IntoIterator<Item = (u128, u64)>) -> PowerSums {
        let mut power_sums = PowerSums::default();
        for (score, times) in scores {
            power_sums.n += times;
            for (k, sum) in (1..).zip(&mut power_sums.sums) {
                *sum += u128::from(times) * score.pow(k);
            }
        }
        power_sums
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 4.0 * f64::EPSILON * b.abs()
    }

    #[test]
    fn no_walk_has_no_mean_and_one_walk_no_variance() {
        assert_eq!(Moments::default().mean(), None);
        let one = Moments { n: 1, sum: 3, sum_sq: 9 };
        assert_eq!((one.mean(), one.variance(), one.standard_error()), (Some(3.0), None, None));
    }

    #[test]
    fn variance_of_a_handful() {
        // 2, 4, 4, 4, 5, 5, 7, 9: mean 5, squared deviations add up to 32
        let moments = Moments { n: 8, sum: 40, sum_sq: 232 };
        assert_eq!(moments.mean(), Some(5.0));
        assert!(close(moments.variance().unwrap(), 32.0 / 7.0));
        assert!(close(moments.standard_error().unwrap(), (4.0 / 7.0f64).sqrt()));
    }

    /// Half of the walks score a million million, half one more: the variance is n/(4(n − 1)), while the
    /// squares of the mean and of the scores are equal to 24 digits.
    #[test]
    fn nothing_cancels_at_any_size() {
        for n in [2u64, 1 << 20, 1 << 46] {
            let (x, half) = (1_000_000_000_000u128, u128::from(n / 2));
            let moments = Moments { n, sum: half * (2 * x + 1), sum_sq: half * (2 * x * x + 2 * x + 1) };
            assert!(close(moments.variance().unwrap(), 0.25 * n as f64 / (n - 1) as f64), "n = {n}");
        }
    }

    #[test]
    fn sums_near_their_limits_do_not_overflow() {
        // every other walk scores 2³²
        let half = 1u128 << 62;
        let moments = Moments { n: 1 << 63, sum: half << 32, sum_sq: half << 64 };
        assert!(close(moments.variance().unwrap(), 2f64.powi(62)));
    }

    #[test]
    fn sums_that_no_scores_have_give_no_variance() {
        assert_eq!(Moments { n: 2, sum: 3, sum_sq: 4 }.variance(), None);
    }

    #[test]
    fn wide_products_agree_with_known_ones() {
        let max = u128::MAX;
        assert_eq!(U256::product(max, max), U256 { high: max - 1, low: 1 });
        assert_eq!(U256::product(1 << 127, 6), U256 { high: 3, low: 0 });
        assert_eq!(
            U256::product(0x1_0000_0001 << 60, 0x3 << 64),
            U256 { high: 0x3000_0000, low: 0x3 << 124 }
        );
        assert_eq!(U256::product(7, 11), U256 { high: 0, low: 77 });
    }

    #[test]
    fn wide_numbers_round_to_nearest() {
        let two_to = |k| 2f64.powi(k);
        assert_eq!(U256 { high: 1, low: 0 }.to_f64(), two_to(128));
        assert_eq!(U256 { high: u128::MAX, low: u128::MAX }.to_f64(), two_to(256));
        assert_eq!(U256 { high: 1 << 127, low: 5 }.to_f64(), two_to(255));
        // a tie goes to the even neighbour, and the least bit below breaks it
        let tie = U256 { high: (1 << 53) + 1, low: 0 };
        assert_eq!(tie.to_f64(), two_to(181));
        assert_eq!(U256 { low: 1, ..tie }.to_f64(), two_to(181) + two_to(129));
    }

    #[test]
    fn variance_of_the_variance_of_a_handful() {
        // 0, 0, 0, 4: mean 1, s² = 4, m₄ = (3 + 81)/4 = 21, (21 − 16/3)/4 = 47/12
        let measured = power_sums([(0, 3), (4, 1)]).variance().unwrap();
        assert!(close(measured.value, 4.0));
        assert!(close(measured.standard_error, (47.0 / 12.0f64).sqrt()));
        assert_eq!(power_sums([(5, 1)]).variance(), None);
    }

    /// Forty million walks far from zero, against the same scores moved next to zero.
    #[test]
    fn fourth_moment_survives_a_distant_mean() {
        let scores = [(0, 10_000_001), (1, 15_000_000), (3, 14_999_000), (40, 1_000)];
        let near = power_sums(scores).variance().unwrap();
        for distance in [200, 1_000_000] {
            let far = power_sums(scores.map(|(x, times)| (x + distance, times))).variance().unwrap();
            assert!(close(far.value, near.value), "at {distance}");
            assert!(close(far.standard_error, near.standard_error), "at {distance}");
        }
        let rare = power_sums([(0, 40_000_000 - 7), (1, 7)]).variance().unwrap();
        assert!((rare.value / 1.75e-7 - 1.0).abs() < 1e-6);
        assert!((rare.standard_error / (1.75e-7 / 4e7f64).sqrt() - 1.0).abs() < 1e-6);
    }
}
