//! Numbers as people read them.

pub use crate::numbers::{measured, number, printed};

/// A number with three digits and a prefix: 1.23 M; a small one as [`number`] has it.
pub fn quantity(x: f64) -> String {
    let (scaled, prefix) = match x {
        x if x > 0.0 && x < 0.01 => return number(x),
        x if x >= 1e9 => (x / 1e9, " G"),
        x if x >= 1e6 => (x / 1e6, " M"),
        x if x >= 1e3 => (x / 1e3, " k"),
        x => (x, ""),
    };
    let decimals = if scaled >= 100.0 {
        0
    } else if scaled >= 10.0 {
        1
    } else {
        2
    };
    format!("{scaled:.decimals$}{prefix}")
}

/// `1 worker`, `2 workers`; `3 patches`, `4 radiosities`.
pub fn counted(number: u64, noun: &str) -> String {
    match (number, noun.strip_suffix('y')) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{number} {stem}ies"),
        _ if noun.ends_with("ch") => format!("{number} {noun}es"),
        _ => format!("{number} {noun}s"),
    }
}

/// Bytes with three digits and a prefix: 1.23 MB.
pub fn bytes(bytes: u64) -> String {
    match bytes {
        0..1000 => format!("{bytes} B"),
        _ => format!("{}B", quantity(bytes as f64)),
    }
}

/// A relative error in percent.
pub fn percent(x: f64) -> String {
    if x.is_finite() { format!("{:.3} %", 100.0 * x) } else { "unknown".into() }
}

/// A part of a whole in percent, with digits that tell a small one.
pub fn share(part: f64) -> String {
    match 100.0 * part {
        percent if percent < 0.1 && percent > 0.0 => format!("{percent:.4} %"),
        percent => format!("{percent:.2} %"),
    }
}

/// A relative error in percent, with three digits.
pub fn brief_percent(x: f64) -> String {
    let decimals = match 100.0 * x {
        percent if percent >= 99.95 => 0,
        percent if percent >= 9.995 => 1,
        percent if percent >= 0.9995 => 2,
        _ => 3,
    };
    if x.is_finite() { format!("{:.decimals$} %", 100.0 * x) } else { "unknown".into() }
}

/// Seconds as people read them.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{:.0} min {:.0} s", (s / 60.0).floor(), s % 60.0),
        s if s < 172_800.0 => format!("{:.0} h {:.0} min", (s / 3600.0).floor(), (s % 3600.0) / 60.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let words =
            [(1, "worker"), (0, "worker"), (2, "patch"), (3, "radiosity")].map(|(n, noun)| counted(n, noun));
        assert_eq!(words, ["1 worker", "0 workers", "2 patches", "3 radiosities"]);
        assert_eq!(quantity(1_234_567.0), "1.23 M");
        assert_eq!(quantity(0.0), "0.00");
        assert_eq!(quantity(7.606_15e-6), "7.606e-6");
        assert_eq!(bytes(999), "999 B");
        assert_eq!(bytes(1_234_567), "1.23 MB");
        assert_eq!(percent(0.01234), "1.234 %");
        assert_eq!(percent(f64::INFINITY), "unknown");
        assert_eq!(duration(75.0), "1 min 15 s");
        assert_eq!(duration(7300.0), "2 h 2 min");
    }
}
