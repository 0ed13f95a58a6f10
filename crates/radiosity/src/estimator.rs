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

/// Scores the events of walks, C channels at a time.
pub trait Estimator<const C: usize> {
    /// What one walk has scored so far.
    type Score: Default;
    /// A walk was born on patch `birth`; what follows belongs to it.
    fn begin(&mut self, score: &mut Self::Score, birth: u32);
    /// It arrived at an active side of `patch` with these weights.
    fn arrival(&mut self, _score: &mut Self::Score, _patch: u32, _weights: [f64; C]) {}
    /// It survived that hit.
    fn survival(&mut self, _score: &mut Self::Score, _patch: u32, _weights: [f64; C]) {}
    /// It was absorbed there.
    fn death(&mut self, _score: &mut Self::Score, _patch: u32, _weights: [f64; C]) {}
    /// It has ended.
    fn end(&mut self, score: &mut Self::Score, rng: &mut WalkRng);
}

/// The patches that a walk scored on, and what: units U each.
#[derive(Clone, Debug)]
pub struct Path<U> {
    patches: Vec<u32>,
    units: Vec<U>,
}

impl<U> Default for Path<U> {
    fn default() -> Self {
        Path { patches: Vec::new(), units: Vec::new() }
    }
}

impl<U> Path<U> {
    #[inline(always)]
    fn push(&mut self, patch: u32, units: U) {
        self.patches.push(patch);
        self.units.push(units);
    }

    fn clear(&mut self) {
        self.patches.clear();
        self.units.clear();
    }
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
    event: PhantomData<V>,
}

impl<'a, V, const M: usize> ShootHits<'a, V, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u64, (), 1, M>) -> Self {
        ShootHits { board, event: PhantomData }
    }

    #[inline(always)]
    fn score(&mut self, path: &mut Path<()>, patch: u32) {
        self.board.prefetch(patch);
        path.push(patch, ());
    }
}

impl<V: Event, const M: usize> Estimator<1> for ShootHits<'_, V, M> {
    type Score = Path<()>;

    #[inline(always)]
    fn begin(&mut self, path: &mut Path<()>, _: u32) {
        path.clear();
    }

    #[inline(always)]
    fn arrival(&mut self, path: &mut Path<()>, patch: u32, _: [f64; 1]) {
        if V::ARRIVAL {
            self.score(path, patch);
        }
    }

    #[inline(always)]
    fn survival(&mut self, path: &mut Path<()>, patch: u32, _: [f64; 1]) {
        if V::SURVIVAL {
            self.score(path, patch);
        }
    }

    #[inline(always)]
    fn death(&mut self, path: &mut Path<()>, patch: u32, _: [f64; 1]) {
        if V::DEATH {
            self.score(path, patch);
        }
    }

    #[inline(always)]
    fn end(&mut self, path: &mut Path<()>, _: &mut WalkRng) {
        self.board.add_path(&path.patches, |_| [1]);
    }
}

/// Weighted shooting: the weights at each event, on the patch it happens on (SInf eq. 1 for arrivals). Rounding
/// to 2⁻⁴⁰ is below 10⁻⁹ of the smallest weight that a threshold of 0.001 leaves.
pub(crate) struct ShootWeights<'a, V, const C: usize, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, C, M>,
    event: PhantomData<V>,
}

impl<'a, V, const C: usize, const M: usize> ShootWeights<'a, V, C, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, C, M>) -> Self {
        ShootWeights { board, event: PhantomData }
    }

    #[inline(always)]
    fn score(&mut self, path: &mut Path<[u64; C]>, patch: u32, weights: [f64; C]) {
        self.board.prefetch(patch);
        path.push(patch, weights.map(|weight| (weight * fixed_units(M) + 0.5) as u64));
    }
}

impl<V: Event, const C: usize, const M: usize> Estimator<C> for ShootWeights<'_, V, C, M> {
    type Score = Path<[u64; C]>;

    #[inline(always)]
    fn begin(&mut self, path: &mut Path<[u64; C]>, _: u32) {
        path.clear();
    }

    #[inline(always)]
    fn arrival(&mut self, path: &mut Path<[u64; C]>, patch: u32, weights: [f64; C]) {
        if V::ARRIVAL {
            self.score(path, patch, weights);
        }
    }

    #[inline(always)]
    fn survival(&mut self, path: &mut Path<[u64; C]>, patch: u32, weights: [f64; C]) {
        if V::SURVIVAL {
            self.score(path, patch, weights);
        }
    }

    #[inline(always)]
    fn death(&mut self, path: &mut Path<[u64; C]>, patch: u32, weights: [f64; C]) {
        if V::DEATH {
            self.score(path, patch, weights);
        }
    }

    #[inline(always)]
    fn end(&mut self, path: &mut Path<[u64; C]>, _: &mut WalkRng) {
        for &patch in &path.patches {
            self.board.count(patch);
        }
        self.board.add_path(&path.patches, |i| path.units[i].map(u128::from));
    }
}

/// A score of a walk in whole units: rounded to a neighbouring one at random, without bias. An emitter may be
/// 10⁻¹² of another, and its light must not vanish.
#[inline(always)]
fn dithered<const M: usize>(score: f64, rng: &mut WalkRng) -> u128 {
    let [dither, _] = rng.pair();
    u128::from_units(score * fixed_units(M) + dither)
}

