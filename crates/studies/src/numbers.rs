//! Numbers and series as pages and charts show them.

use report::{Point, Series, Style};
use stats::Measured;

/// What theory says along a sweep.
pub fn theory(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    let points = points.into_iter().map(|(x, y)| Point { x, y, error: 0.0 }).collect();
    Series { name: name.into(), style: Style::Line, points }
}

/// What is seen along a sweep.
pub fn seen(name: &str, points: impl IntoIterator<Item = (f64, Measured)>) -> Series {
    let point = |(x, y): (f64, Measured)| Point { x, y: y.value, error: y.standard_error };
    Series { name: name.into(), style: Style::Joined, points: points.into_iter().map(point).collect() }
}

/// A number with three digits.
pub fn figure(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if !(1e-3..1e5).contains(&a) => exponential(x),
        a => format!("{x:.*}", (2 - a.log10().floor() as i32).max(0) as usize),
    }
}

fn exponential(x: f64) -> String {
    let text = format!("{x:.1e}");
    match text.split_once('e') {
        Some((digits, power)) => format!("{digits}·10^{power}"),
        None => text,
    }
}

/// A value ± its standard error.
pub fn pm(measured: Measured) -> String {
    let Measured { value, standard_error } = measured;
    if !(1e-3..1e5).contains(&value.abs()) || standard_error <= 0.0 {
        return format!("{} ± {}", figure(value), figure(standard_error));
    }
    // As many decimals as the first two digits of the error take.
    let decimals = (1 - standard_error.log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$} ± {standard_error:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_they_deserve() {
        assert_eq!(figure(0.123456), "0.123");
        assert_eq!(figure(1234.5), "1234");
        assert_eq!(figure(1.5e-9), "1.5·10^-9");
        assert_eq!(pm(Measured { value: 0.98765, standard_error: 0.0123 }), "0.988 ± 0.012");
    }
}
