//! Scores: whole numbers of units, by face.
//!
//! A shooting walk scores on the faces it meets; a gathering walk on the face it was born on, by the
//! emittances it meets; in each of C channels. Scores are whole numbers of units: hits for grey analog shooting,
//! else 2⁻⁴⁰ of the largest single score.

use super::estimator::Event;
use super::spots::BasisSample;
use super::visits::{Path, SEARCHED, VisitRecord, Visits, empty_paths};
use crate::random::rng::WalkRng;
use crate::scene::Scene;
use crate::simd::batch::{Decisions, Lanes, WIDTH};
use crate::simd::isa::{Isa, Simd};
use crate::tally::{HitScoreboard, WeightScoreboard, Word, rounded};
use crate::trace::ray::{Hits, Rays};

/// Units of fixed-point scores in the largest single score.
pub(crate) const FIXED_UNITS: f64 = (1_u64 << 40) as f64;

/// Scores the events of a batch of walks, C channels at a time.
pub(crate) trait Scorer<const C: usize> {
    /// Walk `lane` was born on face `birth`.
    fn begin(&mut self, lane: usize, birth: u32);
    /// The walks have arrived on these faces with these weights, and this became of them.
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]);
    /// Walk `lane` was born on a surface, in a cell of it, at these local coordinates.
    #[inline(always)]
    fn born_at(&mut self, _lane: usize, _scene: &Scene, _place: [u32; 2], _uv: [f64; 2]) {}
    /// The walks have met these points on these pieces, of which those on active sides will be scored.
    #[inline(always)]
    fn locate(&mut self, _isa: Isa, _scene: &Scene, _len: usize, _hits: &Hits, _pieces: &[u32; WIDTH]) {}
    /// These rays have left the scene.
    #[inline(always)]
    fn lose(&mut self, _lanes: Lanes, _rays: &Rays) {}
    /// Walk `lane` has ended.
    fn end(&mut self, lane: usize, rng: WalkRng);
    /// Walk `from` goes on as walk `to`.
    fn relocate(&mut self, from: usize, to: usize);
    /// The walks will soon score on these faces.
    fn expect(&self, _faces: &[u32]) {}
}

/// A board on which whole hits are scored, one for each event.
pub(crate) trait HitTally {
    /// What is kept of where a walk scores.
    type Sample: BasisSample;
    /// A walk scores on a face, where it has scored `before`: how often, and with what sum of spots.
    fn add_hit(&mut self, face: u32, before: (u64, Self::Sample), spot: Self::Sample);
    /// The walks will soon score on these faces.
    fn expect_faces(&self, faces: &[u32]);
}

/// A board on which weights are scored in C channels, in fixed point.
pub(crate) trait WeightTally<const C: usize> {
    /// What is kept of where a walk scores.
    type Sample: BasisSample;
    /// What a visit scores; or the sum of up to [`SEARCHED`] visits of one walk to a face.
    type VisitScore: VisitRecord;
    /// What visits of the walks of a batch are worth, computed side by side.
    type Units;
    const NO_UNITS: Self::Units;
    /// Computes that from their weights.
    fn set_units(&mut self, units: &mut Self::Units, weights: &[[f64; C]; WIDTH]);
    /// What a visit scores.
    fn visit_score(units: &Self::Units, lane: usize, spot: Self::Sample) -> Self::VisitScore;
    /// Counts an event on a face, or a birth.
    fn count_event(&mut self, face: u32);
    /// Counts an event of a walk on a face, where it has scored `before`, and adds what it scores now.
    fn add_visit(&mut self, face: u32, before: &Self::VisitScore, now: &Self::VisitScore);
    /// Counts an event of a walk on a face, where it has not scored before, and adds what it scores now: a visit of the batch.
    fn add_first<S: Simd>(&mut self, face: u32, now: &Self::VisitScore, units: &Self::Units, lane: usize);
    /// Adds what a walk scores on a face by visits, any number, after some that were added already. The events are counted.
    fn add_visits(
        &mut self,
        face: u32,
        before: impl Iterator<Item = Self::VisitScore>,
        now: impl Iterator<Item = Self::VisitScore>,
    );
    /// Adds what a walk has gathered for the face where it was born, rounded at random.
    fn add_gathered(&mut self, birth: u32, scores: [f64; C], spot: Self::Sample, rng: WalkRng);
    /// The walks will soon score on these faces.
    fn expect_faces(&self, faces: &[u32]);
}

impl HitTally for HitScoreboard<1> {
    type Sample = ();

    #[inline(always)]
    fn add_hit(&mut self, face: u32, (earlier, ()): (u64, ()), (): ()) {
        self.add_one(face, earlier);
    }

    #[inline(always)]
    fn expect_faces(&self, faces: &[u32]) {
        self.expect(faces);
    }
}

impl<const C: usize> WeightTally<C> for WeightScoreboard<C> {
    type Sample = ();
    type VisitScore = [u64; C];

    type Units = [[u64; C]; WIDTH];
    const NO_UNITS: Self::Units = [[0; C]; WIDTH];

