//! Walks that are distinguished by where they are born.
//!
//! This scorer and the one of marks ([`super::marks`]) stand between the kernel and the scorer of a method, which is reached by
//! reference: once for a batch of walks, so that this costs little, and the kernel is compiled once for all of them.

use super::score::Scorer;
use crate::random::rng::WalkRng;
use crate::simd::batch::{Decisions, WIDTH};

/// Hands the scores of each walk to the class that the walk belongs to: face i of a class is the slot i of a board, counted
/// from the first slot of the class.
pub(crate) struct LightGroups<'a, const C: usize> {
    inner: &'a mut dyn Scorer<C>,
    /// The first slot of a walk's class, by the face of its birth.
    first_slots: &'a [u32],
    /// The first slots of the classes of the walks in the batch.
    offsets: [u32; WIDTH],
}

impl<'a, const C: usize> LightGroups<'a, C> {
    pub(crate) fn new(inner: &'a mut dyn Scorer<C>, first_slots: &'a [u32]) -> Self {
        LightGroups { inner, first_slots, offsets: [0; WIDTH] }
    }

    /// Slots of walks on some faces. Walks that are nowhere have a face, too, whose slot is of no use.
    #[inline(always)]
    fn slots(&self, faces: &[u32]) -> [u32; WIDTH] {
        let mut slots = [0; WIDTH];
        for ((slot, face), offset) in slots.iter_mut().zip(faces).zip(&self.offsets) {
            *slot = face.wrapping_add(*offset);
        }
        slots
    }
}

impl<const C: usize> Scorer<C> for LightGroups<'_, C> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, birth: u32) {
        self.offsets[lane] = self.first_slots[birth as usize];
        self.inner.begin(lane, birth);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        self.inner.score(&self.slots(faces), decided, weights);
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, rng: WalkRng) {
        self.inner.end(lane, rng);
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.offsets[to] = self.offsets[from];
        self.inner.relocate(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.inner.expect(&self.slots(faces)[..faces.len()]);
    }
}
