//! The quantiles of Student's t distribution.

use crate::normal::normal_quantile;

/// The degrees of freedom from which the quantile is expanded about the normal one.
const MANY: u64 = 200;

/// The number that t with `freedom` degrees of freedom stays below with probability `p`, good to 10⁻⁹. 1 is taken for the number before it: the
/// levels of very many intervals at once round to it.
///
/// # Panics
/// If `p` is 0 or not between 0 and 1, or `freedom` is 0.
pub fn student_quantile(p: f64, freedom: u64) -> f64 {
    assert!(p > 0.0 && p <= 1.0, "probability {p} is not between 0 and 1");
    let p = p.min(1.0_f64.next_down());
    assert!(freedom > 0, "t has at least one degree of freedom");
    if p < 0.5 {
        return -student_quantile(1.0 - p, freedom);
    }
    if freedom >= MANY {
        return expanded(normal_quantile(p), freedom as f64);
    }
    let (mut low, mut high) = (0.0, 1.0);
    while probability_below(high, freedom) < p {
        (low, high) = (high, 2.0 * high);
    }
    // Halving ends when no number lies between.
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        *(if probability_below(middle, freedom) < p { &mut low } else { &mut high }) = middle;
    }
}

/// The expansion about the normal quantile z: M. Abramowitz & I. Stegun, *Handbook of Mathematical Functions* (1964),
/// eq. 26.7.5.
fn expanded(z: f64, freedom: f64) -> f64 {
    let z2 = z * z;
    let terms = [
        (z2 + 1.0) / 4.0,
        ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0,
        (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0,
        ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) / 92_160.0,
    ];
    z + z * terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom)
}

/// P(T ≤ t) for t ≥ 0, by the finite series of Abramowitz & Stegun (1964), eqs. 26.7.3 and 26.7.4.
fn probability_below(t: f64, freedom: u64) -> f64 {
    let angle = (t / (freedom as f64).sqrt()).atan();
    let (sin, cos) = angle.sin_cos();
    let odd = freedom % 2 == 1;
    // Each term of the series follows from the one before.
    let (mut term, mut sum) = if odd { (cos, 0.0) } else { (1.0, 0.0) };
    let mut k = if odd { 1 } else { 0 };
    while k + 2 <= freedom {
        sum += term;
        term *= cos * cos * (k + 1) as f64 / (k + 2) as f64;
        k += 2;
    }
    let between = if odd { (angle + sin * sum) / std::f64::consts::FRAC_PI_2 } else { sin * sum };
    0.5 + 0.5 * between
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published tables (Abramowitz & Stegun 26.10), to their three decimals.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (p, freedom, t) in [
            (0.975, 1, 12.706),
            (0.975, 2, 4.303),
            (0.975, 3, 3.182),
            (0.975, 7, 2.365),
            (0.95, 10, 1.812),
            (0.995, 15, 2.947),
            (0.975, 120, 1.980),
        ] {
            assert!((student_quantile(p, freedom) - t).abs() < 6e-4, "{p} {freedom}");
            assert_eq!(student_quantile(1.0 - p, freedom), -student_quantile(1.0 - (1.0 - p), freedom));
        }
        assert!(student_quantile(0.5, 4).abs() < 1e-9);
        for freedom in [1, 7, MANY] {
            let furthest = student_quantile(1.0, freedom);
            assert!(furthest.is_finite() && furthest > student_quantile(1.0 - 1e-12, freedom), "{furthest}");
        }
    }

    #[test]
    fn series_and_expansion_meet() {
        for p in [0.75, 0.975, 0.9995] {
            let (below, above) =
                (student_quantile(p, MANY - 1), expanded(normal_quantile(p), (MANY - 1) as f64));
            assert!((below - above).abs() < 1e-8, "{p}: {below} {above}");
        }
    }
}
