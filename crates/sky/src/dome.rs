//! Skies in patches: sky vectors, with the ground and the sun.

use std::f64::consts::PI;

use radiosity::daylight::SkyPatches;

use crate::luminance::{Sky, gauss};

/// The sun is shared out over this many patches, the nearest ones, as in Radiance's `gendaymtx`.
pub const SUN_PATCHES: usize = 4;

/// The sky in patches, with directions and weights for integrals over each patch.
#[derive(Clone, Debug)]
pub struct Dome {
    patches: SkyPatches,
    /// Directions and weights of each patch, `per_patch` of them.
    nodes: Vec<([f64; 3], f64)>,
    per_patch: usize,
    middles: Vec<[f64; 3]>,
    solid_angles: Vec<f64>,
    factors: Vec<f64>,
}

impl Dome {
    /// The sky in one of the divisions of [`SkyPatches::SIZES`].
    pub fn new(patches: SkyPatches) -> Self {
        let nodes: Vec<([f64; 3], f64)> = match patches.count() {
            0..=145 => nodes::<4>(&patches),
            146..=577 => nodes::<2>(&patches),
            _ => nodes::<1>(&patches),
        };
        Dome {
            per_patch: nodes.len() / patches.count(),
            middles: nodes_of::<1>(&patches).into_iter().map(|(direction, _)| direction).collect(),
            solid_angles: patches.solid_angles(),
            factors: patches.horizontal_factors(),
            nodes,
            patches,
        }
    }

    /// The division.
    pub fn patches(&self) -> &SkyPatches {
        &self.patches
    }

    /// How many numbers a sky vector has: one for the ground, which is the first, and one for each patch.
    pub fn size(&self) -> usize {
        self.patches.count() + 1
    }

    /// The mean radiance of each patch, the ground dark. A horizontal plane under these patches receives exactly what it does from the sky.
    pub fn vector(&self, sky: &Sky) -> Vec<f64> {
        let mean = |nodes: &[([f64; 3], f64)]| {
            nodes.iter().map(|(node, weight)| weight * sky.relative(*node)).sum::<f64>()
        };
        let means: Vec<f64> = self.nodes.chunks(self.per_patch).map(mean).collect();
        let horizontal = self.horizontal(&means);
        // A sky that is cut at 0 everywhere has its light from everywhere.
        let (flat, scale) = match horizontal > 0.0 {
            true => (0.0, sky.horizontal / horizontal),
            false => (sky.horizontal / PI, 0.0),
        };
        std::iter::once(0.0).chain(means.iter().map(|mean| flat + scale * mean)).collect()
    }

    /// What a horizontal plane receives from patches of these radiances, the ground left out.
    fn horizontal(&self, radiances: &[f64]) -> f64 {
        PI * radiances.iter().zip(&self.factors).map(|(radiance, factor)| radiance * factor).sum::<f64>()
    }

    /// The part of π·L that a horizontal plane sees of each number of a sky vector: Σ p·π·L is the light of the sky.
    pub fn open(&self) -> Vec<f64> {
        std::iter::once(0.0).chain(self.factors.iter().copied()).collect()
    }

    /// The patches that stand for the sun in a direction, and the radiance of each: they give a plane that faces the sun as much as
    /// `normal`, shared out by nearness as in `gendaymtx`.
    pub fn sun(&self, direction: [f64; 3], normal: f64) -> Vec<(usize, f64)> {
        let cosine = |middle: &[f64; 3]| middle.iter().zip(direction).map(|(x, y)| x * y).sum::<f64>();
        let mut near: Vec<(usize, f64)> = self.middles.iter().map(cosine).enumerate().collect();
        let by_nearness = |a: &(usize, f64), b: &(usize, f64)| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0));
        near.select_nth_unstable_by(SUN_PATCHES - 1, by_nearness);
        near.truncate(SUN_PATCHES);
        near.sort_by(by_nearness);
        let weight = |cosine: f64| 1.0 / (1.002 - cosine);
        let total: f64 = near.iter().map(|&(_, cosine)| weight(cosine)).sum();
        near.iter()
            .map(|&(patch, cosine)| (patch + 1, normal * weight(cosine) / (total * self.solid_angles[patch])))
            .collect()
    }
}

