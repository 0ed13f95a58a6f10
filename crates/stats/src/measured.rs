//! Numbers that were measured.

/// A measured value with its standard error, in the same unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Its standard deviation over repetitions of the measurement.
    pub standard_error: f64,
}

impl Measured {
    /// The mean of independent values, with the standard error that they tell themselves. NaN of fewer than two.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (n - 1.0);
        Measured { value, standard_error: (variance / n).sqrt() }
    }

    /// How many standard errors the value lies above what was expected.
    pub fn z(&self, expected: f64) -> f64 {
        (self.value - expected) / self.standard_error
    }
}
