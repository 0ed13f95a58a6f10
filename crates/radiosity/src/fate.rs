//! What becomes of a walk at a hit: absorbed at random, or weakened.

use crate::method::InfiniteEnd;
use crate::rng::WalkRng;
use crate::surface::Surface;

/// What a walk does after a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Next {
    /// Goes on.
    Survives,
    /// Is absorbed.
    Dies,
    /// Is cut off with this weight left.
    Truncated(f64),
}

/// How walks end. A walk's own state is a copy.
pub(crate) trait Fate: Copy {
    /// The weight that it arrives with.
    fn weight(&self) -> f64;
    /// Decides at a hit.
    fn decide(&mut self, surface: &Surface, rng: &mut WalkRng) -> Next;
}

/// Absorbed with probability 1 − R at each hit; the weight stays 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Analog;

impl Fate for Analog {
    #[inline(always)]
    fn weight(&self) -> f64 {
        1.0
    }

    #[inline(always)]
    fn decide(&mut self, surface: &Surface, rng: &mut WalkRng) -> Next {
        if surface.survives(rng.bits()) { Next::Survives } else { Next::Dies }
    }
}

/// Never absorbed by chance: the weight is the product of the reflectances met (SInf), until `end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Infinite {
    weight: f64,
    hits: u32,
    /// Goes on as a collision walk of this weight.
    roulette: bool,
    end: InfiniteEnd,
}

impl Infinite {
    pub(crate) fn new(end: InfiniteEnd) -> Self {
        Infinite { weight: 1.0, hits: 0, roulette: false, end }
    }
}

impl Fate for Infinite {
    #[inline(always)]
    fn weight(&self) -> f64 {
        self.weight
    }

    #[inline(always)]
    fn decide(&mut self, surface: &Surface, rng: &mut WalkRng) -> Next {
        if self.roulette {
            return Analog.decide(surface, rng);
        }
        self.weight *= surface.reflectance();
        self.hits += 1;
        if self.weight == 0.0 {
            return Next::Dies;
        }
        match self.end {
            InfiniteEnd::Roulette { threshold } => self.roulette = self.weight < threshold,
            InfiniteEnd::Cutoff { threshold } if self.weight < threshold => {
                return Next::Truncated(self.weight);
            }
            InfiniteEnd::Length { length } if self.hits >= length => return Next::Truncated(self.weight),
            InfiniteEnd::Cutoff { .. } | InfiniteEnd::Length { .. } => {}
        }
        Next::Survives
    }
}