fn nodes<const N: usize>(patches: &SkyPatches) -> Vec<([f64; 3], f64)> {
    nodes_of::<N>(patches)
}

/// Directions and weights of a rule of N × N nodes for the mean over each patch: uniform in the sine of altitude and in azimuth.
fn nodes_of<const N: usize>(patches: &SkyPatches) -> Vec<([f64; 3], f64)> {
    let rule = gauss::<N>();
    (0..patches.count() as u32)
        .flat_map(|patch| {
            let [[low, high], [from, to]] = patches.bounds(patch);
            let cap = high == 1.0;
            rule.into_iter().flat_map(move |[x, w]| {
                rule.into_iter().map(move |[y, v]| {
                    // The middle of the cap is the zenith.
                    let sine = if cap && N == 1 { 1.0 } else { low + x * (high - low) };
                    let (east, north) = (from + y * (to - from)).sin_cos();
                    let flat = (1.0 - sine * sine).sqrt();
                    ([flat * east, flat * north, sine], w * v)
                })
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dome(size: u32) -> Dome {
        Dome::new(SkyPatches::new(size).unwrap())
    }

    /// A plane under the patches has what it has under the sky; patches of a uniform sky are alike.
    #[test]
    fn vectors_keep_the_light_of_the_sky() {
        for size in SkyPatches::SIZES {
            let dome = dome(size);
            assert_eq!(dome.size(), size as usize + 1);
            let vector = dome.vector(&Sky::uniform(PI));
            assert!(vector[0] == 0.0 && vector[1..].iter().all(|radiance| (radiance - 1.0).abs() < 1e-12));
            for number in 1..=16 {
                let sky = Sky::standard(number, [0.6, 0.0, 0.8], 1e4).unwrap();
                let vector = dome.vector(&sky);
                let light: f64 =
                    vector.iter().zip(dome.open()).map(|(radiance, part)| PI * radiance * part).sum();
                assert!((light / 1e4 - 1.0).abs() < 1e-12, "{size}, {number}: {light}");
            }
        }
    }

    /// A sky of any type in patches differs little from the sky itself: by the mean over what a vertical plane sees.
    #[test]
    fn patches_come_nearer_to_the_sky_the_smaller_they_are() {
        let sky = Sky::standard(12, [0.6, 0.0, 0.8], 1.0).unwrap();
        let truth = sky.relative([0.0, 1.0, 0.0]) / sky.relative_horizontal();
        let error = |size| {
            let vector = dome(size).vector(&sky);
            (vector[1] / truth - 1.0).abs()
        };
        let errors = SkyPatches::SIZES.map(error);
        assert!(
            errors[0] < 0.2 && errors[1] < 0.12 && errors[2] < 0.06 && errors[2] < errors[0],
            "{errors:?}"
        );
    }

    /// The patches of the sun hold all of it, about where it is.
    #[test]
    fn the_sun_is_spread_about_its_place() {
        for size in SkyPatches::SIZES {
            let dome = dome(size);
            let direction = [0.48, -0.64, 0.6];
            let sun = dome.sun(direction, 900.0);
            let sum: f64 = sun.iter().map(|&(patch, radiance)| radiance * dome.solid_angles[patch - 1]).sum();
            assert!((sum - 900.0).abs() < 1e-9 && sun.len() == SUN_PATCHES);
            let own = dome.patches.of(direction).unwrap() as usize + 1;
            assert!(sun.iter().any(|&(patch, _)| patch == own));
            let along: f64 = sun
                .iter()
                .map(|&(patch, radiance)| {
                    let cosine: f64 = dome.middles[patch - 1].iter().zip(direction).map(|(x, y)| x * y).sum();
                    radiance * dome.solid_angles[patch - 1] * cosine
                })
                .sum();
            assert!(along / 900.0 > 0.98, "{size}: {along}");
        }
    }
}
