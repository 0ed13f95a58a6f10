//! The form of numbers on pages.

use stats::Measured;

/// A number to four digits.
pub fn number(x: f64) -> String {
    if x == 0.0 { "0".into() } else { to_digit(x, x.abs().log10().floor() as i32 - 3) }
}

/// A number as it was printed, or to four digits if it is longer.
pub fn printed(x: f64) -> String {
    let whole = x.to_string();
    if whole.len() <= 7 { whole } else { number(x) }
}

/// A number to the digit that two digits of its error allow.
pub fn measured(Measured { value, standard_error }: Measured) -> String {
    if standard_error == 0.0 || !standard_error.is_finite() {
        return number(value);
    }
    let last = standard_error.log10().floor() as i32 - 1;
    format!("{} ± {}", to_digit(value, last), to_digit(standard_error, last))
}

/// A number down to the digit worth 10^`last`.
fn to_digit(x: f64, last: i32) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if x.abs() >= 1e6 || x.abs() < 1e-4 {
        let digits = (x.abs().log10().floor() as i32 - last).clamp(0, 6) as usize;
        return format!("{x:.digits$e}");
    }
    let digits = (-last).clamp(0, 8) as usize;
    format!("{x:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_end_where_their_errors_begin() {
        let of = |value, standard_error| measured(Measured { value, standard_error });
        assert_eq!(of(1.23456, 0.0123), "1.235 ± 0.012");
        assert_eq!(of(1234.5678, 12.0), "1235 ± 12");
        assert_eq!(of(0.5, 0.0), "0.5000");
        assert_eq!(number(0.049_154), "0.04915");
        assert_eq!(number(12_345_678.0), "1.235e7");
        assert_eq!(number(0.0), "0");
    }
}
