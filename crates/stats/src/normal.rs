//! The quantiles of the normal distribution.

#![expect(clippy::excessive_precision, reason = "coefficients as published")]

/// The standard normal deviate below which a fraction `p` lies: Φ⁻¹(p), to about 1e-15 relative; infinite at
/// 0 and 1, NaN outside. Near 1 rather ask for `-normal_quantile(1 - p)` with an exact `1 - p`.
///
/// Source: M. J. Wichura, "Algorithm AS 241: the percentage points of the normal distribution",
/// Applied Statistics 37 (1988) 477–484, routine PPND16.
pub fn normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180625 - q * q;
        return q * polynomial(&CENTRE.0, r) / polynomial(&CENTRE.1, r);
    }
    if !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    let r = (-p.min(1.0 - p).ln()).sqrt();
    if r.is_infinite() {
        return r.copysign(q);
    }
    let (shift, (numerator, denominator)) = if r <= 5.0 { (1.6, &SHOULDER) } else { (5.0, &TAIL) };
    (polynomial(numerator, r - shift) / polynomial(denominator, r - shift)).copysign(q)
}

/// The fraction Φ(x) of normal deviates below x, to about 1e-15: the quantile function, inverted by bisection.
pub fn normal_cdf(x: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if normal_quantile(middle) < x { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Evaluates a polynomial by Horner's rule; the constant term comes first.
fn polynomial(coefficients: &[f64; 8], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |value, c| value * x + c)
}

/// Numerator and denominator for |p − ½| ≤ 0.425, in 0.425² − (p − ½)².
const CENTRE: ([f64; 8], [f64; 8]) = (
    [
        3.387132872796366608,
        133.14166789178437745,
        1971.5909503065514427,
        13731.693765509461125,
        45921.953931549871457,
        67265.770927008700853,
        33430.575583588128105,
        2509.0809287301226727,
    ],
    [
        1.0,
        42.313330701600911252,
        687.1870074920579083,
        5394.1960214247511077,
        21213.794301586595867,
        39307.89580009271061,
        28729.085735721942674,
        5226.495278852854561,
    ],
);

/// Numerator and denominator for r = √(−ln(tail)) ≤ 5, in r − 1.6.
const SHOULDER: ([f64; 8], [f64; 8]) = (
    [
        1.42343711074968357734,
        4.6303378461565452959,
        5.7694972214606914055,
        3.64784832476320460504,
        1.27045825245236838258,
        0.241780725177450611770,
        2.27238449892691845833e-2,
        7.7454501427834140764e-4,
    ],
    [
        1.0,
        2.05319162663775882187,
        1.6763848301838038494,
        0.68976733498510000455,
        0.14810397642748007459,
        1.51986665636164571966e-2,
        5.475938084995344946e-4,
        1.05075007164441684324e-9,
    ],
);

/// Numerator and denominator for r > 5, in r − 5.
const TAIL: ([f64; 8], [f64; 8]) = (
    [
        6.6579046435011037772,
        5.4637849111641143699,
        1.7848265399172913358,
        0.29656057182850489123,
        2.6532189526576123093e-2,
        1.2426609473880784386e-3,
        2.71155556874348757815e-5,
        2.01033439929228813265e-7,
    ],
    [
        1.0,
        0.59983220655588793769,
        0.13692988092273580531,
        1.48753612908506148525e-2,
        7.868691311456132591e-4,
        1.8463183175100546818e-5,
        1.4215117583164458887e-7,
        2.04426310338993978564e-15,
    ],
);

#[cfg(test)]
mod tests {
    use super::*;

    /// Roots of Φ(z) = p, found in arithmetic of 40 digits.
    #[test]
    fn agrees_with_tabulated_deviates_to_1e_14() {
        let known = [
            (0.5, 0.0),
            (0.4, -0.253347103135799741),
            (0.25, -0.674489750196081743),
            (0.075, -1.43953147093845593),
            (0.025, -1.95996398454005421),
            (0.005, -2.57582930354890075),
            (1e-4, -3.71901648545568055),
            (1e-10, -6.3613409024040562),
            (1e-12, -7.03448382530113193),
            (1e-50, -14.933337534788489),
            (1e-300, -37.0470962993611992),
        ];
        for (p, deviate) in known {
            let error = (normal_quantile(p) - deviate).abs();
            assert!(error <= 1e-14 * deviate.abs(), "p = {p}: {} for {deviate}", normal_quantile(p));
        }
    }

    #[test]
    fn is_antisymmetric() {
        for p in [0.4375, 0.25, 0.0625, 2f64.powi(-30)] {
            assert_eq!(normal_quantile(1.0 - p), -normal_quantile(p), "p = {p}");
        }
    }

    #[test]
    fn the_distribution_is_the_inverse_of_its_quantiles() {
        for (x, p) in [(0.0, 0.5), (1.0, 0.841344746068542949), (-1.959963984540054, 0.025), (9.0, 1.0)] {
            assert!((normal_cdf(x) - p).abs() < 1e-15, "{x}: {}", normal_cdf(x));
        }
    }

    #[test]
    fn ends_are_infinite_and_the_outside_is_not_a_number() {
        assert_eq!(normal_quantile(0.0), f64::NEG_INFINITY);
        assert_eq!(normal_quantile(1.0), f64::INFINITY);
        assert!(
            normal_quantile(-0.1).is_nan()
                && normal_quantile(1.1).is_nan()
                && normal_quantile(f64::NAN).is_nan()
        );
    }
}
