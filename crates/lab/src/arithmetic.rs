//! Arithmetic of numbers with standard errors.

use stats::Measured;

/// A number without any statistical error.
pub(crate) fn counted(value: f64) -> Measured {
    Measured { value, standard_error: 0.0 }
}

/// The quotient of two independent numbers, neither of them near 0.
pub(crate) fn quotient(a: Measured, b: Measured) -> Measured {
    let value = a.value / b.value;
    let relative = (a.standard_error / a.value).hypot(b.standard_error / b.value);
    Measured { value, standard_error: value.abs() * relative }
}

/// The ratio of a measurement to its expectation.
pub(crate) fn ratio(measured: Measured, expected: f64) -> Measured {
    Measured { value: measured.value / expected, standard_error: measured.standard_error / expected }
}

/// The root mean square of a mean square, with its standard error.
pub(crate) fn root(square: Measured) -> Measured {
    let value = square.value.sqrt();
    Measured { value, standard_error: 0.5 * square.standard_error / value }
}

/// The mean of parts over runs. If all runs agree, the error is that of the rule of three.
pub(crate) fn proportion(parts: &[f64]) -> Measured {
    let measured = Measured::of(parts);
    Measured { standard_error: measured.standard_error.max(1.0 / parts.len() as f64), ..measured }
}
