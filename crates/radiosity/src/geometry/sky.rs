//! The sky in patches of nearly equal solid angle, by the direction in which rays leave a scene.
//!
//! P. R. Tregenza divides the sky in seven bands of 12° and a cap at the zenith, 145 patches (*Subdivision of the sky hemisphere for
//! luminance measurements*, Lighting Research and Technology 19 (1987) 13–14). C. F. Reinhart divides each of these in m × m, but for
//! the cap: 144·m² + 1 patches in 7·m bands of the height 90°/(7·m + ½).
//!
//! Patches are numbered from the horizon up; within a band from the north (+y) over the east (+x), the first patch centred on the
//! north. The zenith is +z, and the cap the last patch.

use std::f64::consts::{FRAC_PI_2, TAU};

/// Patches of Tregenza's bands, from the horizon up.
const TREGENZA: [u32; 7] = [30, 30, 24, 24, 18, 12, 6];

/// A division of the sky.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyPatches {
    /// The sine of the altitude where each band begins, and of that where the cap does.
    edges: Vec<f64>,
    /// The patches of each band, and of the cap.
    counts: Vec<u32>,
    /// The number of the first patch of each.
    firsts: Vec<u32>,
}

impl SkyPatches {
    /// The numbers of patches that a division may have: 144·m² + 1 for m = 1, 2, 4.
    pub const SIZES: [u32; 3] = [145, 577, 2305];

    /// The division of the sky into `patches` patches; `None` where [`SkyPatches::SIZES`] lacks the number.
    pub fn new(patches: u32) -> Option<Self> {
        let m = [1, 2, 4][SkyPatches::SIZES.iter().position(|&size| size == patches)?];
        let bands = TREGENZA.iter().flat_map(|&count| std::iter::repeat_n(m * count, m as usize));
        let counts: Vec<u32> = bands.chain([1]).collect();
        let height = FRAC_PI_2 / (f64::from(7 * m) + 0.5);
        let edges = (0..counts.len()).map(|band| (height * band as f64).sin()).collect();
        let firsts = counts.iter().scan(0, |next, count| {
            *next += count;
            Some(*next - count)
        });
        Some(SkyPatches { edges, firsts: firsts.collect(), counts })
    }

    /// How many patches there are.
    pub fn count(&self) -> usize {
        self.counts.iter().sum::<u32>() as usize
    }

    /// The patch in a direction of any length; `None` below the horizon.
    pub fn of(&self, [x, y, z]: [f64; 3]) -> Option<u32> {
        let sine = z / (x * x + y * y + z * z).sqrt();
        let band = self.edges.partition_point(|&edge| edge <= sine).checked_sub(1)?;
        let count = self.counts[band];
        let turn = x.atan2(y) / TAU + 0.5 / f64::from(count);
        let place = (turn.rem_euclid(1.0) * f64::from(count)) as u32;
        Some(self.firsts[band] + place.min(count - 1))
    }

    /// The sines of the altitudes and the azimuths [rad] between which a patch lies; the cap goes all round.
    pub fn bounds(&self, patch: u32) -> [[f64; 2]; 2] {
        let band = self.firsts.partition_point(|&first| first <= patch) - 1;
        let (count, place) = (f64::from(self.counts[band]), f64::from(patch - self.firsts[band]));
        let sines = [self.edges[band], self.edges.get(band + 1).copied().unwrap_or(1.0)];
        [sines, [-0.5, 0.5].map(|side| TAU * (place + side) / count)]
    }

    /// The solid angle of each patch [sr].
    pub fn solid_angles(&self) -> Vec<f64> {
        self.each_band(|low, high| TAU * (high - low))
    }

    /// What a horizontal plane sees of each patch in an open landscape: the integral of cos θ/π, its form factor.
    pub fn horizontal_factors(&self) -> Vec<f64> {
        self.each_band(|low, high| high * high - low * low)
    }

    /// A number of each patch, which is a part of its band's, given by the sines of the altitudes of the band.
    fn each_band(&self, of: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let tops = self.edges[1..].iter().copied().chain([1.0]);
        let bands = self.edges.iter().zip(tops).zip(&self.counts);
        bands
            .flat_map(|((&low, high), &count)| {
                std::iter::repeat_n(of(low, high) / f64::from(count), count as usize)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solid_angles_and_factors_add_up() {
        for size in SkyPatches::SIZES {
            let sky = SkyPatches::new(size).unwrap();
            assert_eq!(sky.count(), size as usize);
            assert!((sky.solid_angles().iter().sum::<f64>() - TAU).abs() < 1e-12);
            assert!((sky.horizontal_factors().iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert_eq!(SkyPatches::new(146), None);
        // Tregenza's patches differ by less than a sixth from the mean (Tregenza 1987, table 1).
        let angles = SkyPatches::new(145).unwrap().solid_angles();
        assert!(angles.iter().all(|angle| (angle * 145.0 / TAU - 1.0).abs() < 0.25), "{angles:?}");
    }

    /// Numbers run from the north over the east, the first patch being centred on the north.
    #[test]
    fn directions_find_their_patches() {
        let sky = SkyPatches::new(145).unwrap();
        let at = |altitude: f64, azimuth: f64| {
            let [(sin, cos), (east, north)] =
                [altitude, azimuth].map(|degrees| degrees.to_radians().sin_cos());
            sky.of([3.0 * cos * east, 3.0 * cos * north, 3.0 * sin])
        };
        assert_eq!((at(6.0, 0.0), at(6.0, 5.9), at(6.0, -5.9)), (Some(0), Some(0), Some(0)));
        assert_eq!((at(6.0, 6.1), at(6.0, 354.1), at(6.0, 90.0)), (Some(1), Some(0), Some(8)));
        assert_eq!((at(11.9, 348.0), at(12.1, 0.0), at(30.0, 0.0)), (Some(29), Some(30), Some(60)));
        assert_eq!((at(83.9, 0.0), at(84.1, 200.0), at(90.0, 0.0)), (Some(138), Some(144), Some(144)));
        assert_eq!((at(-0.1, 0.0), at(0.0, 0.0)), (None, Some(0)));
    }

    /// The middle of each patch is in it, and its bounds span its solid angle.
    #[test]
    fn bounds_are_those_of_directions() {
        for size in SkyPatches::SIZES {
            let sky = SkyPatches::new(size).unwrap();
            for (patch, angle) in (0..size).zip(sky.solid_angles()) {
                let [[low, high], [from, to]] = sky.bounds(patch);
                assert!(((high - low) * (to - from) - angle).abs() < 1e-12);
                let ((sine, azimuth), along) =
                    ((0.5 * (low + high), 0.5 * (from + to)), |s: f64| 1.0 - s * s);
                let flat = along(sine).sqrt();
                assert_eq!(sky.of([flat * azimuth.sin(), flat * azimuth.cos(), sine]), Some(patch));
            }
        }
    }
}
