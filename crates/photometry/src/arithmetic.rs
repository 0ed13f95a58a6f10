//! Sine, cosine and angle by + − × ÷ √ alone, in one order: the same bits on every machine.

use std::f64::consts::{FRAC_PI_2, PI};

/// 1/n! with the signs of the series of the sine: (−1)^k / (2k + 1)!.
const SINE: [f64; 10] = series(1);

/// The terms of 1 − cos x = x²/2! − x⁴/4! + …: (−1)^k / (2k + 2)!.
const VERSINE: [f64; 10] = series(2);

/// (−1)^k / (2k + `first`)!.
const fn series(first: u32) -> [f64; 10] {
    let mut terms = [0.0; 10];
    let (mut k, mut factorial) = (0, if first == 1 { 1.0 } else { 2.0 });
    while k < 10 {
        terms[k] = if k % 2 == 0 { 1.0 / factorial } else { -1.0 / factorial };
        let n = (2 * k + first as usize) as f64;
        factorial *= (n + 1.0) * (n + 2.0);
        k += 1;
    }
    terms
}

fn horner(terms: &[f64], x: f64) -> f64 {
    terms.iter().rev().fold(0.0, |sum, term| sum * x + term)
}

/// sin x and 1 − cos x for |x| ≤ π/4, to 2⁻⁵². The second keeps its digits where x is small.
pub(crate) fn sine_versine(x: f64) -> [f64; 2] {
    let square = x * x;
    [x * horner(&SINE, square), square * horner(&VERSINE, square)]
}

/// Sine and cosine of an angle [°]; exact at multiples of 90°.
pub(crate) fn sin_cos(degrees: f64) -> [f64; 2] {
    let quarter = (degrees / 90.0).round();
    let [sine, versine] = sine_versine((degrees - 90.0 * quarter) * (PI / 180.0));
    let cosine = 1.0 - versine;
    match (quarter as i64).rem_euclid(4) {
        0 => [sine, cosine],
        1 => [cosine, -sine],
        2 => [-sine, -cosine],
        _ => [-cosine, sine],
    }
}

/// The angle of (x, y) from the x axis [°], in [−180, 180]; 0 at the origin.
pub(crate) fn angle(y: f64, x: f64) -> f64 {
    let (least, largest) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    // tan(φ/2) = tan φ / (1 + √(1 + tan² φ)), twice: at most tan(π/16).
    let halved = |t: f64| t / (1.0 + (1.0 + t * t).sqrt());
    let t = halved(halved(least / largest));
    let square = t * t;
    let sum = (0..13).rev().fold(0.0, |sum, k| {
        let term = 1.0 / f64::from(2 * k + 1);
        sum * square + if k % 2 == 0 { term } else { -term }
    });
    let octant = 4.0 * t * sum;
    let quadrant = if y.abs() > x.abs() { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    (if y < 0.0 { -half } else { half }) * (180.0 / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_angles_are_those_of_the_platform() {
        for n in -7200..=7200 {
            let degrees = f64::from(n) * 0.1001;
            let [sine, cosine] = sin_cos(degrees);
            let (s, c) = degrees.to_radians().sin_cos();
            assert!((sine - s).abs() < 2e-15 && (cosine - c).abs() < 2e-15, "{degrees}");
            let expected = s.atan2(c).to_degrees();
            assert!((angle(s, c) - expected).abs() < 2e-13, "{degrees}");
        }
        assert_eq!([sin_cos(90.0), sin_cos(180.0), sin_cos(-90.0)], [[1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]]);
        assert_eq!(
            [angle(1.0, 0.0), angle(0.0, -1.0), angle(-2.0, 0.0), angle(0.0, 0.0)],
            [90.0, 180.0, -90.0, 0.0]
        );
    }
}
