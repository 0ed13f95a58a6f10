//! Scores of weighted walks: the weights of C channels at each event, in fixed point.

use super::estimator::Event;
use super::score::{FIXED_UNITS, Scorer, WeightTally, dithered};
use super::spots::BasisSample;
use super::visits::{Earlier, SEARCHED, VisitRecord, Visits};
use crate::random::rng::WalkRng;
use crate::scene::Scene;
use crate::simd::batch::{Decisions, Lanes, WIDTH, WORD};
use crate::simd::isa::{Isa, Kernel, Simd};
use crate::tally::{ColouredBoard, ColouredVisits};
use crate::trace::ray::Hits;

impl WeightTally<3> for ColouredBoard {
    type Sample = ();
    type VisitScore = [u64; 3];

    type Units = ColouredVisits<WIDTH>;
    const NO_UNITS: Self::Units = ColouredVisits::NONE;

    #[inline(always)]
    fn set_units(&mut self, units: &mut Self::Units, weights: &[[f64; 3]; WIDTH]) {
        self.set_visits(units, weights, FIXED_UNITS);
    }

    #[inline(always)]
    fn visit_score(units: &Self::Units, lane: usize, (): ()) -> [u64; 3] {
        units.units(lane)
    }

    #[inline(always)]
    fn count_event(&mut self, face: u32) {
        self.count(face);
    }

    #[inline(never)]
    fn add_visit(&mut self, face: u32, before: &[u64; 3], now: &[u64; 3]) {
        self.add_event(face, *before, *now);
    }

    #[inline(always)]
    fn add_first<S: Simd>(&mut self, face: u32, _: &[u64; 3], units: &Self::Units, lane: usize) {
        ColouredBoard::add_first::<S, WIDTH>(self, face, units, lane);
    }

    fn add_visits(
        &mut self,
        face: u32,
        before: impl Iterator<Item = [u64; 3]>,
        now: impl Iterator<Item = [u64; 3]>,
    ) {
        let plus = |sum: [u128; 3], units: [u64; 3]| std::array::from_fn(|c| sum[c] + u128::from(units[c]));
        self.add_more(face, before.fold([0; 3], plus), now.fold([0; 3], plus));
    }

    #[inline(always)]
    fn add_gathered(&mut self, birth: u32, scores: [f64; 3], (): (), mut rng: WalkRng) {
        self.add_more(birth, [0; 3], scores.map(|score| dithered(score, &mut rng).0));
    }

    #[inline(always)]
    fn expect_faces(&self, faces: &[u32]) {
        self.expect(faces);
    }
}

/// Weighted shooting: the weights at each event, on the face it happens on (SInf eq. 1 for arrivals). Rounding
/// to 2⁻⁴⁰ is below 10⁻⁹ of the smallest weight that a threshold of 0.001 leaves.
pub(crate) struct ShootWeights<'a, B: WeightTally<C>, const C: usize> {
    board: &'a mut B,
    visits: Visits<B::VisitScore>,
    /// Where the walks are now, and what visits there are worth.
    spots: <B::Sample as VisitRecord>::Row,
    units: B::Units,
    isa: Isa,
    event: Event,
}

impl<'a, B: WeightTally<C>, const C: usize> ShootWeights<'a, B, C> {
    pub(crate) fn new(isa: Isa, board: &'a mut B, event: Event) -> Self {
        let (visits, spots, units) = (Visits::new(), B::Sample::NO_ROW, B::NO_UNITS);
        ShootWeights { board, visits, spots, units, isa, event }
    }

    /// Scores the visits that were kept apart.
    #[cold]
    fn score_later(&mut self, lane: usize) {
        let later = self.visits.take_later(lane);
        for visits in later.chunk_by(|(a, _), (b, _)| a == b) {
            let face = visits[0].0;
            visits.iter().for_each(|_| self.board.count_event(face));
            let scores = || visits.iter().map(|&(_, visit_score)| visit_score);
            let (_, scored) = self.visits.scored_on(lane, face);
            self.board.add_visits(face, self.visits.on(lane, face).chain([scored]), scores());
            let sum = scores().fold(B::VisitScore::NONE, B::VisitScore::plus);
            self.visits.add_scored(lane, face, (visits.len() as u64, sum));
        }
    }

    /// Scores what is kept apart of walks that have as much of it as may be.
    #[cold]
    fn score_full(&mut self) {
        self.visits.take_full().into_iter().for_each(|lane| self.score_later(lane));
    }
}

impl<B: WeightTally<C>, const C: usize> Scorer<C> for ShootWeights<'_, B, C> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, _: u32) {
        self.visits.len[lane] = 0;
    }

    #[inline(always)]
    fn locate(&mut self, isa: Isa, scene: &Scene, len: usize, hits: &Hits, pieces: &[u32; WIDTH]) {
        B::Sample::locate(&mut self.spots, isa, scene, len, hits, pieces);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        let earlier = self.visits.earlier(self.isa, faces);
        let scoring = self.event.scoring(decided);
        self.isa.run(ScoreVisits { shoot: self, scoring, faces, weights, earlier: &earlier });
        if self.visits.is_full {
            self.score_full();
        }
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, _: WalkRng) {
        if self.visits.len[lane] == SEARCHED as u32 {
            self.score_later(lane);
            self.visits.forget_scored(lane);
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.visits.relocate(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.board.expect_faces(faces);
    }
}

/// Scores what walks of a batch are worth on their faces.
struct ScoreVisits<'s, 'a, B: WeightTally<C>, const C: usize> {
    shoot: &'s mut ShootWeights<'a, B, C>,
    scoring: Lanes,
    faces: &'s [u32; WIDTH],
    weights: &'s [[f64; C]; WIDTH],
    earlier: &'s Earlier<B::VisitScore>,
}

impl<B: WeightTally<C>, const C: usize> Kernel for ScoreVisits<'_, '_, B, C> {
    #[inline(always)]
    fn run<S: Simd>(self) {
        let ShootWeights { board, visits, spots, units, .. } = self.shoot;
        board.set_units(units, self.weights);
        for first in (0..WIDTH).step_by(WORD) {
            let mut scoring = self.scoring.word(first);
            while scoring != 0 {
                let lane = first + scoring.trailing_zeros() as usize % WORD;
                scoring &= scoring - 1;
                let face = self.faces[lane];
                let visit_score = B::visit_score(units, lane, B::Sample::of(spots, lane));
                if self.earlier.visits[lane] == 0 {
                    if visits.push(lane, face, visit_score) {
                        board.add_first::<S>(face, &visit_score, units, lane);
                    }
                    continue;
                }
                let before = visits.on(lane, face).fold(B::VisitScore::NONE, B::VisitScore::plus);
                if visits.push(lane, face, visit_score) {
                    board.add_visit(face, &before, &visit_score);
                }
            }
        }
    }
}
