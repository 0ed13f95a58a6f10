//! What becomes of a walk at a hit: absorbed at random, or weakened.
//!
//! A walk serves all channels at once, with a weight for each. It survives a surface with probability σ, the
//! largest channel of R there, and is then multiplied by R_c/σ in channel c: the mean is R_c, as if that channel
//! had walked alone, and no weight ever grows, so that no score can exceed what it set out with. A grey walk
//! has σ = R and carries no weight at all.

use std::hint::select_unpredictable;

use serde::{Deserialize, Serialize};

use crate::geometry::surface::Surface;
use crate::geometry::tints::{TINT, Tints};
use crate::simd::batch::{Decisions, Lanes, WIDTH, WORD};
use crate::simd::isa::{Isa, Kernel, Simd};
use crate::trace::ray::Hits;

/// How walks of the infinite estimator end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InfiniteEnd {
    /// Below a weight they go on as collision walks of that weight; unbiased.
    Roulette {
        /// The weight, in (0, 1).
        threshold: f64,
    },
    /// At once below a weight; biased.
    Cutoff {
        /// The weight, in (0, 1).
        threshold: f64,
    },
    /// After a number of hits; biased.
    Length {
        /// The number, at least 1.
        length: u32,
    },
}

impl InfiniteEnd {
    /// The weight of a job that names none.
    pub const DEFAULT_THRESHOLD: f64 = 0.001;

    /// Whether walks are cut off while they still carry weight.
    pub fn is_biased(self) -> bool {
        !matches!(self, InfiniteEnd::Roulette { .. })
    }
}

impl Default for InfiniteEnd {
    fn default() -> Self {
        InfiniteEnd::Roulette { threshold: Self::DEFAULT_THRESHOLD }
    }
}

/// What a walk does after a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Next {
    /// The walk goes on.
    Survives,
    /// The walk is absorbed.
    Dies,
    /// Is cut off with the weights it has left.
    Truncated,
}

/// How walks end, C channels at a time. A walk's own state is a copy.
pub(crate) trait CollisionModel<const C: usize>: Copy {
    /// Whether chance alone decides and nothing is remembered.
    const CHANCE: bool = false;
    /// Whether the first arrival is the last, whatever chance has to say (direct light).
    #[inline(always)]
    fn ends_at_once(&self) -> bool {
        false
    }
    /// The walk sets out with these weights.
    fn set_out(&mut self, weights: [f64; C]);
    /// The weights that it arrives with.
    fn weights(&self) -> [f64; C];
    /// Decides at a hit; `survives` as chance has it, with probability σ.
    fn decide(&mut self, surface: &Surface, survives: bool) -> Next;
    /// Decides for a batch of walks, and notes the weights that they arrive with.
    #[inline(always)]
    fn decide_all(
        models: &mut [Self; WIDTH],
        collisions: &CollisionBatch,
        weights: &mut [[f64; C]; WIDTH],
    ) -> Decisions {
        let CollisionBatch { surfaces, met, arrived, survives, .. } = *collisions;
        let mut decided = Decisions { arrived, ..Decisions::default() };
        arrived.each(|lane| {
            let model = &mut models[lane];
            weights[lane] = model.weights();
            match model.decide(&surfaces[met[lane] as usize], survives.has(lane)) {
                Next::Survives => decided.survived.insert(lane),
                Next::Dies => decided.died.insert(lane),
                Next::Truncated => {}
            }
        });
        decided
    }
}

/// Where the walks of a batch have arrived.
pub(crate) struct CollisionBatch<'a> {
    pub(crate) isa: Isa,
    pub(crate) surfaces: &'a [Surface],
    pub(crate) tints: &'a Tints,
    /// The surfaces that they have met.
    pub(crate) met: &'a [u32; WIDTH],
    /// The walks that have arrived at an active side.
    pub(crate) arrived: Lanes,
    /// The walks that chance lets survive.
    pub(crate) survives: Lanes,
}

impl CollisionBatch<'_> {
    /// What chance alone decides.
    #[inline(always)]
    pub(crate) fn by_chance(&self) -> Decisions {
        let survived = self.arrived & self.survives;
        Decisions { arrived: self.arrived, survived, died: self.arrived.without(survived) }
    }
}

#[inline(always)]
fn analog(survives: bool) -> Next {
    if survives { Next::Survives } else { Next::Dies }
}

/// Grey: absorbed with probability 1 − R at each hit; the weight stays 1.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Analog {
    /// The first arrival is the last.
    pub(crate) ends_at_once: bool,
}

impl Analog {
    /// Of walks without weights, which may go on after their first arrival or not.
    pub(crate) fn of(goes_on: bool) -> Self {
        Analog { ends_at_once: !goes_on }
    }
}

impl CollisionModel<1> for Analog {
    const CHANCE: bool = true;

    #[inline(always)]
    fn ends_at_once(&self) -> bool {
        self.ends_at_once
    }

