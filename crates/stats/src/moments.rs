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

/// The unbiased variance of one walk's score from blocks of independent walks, as many in each, with the standard error that the
/// scatter of the blocks' own variances gives. `None` where a block has no variance; the standard error of one block is NaN.
pub fn variance_of_blocks(blocks: impl IntoIterator<Item = Moments>) -> Option<Measured> {
    let variances: Option<Vec<f64>> = blocks.into_iter().map(|block| block.variance()).collect();
    Some(Measured::of(&variances?))
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
    fn the_variance_of_blocks_is_their_mean_with_the_error_of_their_scatter() {
        // Blocks of four walks: 0, 0, 0, 4 has variance 4, 0, 0, 0, 2 has 1, and 0, 0, 1, 1 has 1/3.
        let blocks = [(4, 16), (2, 4), (2, 2)].map(|(sum, sum_sq)| Moments { n: 4, sum, sum_sq });
        let measured = variance_of_blocks(blocks).unwrap();
        assert!(close(measured.value, 16.0 / 9.0));
        // Σ(s² − 16/9)² = (20/9)² + (7/9)² + (13/9)².
        assert!(close(measured.standard_error, (618.0 / 81.0 / 6.0f64).sqrt()));
        assert_eq!(variance_of_blocks([Moments { n: 1, sum: 5, sum_sq: 25 }]), None);
    }
}
