//! Exchange factors, read off counts.

use stats::{Interval, Moments, proportion_interval};

use crate::counts::ExchangeCounts;

/// One exchange factor with its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    /// The estimate of the factor, n/N to 52 bits. A row adds up to exactly 1.
    pub factor: f64,
    /// The standard error of the factor, √(p(1 − p)/(N − 1)); `None` where no walk or every walk was taken, which tells of no spread.
    pub std_error: Option<f64>,
    /// The confidence interval of the factor.
    pub interval: Interval,
}

impl Factor {
    /// The factor that `hits` of some walks say, with an interval of a level.
    pub(crate) fn of(hits: u64, walks: u64, level: f64) -> Self {
        let moments = Moments { n: walks, sum: hits.into(), sum_sq: hits.into() };
        let is_known = hits > 0 && hits < walks;
        Factor {
            factor: hits as f64 / walks.max(1) as f64,
            std_error: moments.standard_error().filter(|_| is_known),
            interval: proportion_interval(hits, walks, level),
        }
    }

    /// Half of the interval's length.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.interval.high - self.interval.low)
    }
}

/// All exchange factors, with intervals of one level.
#[derive(Clone, Debug)]
pub struct Factors<'a> {
    counts: &'a ExchangeCounts,
    level: f64,
    /// The factors, row by row, in the columns of [`ExchangeCounts::row`].
    rows: Vec<Vec<f64>>,
}

/// The bits of a factor behind the point.
const FACTOR_BITS: i32 = 52;

/// The factors n/N of a row, as multiples of 2⁻⁵² that add up to exactly 1: the sums of the first columns are rounded. Nothing
/// is rounded where N is a power of two. A row without walks has factors of 0.
pub(crate) fn factors_of(walks: u64, counts: impl Iterator<Item = u64>) -> impl Iterator<Item = f64> {
    let walks = u128::from(walks.max(1));
    let rounded = move |sum: u64| ((u128::from(sum) << (FACTOR_BITS + 1)) / walks).div_ceil(2) as f64;
    let quantum = 2.0_f64.powi(-FACTOR_BITS);
    counts.scan(0, move |sum, count| {
        let begin = *sum;
        *sum += count;
        Some((rounded(*sum) - rounded(begin)) * quantum)
    })
}

fn row_of(counts: &[u64]) -> Vec<f64> {
    factors_of(counts.iter().sum(), counts.iter().copied()).collect()
}

impl<'a> Factors<'a> {
    /// The factors that some counts give, with intervals that hold each with the probability `level`.
    pub fn new(counts: &'a ExchangeCounts, level: f64) -> Self {
        let rows = (0..counts.groups()).map(|i| row_of(counts.row(i))).collect();
        Factors { counts, level, rows }
    }

    /// The counts that the factors are estimated from.
    pub fn counts(&self) -> &'a ExchangeCounts {
        self.counts
    }

    /// The factor from group i to column j: a group, or G for backs, or G + 1 for what escapes.
    pub fn get(&self, i: usize, j: usize) -> Factor {
        let (hits, walks) = (self.counts.row(i)[j], self.counts.walks(i));
        Factor { factor: self.rows[i][j], ..Factor::of(hits, walks, self.level) }
    }

    /// The relative error of a whole row: the half-width of each interval over its factor, in the mean square, each factor
    /// counting by its size. Infinite where no walk has been taken.
    pub fn row_error(&self, i: usize) -> f64 {
        let squares =
            (0..self.counts.row(i).len()).map(|j| self.get(i, j)).filter(|known| known.factor > 0.0);
        let (sum, whole) = squares.fold((0.0, 0.0), |(sum, whole), known| {
            (sum + known.half_width().powi(2) / known.factor, whole + known.factor)
        });
        if whole > 0.0 { sum.sqrt() } else { f64::INFINITY }
    }

    /// The half-width of the factor from i to j over the factor; infinite where no walk was taken.
    pub fn pair_error(&self, i: usize, j: usize) -> f64 {
        let known = self.get(i, j);
        if known.factor > 0.0 { known.half_width() / known.factor } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sevenths are no binary fractions, and add up to 1 all the same; those of powers of two are what they were.
    #[test]
    fn rows_add_up_to_one() {
        let rows = [vec![1, 2, 0, 3, 1], vec![1 << 51, 1, 7, (1 << 51) - 8, 0], vec![0, 0, 0, 0, 0]];
        for (row, sum) in rows.iter().zip([1.0, 1.0, 0.0]) {
            let factors = row_of(row);
            assert_eq!(factors.iter().sum::<f64>(), sum);
            let walks = row.iter().sum::<u64>().max(1) as f64;
            for (factor, &hits) in factors.iter().zip(row) {
                assert!((factor - hits as f64 / walks).abs() <= f64::EPSILON);
                assert_eq!(*factor == 0.0, hits == 0);
            }
        }
        assert_eq!(row_of(&rows[1])[1], 2.0_f64.powi(-52));
        assert_eq!(row_of(&[3, 5, 0]), [0.375, 0.625, 0.0]);
    }
}
