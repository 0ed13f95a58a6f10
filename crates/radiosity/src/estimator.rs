//! Estimators: what a walk scores, and where.
//!
//! A shooting walk scores on the patches it meets; a gathering walk on the patch it was born on, by the
//! emittances it meets; in each of C channels. Scores are whole numbers of units: hits for grey analog shooting,
//! else 2⁻⁴⁰ of the largest single score (2⁻²⁴ where fourth powers are summed, which would not fit otherwise).

use std::marker::PhantomData;

use crate::rng::WalkRng;
use crate::tally::{Scoreboard, Word};

/// Units of fixed-point scores in the largest single score, for boards of so many power sums.
pub(crate) const fn fixed_units(moments: usize) -> f64 {
    let bits = if moments <= 2 { 40 } else { 24 };
    (1_u64 << bits) as f64
}

/// Scores the events of one walk after another, C channels at a time.
pub trait Estimator<const C: usize> {
    /// Walk number `walk` was born on patch `birth`; what follows belongs to it.
    fn begin(&mut self, walk: u64, birth: u32);
    /// It arrived at an active side of `patch` with these weights.
    fn arrival(&mut self, _patch: u32, _weights: [f64; C]) {}
    /// It survived that hit.
    fn survival(&mut self, _patch: u32, _weights: [f64; C]) {}
    /// It was absorbed there.
    fn death(&mut self, _patch: u32, _weights: [f64; C]) {}
    /// It has ended.
    fn end(&mut self, _rng: &mut WalkRng) {}
}

/// Which event of a walk scores.
pub(crate) trait Event {
    const ARRIVAL: bool = false;
    const SURVIVAL: bool = false;
    const DEATH: bool = false;
}

/// Every hit scores (S97 §2.4, §3.4).
pub(crate) struct Collision;
/// Every hit but the last scores (S97 §2.3, §3.3).
pub(crate) struct Survival;
/// The absorption scores (S97 §2.2, §3.2).
pub(crate) struct Absorption;

impl Event for Collision {
    const ARRIVAL: bool = true;
}
impl Event for Survival {
    const SURVIVAL: bool = true;
}
impl Event for Absorption {
    const DEATH: bool = true;
}

/// Grey analog shooting: one unit for each event, on the patch where it happens.
pub(crate) struct ShootHits<'a, V, const M: usize> {
    board: &'a mut Scoreboard<u64, (), 1, M>,
    walk: u64,
    event: PhantomData<V>,
}

impl<'a, V, const M: usize> ShootHits<'a, V, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u64, (), 1, M>) -> Self {
        ShootHits { board, walk: 0, event: PhantomData }
    }
}

impl<V: Event, const M: usize> Estimator<1> for ShootHits<'_, V, M> {
    #[inline(always)]
    fn begin(&mut self, walk: u64, _: u32) {
        self.walk = walk;
    }

    #[inline(always)]
    fn arrival(&mut self, patch: u32, _: [f64; 1]) {
        if V::ARRIVAL {
            self.board.add(self.walk, patch, [1]);
        }
    }

    #[inline(always)]
    fn survival(&mut self, patch: u32, _: [f64; 1]) {
        if V::SURVIVAL {
            self.board.add(self.walk, patch, [1]);
        }
    }

    #[inline(always)]
    fn death(&mut self, patch: u32, _: [f64; 1]) {
        if V::DEATH {
            self.board.add(self.walk, patch, [1]);
        }
    }
}

/// Weighted shooting: the weights at each event, on the patch it happens on (SInf eq. 1 for arrivals). Rounding
/// to 2⁻⁴⁰ is below 10⁻⁹ of the smallest weight that a threshold of 0.001 leaves.
pub(crate) struct ShootWeights<'a, V, const C: usize, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, C, M>,
    walk: u64,
    event: PhantomData<V>,
}

impl<'a, V, const C: usize, const M: usize> ShootWeights<'a, V, C, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, C, M>) -> Self {
        ShootWeights { board, walk: 0, event: PhantomData }
    }

    #[inline(always)]
    fn score(&mut self, patch: u32, weights: [f64; C]) {
        let units = weights.map(|weight| u128::from_units(weight * fixed_units(M) + 0.5));
        self.board.add(self.walk, patch, units);
        self.board.count(patch);
    }
}

impl<V: Event, const C: usize, const M: usize> Estimator<C> for ShootWeights<'_, V, C, M> {
    #[inline(always)]
    fn begin(&mut self, walk: u64, _: u32) {
        self.walk = walk;
    }

    #[inline(always)]
    fn arrival(&mut self, patch: u32, weights: [f64; C]) {
        if V::ARRIVAL {
            self.score(patch, weights);
        }
    }

    #[inline(always)]
    fn survival(&mut self, patch: u32, weights: [f64; C]) {
        if V::SURVIVAL {
            self.score(patch, weights);
        }
    }

    #[inline(always)]
    fn death(&mut self, patch: u32, weights: [f64; C]) {
        if V::DEATH {
            self.score(patch, weights);
        }
    }
}

