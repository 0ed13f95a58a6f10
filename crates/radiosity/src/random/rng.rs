//! Random numbers: the walk is the random unit.
//!
//! One PCG64-DXSM sequence per job, its (state, increment) hashed from the seed. Walk n starts n·G draws
//! into it, G = 0x9E3779B97F4A7C15F39CC0605CEDC835 (2¹²⁸ over the golden ratio, odd): N walks are disjoint
//! while each draws fewer than 2¹²⁸/(√5·N) numbers, and from walk n to n + 1 is one constant affine map.

use rand_pcg::Pcg64Dxsm;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;

/// The "cheap" multiplier of PCG64-DXSM.
const MULTIPLIER: u64 = 0xDA94_2042_E4DD_58B5;

/// The distance between the starts of consecutive walks, in draws.
const WALK_STRIDE: u128 = 0x9E37_79B9_7F4A_7C15_F39C_C060_5CED_C835;

/// s ↦ mul·s + add on the 128-bit state: any number of steps of the generator at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Jump {
    mul: u128,
    add: u128,
}

impl Jump {
    /// `steps` steps of a generator with this increment, by repeated squaring (Brown 1994).
    fn new(increment: u128, mut steps: u128) -> Self {
        let mut jump = Jump { mul: 1, add: 0 };
        let mut doubled = Jump { mul: u128::from(MULTIPLIER), add: increment };
        while steps > 0 {
            if steps & 1 == 1 {
                jump = Jump { mul: jump.mul.wrapping_mul(doubled.mul), add: doubled.apply(jump.add) };
            }
            doubled = Jump { mul: doubled.mul.wrapping_mul(doubled.mul), add: doubled.apply(doubled.add) };
            steps >>= 1;
        }
        jump
    }

    #[inline]
    fn apply(self, state: u128) -> u128 {
        self.mul.wrapping_mul(state).wrapping_add(self.add)
    }
}

/// The sequence of one job: hands out the generator of any walk.
///
/// ```
/// use radiosity::Sequence;
///
/// let sequence = Sequence::new(7);
/// let mut third = sequence.walks_from(1).nth(2).expect("walks have no end");
/// assert_eq!(third.bits(), sequence.walk(3).bits());
/// ```
#[derive(Clone, Debug)]
pub struct Sequence {
    state: u128,
    increment: u128,
    next_walk: Jump,
}

impl Sequence {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        let mut hash = Pcg64Dxsm::seed_from_u64(seed);
        let mut word = || u128::from(hash.next_u64()) << 64 | u128::from(hash.next_u64());
        let (state, increment) = (word(), word() | 1);
        Sequence { state, increment, next_walk: Jump::new(increment, WALK_STRIDE) }
    }

    /// Whether this is the sequence of a seed.
    pub(crate) fn is_of(&self, seed: u64) -> bool {
        let Sequence { state, increment, .. } = Sequence::new(seed);
        (self.state, self.increment) == (state, increment)
    }

    /// The generator at the start of walk `n`.
    pub fn walk(&self, n: u64) -> WalkRng {
        let jump = Jump::new(self.increment, WALK_STRIDE.wrapping_mul(u128::from(n)));
        WalkRng { state: jump.apply(self.state), increment: self.increment }
    }

    /// The generators of walks `first`, `first` + 1, …, one affine step apart.
    pub fn walks_from(&self, first: u64) -> impl Iterator<Item = WalkRng> + '_ {
        std::iter::successors(Some(self.walk(first)), |walk| {
            Some(WalkRng { state: self.next_walk.apply(walk.state), increment: walk.increment })
        })
    }
}

/// The numbers that walks are made of, for a batch of walks side by side.
pub(crate) trait Numbers {
    /// Where a walk is in them.
    type Place;
    /// Walk `lane` goes on from there.
    fn set(&mut self, lane: usize, place: &Self::Place);
    /// Where walk `lane` is.
    fn get(&self, lane: usize) -> Self::Place;
    /// Puts walk `from` in place of walk `to`.
    fn copy(&mut self, from: usize, to: usize);
    /// What every walk draws at its birth: source, cell, point, direction.
    fn births(&mut self, isa: Isa, draws: &mut [[u64; WIDTH]; 4]);
    /// What every walk draws at an arrival: survival, point, direction.
    fn arrivals(&mut self, isa: Isa, draws: &mut [[u64; WIDTH]; 3]);
    /// For what is left to chance when walk `lane` ends.
    fn chance(&self, lane: usize) -> WalkRng;
}

