//! Panes of clear glass, as a scene is written, and the part of the light that passes them by angle.
//!
//! A pane is a filter that rays cross: no ray ends on it, and it is no patch. What it does not pass is absorbed: reflections of a pane
//! are left out, as is the shift of a ray by refraction. The law is that of a plane-parallel plate of refractive index 1.52 (A. Fresnel;
//! all reflections between its two faces; absorption along the refracted way), which is also that of Radiance's `glass`.

use serde::{Deserialize, Serialize};

use super::spec::Shape;

/// The refractive index of window glass.
const INDEX: f64 = 1.52;

/// What one face of a pane reflects at normal incidence.
const NORMAL_REFLECTANCE: f64 = (INDEX - 1.0) * (INDEX - 1.0) / ((INDEX + 1.0) * (INDEX + 1.0));

/// What glass that absorbs nothing passes at normal incidence.
pub const CLEAREST: f64 = (1.0 - NORMAL_REFLECTANCE) / (1.0 + NORMAL_REFLECTANCE);

/// A pane of clear glass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaneSpec {
    /// The name of the pane.
    pub name: String,
    /// Its outline; cells mean nothing here.
    pub shape: Shape,
    /// The part of the light that passes at normal incidence, above 0 and at most [`CLEAREST`].
    pub transmittance: f64,
}

impl PaneSpec {
    /// What is wrong with the pane, where something is.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        let (corner, u, v) = self.shape.edges();
        let transmittance = self.transmittance;
        match () {
            () if ![corner, u, v].iter().all(|vector| vector.is_finite()) => {
                Some("its corners are no finite numbers")
            }
            () if u.cross(v).try_normalize().is_none() => Some("it has no area"),
            () if !(transmittance > 0.0 && transmittance <= CLEAREST) => Some(
                "its transmittance is not above 0 and at most 0.918, that of glass which absorbs nothing",
            ),
            () => None,
        }
    }

    /// Every number of the pane, for a digest.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        let (corner, u, v) = self.shape.edges();
        let is_triangle = matches!(self.shape, Shape::Triangle { .. });
        let vectors = [corner, u, v].into_iter().flat_map(|vector| vector.to_array());
        vectors.chain([f64::from(u8::from(is_triangle)), self.transmittance])
    }
}

/// What glass of one kind passes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glass {
    /// The natural logarithm of what one way straight through the glass leaves of light.
    depth: f64,
}

impl Glass {
    /// Glass that passes this part of the light at normal incidence.
    ///
    /// T = (1 − r)²a/(1 − r²a²) is solved for a, the part that one way through the glass leaves.
    pub(crate) fn new(transmittance: f64) -> Self {
        let (r, rest) = (NORMAL_REFLECTANCE, (1.0 - NORMAL_REFLECTANCE) * (1.0 - NORMAL_REFLECTANCE));
        let root = (rest * rest + 4.0 * transmittance * transmittance * r * r).sqrt();
        // The root without the cancellation of (−rest + root)/(2·T·r²).
        let left = 2.0 * transmittance / (rest + root);
        Glass { depth: logarithm(left.min(1.0)) }
    }

    /// The part of unpolarised light that passes at this cosine of the angle to the normal, in [0, 1].
    pub(crate) fn passes(self, cosine: f64) -> f64 {
        if cosine <= 0.0 {
            return 0.0;
        }
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt() / INDEX;
        let inside = (1.0 - sine * sine).sqrt();
        let left = exponential(self.depth / inside);
        let of = |a: f64, b: f64| {
            let amplitude = (a - b) / (a + b);
            let r = amplitude * amplitude;
            // At grazing angles r rounds to 1, and nothing passes.
            if r < 1.0 { (1.0 - r) * (1.0 - r) * left / (1.0 - r * r * left * left) } else { 0.0 }
        };
        0.5 * (of(cosine, INDEX * inside) + of(INDEX * cosine, inside))
    }
}

/// ln x for x in (0, 1], by the series of the area tangent: the same bits on every machine, which those of libraries are not.
fn logarithm(mut x: f64) -> f64 {
    let mut halvings = 0;
    while x < 0.5 {
        x *= 2.0;
        halvings += 1;
    }
    let y = (x - 1.0) / (x + 1.0);
    let (square, mut power, mut sum) = (y * y, y, 0.0);
    for odd in (1..60).step_by(2) {
        sum += power / f64::from(odd);
        power *= square;
    }
    2.0 * sum - f64::from(halvings) * std::f64::consts::LN_2
}

/// eˣ for x ≤ 0, by its series: the same bits on every machine.
fn exponential(x: f64) -> f64 {
    // The series of x / 64 converges fast; its sum is squared six times.
    const HALVINGS: i32 = 6;
    let small = x / f64::from(1 << HALVINGS);
    let mut sum = 1.0;
    for n in (1..=16).rev() {
        sum = 1.0 + sum * small / f64::from(n);
    }
    (0..HALVINGS).fold(sum, |power, _| power * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_and_powers_are_those_of_the_platform() {
        for n in 1..=1000 {
            let x = f64::from(n) * 1e-3;
            assert!((logarithm(x) - x.ln()).abs() < 1e-14 * (1.0 + x.ln().abs()), "{x}");
            let z = -f64::from(n) * 0.01;
            assert!((exponential(z) / z.exp() - 1.0).abs() < 1e-13, "{z}");
        }
    }

    #[test]
    fn glass_passes_what_it_is_sold_for_and_less_aslant() {
        for transmittance in [1e-6, 0.1, 0.5, 0.88, CLEAREST] {
            let glass = Glass::new(transmittance);
            assert!((glass.passes(1.0) / transmittance - 1.0).abs() < 1e-12, "{transmittance}");
            let by_angle: Vec<f64> =
                (0..=90).map(|a| glass.passes(f64::from(a).to_radians().cos())).collect();
            assert!(by_angle.windows(2).all(|pair| pair[1] < pair[0] * (1.0 + 1e-6)), "{by_angle:?}");
            assert!(by_angle[90] < 1e-12);
        }
    }

    /// At Brewster's angle tan θ = n the light in the plane of incidence is not reflected at all, and r of the other is
    /// ((n² − 1)/(n² + 1))².
    #[test]
    fn clear_glass_at_brewsters_angle_is_known_in_closed_form() {
        let square = INDEX * INDEX;
        let r = ((square - 1.0) / (square + 1.0)).powi(2);
        let expected = 0.5 * (1.0 + (1.0 - r) / (1.0 + r));
        let cosine = 1.0 / (1.0 + square).sqrt();
        assert!((Glass::new(CLEAREST).passes(cosine) - expected).abs() < 1e-13);
    }
}