/// A score of a walk in whole units: rounded to a neighbouring one at random, without bias. An emitter may be
/// 10⁻¹² of another, and its light must not vanish.
#[inline(always)]
fn dithered<const M: usize>(score: f64, rng: &mut WalkRng) -> u128 {
    let [dither, _] = rng.pair();
    u128::from_units(score * fixed_units(M) + dither)
}

/// Gathering: the value of each event's patch times the weight there, on the patch of birth.
pub(crate) struct Gather<'a, V, const C: usize, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, C, M>,
    /// What an event on each patch is worth, over the largest of these values in its channel.
    values: &'a [[f64; C]],
    walk: u64,
    birth: u32,
    scores: [f64; C],
    event: PhantomData<V>,
}

impl<'a, V, const C: usize, const M: usize> Gather<'a, V, C, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, C, M>, values: &'a [[f64; C]]) -> Self {
        Gather { board, values, walk: 0, birth: 0, scores: [0.0; C], event: PhantomData }
    }

    #[inline(always)]
    fn score(&mut self, patch: u32, weights: [f64; C]) {
        let values = self.values[patch as usize];
        for ((score, weight), value) in self.scores.iter_mut().zip(weights).zip(values) {
            *score += weight * value;
        }
    }
}

impl<V: Event, const C: usize, const M: usize> Estimator<C> for Gather<'_, V, C, M> {
    #[inline(always)]
    fn begin(&mut self, walk: u64, birth: u32) {
        (self.walk, self.birth, self.scores) = (walk, birth, [0.0; C]);
        self.board.count(birth);
    }

    #[inline(always)]
    fn arrival(&mut self, patch: u32, weights: [f64; C]) {
        if V::ARRIVAL {
            self.score(patch, weights);
        }
    }

    #[inline(always)]
    fn survival(&mut self, patch: u32, weights: [f64; C]) {
        if V::SURVIVAL {
            self.score(patch, weights);
        }
    }

    #[inline(always)]
    fn death(&mut self, patch: u32, weights: [f64; C]) {
        if V::DEATH {
            self.score(patch, weights);
        }
    }

    #[inline(always)]
    fn end(&mut self, rng: &mut WalkRng) {
        if self.scores.iter().any(|&score| score > 0.0) {
            let units = self.scores.map(|score| dithered::<M>(score, rng));
            self.board.add(self.walk, self.birth, units);
        }
    }
}

/// The scores of [`ShootRelated`] and [`GatherRelated`], in this order: collision, absorption, survival, and the
/// sum of the last two, whose square tells their covariance.
pub(crate) const RELATED: usize = 4;

/// Collision, absorption and survival shooting of the same grey walks, in hits.
pub(crate) struct ShootRelated<'a, const M: usize> {
    board: &'a mut Scoreboard<u64, (), RELATED, M>,
    walk: u64,
}

impl<'a, const M: usize> ShootRelated<'a, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u64, (), RELATED, M>) -> Self {
        ShootRelated { board, walk: 0 }
    }
}

impl<const M: usize> Estimator<1> for ShootRelated<'_, M> {
    fn begin(&mut self, walk: u64, _: u32) {
        self.walk = walk;
    }

    fn survival(&mut self, patch: u32, _: [f64; 1]) {
        self.board.add(self.walk, patch, [1, 0, 1, 1]);
    }

    fn death(&mut self, patch: u32, _: [f64; 1]) {
        self.board.add(self.walk, patch, [1, 1, 0, 1]);
    }
}

/// Collision, absorption and survival gathering of the same grey walks.
pub(crate) struct GatherRelated<'a, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, RELATED, M>,
    /// What an arrival, a death, a survival on each patch is worth, over the largest of all these values.
    values: &'a [[f64; 3]],
    walk: u64,
    birth: u32,
    scores: [f64; 3],
}

impl<'a, const M: usize> GatherRelated<'a, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, RELATED, M>, values: &'a [[f64; 3]]) -> Self {
        GatherRelated { board, values, walk: 0, birth: 0, scores: [0.0; 3] }
    }
}

impl<const M: usize> Estimator<1> for GatherRelated<'_, M> {
    fn begin(&mut self, walk: u64, birth: u32) {
        (self.walk, self.birth, self.scores) = (walk, birth, [0.0; 3]);
        self.board.count(birth);
    }

    fn arrival(&mut self, patch: u32, _: [f64; 1]) {
        self.scores[0] += self.values[patch as usize][0];
    }

    fn death(&mut self, patch: u32, _: [f64; 1]) {
        self.scores[1] += self.values[patch as usize][1];
    }

    fn survival(&mut self, patch: u32, _: [f64; 1]) {
        self.scores[2] += self.values[patch as usize][2];
    }

    fn end(&mut self, rng: &mut WalkRng) {
        if self.scores[0] > 0.0 {
            let [collision, absorption, survival] = self.scores.map(|score| dithered::<M>(score, rng));
            self.board.add(self.walk, self.birth, [collision, absorption, survival, absorption + survival]);
        }
    }
}