    #[inline(always)]
    fn set_units(&mut self, units: &mut Self::Units, weights: &[[f64; C]; WIDTH]) {
        set_units::<C>(units, weights);
    }

    #[inline(always)]
    fn visit_score(units: &Self::Units, lane: usize, (): ()) -> [u64; C] {
        units[lane]
    }

    #[inline(always)]
    fn count_event(&mut self, face: u32) {
        self.count(face);
    }

    #[inline(always)]
    fn add_visit(&mut self, face: u32, before: &[u64; C], now: &[u64; C]) {
        self.add_event(face, before, now);
    }

    #[inline(always)]
    fn add_first<S: Simd>(&mut self, face: u32, now: &[u64; C], _: &Self::Units, _: usize) {
        self.add_event(face, &[0; C], now);
    }

    fn add_visits(
        &mut self,
        face: u32,
        before: impl Iterator<Item = [u64; C]>,
        now: impl Iterator<Item = [u64; C]>,
    ) {
        let plus = |sum: [u128; C], units: [u64; C]| std::array::from_fn(|c| sum[c] + u128::from(units[c]));
        self.add_more(face, before.fold([0; C], plus), now.fold([0; C], plus));
    }

    #[inline(always)]
    fn add_gathered(&mut self, birth: u32, scores: [f64; C], (): (), mut rng: WalkRng) {
        self.add(birth, scores.map(|score| dithered(score, &mut rng).0));
    }

    #[inline(always)]
    fn expect_faces(&self, faces: &[u32]) {
        self.expect(faces);
    }
}

/// Grey analog shooting: one unit for each event, on the face where it happens.
pub(crate) struct ShootHits<'a, B: HitTally> {
    board: &'a mut B,
    visits: Visits<B::Sample>,
    /// Where the walks are now.
    spots: <B::Sample as VisitRecord>::Row,
    isa: Isa,
    event: Event,
}

impl<'a, B: HitTally> ShootHits<'a, B> {
    pub(crate) fn new(isa: Isa, board: &'a mut B, event: Event) -> Self {
        ShootHits { board, visits: Visits::new(), spots: B::Sample::NO_ROW, isa, event }
    }

    /// Scores the visits that were kept apart.
    #[cold]
    fn score_later(&mut self, lane: usize) {
        let later = self.visits.take_later(lane);
        for visits in later.chunk_by(|(a, _), (b, _)| a == b) {
            let plus = |(number, sum): (u64, B::Sample), spot: B::Sample| (number + 1, sum.plus(spot));
            let face = visits[0].0;
            let scored = self.visits.scored_on(lane, face);
            let mut before = self.visits.on(lane, face).fold(scored, plus);
            for &(face, spot) in visits {
                self.board.add_hit(face, before, spot);
                before = plus(before, spot);
            }
            let now = visits.iter().map(|&(_, spot)| spot).fold((0, B::Sample::NONE), plus);
            self.visits.add_scored(lane, face, now);
        }
    }

    /// Scores what is kept apart of walks that have as much of it as may be.
    #[cold]
    fn score_full(&mut self) {
        self.visits.take_full().into_iter().for_each(|lane| self.score_later(lane));
    }
}

impl<B: HitTally> Scorer<1> for ShootHits<'_, B> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, _: u32) {
        self.visits.len[lane] = 0;
    }

    #[inline(always)]
    fn locate(&mut self, isa: Isa, scene: &Scene, len: usize, hits: &Hits, pieces: &[u32; WIDTH]) {
        B::Sample::locate(&mut self.spots, isa, scene, len, hits, pieces);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        let earlier = self.visits.earlier(self.isa, faces);
        self.event.scoring(decided).each(|lane| {
            let spot = B::Sample::of(&self.spots, lane);
            if self.visits.push(lane, faces[lane], spot) {
                let before = (earlier.visits[lane].into(), B::Sample::of(&earlier.spots, lane));
                self.board.add_hit(faces[lane], before, spot);
            }
        });
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

/// Weights in units, rounded.
#[inline(always)]
pub(super) fn set_units<const C: usize>(units: &mut [[u64; C]; WIDTH], weights: &[[f64; C]; WIDTH]) {
    for (units, weight) in units.as_flattened_mut().iter_mut().zip(weights.as_flattened()) {
        *units = rounded(weight * FIXED_UNITS);
    }
}

/// A score of a walk in whole units: rounded to a neighbouring one at random, without bias. An emitter may be
/// 10⁻¹² of another, and its light must not vanish. Returns the other uniform number of the draw, too.
#[inline(always)]
pub(super) fn dithered(score: f64, rng: &mut WalkRng) -> (u128, f64) {
    let [dither, other] = rng.pair();
    (u128::from_units(score * FIXED_UNITS + dither), other)
}

/// The face that a gathering walk was born on, and what the walk has gathered.
#[derive(Clone, Copy, Debug)]
struct Gathered<const S: usize> {
    birth: u32,
    scores: [f64; S],
}

impl<const S: usize> Gathered<S> {
    /// Adds the value of an event in each channel, times the weight there.
    #[inline(always)]
    fn gather(&mut self, weights: [f64; S], values: [f64; S]) {
        for ((score, weight), value) in self.scores.iter_mut().zip(weights).zip(values) {
            *score += weight * value;
        }
    }
}

impl<const S: usize> Default for Gathered<S> {
    fn default() -> Self {
        Gathered { birth: 0, scores: [0.0; S] }
    }
}

/// Gathering: the value of each event's face times the weight there, on the face of birth.
pub(crate) struct Gather<'a, B: WeightTally<C>, const C: usize> {
    board: &'a mut B,
    /// What an event on each face is worth, over the largest of these values in its channel.
    values: &'a [[f64; C]],
    gathered: [Gathered<C>; WIDTH],
    /// Where the walks were born.
    births: <B::Sample as VisitRecord>::Row,
    event: Event,
}

