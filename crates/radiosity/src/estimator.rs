//! Estimators: what a walk scores, and where.
//!
//! A shooting walk scores on the patches it meets; a gathering walk on the patch it was born on, by the
//! emittances it meets. Scores are whole numbers of units: hits for analog shooting, else 2⁻⁴⁰ of the largest
//! single score (2⁻²⁴ where fourth powers are summed, which would not fit otherwise).

use crate::rng::WalkRng;
use crate::tally::{Scoreboard, Word};

/// Units of fixed-point scores in the largest single score, for boards of so many power sums.
pub(crate) const fn fixed_units(moments: usize) -> f64 {
    let bits = if moments <= 2 { 40 } else { 24 };
    (1_u64 << bits) as f64
}

/// Scores the events of one walk after another.
pub trait Estimator {
    /// Walk number `walk` was born on patch `birth`; what follows belongs to it.
    fn begin(&mut self, walk: u64, birth: u32);
    /// It arrived at an active side of `patch` with a weight in (0, 1].
    fn arrival(&mut self, _patch: u32, _weight: f64) {}
    /// It survived that hit.
    fn survival(&mut self, _patch: u32) {}
    /// It was absorbed there.
    fn death(&mut self, _patch: u32) {}
    /// It has ended.
    fn end(&mut self, _rng: &mut WalkRng) {}
}

/// Which event of an analog walk scores.
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

/// Analog shooting: one unit for each event, on the patch where it happens.
pub(crate) struct ShootAnalog<'a, V, const M: usize> {
    board: &'a mut Scoreboard<u64, (), M>,
    walk: u64,
    event: std::marker::PhantomData<V>,
}

impl<'a, V, const M: usize> ShootAnalog<'a, V, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u64, (), M>) -> Self {
        ShootAnalog { board, walk: 0, event: std::marker::PhantomData }
    }
}

impl<V: Event, const M: usize> Estimator for ShootAnalog<'_, V, M> {
    #[inline(always)]
    fn begin(&mut self, walk: u64, _: u32) {
        self.walk = walk;
    }

    #[inline(always)]
    fn arrival(&mut self, patch: u32, _: f64) {
        if V::ARRIVAL {
            self.board.add(self.walk, patch, 1);
        }
    }

    #[inline(always)]
    fn survival(&mut self, patch: u32) {
        if V::SURVIVAL {
            self.board.add(self.walk, patch, 1);
        }
    }

    #[inline(always)]
    fn death(&mut self, patch: u32) {
        if V::DEATH {
            self.board.add(self.walk, patch, 1);
        }
    }
}

/// Infinite shooting: the weight of each arrival, on the patch it happens on (SInf eq. 1). Rounding to 2⁻⁴⁰ is
/// below 10⁻⁹ of the smallest weight that a threshold of 0.001 leaves.
pub(crate) struct ShootInfinite<'a, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, M>,
    walk: u64,
}

impl<'a, const M: usize> ShootInfinite<'a, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, M>) -> Self {
        ShootInfinite { board, walk: 0 }
    }
}

impl<const M: usize> Estimator for ShootInfinite<'_, M> {
    #[inline(always)]
    fn begin(&mut self, walk: u64, _: u32) {
        self.walk = walk;
    }

    #[inline(always)]
    fn arrival(&mut self, patch: u32, weight: f64) {
        self.board.add(self.walk, patch, u128::from_units(weight * fixed_units(M) + 0.5));
        self.board.count(patch);
    }
}

/// Gathering, analog or infinite: the value of each event's patch, on the patch of birth.
pub(crate) struct Gather<'a, V, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, M>,
    /// What an event on each patch is worth, over the largest of these values.
    values: &'a [f64],
    walk: u64,
    birth: u32,
    score: f64,
    event: std::marker::PhantomData<V>,
}

impl<'a, V, const M: usize> Gather<'a, V, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, M>, values: &'a [f64]) -> Self {
        Gather { board, values, walk: 0, birth: 0, score: 0.0, event: std::marker::PhantomData }
    }
}

impl<V: Event, const M: usize> Estimator for Gather<'_, V, M> {
    #[inline(always)]
    fn begin(&mut self, walk: u64, birth: u32) {
        (self.walk, self.birth, self.score) = (walk, birth, 0.0);
        self.board.count(birth);
    }

    #[inline(always)]
    fn arrival(&mut self, patch: u32, weight: f64) {
        if V::ARRIVAL {
            self.score += weight * self.values[patch as usize];
        }
    }

    #[inline(always)]
    fn survival(&mut self, patch: u32) {
        if V::SURVIVAL {
            self.score += self.values[patch as usize];
        }
    }

    #[inline(always)]
    fn death(&mut self, patch: u32) {
        if V::DEATH {
            self.score += self.values[patch as usize];
        }
    }

    /// The whole score is rounded to a neighbouring unit at random, without bias: an emitter may be 10⁻¹² of
    /// another, and its light must not vanish.
    #[inline(always)]
    fn end(&mut self, rng: &mut WalkRng) {
        if self.score > 0.0 {
            let [dither, _] = rng.pair();
            self.board.add(self.walk, self.birth, u128::from_units(self.score * fixed_units(M) + dither));
        }
    }
}
