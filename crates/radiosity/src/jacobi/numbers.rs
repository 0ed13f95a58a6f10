//! The numbers that rays of chains are made of: four of 32 bits each, two for the place, two for the direction.

use crate::random::rng::WalkRng;
use crate::random::sobol::{DIMENSIONS, Points, Sobol, scramble};
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};

/// Numbers for the rays of a batch, face by face.
pub(crate) trait RayNumbers {
    /// The next rays leave face `face`, which has already shot `shot` rays.
    fn leave(&mut self, face: u32, shot: u32);

    /// Draws the next ray of the face, which is number `i` of the batch.
    fn draw(&mut self, i: usize);

    /// The numbers of the whole batch, a row for each dimension.
    fn points(&mut self, isa: Isa) -> &Points;

    /// The chain's own generator, for whatever else is left to chance.
    fn rng(&mut self) -> &mut WalkRng;
}

/// The n-th ray of a face is the n-th point of the face's own scrambled Sobol sequence, whenever it is shot.
#[derive(Clone)]
pub(crate) struct SobolNumbers {
    /// Tells this chain's scramblings from those of others.
    key: u64,
    rng: WalkRng,
    sequence: Sobol,
    seeds_of_face: [u32; DIMENSIONS],
    points: Points,
    seeds: Points,
}

impl SobolNumbers {
    pub(crate) fn new(mut rng: WalkRng) -> Self {
        SobolNumbers {
            key: rng.bits(),
            rng,
            sequence: Sobol::at(0),
            seeds_of_face: [0; DIMENSIONS],
            points: [[0; WIDTH]; DIMENSIONS],
            seeds: [[0; WIDTH]; DIMENSIONS],
        }
    }

    /// Numbers with a scrambling of their own.
    pub(super) fn independent(rng: &mut WalkRng) -> Self {
        let numbers = SobolNumbers::new(rng.clone());
        rng.bits();
        numbers
    }
}

impl RayNumbers for SobolNumbers {
    fn leave(&mut self, face: u32, shot: u32) {
        self.sequence = Sobol::at(shot);
        self.seeds_of_face = seeds(self.key, face);
    }

    #[inline(always)]
    fn draw(&mut self, i: usize) {
        let numbers = self.sequence.next().into_iter().zip(self.seeds_of_face);
        for ((points, seeds), (number, seed)) in self.points.iter_mut().zip(&mut self.seeds).zip(numbers) {
            (points[i], seeds[i]) = (number, seed);
        }
    }

    fn points(&mut self, isa: Isa) -> &Points {
        let (points, seeds) = (&mut self.points, &self.seeds);
        on_isa!(isa, scramble(points: &mut Points, seeds: &Points));
        &self.points
    }

    fn rng(&mut self) -> &mut WalkRng {
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

/// Independent numbers, as walks draw them.
pub(crate) struct RandomNumbers {
    rng: WalkRng,
    points: Points,
}

impl RandomNumbers {
    pub(crate) fn new(rng: WalkRng) -> Self {
        RandomNumbers { rng, points: [[0; WIDTH]; DIMENSIONS] }
    }
}

impl RayNumbers for RandomNumbers {
    fn leave(&mut self, _face: u32, _shot: u32) {}

    #[inline(always)]
    fn draw(&mut self, i: usize) {
        let halves = [self.rng.bits(), self.rng.bits()].map(|bits| [(bits >> 32) as u32, bits as u32]);
        for (row, &number) in self.points.iter_mut().zip(halves.as_flattened()) {
            row[i] = number;
        }
    }

    fn points(&mut self, _isa: Isa) -> &Points {
        &self.points
    }

    fn rng(&mut self) -> &mut WalkRng {
        &mut self.rng
    }
}
