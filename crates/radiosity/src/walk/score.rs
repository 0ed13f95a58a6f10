//! Scores: whole numbers of units, by face.
//!
//! A shooting walk scores on the faces it meets; a gathering walk on the face it was born on, by the
//! emittances it meets; in each of C channels. Scores are whole numbers of units: hits for grey analog shooting,
//! else 2⁻⁴⁰ of the largest single score (2⁻²⁴ where fourth powers are summed, which would not fit otherwise).

use std::marker::PhantomData;

use crate::geometry::surface::Surface;
use crate::random::rng::WalkRng;
use crate::scene::Scene;
use crate::simd::batch::{Decisions, Lanes, WIDTH};
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::tally::{Scoreboard, Word};
use crate::trace::ray::Hits;

/// Units of fixed-point scores in the largest single score, for boards of `moments` power sums.
pub(crate) const fn fixed_units(moments: usize) -> f64 {
    let bits = if moments <= 2 { 40 } else { 24 };
    (1_u64 << bits) as f64
}

/// Scores the events of a batch of walks, C channels at a time.
pub(crate) trait Scorer<const C: usize> {
    /// Walk `lane` was born on face `birth`.
    fn begin(&mut self, lane: usize, birth: u32);
    /// The walks have arrived on these faces with these weights, and this became of them.
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]);
    /// Walk `lane` was born in a cell of a surface, at these local coordinates.
    #[inline(always)]
    fn born_at(&mut self, _lane: usize, _surface: &Surface, _cell: u32, _uv: [f64; 2]) {}
    /// The walks have met these points, of which those on active sides will be scored.
    #[inline(always)]
    fn locate(&mut self, _isa: Isa, _scene: &Scene, _len: usize, _hits: &Hits) {}
    /// Walk `lane` has ended.
    fn end(&mut self, lane: usize, rng: WalkRng);
    /// Walk `from` goes on as walk `to`.
    fn relocate(&mut self, from: usize, to: usize);
    /// The walks will soon score on these faces.
    fn expect(&self, _faces: &[u32]) {}
}

/// The faces that a walk scored on, and what: units U each.
#[derive(Clone, Debug)]
pub(crate) struct Path<U> {
    faces: Vec<u32>,
    units: Vec<U>,
}

impl<U> Default for Path<U> {
    fn default() -> Self {
        Path { faces: Vec::new(), units: Vec::new() }
    }
}

impl<U> Path<U> {
    #[inline(always)]
    fn push(&mut self, face: u32, units: U) {
        self.faces.push(face);
        self.units.push(units);
    }

    fn clear(&mut self) {
        self.faces.clear();
        self.units.clear();
    }
}

fn empty_paths<U: Clone>() -> Vec<Path<U>> {
    vec![Path::default(); WIDTH]
}

/// Which event of a walk scores.
pub(crate) trait Event {
    /// The walks that score.
    fn scoring(decided: &Decisions) -> Lanes;
}

/// The event of the collision estimator: every hit scores.
pub(crate) struct OnArrival;
/// The event of the survival estimator: every hit but the last scores.
pub(crate) struct OnSurvival;
/// The event of the absorption estimator: the absorption scores.
pub(crate) struct OnAbsorption;

impl Event for OnArrival {
    #[inline(always)]
    fn scoring(decided: &Decisions) -> Lanes {
        decided.arrived
    }
}
impl Event for OnSurvival {
    #[inline(always)]
    fn scoring(decided: &Decisions) -> Lanes {
        decided.survived
    }
}
impl Event for OnAbsorption {
    #[inline(always)]
    fn scoring(decided: &Decisions) -> Lanes {
        decided.died
    }
}

/// The first faces that each walk of a batch scored on; the later ones of a long walk are kept apart.
pub(super) struct Visits {
    /// `faces[k][lane]`: face number k of a walk.
    pub(super) faces: Vec<[u32; WIDTH]>,
    pub(super) len: [u32; WIDTH],
    later: Vec<Vec<u32>>,
}

/// The number of visits of a walk in which an earlier visit to the same face is searched; further visits are scored at
/// the walk's end.
pub(super) const SEARCHED: usize = 64;

impl Visits {
    pub(super) fn new() -> Self {
        Visits { faces: Vec::new(), len: [0; WIDTH], later: vec![Vec::new(); WIDTH] }
    }