/// The random numbers of one walk.
///
/// ```
/// use radiosity::Sequence;
///
/// let [u, v] = Sequence::new(7).walk(0).pair();
/// assert!(0.0 < u && u < 1.0 && 0.0 < v && v < 1.0);
/// ```
#[derive(Clone, Debug)]
pub struct WalkRng {
    state: u128,
    increment: u128,
}

impl WalkRng {
    /// The next 64 random bits (the same as `rand_pcg::Pcg64Dxsm` gives from this state).
    #[inline(always)]
    pub fn bits(&mut self) -> u64 {
        let (mut hi, lo) = ((self.state >> 64) as u64, self.state as u64 | 1);
        hi ^= hi >> 32;
        hi = hi.wrapping_mul(MULTIPLIER);
        hi ^= hi >> 48;
        self.state = self.state.wrapping_mul(u128::from(MULTIPLIER)).wrapping_add(self.increment);
        hi.wrapping_mul(lo)
    }

    /// Two independent uniforms in (0, 1) from one draw, each at the middle of one of 2³² equal cells: the
    /// discretisation is unbiased for linear functions and never touches an edge.
    #[inline(always)]
    pub fn pair(&mut self) -> [f64; 2] {
        let bits = self.bits();
        [unit_32((bits >> 32) as u32), unit_32(bits as u32)]
    }
}

/// The generators of a batch of walks, each half of their states side by side.
#[derive(Clone, Debug)]
pub(crate) struct Generators {
    increment: u128,
    high: [u64; WIDTH],
    low: [u64; WIDTH],
}

impl Generators {
    /// For walks of one sequence.
    pub(crate) fn new(sequence: &Sequence) -> Self {
        Generators { increment: sequence.increment, high: [0; WIDTH], low: [0; WIDTH] }
    }

    /// The next 64 bits of every walk, once for each row.
    fn draw(&mut self, isa: Isa, rows: &mut [[u64; WIDTH]]) {
        for row in rows {
            let generators = &mut *self;
            on_isa!(isa, draw(generators: &mut Generators, row: &mut [u64; WIDTH]));
        }
    }
}

impl Numbers for Generators {
    type Place = WalkRng;

