//! MGF's colours: CIE 1931 chromaticities, mixtures, spectra and black bodies, as red, green and blue.

use std::sync::LazyLock;

use glam::{DMat3, DVec3};
use radiosity::Spectrum;

/// A CIE 1931 chromaticity (x, y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Colour {
    pub(super) x: f64,
    pub(super) y: f64,
}

/// The most distance of a chromaticity from equal energy (1/3, 1/3) that still counts as grey: files round to three
/// digits.
const GREY: f64 = 1e-3;

/// Red, green and blue, as the chromaticities of MGF's own converters, with white at equal energy.
const PRIMARIES: [Colour; 3] =
    [Colour { x: 0.640, y: 0.330 }, Colour { x: 0.290, y: 0.600 }, Colour { x: 0.150, y: 0.060 }];

/// The highest reflectance of a channel that a saturated colour is left with.
const BRIGHTEST: f64 = 0.99;

impl Default for Colour {
    fn default() -> Self {
        Colour { x: 1.0 / 3.0, y: 1.0 / 3.0 }
    }
}

impl Colour {
    /// The chromaticity of X, Y, Z; `None` if they are no light.
    pub(super) fn of(xyz: DVec3) -> Option<Self> {
        let sum = xyz.element_sum();
        (sum > 0.0 && sum.is_finite()).then(|| Colour { x: xyz.x / sum, y: xyz.y / sum })
    }

    /// The X, Y, Z of this chromaticity at luminance Y = 1.
    pub(super) fn xyz(self) -> DVec3 {
        let y = self.y.max(1e-6);
        DVec3::new(self.x / y, 1.0, (1.0 - self.x - self.y) / y)
    }

    /// A reflectance of luminance Y, and the part of grey that was mixed in for every channel to lie in [0, 1).
    pub(super) fn reflectance(self, luminance: f64) -> (Spectrum, f64) {
        self.within(luminance, BRIGHTEST.max(luminance))
    }

    /// An emittance of luminance Y, and the part of grey that was mixed in for no channel to be negative.
    pub(super) fn emittance(self, luminance: f64) -> (Spectrum, f64) {
        self.within(luminance, f64::INFINITY)
    }

    /// The colour mixed with the grey of its luminance until all channels lie in [0, `most`]; with the part of grey.
    fn within(self, luminance: f64, most: f64) -> (Spectrum, f64) {
        if (self.x - 1.0 / 3.0).abs() <= GREY && (self.y - 1.0 / 3.0).abs() <= GREY {
            return (luminance.into(), 0.0);
        }
        let rgb = *TO_RGB * self.xyz() * luminance;
        let beyond = |channel: f64| {
            let limit = if channel < luminance { 0.0 } else { most };
            let kept = (limit - luminance) / (channel - luminance);
            if kept.is_finite() { (1.0 - kept).max(0.0) } else { 0.0 }
        };
        let grey = rgb.to_array().map(beyond).into_iter().fold(0.0, f64::max);
        let mixed = rgb.lerp(DVec3::splat(luminance), grey).to_array();
        // A channel that rounding has left of 0 is 0.
        let channel = |channel: f64| if channel > 1e-12 * luminance { channel } else { 0.0 };
        (Spectrum::rgb(mixed.map(channel)), grey)
    }
}

/// The matrix from X, Y, Z to red, green, blue; equal energy is (1, 1, 1).
static TO_RGB: LazyLock<DMat3> = LazyLock::new(|| {
    let [red, green, blue] = PRIMARIES.map(|primary| primary.xyz() * primary.y);
    let primaries = DMat3::from_cols(red, green, blue);
    let amounts = primaries.inverse() * DVec3::ONE;
    (primaries * DMat3::from_diagonal(amounts)).inverse()
});

/// Mixes colours, each weighted by its luminance.
pub(super) fn mix(parts: &[(f64, Colour)]) -> Option<Colour> {
    Colour::of(parts.iter().map(|(weight, colour)| colour.xyz() * *weight).sum())
}

/// The colour of a spectrum: values at equal steps from `low` to `high` [nm].
pub(super) fn of_spectrum(low: f64, high: f64, values: &[f64]) -> Option<Colour> {
    let step = (high - low) / (values.len() - 1) as f64;
    Colour::of(integrate(|wavelength| {
        let at = (wavelength - low) / step;
        let (i, part) = (at.floor(), at.fract());
        let value = |i: f64| if i >= 0.0 { values.get(i as usize).copied().unwrap_or(0.0) } else { 0.0 };
        if at < 0.0 { 0.0 } else { value(i) * (1.0 - part) + value(i + 1.0) * part }
    }))
}

