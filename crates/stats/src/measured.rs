//! Measured values with their standard errors.

/// A measured value with its standard error, in the same unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The value that was measured.
    pub value: f64,
    /// The standard deviation of the value over repetitions of the measurement.
    pub standard_error: f64,
}

impl Measured {
    /// The mean of independent values, with the standard error that their spread gives. Both are NaN for fewer than
    /// two.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (n - 1.0);
        Measured { value, standard_error: (variance / n).sqrt() }
    }

    /// The number of standard errors by which the value exceeds what was expected.
    pub fn z(&self, expected: f64) -> f64 {
        (self.value - expected) / self.standard_error
    }
}