    #[inline(always)]
    fn set(&mut self, lane: usize, walk: &WalkRng) {
        self.high[lane] = (walk.state >> 64) as u64;
        self.low[lane] = walk.state as u64;
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> WalkRng {
        let state = u128::from(self.high[lane]) << 64 | u128::from(self.low[lane]);
        WalkRng { state, increment: self.increment }
    }

    #[inline(always)]
    fn copy(&mut self, from: usize, to: usize) {
        self.high[to] = self.high[from];
        self.low[to] = self.low[from];
    }

    fn births(&mut self, isa: Isa, draws: &mut [[u64; WIDTH]; 4]) {
        self.draw(isa, draws);
    }

    fn arrivals(&mut self, isa: Isa, draws: &mut [[u64; WIDTH]; 3]) {
        self.draw(isa, draws);
    }

    #[inline(always)]
    fn chance(&self, lane: usize) -> WalkRng {
        self.get(lane)
    }
}

/// [`WalkRng::bits`] for each walk.
#[inline(always)]
fn draw<R: Real>(generators: &mut Generators, row: &mut [u64; WIDTH]) {
    if R::MULTIPLIES_HALVES {
        draw_by_halves(generators, row);
    } else {
        for (lane, bits) in row.iter_mut().enumerate() {
            let mut walk = generators.get(lane);
            *bits = walk.bits();
            generators.set(lane, &walk);
        }
    }
}

/// [`draw`] in halves of words.
#[inline(always)]
fn draw_by_halves(generators: &mut Generators, row: &mut [u64; WIDTH]) {
    // The lower half of a word.
    const HALF: u64 = 0xFFFF_FFFF;
    let [add_high, add_low] = [(generators.increment >> 64) as u64, generators.increment as u64];
    let states = generators.high.iter_mut().zip(&mut generators.low);
    for ((high, low), bits) in states.zip(row) {
        let mut mixed = *high ^ (*high >> 32);
        mixed = mixed.wrapping_mul(MULTIPLIER);
        mixed ^= mixed >> 48;
        *bits = mixed.wrapping_mul(*low | 1);

        let (m1, m0) = (MULTIPLIER >> 32, MULTIPLIER & HALF);
        let (l1, l0) = (*low >> 32, *low & HALF);
        let (l0m0, l1m0, l0m1) = (l0 * m0, l1 * m0, l0 * m1);
        let middle = (l0m0 >> 32) + (l1m0 & HALF) + (l0m1 & HALF);
        let carried = l1 * m1 + (l1m0 >> 32) + (l0m1 >> 32) + (middle >> 32);
        let product_low = middle << 32 | l0m0 & HALF;
        *low = product_low.wrapping_add(add_low);
        let carry = u64::from(*low < add_low);
        *high =
            high.wrapping_mul(MULTIPLIER).wrapping_add(carried).wrapping_add(add_high).wrapping_add(carry);
    }
}

/// The middle of cell `k` of the 2³² that divide [0, 1).
#[inline(always)]
pub(crate) fn unit_32(k: u32) -> f64 {
    unit(f64::from(k))
}

/// The middles of cells number `k` of the 2³² that divide [0, 1).
#[inline(always)]
pub(crate) fn unit<R: Real>(k: R) -> R {
    (k + R::splat(0.5)) * R::splat(1.0 / 4_294_967_296.0)
}

/// Two uniforms in (0, 1) from each of N draws.
#[inline(always)]
pub(crate) fn units<R: Real>(bits: &[u64]) -> [R; 2] {
    R::load_halves(bits).map(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_those_of_rand_pcg() {
        let ours = Sequence::new(42);
        // `Pcg64Dxsm::new` steps once from state + increment; undo that by starting one step earlier.
        let back = Jump::new(ours.increment, u128::MAX);
        let before = back.apply(ours.state).wrapping_sub(ours.increment);
        let mut judge = Pcg64Dxsm::new(before, ours.increment >> 1);
        for n in [0_u64, 1, 2, 1_000_003] {
            let mut expected = judge.clone();
            expected.advance(WALK_STRIDE.wrapping_mul(u128::from(n)));
            let mut walk = ours.walk(n);
            for _ in 0..100 {
                assert_eq!(walk.bits(), expected.next_u64());
            }
        }
        judge.advance(1);
    }

    #[test]
    fn a_batch_draws_what_its_walks_would() {
        for isa in Isa::available() {
            let sequence = Sequence::new(42);
            let mut generators = Generators::new(&sequence);
            let mut walks: Vec<WalkRng> = sequence.walks_from(99).take(WIDTH).collect();
            walks.iter().enumerate().for_each(|(lane, walk)| generators.set(lane, walk));
            for _ in 0..100 {
                let mut draws = [[0; WIDTH]; 3];
                generators.arrivals(isa, &mut draws);
                for (lane, walk) in walks.iter_mut().enumerate() {
                    assert_eq!(draws.map(|row| row[lane]), [walk.bits(), walk.bits(), walk.bits()]);
                }
            }
        }
    }

    #[test]
    fn consecutive_walks_are_one_affine_step_apart() {
        let sequence = Sequence::new(7);
        for (n, mut walk) in (123..).zip(sequence.walks_from(123)).take(50) {
            assert_eq!(walk.bits(), sequence.walk(n).bits());
        }
    }

    /// The low k bits of the state run through all 2^k values from walk to walk, as only an odd distance makes
    /// them do; at a distance of 2⁶⁴ draws all walks would have the low half in common for ever.
    #[test]
    fn neighbouring_walks_have_no_low_bits_in_common() {
        let sequence = Sequence::new(3);
        let low: std::collections::HashSet<u8> =
            sequence.walks_from(0).take(256).map(|walk| walk.state as u8).collect();
        assert_eq!(low.len(), 256);
    }

    #[test]
    fn seeds_give_unlike_sequences() {
        let seeds = (0..1000).chain((10..64).map(|bit| 1 << bit));
        let firsts: Vec<u64> = seeds.map(|seed| Sequence::new(seed).walk(0).bits()).collect();
        let distinct: std::collections::HashSet<_> = firsts.iter().collect();
        assert_eq!(distinct.len(), firsts.len());
    }
}