impl<'a, B: WeightTally<C>, const C: usize> Gather<'a, B, C> {
    pub(crate) fn new(board: &'a mut B, values: &'a [[f64; C]], event: Event) -> Self {
        let gathered = [Gathered::default(); WIDTH];
        Gather { board, values, gathered, births: B::Sample::NO_ROW, event }
    }
}

impl<B: WeightTally<C>, const C: usize> Scorer<C> for Gather<'_, B, C> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, birth: u32) {
        self.gathered[lane] = Gathered { birth, scores: [0.0; C] };
        self.board.count_event(birth);
    }

    #[inline(always)]
    fn born_at(&mut self, lane: usize, scene: &Scene, place: [u32; 2], uv: [f64; 2]) {
        B::Sample::of_birth(scene, place, uv).put(&mut self.births, lane);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        self.event.scoring(decided).each(|lane| {
            self.gathered[lane].gather(weights[lane], self.values[faces[lane] as usize]);
        });
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, rng: WalkRng) {
        let Gathered { birth, scores } = self.gathered[lane];
        if scores.iter().any(|&score| score > 0.0) {
            self.board.add_gathered(birth, scores, B::Sample::of(&self.births, lane), rng);
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.gathered[to] = self.gathered[from];
        B::Sample::of(&self.births, from).put(&mut self.births, to);
    }
}

/// The scores of [`ShootRelated`] and [`GatherRelated`], in this order: collision, absorption, survival, and the
/// sum of the last two, whose square gives their covariance.
pub(crate) const RELATED: usize = 4;

/// Collision, absorption and survival shooting of the same grey walks, in hits.
pub(crate) struct ShootRelated<'a> {
    board: &'a mut HitScoreboard<RELATED>,
    paths: Vec<Path<[u64; RELATED]>>,
}

impl<'a> ShootRelated<'a> {
    pub(crate) fn new(board: &'a mut HitScoreboard<RELATED>) -> Self {
        ShootRelated { board, paths: empty_paths() }
    }
}

impl Scorer<1> for ShootRelated<'_> {
    fn begin(&mut self, lane: usize, _: u32) {
        self.paths[lane].clear();
    }

    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        decided.survived.each(|lane| self.paths[lane].push(faces[lane], [1, 0, 1, 1]));
        decided.died.each(|lane| self.paths[lane].push(faces[lane], [1, 1, 0, 1]));
    }

    fn end(&mut self, lane: usize, _: WalkRng) {
        let path = &self.paths[lane];
        self.board.add_path(&path.faces, |i| path.units[i]);
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.paths.swap(from, to);
    }
}

/// Collision, absorption and survival gathering of the same grey walks.
pub(crate) struct GatherRelated<'a> {
    board: &'a mut WeightScoreboard<RELATED>,
    /// What an arrival, a death, a survival on each face is worth, over the largest of all these values.
    values: &'a [[f64; 3]],
    gathered: [Gathered<3>; WIDTH],
}

impl<'a> GatherRelated<'a> {
    pub(crate) fn new(board: &'a mut WeightScoreboard<RELATED>, values: &'a [[f64; 3]]) -> Self {
        GatherRelated { board, values, gathered: [Gathered::default(); WIDTH] }
    }
}

impl Scorer<1> for GatherRelated<'_> {
    fn begin(&mut self, lane: usize, birth: u32) {
        self.gathered[lane] = Gathered { birth, scores: [0.0; 3] };
        self.board.count(birth);
    }

    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        for (kind, scoring) in [decided.arrived, decided.died, decided.survived].into_iter().enumerate() {
            scoring.each(|lane| {
                self.gathered[lane].scores[kind] += self.values[faces[lane] as usize][kind];
            });
        }
    }

    fn end(&mut self, lane: usize, mut rng: WalkRng) {
        let Gathered { birth, scores } = self.gathered[lane];
        if scores[0] > 0.0 {
            let [collision, absorption, survival] = scores.map(|score| dithered(score, &mut rng).0);
            self.board.add(birth, [collision, absorption, survival, absorption + survival]);
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.gathered[to] = self.gathered[from];
    }
}