/// The patch that a gathering walk was born on, and what the walk has gathered.
#[derive(Clone, Debug)]
pub struct Gathered<const S: usize> {
    birth: u32,
    scores: [f64; S],
}

impl<const S: usize> Default for Gathered<S> {
    fn default() -> Self {
        Gathered { birth: 0, scores: [0.0; S] }
    }
}

/// Gathering: the value of each event's patch times the weight there, on the patch of birth.
pub(crate) struct Gather<'a, V, const C: usize, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, C, M>,
    /// What an event on each patch is worth, over the largest of these values in its channel.
    values: &'a [[f64; C]],
    event: PhantomData<V>,
}

impl<'a, V, const C: usize, const M: usize> Gather<'a, V, C, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, C, M>, values: &'a [[f64; C]]) -> Self {
        Gather { board, values, event: PhantomData }
    }

    #[inline(always)]
    fn score(&mut self, gathered: &mut Gathered<C>, patch: u32, weights: [f64; C]) {
        let values = self.values[patch as usize];
        for ((score, weight), value) in gathered.scores.iter_mut().zip(weights).zip(values) {
            *score += weight * value;
        }
    }
}

impl<V: Event, const C: usize, const M: usize> Estimator<C> for Gather<'_, V, C, M> {
    type Score = Gathered<C>;

    #[inline(always)]
    fn begin(&mut self, gathered: &mut Gathered<C>, birth: u32) {
        *gathered = Gathered { birth, scores: [0.0; C] };
        self.board.count(birth);
    }

    #[inline(always)]
    fn arrival(&mut self, gathered: &mut Gathered<C>, patch: u32, weights: [f64; C]) {
        if V::ARRIVAL {
            self.score(gathered, patch, weights);
        }
    }

    #[inline(always)]
    fn survival(&mut self, gathered: &mut Gathered<C>, patch: u32, weights: [f64; C]) {
        if V::SURVIVAL {
            self.score(gathered, patch, weights);
        }
    }

    #[inline(always)]
    fn death(&mut self, gathered: &mut Gathered<C>, patch: u32, weights: [f64; C]) {
        if V::DEATH {
            self.score(gathered, patch, weights);
        }
    }

    #[inline(always)]
    fn end(&mut self, gathered: &mut Gathered<C>, rng: &mut WalkRng) {
        if gathered.scores.iter().any(|&score| score > 0.0) {
            let units = gathered.scores.map(|score| dithered::<M>(score, rng));
            self.board.add(gathered.birth, units);
        }
    }
}

/// The scores of [`ShootRelated`] and [`GatherRelated`], in this order: collision, absorption, survival, and the
/// sum of the last two, whose square tells their covariance.
pub(crate) const RELATED: usize = 4;

/// Collision, absorption and survival shooting of the same grey walks, in hits.
pub(crate) struct ShootRelated<'a, const M: usize> {
    board: &'a mut Scoreboard<u64, (), RELATED, M>,
}

impl<'a, const M: usize> ShootRelated<'a, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u64, (), RELATED, M>) -> Self {
        ShootRelated { board }
    }
}

impl<const M: usize> Estimator<1> for ShootRelated<'_, M> {
    type Score = Path<[u64; RELATED]>;

    fn begin(&mut self, path: &mut Path<[u64; RELATED]>, _: u32) {
        path.clear();
    }

    fn survival(&mut self, path: &mut Path<[u64; RELATED]>, patch: u32, _: [f64; 1]) {
        path.push(patch, [1, 0, 1, 1]);
    }

    fn death(&mut self, path: &mut Path<[u64; RELATED]>, patch: u32, _: [f64; 1]) {
        path.push(patch, [1, 1, 0, 1]);
    }

    fn end(&mut self, path: &mut Path<[u64; RELATED]>, _: &mut WalkRng) {
        self.board.add_path(&path.patches, |i| path.units[i]);
    }
}

/// Collision, absorption and survival gathering of the same grey walks.
pub(crate) struct GatherRelated<'a, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, RELATED, M>,
    /// What an arrival, a death, a survival on each patch is worth, over the largest of all these values.
    values: &'a [[f64; 3]],
}

impl<'a, const M: usize> GatherRelated<'a, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, RELATED, M>, values: &'a [[f64; 3]]) -> Self {
        GatherRelated { board, values }
    }
}

impl<const M: usize> Estimator<1> for GatherRelated<'_, M> {
    type Score = Gathered<3>;

    fn begin(&mut self, gathered: &mut Gathered<3>, birth: u32) {
        *gathered = Gathered { birth, scores: [0.0; 3] };
        self.board.count(birth);
    }

    fn arrival(&mut self, gathered: &mut Gathered<3>, patch: u32, _: [f64; 1]) {
        gathered.scores[0] += self.values[patch as usize][0];
    }

    fn death(&mut self, gathered: &mut Gathered<3>, patch: u32, _: [f64; 1]) {
        gathered.scores[1] += self.values[patch as usize][1];
    }

    fn survival(&mut self, gathered: &mut Gathered<3>, patch: u32, _: [f64; 1]) {
        gathered.scores[2] += self.values[patch as usize][2];
    }

    fn end(&mut self, gathered: &mut Gathered<3>, rng: &mut WalkRng) {
        if gathered.scores[0] > 0.0 {
            let [collision, absorption, survival] = gathered.scores.map(|score| dithered::<M>(score, rng));
            self.board.add(gathered.birth, [collision, absorption, survival, absorption + survival]);
        }
    }
}
