//! The places where walks arrive, one by one: what a tally keeps the sums of.

use std::ops::Range;

use super::Experiment;
use crate::random::rng::{Sequence, WalkRng};
use crate::scene::Scene;
use crate::simd::batch::{Decisions, WIDTH};
use crate::simd::isa::Isa;
use crate::tally::Counts;
use crate::trace::ray::Hits;
use crate::walk::batch::walk_all;
use crate::walk::collision::CollisionModel;
use crate::walk::estimator::{Estimator, with_collision_model};
use crate::walk::score::Scorer;

/// The arrival of a walk at an active side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// The piece that the walk has met.
    pub piece: u32,
    /// The place, in the local coordinates of its surface.
    pub uv: [f64; 2],
    /// The weights that the walk arrives with; 0 of channels that the scene does not have.
    pub weights: [f64; 3],
}

/// Tells of arrivals as they happen.
struct Witness<F> {
    see: F,
    pieces: [u32; WIDTH],
    uv: [[f64; 2]; WIDTH],
}

impl<const C: usize, F: FnMut(Arrival)> Scorer<C> for Witness<F> {
    fn begin(&mut self, _: usize, _: u32) {}

    fn locate(&mut self, _: Isa, _: &Scene, len: usize, hits: &Hits, pieces: &[u32; WIDTH]) {
        self.pieces = *pieces;
        (0..len).for_each(|lane| self.uv[lane] = hits.uv.each_ref().map(|row| row[lane]));
    }

    fn score(&mut self, _: &[u32; WIDTH], outcome: &Decisions, weights: &[[f64; C]; WIDTH]) {
        outcome.arrived.each(|lane| {
            let mut all = [0.0; 3];
            all[..C].copy_from_slice(&weights[lane]);
            (self.see)(Arrival { piece: self.pieces[lane], uv: self.uv[lane], weights: all });
        });
    }

    fn end(&mut self, _: usize, _: WalkRng) {}

    /// Nothing is kept from one arrival to the next.
    fn relocate(&mut self, _: usize, _: usize) {}
}

impl Experiment {
    /// Each arrival of some shooting walks, in no order; returns how the walks ended.
    pub fn each_arrival(&self, sequence: &Sequence, walks: Range<u64>, see: impl FnMut(Arrival)) -> Counts {
        let witness = Witness { see, pieces: [0; WIDTH], uv: [[0.0; 2]; WIDTH] };
        match self.scene().channels() {
            1 => with_collision_model!(Analog, Estimator::Collision, |model| self
                .witness::<1>(sequence, walks, model, witness)),
            _ => with_collision_model!(Coloured, Estimator::Collision, |model| self
                .witness::<3>(sequence, walks, model, witness)),
        }
    }

    fn witness<const C: usize>(
        &self,
        sequence: &Sequence,
        walks: Range<u64>,
        model: impl CollisionModel<C>,
        mut witness: impl Scorer<C>,
    ) -> Counts {
        walk_all(self.scene(), self.births(), self.method().space(), sequence, walks, model, &mut witness)
    }
}
