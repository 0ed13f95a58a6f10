//! One walk again, event by event: what a tally only has the sum of.

use crate::experiment::Experiment;
use crate::random::rng::{Sequence, WalkRng};
use crate::simd::batch::{Decisions, WIDTH};
use crate::walk::batch::{Terms, WalkEnd, walk_all};
use crate::walk::collision::CollisionModel;
use crate::walk::estimator::{Estimator, with_collision_model};
use crate::walk::score::Scorer;

/// A walk, described from its birth to its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// The patch it was born on.
    pub birth: u32,
    /// The arrivals of the walk at active sides, in order.
    pub steps: Vec<ReplayedHit>,
    /// How the walk ended.
    pub end: WalkEnd,
}

/// An arrival of the walk at an active side.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayedHit {
    /// The patch of the arrival.
    pub patch: u32,
    /// The weight of each channel, on arrival.
    pub weights: Vec<f64>,
    /// Whether the walk goes on from there.
    pub survives: bool,
}

/// Takes down what happens.
#[derive(Default)]
struct Recorder {
    birth: u32,
    steps: Vec<ReplayedHit>,
}

impl<const C: usize> Scorer<C> for Recorder {
    fn begin(&mut self, _: usize, birth: u32) {
        self.birth = birth;
    }

    fn score(&mut self, patches: &[u32; WIDTH], outcome: &Decisions, weights: &[[f64; C]; WIDTH]) {
        outcome.arrived.each(|lane| {
            let survives = outcome.survived.has(lane);
            self.steps.push(ReplayedHit { patch: patches[lane], weights: weights[lane].to_vec(), survives });
        });
    }

    fn end(&mut self, _: usize, _: WalkRng) {}

    /// Nothing is kept by place: the walk is alone.
    fn relocate(&mut self, _: usize, _: usize) {}
}

impl Experiment {
    /// Walk number `n` of a sequence.
    pub fn replay(&self, sequence: &Sequence, n: u64) -> Replay {
        self.replay_while(sequence, n, &|| true)
    }

    /// The first arrivals of walk number `n` of a sequence: all, or some thousands.
    pub fn replay_beginning(&self, sequence: &Sequence, n: u64) -> Vec<ReplayedHit> {
        self.replay_while(sequence, n, &|| false).steps
    }

    fn replay_while(&self, sequence: &Sequence, n: u64, go_on: &dyn Fn() -> bool) -> Replay {
        let terms = Terms { space: self.method().space(), go_on };
        let estimator = self.method().estimator().unwrap_or(Estimator::Collision);
        match self.scene().channels() {
            1 => {
                with_collision_model!(Analog, estimator, |model| self.record::<1>(sequence, n, terms, model))
            }
            _ => with_collision_model!(Coloured, estimator, |model| self
                .record::<3>(sequence, n, terms, model)),
        }
    }

    fn record<const C: usize>(
        &self,
        sequence: &Sequence,
        n: u64,
        terms: Terms,
        model: impl CollisionModel<C>,
    ) -> Replay {
        let mut recorder = Recorder::default();
        let counts = walk_all(self.scene(), self.births(), terms, sequence, n..n + 1, model, &mut recorder);
        let ends = [
            (counts.absorbed_back, WalkEnd::AbsorbedBack),
            (counts.escaped, WalkEnd::Escaped),
            (counts.truncated, WalkEnd::Truncated),
        ];
        let end = ends.into_iter().find(|&(walks, _)| walks > 0).map_or(WalkEnd::Absorbed, |(_, end)| end);
        Replay { birth: recorder.birth, steps: recorder.steps, end }
    }
}