/// Red, green and blue of a spectrum of pairs of wavelength [nm] and value, which goes on beyond its ends as it is there. One that is 1
/// everywhere is (1, 1, 1); of a saturated one no channel is negative.
pub(crate) fn rgb_of_pairs(mut pairs: Vec<(f64, f64)>) -> [f64; 3] {
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let value = |wavelength: f64| {
        let next = pairs.partition_point(|&(at, _)| at < wavelength);
        match (pairs[..next].last(), pairs.get(next)) {
            (Some(&(low, before)), Some(&(high, after))) => {
                before + (after - before) * (wavelength - low) / (high - low)
            }
            (Some(&(_, only)), None) | (None, Some(&(_, only))) => only,
            (None, None) => 0.0,
        }
    };
    let xyz = integrate(value) / integrate(|_| 1.0);
    (*TO_RGB * xyz).to_array().map(|channel| channel.max(0.0))
}

/// The colour of a black body at a temperature [K], by Planck's law.
pub(super) fn of_black_body(temperature: f64) -> Option<Colour> {
    // The second radiation constant hc/k [nm·K].
    const SECOND_RADIATION: f64 = 1.438_776_877e7;
    Colour::of(integrate(|wavelength| {
        let hottest = 560.0_f64;
        (hottest / wavelength).powi(5) / (SECOND_RADIATION / (wavelength * temperature)).exp_m1()
    }))
}

/// The X, Y, Z of a spectrum over wavelength [nm].
fn integrate(spectrum: impl Fn(f64) -> f64) -> DVec3 {
    (380..=780).step_by(2).map(|nm| matching(f64::from(nm)) * spectrum(f64::from(nm))).sum()
}

/// The CIE 1931 colour matching functions at a wavelength [nm], as fitted by Wyman, Sloan and Shirley, *Simple
/// Analytic Approximations to the CIE XYZ Color Matching Functions* (JCGT 2013), section 2.2.
fn matching(nm: f64) -> DVec3 {
    let lobe = |height: f64, centre: f64, below: f64, above: f64| {
        let t = (nm - centre) * if nm < centre { below } else { above };
        height * (-0.5 * t * t).exp()
    };
    DVec3::new(
        lobe(0.362, 442.0, 0.0624, 0.0374)
            + lobe(1.056, 599.8, 0.0264, 0.0323)
            + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(colour: Option<Colour>, [x, y]: [f64; 2], tolerance: f64) {
        let colour = colour.unwrap();
        assert!((colour.x - x).abs() < tolerance && (colour.y - y).abs() < tolerance, "{colour:?}");
    }

    #[test]
    fn grey_is_exactly_grey() {
        let (grey, lost) = Colour { x: 0.333, y: 0.333 }.reflectance(0.7);
        assert_eq!((grey.channels(), lost), ([0.7; 3], 0.0));
    }

    #[test]
    fn primaries_are_pure() {
        let (red, _) = PRIMARIES[0].emittance(1.0);
        assert!(red[0] > 3.0 && red[1].abs() < 1e-9 && red[2].abs() < 1e-9, "{red:?}");
    }

    #[test]
    fn saturated_reflectances_keep_their_luminance() {
        let (red, lost) = Colour { x: 0.75, y: 0.1 }.reflectance(0.29);
        let to_xyz = TO_RGB.inverse();
        let luminance = (to_xyz * DVec3::from_array(red.channels())).y;
        assert!((luminance - 0.29).abs() < 1e-9 && red.max() <= 0.99 && lost > 0.5, "{red:?} {lost}");
    }

    /// CIE 15: the chromaticity of illuminant A, a black body at 2856 K.
    #[test]
    fn black_bodies_have_their_known_colour() {
        assert_near(of_black_body(2856.0), [0.4476, 0.4074], 0.004);
    }

    #[test]
    fn pairs_are_a_spectrum() {
        for flat in [vec![(400.0, 0.78), (700.0, 0.78)], vec![(500.0, 0.78)]] {
            assert!(rgb_of_pairs(flat).iter().all(|channel| (channel - 0.78).abs() < 1e-12));
        }
        let [red, green, blue] = rgb_of_pairs(vec![(700.0, 0.9), (620.0, 0.8), (560.0, 0.1), (400.0, 0.1)]);
        assert!(red > 0.5 && green < 0.4 && blue < 0.2, "{red} {green} {blue}");
        assert_eq!(rgb_of_pairs(Vec::new()), [0.0; 3]);
    }

    #[test]
    fn a_flat_spectrum_is_grey_and_halves_mix() {
        assert_near(of_spectrum(380.0, 780.0, &[1.0, 1.0]), [1.0 / 3.0; 2], 0.004);
        let (a, b) = (Colour { x: 0.3, y: 0.3 }, Colour { x: 0.5, y: 0.3 });
        assert_near(mix(&[(1.0, a), (1.0, b)]), [0.4, 0.3], 1e-12);
    }
}
