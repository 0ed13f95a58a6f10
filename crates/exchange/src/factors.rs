//! Exchange factors, read off counts.

use stats::{Interval, Moments, proportion_interval};

use crate::counts::Counts;

/// One exchange factor with its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    /// The estimate of the factor, n/N.
    pub factor: f64,
    /// The standard error of the factor, √(p(1 − p)/(N − 1)); `None` where no walk or every walk was taken, which tells of no spread.
    pub std_error: Option<f64>,
    /// The confidence interval of the factor.
    pub interval: Interval,
}

impl Factor {
    /// Half of the interval's length.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.interval.high - self.interval.low)
    }
}

/// All exchange factors, with intervals of one level.
#[derive(Clone, Copy, Debug)]
pub struct Factors<'a> {
    counts: &'a Counts,
    level: f64,
}

impl<'a> Factors<'a> {
    /// The factors that some counts give, with intervals that hold each with the probability `level`.
    pub fn new(counts: &'a Counts, level: f64) -> Self {
        Factors { counts, level }
    }

    /// The counts that the factors are estimated from.
    pub fn counts(&self) -> &'a Counts {
        self.counts
    }

    /// The factor from group i to column j: a group, or G for backs, or G + 1 for what escapes.
    pub fn get(&self, i: usize, j: usize) -> Factor {
        let (hits, walks) = (self.counts.row(i)[j], self.counts.walks(i));
        let moments = Moments { n: walks, sum: hits.into(), sum_sq: hits.into() };
        let told = hits > 0 && hits < walks;
        Factor {
            factor: if walks > 0 { hits as f64 / walks as f64 } else { 0.0 },
            std_error: moments.standard_error().filter(|_| told),
            interval: proportion_interval(hits, walks, self.level),
        }
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