    /// How often each walk has been on its face.
    #[inline(always)]
    pub(super) fn earlier(&self, isa: Isa, faces: &[u32; WIDTH]) -> [u32; WIDTH] {
        let mut earlier = [0; WIDTH];
        let (visits, found) = (self, &mut earlier);
        on_isa!(isa, count_earlier(visits: &Visits, faces: &[u32; WIDTH], found: &mut [u32; WIDTH]));
        earlier
    }

    /// Remembers a visit; false where too many are remembered already.
    #[inline(always)]
    fn push(&mut self, lane: usize, face: u32) -> bool {
        let len = self.len[lane] as usize;
        if len == self.faces.len() {
            if len == SEARCHED {
                self.later[lane].push(face);
                return false;
            }
            self.faces.push([0; WIDTH]);
        }
        self.faces[len][lane] = face;
        self.len[lane] += 1;
        true
    }

    pub(super) fn relocate(&mut self, from: usize, to: usize) {
        self.len[to] = self.len[from];
        self.faces.iter_mut().for_each(|row| row[to] = row[from]);
        self.later.swap(from, to);
    }
}

#[inline(always)]
fn count_earlier<R: Real>(visits: &Visits, faces: &[u32; WIDTH], earlier: &mut [u32; WIDTH]) {
    let longest = visits.len.iter().fold(0, |longest, &len| longest.max(len));
    for (k, row) in (0..longest).zip(&visits.faces) {
        for lane in 0..WIDTH {
            earlier[lane] += u32::from((row[lane] == faces[lane]) & (k < visits.len[lane]));
        }
    }
}

/// Grey analog shooting: one unit for each event, on the face where it happens.
pub(crate) struct ShootHits<'a, V, const M: usize> {
    board: &'a mut Scoreboard<u64, (), 1, M>,
    visits: Visits,
    isa: Isa,
    event: PhantomData<V>,
}

impl<'a, V, const M: usize> ShootHits<'a, V, M> {
    pub(crate) fn new(isa: Isa, board: &'a mut Scoreboard<u64, (), 1, M>) -> Self {
        ShootHits { board, visits: Visits::new(), isa, event: PhantomData }
    }

    /// Scores the visits that were kept apart.
    #[cold]
    fn score_later(&mut self, lane: usize) {
        let mut later = std::mem::take(&mut self.visits.later[lane]);
        later.sort_unstable();
        for visits in later.chunk_by(|a, b| a == b) {
            let first = self.visits.faces.iter().filter(|row| row[lane] == visits[0]).count() as u64;
            (0..visits.len() as u64).for_each(|i| self.board.add_one(visits[0], first + i));
        }
    }
}

impl<V: Event, const M: usize> Scorer<1> for ShootHits<'_, V, M> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, _: u32) {
        self.visits.len[lane] = 0;
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        let earlier = self.visits.earlier(self.isa, faces);
        V::scoring(decided).each(|lane| {
            if self.visits.push(lane, faces[lane]) {
                self.board.add_one(faces[lane], earlier[lane].into());
            }
        });
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, _: WalkRng) {
        if self.visits.len[lane] == SEARCHED as u32 {
            self.score_later(lane);
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.visits.relocate(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.board.expect(faces);
    }
}

/// Weighted shooting: the weights at each event, on the face it happens on (SInf eq. 1 for arrivals). Rounding
/// to 2⁻⁴⁰ is below 10⁻⁹ of the smallest weight that a threshold of 0.001 leaves.
pub(crate) struct ShootWeights<'a, V, const C: usize, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, C, M>,
    paths: Vec<Path<[u64; C]>>,
    event: PhantomData<V>,
}

impl<'a, V, const C: usize, const M: usize> ShootWeights<'a, V, C, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, C, M>) -> Self {
        ShootWeights { board, paths: empty_paths(), event: PhantomData }
    }
}

impl<V: Event, const C: usize, const M: usize> Scorer<C> for ShootWeights<'_, V, C, M> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, _: u32) {
        self.paths[lane].clear();
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        V::scoring(decided).each(|lane| {
            let units = weights[lane].map(|weight| (weight * fixed_units(M) + 0.5) as u64);
            self.paths[lane].push(faces[lane], units);
        });
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, _: WalkRng) {
        let path = &self.paths[lane];
        for &face in &path.faces {
            self.board.count(face);
        }
        self.board.add_path(&path.faces, |i| path.units[i].map(u128::from));
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.paths.swap(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.board.expect(faces);
    }
}

/// A score of a walk in whole units: rounded to a neighbouring one at random, without bias. An emitter may be
/// 10⁻¹² of another, and its light must not vanish. Returns the other uniform number of the draw, too.
#[inline(always)]
pub(super) fn dithered<const M: usize>(score: f64, rng: &mut WalkRng) -> (u128, f64) {
    let [dither, other] = rng.pair();
    (u128::from_units(score * fixed_units(M) + dither), other)
}

