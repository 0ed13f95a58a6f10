//! Walks of an experiment, onto its board.

use std::ops::Range;

use super::Experiment;
use super::board::{Board, Scores, with_board};
use super::gathering::{EventValues, Gathering};
use super::solution::Solution;
use crate::method::{Method, Score, Walks};
use crate::random::quasi::{Quasi, QuasiPosition};
use crate::random::rng::Sequence;
use crate::scene::births::Births;
use crate::tally::{Counts, Overflow, Word};
use crate::thread_pool::ThreadPool;
use crate::walk::batch::{Terms, walk_all, walk_each};
use crate::walk::collision::{Analog, CollisionModel, Infinite};
use crate::walk::estimator::{EstimatorKind, Event, with_collision_model};
use crate::walk::light_groups::LightGroups;
use crate::walk::marks::{LikelihoodRatio, MarkBoard, Marked};
use crate::walk::score::{Gather, GatherRelated, Scorer, ShootHits, ShootRelated};
use crate::walk::weighted::ShootWeights;

/// Where the numbers of walks come from, and which walks.
pub(super) enum Source<'a> {
    Random(&'a Sequence, Range<u64>),
    Sobol(&'a Quasi, Range<u64>),
}

/// The marks of a kind, where there are marks.
macro_rules! marks_of {
    ($marks:expr, $kind:ident) => {
        $marks.map(|marks| match marks {
            MarkBoard::$kind(marks) => marks,
            _ => wrong_board(),
        })
    };
}

/// Samples between two looks at whether a sum could wrap: those of that many never do.
const PART: u64 = 1 << 18;

impl Experiment {
    /// What the first `samples` walks (or batches, or chains) of a seed's sequence tell, on this thread, with intervals of
    /// 95 %.
    ///
    /// # Errors
    /// Where a sum leaves its range, which takes more than 10³⁸ units.
    ///
    /// # Panics
    /// Where `samples` is 0: nothing would be known.
    pub fn run(&self, seed: u64, samples: u64) -> Result<Solution, Overflow> {
        assert!(samples > 0, "no samples tell nothing; ask for one or more");
        let (sequence, mut board, mut tally) = (Sequence::new(seed), self.board(), self.tally());
        for first in (0..samples).step_by(PART as usize) {
            self.walk(&sequence, first..samples.min(first + PART), &mut board);
            board.add_to(&mut tally)?;
        }
        Ok(Solution::new(self, &tally, 0.95))
    }

    /// Walks (or batches, or chains) number `walks.start` … `walks.end` − 1 of a sequence, onto a board that
    /// [`Experiment::board`] made.
    ///
    /// # Panics
    /// Where the board was made by an experiment that scores in another way.
    pub fn walk(&self, sequence: &Sequence, walks: Range<u64>, board: &mut Board) {
        self.walk_while(sequence, walks, board, &|| true);
    }

    /// Walks as [`Experiment::walk`] does, but gives up a batch or a chain, which may be long, once `pool` no longer wants it.
    /// What the board holds is of no use then. A chain of links is shared among the threads that `pool` lends.
    ///
    /// # Panics
    /// Where the board was made by an experiment that scores in another way.
    pub fn walk_while(
        &self,
        sequence: &Sequence,
        walks: Range<u64>,
        board: &mut Board,
        pool: &dyn ThreadPool,
    ) {
        let go_on = &|| pool.go_on();
        let Board { scores, sensing, group_sums } = board;
        if let Some(exchange) = &self.exchange {
            let Scores::Hits(board) = scores else { wrong_board() };
            return exchange.walk(&self.scene, self.method.space(), (sequence, walks), board);
        }
        if let Some(daylight) = &self.daylight {
            let Scores::Hits(board) = scores else { wrong_board() };
            return daylight.walk((sequence, walks), board);
        }
        let counts = match (&self.method, &mut *scores) {
            (Method::Walks(plan), scores) => {
                return match self.sensors().zip(sensing.as_mut()) {
                    None => {
                        let marks = group_sums.as_mut().and_then(|group_sums| group_sums.marks.as_mut());
                        self.single_walks(plan, (sequence, walks), (scores, marks), go_on);
                    }
                    Some((sensors, sensing)) => {
                        let onto = (scores, sensing);
                        self.sensed_walks((plan, sensors), sequence, walks, onto, go_on);
                    }
                };
            }
            (Method::Batches(plan), Scores::Chains(scores)) => {
                let batch = |batch| self.batch_of_walks(sequence, batch, plan, go_on);
                self.batches(sequence, walks, (scores, sensing), batch, go_on)
            }
            (Method::Chains(plan), Scores::Chains(scores)) => {
                let chain = |chain| self.chain(sequence, chain, plan, pool);
                self.batches(sequence, walks, (scores, sensing), chain, go_on)
            }
            _ => wrong_board(),
        };
        with_board!(scores, board => board.counts.add(&counts)).expect("64 bits outlast any process");
    }

    /// Walks that are samples each, onto the scores of faces, and onto the marks of materials where these are asked for.
    pub(super) fn single_walks(
        &self,
        plan: &Walks,
        (sequence, walks): (&Sequence, Range<u64>),
        (scores, marks): (&mut Scores, Option<&mut MarkBoard>),
        go_on: &dyn Fn() -> bool,
    ) {
        let terms = Terms { space: plan.space, go_on };
        let counts = match &self.gathering {
            None => {
                let source = Source::Random(sequence, walks);
                self.shoot((plan.score, terms), &source, (scores, marks))
            }
            Some(gathering) => self.gather((plan.score, terms), gathering, (sequence, walks), scores),
        };
        with_board!(scores, board => board.counts.add(&counts)).expect("64 bits outlast any process");
    }

    /// Walks from the emitters.
    pub(super) fn shoot(
        &self,
        (score, terms): (Score, Terms),
        source: &Source,
        (board, marks): (&mut Scores, Option<&mut MarkBoard>),
    ) -> Counts {
        match (board, score) {
            (Scores::Hits(board), Score::Of(estimator)) => {
                let mut score = ShootHits::new(self.scene.parts.isa, board, estimator.event());
                let model = Analog::of(estimator.kind().goes_on());
                self.shoot_all(terms, source, model, (&mut score, marks_of!(marks, Hits)))
            }
            (Scores::RelatedHits(board), Score::Mix) => {
                let mut score = ShootRelated::new(board);
                self.walk_all(self.scene.emitters(), terms, source, Analog::default(), &mut score)
            }
            (Scores::Fixed(board), Score::Of(estimator)) => {
                let end = estimator.infinite_end().unwrap_or_else(|| wrong_board());
                let mut score = ShootWeights::<_, 1>::new(self.scene.parts.isa, board, estimator.event());
                self.shoot_all(terms, source, Infinite::new(end), (&mut score, marks_of!(marks, Fixed)))
            }
            (Scores::LinearHits(board), Score::Linear(estimator)) => {
                let mut score = ShootHits::new(self.scene.parts.isa, board, estimator.event());
                let model = Analog::of(estimator.kind().goes_on());
                self.walk_all(self.scene.emitters(), terms, source, model, &mut score)
            }
            (Scores::LinearFixed(board), Score::Linear(estimator)) => {
                let end = estimator.infinite_end().unwrap_or_else(|| wrong_board());
                let mut score = ShootWeights::<_, 1>::new(self.scene.parts.isa, board, estimator.event());
                self.walk_all(self.scene.emitters(), terms, source, Infinite::new(end), &mut score)
            }
            (Scores::LinearColoured(board), Score::Linear(estimator)) => {
                with_collision_model!(Coloured, estimator, |model| {
                    let mut score = ShootWeights::<_, 3>::new(self.scene.parts.isa, board, estimator.event());
                    self.walk_all(self.scene.emitters(), terms, source, model, &mut score)
                })
            }
            (Scores::Coloured(board), Score::Of(estimator)) => {
                with_collision_model!(Coloured, estimator, |model| {
                    let mut score = ShootWeights::<_, 3>::new(self.scene.parts.isa, board, estimator.event());
                    self.shoot_all(terms, source, model, (&mut score, marks_of!(marks, Coloured)))
                })
            }
            _ => wrong_board(),
        }
    }

    /// Walks from the emitters; where groups are distinguished, each scores for its own.
    fn shoot_all<T: Word, const C: usize>(
        &self,
        terms: Terms,
        source: &Source,
        model: impl CollisionModel<C>,
        (score, marks): (&mut impl Scorer<C>, Option<&mut Marked<T, C>>),
    ) -> Counts {
        let births = self.scene.emitters();
        let (Some(groups), Source::Random(sequence, walks)) = (&self.groups, source) else {
            return self.walk_all(births, terms, source, model, score);
        };
        let walks = walks.clone();
        let mut score = LightGroups::new(score, &groups.first_slots);
        let Some(marks) = marks else {
            return walk_all(&self.scene, births, terms, sequence, walks, model, &mut score);
        };
        let event = self.method.estimator_kind().map_or(Event::Arrival, EstimatorKind::event);
        let isa = self.scene.parts.isa;
        let mut score = LikelihoodRatio::new(isa, (&mut score, marks), &groups.material_of_face, event);
        walk_all(&self.scene, births, terms, sequence, walks, model, &mut score)
    }

    /// Walks from the patches.
    fn gather(
        &self,
        (score, terms): (Score, Terms),
        gathering: &Gathering,
        (sequence, walks): (&Sequence, Range<u64>),
        board: &mut Scores,
    ) -> Counts {
        let (scene, births) = (&self.scene, &gathering.births);
        match (board, &gathering.values, score) {
            (Scores::Fixed(board), EventValues::Grey(values), Score::Of(estimator)) => {
                with_collision_model!(Analog, estimator, |model| {
                    let mut score = Gather::<_, 1>::new(board, values, estimator.event());
                    walk_all(scene, births, terms, sequence, walks, model, &mut score)
                })
            }
            (Scores::Coloured(board), EventValues::Coloured(values), Score::Of(estimator)) => {
                with_collision_model!(Coloured, estimator, |model| {
                    let mut score = Gather::<_, 3>::new(board, values, estimator.event());
                    walk_all(scene, births, terms, sequence, walks, model, &mut score)
                })
            }
            (Scores::LinearFixed(board), EventValues::Grey(values), Score::Linear(estimator)) => {
                with_collision_model!(Analog, estimator, |model| {
                    let mut score = Gather::<_, 1>::new(board, values, estimator.event());
                    walk_all(scene, births, terms, sequence, walks, model, &mut score)
                })
            }
            (Scores::LinearColoured(board), EventValues::Coloured(values), Score::Linear(estimator)) => {
                with_collision_model!(Coloured, estimator, |model| {
                    let mut score = Gather::<_, 3>::new(board, values, estimator.event());
                    walk_all(scene, births, terms, sequence, walks, model, &mut score)
                })
            }
            (Scores::RelatedFixed(board), EventValues::Related(values), Score::Mix) => {
                let mut score = GatherRelated::new(board, values);
                walk_all(scene, births, terms, sequence, walks, Analog::default(), &mut score)
            }
            _ => wrong_board(),
        }
    }

    fn walk_all<const C: usize>(
        &self,
        births: &Births,
        terms: Terms,
        source: &Source,
        model: impl CollisionModel<C>,
        score: &mut impl Scorer<C>,
    ) -> Counts {
        let scene = &self.scene;
        match source {
            Source::Random(sequence, walks) => {
                walk_all(scene, births, terms, sequence, walks.clone(), model, score)
            }
            Source::Sobol(numbers, walks) => {
                let starts = walks.clone().map(|walk| QuasiPosition::start(walk as u32));
                walk_each(scene, births, terms, *numbers, starts, model, score)
            }
        }
    }
}

/// A board is of no use to an experiment that scores in another way.
#[cold]
fn wrong_board() -> ! {
    panic!(
        "the board was made by an experiment that scores in another way; take the one of `Experiment::board`"
    )
}