    #[inline(always)]
    fn set_out(&mut self, _: [f64; 1]) {}

    #[inline(always)]
    fn weights(&self) -> [f64; 1] {
        [1.0]
    }

    #[inline(always)]
    fn decide(&mut self, _: &Surface, survives: bool) -> Next {
        analog(survives)
    }
}

/// In colour: absorbed with probability 1 − σ at each hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coloured {
    /// Those of the channels, and 1.
    weights: [f64; TINT],
    /// The first arrival is the last.
    ends_at_once: bool,
}

impl Coloured {
    /// Of walks without weights in one channel, which may go on after their first arrival or not.
    pub(crate) fn of(goes_on: bool) -> Self {
        Coloured { weights: [1.0; TINT], ends_at_once: !goes_on }
    }
}

impl CollisionModel<3> for Coloured {
    #[inline(always)]
    fn ends_at_once(&self) -> bool {
        self.ends_at_once
    }

    #[inline(always)]
    fn set_out(&mut self, [red, green, blue]: [f64; 3]) {
        self.weights = [red, green, blue, 1.0];
    }

    #[inline(always)]
    fn weights(&self) -> [f64; 3] {
        let [red, green, blue, _] = self.weights;
        [red, green, blue]
    }

    #[inline(always)]
    fn decide(&mut self, surface: &Surface, survives: bool) -> Next {
        let next = analog(survives);
        if next == Next::Survives {
            weaken(&mut self.weights, surface.tint());
        }
        next
    }

    #[inline(always)]
    fn decide_all(
        models: &mut [Self; WIDTH],
        collisions: &CollisionBatch,
        weights: &mut [[f64; 3]; WIDTH],
    ) -> Decisions {
        let decided = collisions.by_chance();
        collisions.isa.run(Tinting { models, collisions, survived: decided.survived, weights });
        decided
    }
}

/// Notes the weights of coloured walks, and multiplies those of survivors by the tints of their surfaces.
struct Tinting<'a> {
    models: &'a mut [Coloured; WIDTH],
    collisions: &'a CollisionBatch<'a>,
    survived: Lanes,
    weights: &'a mut [[f64; 3]; WIDTH],
}

impl Kernel for Tinting<'_> {
    #[inline(always)]
    fn run<S: Simd>(self) {
        let CollisionBatch { tints, met, .. } = *self.collisions;
        for first in (0..WIDTH).step_by(WORD) {
            let survived = self.survived.word(first);
            for i in 0..WORD {
                let (model, met) = (&mut self.models[first + i], met[first + i]);
                self.weights[first + i] = model.weights();
                // Whether a walk survives cannot be predicted: the others are multiplied by 1.
                let tint = *tints.of(select_unpredictable(survived >> i & 1 == 1, met, Hits::NONE));
                model.weights = std::array::from_fn(|c| model.weights[c] * tint[c]);
            }
        }
    }
}

#[inline(always)]
fn weaken<const C: usize>(weights: &mut [f64; C], factors: [f64; 3]) {
    for (weight, factor) in weights.iter_mut().zip(factors) {
        *weight *= factor;
    }
}

/// Never absorbed by chance: the weights are multiplied by the reflectances met (SInf), until `end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Infinite<const C: usize> {
    weights: [f64; C],
    hits: u32,
    /// Goes on as a collision walk of these weights.
    roulette: bool,
    end: InfiniteEnd,
}

impl<const C: usize> Infinite<C> {
    pub(crate) fn new(end: InfiniteEnd) -> Self {
        Infinite { weights: [1.0; C], hits: 0, roulette: false, end }
    }

    #[inline(always)]
    fn largest_weight(&self) -> f64 {
        self.weights.into_iter().fold(0.0, f64::max)
    }
}

impl<const C: usize> CollisionModel<C> for Infinite<C> {
    #[inline(always)]
    fn set_out(&mut self, weights: [f64; C]) {
        self.weights = weights;
    }

    #[inline(always)]
    fn weights(&self) -> [f64; C] {
        self.weights
    }

    #[inline(always)]
    fn decide(&mut self, surface: &Surface, survives: bool) -> Next {
        if self.roulette {
            let next = analog(survives);
            if C > 1 && next == Next::Survives {
                weaken(&mut self.weights, surface.tint());
            }
            return next;
        }
        weaken(&mut self.weights, surface.reflectance().channels());
        self.hits += 1;
        let weight = self.largest_weight();
        if weight == 0.0 {
            return Next::Dies;
        }
        match self.end {
            InfiniteEnd::Roulette { threshold } => self.roulette = weight < threshold,
            InfiniteEnd::Cutoff { threshold } if weight < threshold => return Next::Truncated,
            InfiniteEnd::Length { length } if self.hits >= length => return Next::Truncated,
            InfiniteEnd::Cutoff { .. } | InfiniteEnd::Length { .. } => {}
        }
        Next::Survives
    }
}