/// The face that a gathering walk was born on, and what the walk has gathered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gathered<const S: usize> {
    pub(super) birth: u32,
    pub(super) scores: [f64; S],
}

impl<const S: usize> Gathered<S> {
    /// Adds the value of an event in each channel, times the weight there.
    #[inline(always)]
    pub(super) fn gather(&mut self, weights: [f64; S], values: [f64; S]) {
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
pub(crate) struct Gather<'a, V, const C: usize, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, C, M>,
    /// What an event on each face is worth, over the largest of these values in its channel.
    values: &'a [[f64; C]],
    gathered: [Gathered<C>; WIDTH],
    event: PhantomData<V>,
}

impl<'a, V, const C: usize, const M: usize> Gather<'a, V, C, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, C, M>, values: &'a [[f64; C]]) -> Self {
        Gather { board, values, gathered: [Gathered::default(); WIDTH], event: PhantomData }
    }
}

impl<V: Event, const C: usize, const M: usize> Scorer<C> for Gather<'_, V, C, M> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, birth: u32) {
        self.gathered[lane] = Gathered { birth, scores: [0.0; C] };
        self.board.count(birth);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        V::scoring(decided).each(|lane| {
            self.gathered[lane].gather(weights[lane], self.values[faces[lane] as usize]);
        });
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, mut rng: WalkRng) {
        let Gathered { birth, scores } = self.gathered[lane];
        if scores.iter().any(|&score| score > 0.0) {
            self.board.add(birth, scores.map(|score| dithered::<M>(score, &mut rng).0));
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.gathered[to] = self.gathered[from];
    }
}

/// The scores of [`ShootRelated`] and [`GatherRelated`], in this order: collision, absorption, survival, and the
/// sum of the last two, whose square gives their covariance.
pub(crate) const RELATED: usize = 4;

/// Collision, absorption and survival shooting of the same grey walks, in hits.
pub(crate) struct ShootRelated<'a, const M: usize> {
    board: &'a mut Scoreboard<u64, (), RELATED, M>,
    paths: Vec<Path<[u64; RELATED]>>,
}

impl<'a, const M: usize> ShootRelated<'a, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u64, (), RELATED, M>) -> Self {
        ShootRelated { board, paths: empty_paths() }
    }
}

impl<const M: usize> Scorer<1> for ShootRelated<'_, M> {
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
pub(crate) struct GatherRelated<'a, const M: usize> {
    board: &'a mut Scoreboard<u128, u64, RELATED, M>,
    /// What an arrival, a death, a survival on each face is worth, over the largest of all these values.
    values: &'a [[f64; 3]],
    gathered: [Gathered<3>; WIDTH],
}

impl<'a, const M: usize> GatherRelated<'a, M> {
    pub(crate) fn new(board: &'a mut Scoreboard<u128, u64, RELATED, M>, values: &'a [[f64; 3]]) -> Self {
        GatherRelated { board, values, gathered: [Gathered::default(); WIDTH] }
    }
}

impl<const M: usize> Scorer<1> for GatherRelated<'_, M> {
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
            let [collision, absorption, survival] = scores.map(|score| dithered::<M>(score, &mut rng).0);
            self.board.add(birth, [collision, absorption, survival, absorption + survival]);
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.gathered[to] = self.gathered[from];
    }
}

/// Exchange: one unit for each walk that an active side takes, in the row of that face's group.
pub(crate) struct Exchanged<'a, const M: usize> {
    board: &'a mut Scoreboard<u64, (), 1, M>,
    group_of_face: &'a [u32],
    /// The row of the first group.
    first_row: u32,
}

impl<'a, const M: usize> Exchanged<'a, M> {
    pub(crate) fn new(
        board: &'a mut Scoreboard<u64, (), 1, M>,
        group_of_face: &'a [u32],
        first_row: u32,
    ) -> Self {
        Exchanged { board, group_of_face, first_row }
    }
}

impl<const M: usize> Scorer<1> for Exchanged<'_, M> {
    #[inline(always)]
    fn begin(&mut self, _: usize, _: u32) {}

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        decided.died.each(|lane| {
            self.board.add_one(self.first_row + self.group_of_face[faces[lane] as usize], 0);
        });
    }

    #[inline(always)]
    fn end(&mut self, _: usize, _: WalkRng) {}

    fn relocate(&mut self, _: usize, _: usize) {}
}
