//! Radiance of the sky by direction: the standard skies of the CIE, and what they share with Perez's.

use std::f64::consts::{FRAC_PI_2, PI};

/// The number of the standard skies: 15 of CIE S 011, and the traditional overcast sky.
pub const STANDARD_SKIES: u8 = 16;

/// (a, b) of the gradations I … VI of CIE S 011:2003 (ISO 15469:2004), table 1.
const GRADATIONS: [[f64; 2]; 6] =
    [[4.0, -0.70], [1.1, -0.80], [0.0, -1.0], [-1.0, -0.55], [-1.0, -0.32], [-1.0, -0.15]];

/// (c, d, e) of the indicatrices 1 … 6, ibidem.
const INDICATRICES: [[f64; 3]; 6] = [
    [0.0, -1.0, 0.00],
    [2.0, -1.5, 0.15],
    [5.0, -2.5, 0.30],
    [10.0, -3.0, 0.45],
    [16.0, -3.0, 0.30],
    [24.0, -2.8, 0.15],
];

/// The gradation and the indicatrix of the skies 1 … 15, ibidem.
const TYPES: [[usize; 2]; 15] = [
    [1, 1],
    [1, 2],
    [2, 1],
    [2, 2],
    [3, 1],
    [3, 2],
    [3, 3],
    [3, 4],
    [4, 2],
    [4, 3],
    [4, 4],
    [5, 4],
    [5, 5],
    [6, 5],
    [6, 6],
];

/// Zenith angles are held below this cosine: the gradation of some of Perez's skies has a pole at the horizon.
const LEAST_COSINE: f64 = 0.01;

/// A sky: radiance by direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    form: SkyForm,
    /// The unit vector to the sun.
    sun: [f64; 3],
    /// What a horizontal plane receives from the whole sky without the sun [W/m² or lx].
    pub(crate) horizontal: f64,
}

/// Radiance up to a factor.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SkyForm {
    /// (1 + 2 sin γ)/3 at the altitude γ (P. Moon & D. E. Spencer 1942).
    Overcast,
    /// φ(Z)·f(χ) with φ = 1 + a·exp(b/cos Z) and f = 1 + c·(exp(d·χ) − k) + e·cos² χ.
    Graded {
        /// a, b of the gradation.
        gradation: [f64; 2],
        /// c, d, e of the indicatrix.
        indicatrix: [f64; 3],
        /// k.
        offset: f64,
    },
}

impl Sky {
    /// The standard sky 1 … 16 of CIE S 011, for a direction of the sun, by the illuminance that it gives a horizontal plane; `None` of other numbers.
    pub fn standard(number: u8, sun: [f64; 3], horizontal: f64) -> Option<Self> {
        if number == STANDARD_SKIES {
            return Some(Sky { form: SkyForm::Overcast, sun, horizontal });
        }
        let [gradation, indicatrix] = *TYPES.get(usize::from(number).checked_sub(1)?)?;
        let (gradation, indicatrix) = (GRADATIONS[gradation - 1], INDICATRICES[indicatrix - 1]);
        // CIE S 011 eq. (4): f(χ) = 1 + c·(exp(dχ) − exp(dπ/2)) + e·cos² χ.
        let offset = (indicatrix[1] * FRAC_PI_2).exp();
        Some(Sky { form: SkyForm::Graded { gradation, indicatrix, offset }, sun, horizontal })
    }

    pub(crate) fn new(form: SkyForm, sun: [f64; 3], horizontal: f64) -> Self {
        Sky { form, sun, horizontal }
    }

    /// The same radiance from every direction above the horizon.
    pub fn uniform(horizontal: f64) -> Self {
        let form = SkyForm::Graded { gradation: [0.0, -1.0], indicatrix: [0.0, -1.0, 0.0], offset: 0.0 };
        Sky { form, sun: [0.0, 0.0, 1.0], horizontal }
    }

    /// The radiance in a direction of length 1 above the horizon, up to the factor that [`Sky::horizontal`] sets. It is not
    /// negative: Perez's formula is at some places, and is cut there.
    pub fn relative(&self, direction: [f64; 3]) -> f64 {
        match &self.form {
            SkyForm::Overcast => (1.0 + 2.0 * direction[2]) / 3.0,
            SkyForm::Graded { gradation: [a, b], indicatrix: [c, d, e], offset } => {
                let gradation = 1.0 + a * (b / direction[2].max(LEAST_COSINE)).exp();
                let cosine: f64 =
                    direction.iter().zip(self.sun).map(|(x, y)| x * y).sum::<f64>().clamp(-1.0, 1.0);
                let scattered = if *c == 0.0 { 0.0 } else { c * ((d * cosine.acos()).exp() - offset) };
                (gradation * (1.0 + scattered + e * cosine * cosine)).max(0.0)
            }
        }
    }

