//! The numbers that rays of chains are made of: four of 32 bits each, two for the place, two for the direction.

use crate::random::rng::WalkRng;
use crate::random::sobol::{DIMENSIONS, Points, Sobol, scramble};
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};

/// Numbers for the rays of a batch, face by face.
#[derive(Clone)]
pub(crate) struct RayNumbers {
    rng: WalkRng,
    points: Points,
    /// None where numbers are independent, as walks draw them.
    sobol: Option<FaceSequences>,
}

/// The n-th ray of a face is the n-th point of the face's own scrambled Sobol sequence, whenever it is shot.
#[derive(Clone)]
struct FaceSequences {
    /// Tells this chain's scramblings from those of others.
    key: u64,
    sequence: Sobol,
    seeds_of_face: [u32; DIMENSIONS],
    seeds: Points,
}

/// A row for each dimension.
const NO_POINTS: Points = [[0; WIDTH]; DIMENSIONS];

impl RayNumbers {
    /// Numbers of Sobol sequences.
    pub(crate) fn sobol(mut rng: WalkRng) -> Self {
        let key = rng.bits();
        let sequences =
            FaceSequences { key, sequence: Sobol::at(0), seeds_of_face: [0; DIMENSIONS], seeds: NO_POINTS };
        RayNumbers { rng, points: NO_POINTS, sobol: Some(sequences) }
    }

    /// Numbers of Sobol sequences with a scrambling of their own.
    pub(super) fn independent(rng: &mut WalkRng) -> Self {
        let numbers = RayNumbers::sobol(rng.clone());
        rng.bits();
        numbers
    }

    /// Independent numbers.
    pub(crate) fn random(rng: WalkRng) -> Self {
        RayNumbers { rng, points: NO_POINTS, sobol: None }
    }

    /// The next rays leave face `face`, which has already shot `shot` rays.
    pub(super) fn leave(&mut self, face: u32, shot: u32) {
        if let Some(sobol) = &mut self.sobol {
            sobol.sequence = Sobol::at(shot);
            sobol.seeds_of_face = seeds(sobol.key, face);
        }
    }

    /// Draws the next ray of the face, which is number `i` of the batch.
    #[inline(always)]
    pub(super) fn draw(&mut self, i: usize) {
        let Some(sobol) = &mut self.sobol else {
            let halves = [self.rng.bits(), self.rng.bits()].map(|bits| [(bits >> 32) as u32, bits as u32]);
            for (row, &number) in self.points.iter_mut().zip(halves.as_flattened()) {
                row[i] = number;
            }
            return;
        };
        let numbers = sobol.sequence.next().into_iter().zip(sobol.seeds_of_face);
        for ((points, seeds), (number, seed)) in self.points.iter_mut().zip(&mut sobol.seeds).zip(numbers) {
            (points[i], seeds[i]) = (number, seed);
        }
    }

    /// The numbers of the whole batch, a row for each dimension.
    pub(super) fn points(&mut self, isa: Isa) -> &Points {
        if let Some(FaceSequences { seeds, .. }) = &self.sobol {
            let points = &mut self.points;
            on_isa!(isa, scramble(points: &mut Points, seeds: &Points));
        }
        &self.points
    }

    /// The chain's own generator, for whatever else is left to chance.
    pub(super) fn rng(&mut self) -> &mut WalkRng {
        &mut self.rng
    }
}

/// Mixes 64 bits (the finaliser of SplitMix64).
#[inline(always)]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A seed per dimension for the rays of one face.
fn seeds(key: u64, face: u32) -> [u32; DIMENSIONS] {
    let a = mix(key ^ mix(u64::from(face).wrapping_mul(0x9E37_79B9_7F4A_7C15)));
    let b = mix(a ^ 0xD1B5_4A32_D192_ED03);
    [a as u32, (a >> 32) as u32, b as u32, (b >> 32) as u32]
}