    /// ∫ L cos θ dω of [`Sky::relative`] over the hemisphere, by Gauss's rule in the sine of altitude and the trapezoid rule in azimuth.
    pub fn relative_horizontal(&self) -> f64 {
        // Half degrees.
        const AZIMUTHS: usize = 720;
        let ring = |sine: f64| {
            let flat = (1.0 - sine * sine).sqrt();
            let at = |i: usize| {
                let (east, north) = (2.0 * PI * i as f64 / AZIMUTHS as f64).sin_cos();
                self.relative([flat * east, flat * north, sine])
            };
            (0..AZIMUTHS).map(at).sum::<f64>() / AZIMUTHS as f64
        };
        // dω = d(sin γ) dα.
        gauss::<64>().iter().map(|[x, weight]| 2.0 * PI * weight * x * ring(*x)).sum()
    }
}

/// Nodes and weights of the N-point rule of Gauss and Legendre on [0, 1].
pub(crate) fn gauss<const N: usize>() -> [[f64; 2]; N] {
    std::array::from_fn(|i| {
        // Newton's method from Tricomi's guess of the root.
        let mut x = (PI * (i as f64 + 0.75) / (N as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut last, mut value) = (1.0, x);
            for k in 2..=N {
                let k = k as f64;
                (last, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * last) / k);
            }
            slope = N as f64 * (last - x * value) / (1.0 - x * x);
            x -= value / slope;
        }
        [0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(altitude: f64, azimuth: f64) -> [f64; 3] {
        let [(sin, cos), (east, north)] = [altitude, azimuth].map(|angle| angle.to_radians().sin_cos());
        [cos * east, cos * north, sin]
    }

    /// ∫ x^k dx = 1/(k + 1) for every power below 2N.
    #[test]
    fn the_rule_of_gauss_is_exact_for_polynomials() {
        for k in 0..8 {
            let sum: f64 = gauss::<4>().iter().map(|[x, w]| w * x.powi(k)).sum();
            assert!((sum - 1.0 / f64::from(k + 1)).abs() < 1e-14, "{k}: {sum}");
        }
        assert_eq!(gauss::<1>(), [[0.5, 1.0]]);
        assert!(
            (gauss::<64>().iter().map(|[x, w]| w * x.exp()).sum::<f64>() - (1.0_f64.exp() - 1.0)).abs()
                < 1e-14
        );
    }

    /// Moon & Spencer's sky gives a horizontal plane 7π/9 of what it would have under the radiance of the zenith everywhere; type 5 is uniform.
    #[test]
    fn skies_with_closed_forms() {
        let overcast = Sky::standard(16, direction(30.0, 0.0), 1.0).unwrap();
        assert!((overcast.relative_horizontal() - 7.0 * PI / 9.0).abs() < 1e-9);
        for sky in [Sky::standard(5, direction(40.0, 90.0), 1.0).unwrap(), Sky::uniform(1.0)] {
            assert!((sky.relative_horizontal() - PI).abs() < 1e-12);
        }
    }

    /// CIE S 011: type 1 differs by less than 4 % from the traditional overcast sky; its gradation from horizon to zenith is 1 : 3.
    /// The ratios L/L_z of other types as the formula gives them with sun and place at the angles named, computed apart in 30 digits.
    #[test]
    fn the_standard_skies_are_those_of_the_formula() {
        let sun = direction(35.0, 120.0);
        let ratio = |number: u8, place: [f64; 3]| {
            let sky = Sky::standard(number, sun, 1.0).unwrap();
            sky.relative(place) / sky.relative([0.0, 0.0, 1.0])
        };
        for (altitude, expected) in
            [(0.0, 1.0 / 3.0), (30.0, 2.0 / 3.0), (60.0, (1.0 + 3.0_f64.sqrt()) / 3.0)]
        {
            assert!((ratio(16, direction(altitude, 77.0)) - expected).abs() < 1e-12);
            assert!((ratio(1, direction(altitude, 77.0)) - expected).abs() < 0.04);
        }
        for (number, expected) in PUBLISHED {
            let found = ratio(number, direction(20.0, 210.0));
            assert!((found / expected - 1.0).abs() < 1e-9, "type {number}: {found}");
        }
        assert_eq!((Sky::standard(0, sun, 1.0), Sky::standard(17, sun, 1.0)), (None, None));
    }

    /// L/L_z at altitude 20°, azimuth 210°, the sun at altitude 35°, azimuth 120°.
    const PUBLISHED: [(u8, f64); 4] = [
        (2, 0.407_878_028_216_482_2),
        (7, 0.739_019_365_185_567_9),
        (12, 1.493_182_313_071_049_5),
        (15, 1.306_747_326_691_518_6),
    ];
}
