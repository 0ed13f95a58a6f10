//! Scores with slopes: for each patch not the score alone, but how it is spread over the patch.
//!
//! With b(x) the light that a patch reflects at x, and ψ₁, ψ₂ the linear basis of `geometry/basis.rs`, a shooting walk that
//! scores y at x adds y·ψ_k(x) to slope k: the mean of that is the mean of b·ψ_k over the patch, as the mean of y is that of
//! b. A gathering walk that is born at x and gathers y tells the same of the patch of its birth.

use std::marker::PhantomData;

use super::places::Places;
use super::score::{Event, Gathered, SEARCHED, Scorer, dithered, fixed_units};
use crate::geometry::basis::{SLOPE_BITS, SLOPE_UNITS, slopes_at};
use crate::geometry::surface::Surface;
use crate::random::rng::WalkRng;
use crate::scene::Scene;
use crate::simd::batch::{Decisions, WIDTH};
use crate::simd::isa::{Isa, on_isa};
use crate::simd::real::Real;
use crate::tally::{LinearBoard, Mark, Word};
use crate::trace::ray::Hits;

/// Power sums of scores with slopes: more would be signed.
pub(crate) const MOMENTS: usize = 2;

/// Visits of every walk of a batch, each the walk's k-th.
struct Visits {
    faces: [u32; WIDTH],
    slopes: [[i32; WIDTH]; 2],
}

/// The first faces that each walk of a batch scored on, and the slopes there; the later ones of a long walk are kept apart.
struct Trail {
    visits: Vec<Visits>,
    len: [u32; WIDTH],
    later: Vec<Vec<(u32, [i32; 2])>>,
    earlier: Earlier,
}

/// What each walk of a batch has scored on its face before.
struct Earlier {
    hits: [u32; WIDTH],
    slopes: [[i32; WIDTH]; 2],
}

impl Earlier {
    fn none() -> Self {
        Earlier { hits: [0; WIDTH], slopes: [[0; WIDTH]; 2] }
    }
}

impl Trail {
    fn new() -> Self {
        Trail {
            visits: Vec::new(),
            len: [0; WIDTH],
            later: vec![Vec::new(); WIDTH],
            earlier: Earlier::none(),
        }
    }

    #[inline(always)]
    fn look_back(&mut self, isa: Isa, faces: &[u32; WIDTH]) {
        let trail = self;
        on_isa!(isa, look_back(trail: &mut Trail, faces: &[u32; WIDTH]));
    }

    /// Remembers a visit; false where too many are remembered already.
    #[inline(always)]
    fn push(&mut self, lane: usize, face: u32, slopes: [i32; 2]) -> bool {
        let len = self.len[lane] as usize;
        if len == self.visits.len() {
            if len == SEARCHED {
                self.later[lane].push((face, slopes));
                return false;
            }
            self.visits.push(Visits { faces: [0; WIDTH], slopes: [[0; WIDTH]; 2] });
        }
        let visits = &mut self.visits[len];
        visits.faces[lane] = face;
        visits.slopes.iter_mut().zip(slopes).for_each(|(row, slope)| row[lane] = slope);
        self.len[lane] += 1;
        true
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.len[to] = self.len[from];
        for visits in &mut self.visits {
            visits.faces[to] = visits.faces[from];
            visits.slopes.iter_mut().for_each(|row| row[to] = row[from]);
        }
        self.later.swap(from, to);
    }
}

#[inline(always)]
fn look_back<R: Real>(trail: &mut Trail, faces: &[u32; WIDTH]) {
    let Trail { visits, len, earlier, .. } = trail;
    *earlier = Earlier::none();
    let longest = len.iter().fold(0, |longest, &len| longest.max(len));
    let [first, second] = &mut earlier.slopes;
    for (k, visits) in (0..longest).zip(visits) {
        for lane in 0..WIDTH {
            let same = u32::from((visits.faces[lane] == faces[lane]) & (k < len[lane]));
            let mask = same.wrapping_neg() as i32;
            earlier.hits[lane] += same;
            first[lane] += visits.slopes[0][lane] & mask;
            second[lane] += visits.slopes[1][lane] & mask;
        }
    }
}

/// The mark of a number of hits, with the sum of their slopes.
#[inline(always)]
fn hits(number: u32, slopes: [i32; 2]) -> Mark<u64, 1> {
    Mark { units: [number.into()], slopes: [slopes.map(|slope| u64::from_signed(slope.into()))] }
}

/// Grey analog shooting: one unit for each event, on the face where it happens.
pub(crate) struct ShootLinearHits<'a, V> {
    board: &'a mut LinearBoard<u64, (), 1>,
    trail: Trail,
    places: Places,
    isa: Isa,
    event: PhantomData<V>,
}

impl<'a, V> ShootLinearHits<'a, V> {
    pub(crate) fn new(isa: Isa, board: &'a mut LinearBoard<u64, (), 1>) -> Self {
        ShootLinearHits { board, trail: Trail::new(), places: Places::new(), isa, event: PhantomData }
    }

    /// Scores the visits that were kept apart.
    #[cold]
    fn score_later(&mut self, lane: usize) {
        let mut later = std::mem::take(&mut self.trail.later[lane]);
        later.sort_by_key(|&(face, _)| face);
        for visits in later.chunk_by(|(a, _), (b, _)| a == b) {
            let face = visits[0].0;
            let first = self.trail.visits.iter().filter(|visits| visits.faces[lane] == face);
            let first = first.map(|visits| hits(1, visits.slopes.map(|row| row[lane])));
            let mut before = first.fold(Mark::none(), Mark::plus);
            for &(_, slopes) in visits {
                self.board.raise(face, &before, &hits(1, slopes));
                before = before.plus(hits(1, slopes));
            }
        }
    }
}

impl<V: Event> Scorer<1> for ShootLinearHits<'_, V> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, _: u32) {
        self.trail.len[lane] = 0;
    }

    #[inline(always)]
    fn locate(&mut self, isa: Isa, scene: &Scene, len: usize, hits: &Hits) {
        self.places.locate(isa, scene, len, hits);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, _: &[[f64; 1]; WIDTH]) {
        self.trail.look_back(self.isa, faces);
        V::scoring(decided).each(|lane| {
            let slopes = self.places.slopes.each_ref().map(|row| row[lane]);
            if self.trail.push(lane, faces[lane], slopes) {
                let earlier = &self.trail.earlier;
                let before = hits(earlier.hits[lane], earlier.slopes.each_ref().map(|row| row[lane]));
                self.board.raise(faces[lane], &before, &hits(1, slopes));
            }
        });
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, _: WalkRng) {
        if self.trail.len[lane] == SEARCHED as u32 {
            self.score_later(lane);
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.trail.relocate(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.board.expect(faces);
    }
}

/// A fixed-point score with its slopes at a place: `score·ψ_k`, plus `rounding` of a unit and rounded down. |ψ| is below 1 by
/// a unit, so that no slope exceeds its score where `rounding` is below 1.
#[inline(always)]
fn fixed<const C: usize>(scores: [u64; C], place: [i32; 2], rounding: [i64; C]) -> Mark<u128, C> {
    Mark {
        units: scores.map(u128::from),
        slopes: std::array::from_fn(|c| {
            let whole = |psi: i32| i128::from(scores[c]) * i128::from(psi) + i128::from(rounding[c]);
            place.map(|psi| u128::from_signed((whole(psi) >> SLOPE_BITS) as i64))
        }),
    }
}

/// A visit of a weighted walk: the units that it scores in each channel, and where.
type Visit<const C: usize> = ([u64; C], [i32; 2]);

/// Weighted shooting: the weights at each event, on the face it happens on.
pub(crate) struct ShootLinearWeights<'a, V, const C: usize> {
    board: &'a mut LinearBoard<u128, u64, C>,
    faces: Vec<Vec<u32>>,
    visits: Vec<Vec<Visit<C>>>,
    places: Places,
    event: PhantomData<V>,
}

impl<'a, V, const C: usize> ShootLinearWeights<'a, V, C> {
    pub(crate) fn new(board: &'a mut LinearBoard<u128, u64, C>) -> Self {
        ShootLinearWeights {
            board,
            faces: vec![Vec::new(); WIDTH],
            visits: vec![Vec::new(); WIDTH],
            places: Places::new(),
            event: PhantomData,
        }
    }
}

impl<V: Event, const C: usize> Scorer<C> for ShootLinearWeights<'_, V, C> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, _: u32) {
        self.faces[lane].clear();
        self.visits[lane].clear();
    }

    #[inline(always)]
    fn locate(&mut self, isa: Isa, scene: &Scene, len: usize, hits: &Hits) {
        self.places.locate(isa, scene, len, hits);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        V::scoring(decided).each(|lane| {
            let units = weights[lane].map(|weight| (weight * fixed_units(MOMENTS) + 0.5) as u64);
            self.faces[lane].push(faces[lane]);
            self.visits[lane].push((units, self.places.slopes.each_ref().map(|row| row[lane])));
        });
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, _: WalkRng) {
        let (faces, visits) = (&self.faces[lane], &self.visits[lane]);
        for &face in faces {
            self.board.count(face);
        }
        let nearest = [SLOPE_UNITS / 2; C];
        self.board.add_path(faces, |i| fixed(visits[i].0, visits[i].1, nearest));
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.faces.swap(from, to);
        self.visits.swap(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.board.expect(faces);
    }
}

/// Gathering: the value of each event's face times the weight there, on the face of birth and where the walk was born there.
pub(crate) struct GatherLinear<'a, V, const C: usize> {
    board: &'a mut LinearBoard<u128, u64, C>,
    /// What an event on each face is worth, over the largest of these values in its channel.
    values: &'a [[f64; C]],
    gathered: [Gathered<C>; WIDTH],
    /// ψ₁ and ψ₂ at the birth.
    births: [[i32; 2]; WIDTH],
    event: PhantomData<V>,
}

impl<'a, V, const C: usize> GatherLinear<'a, V, C> {
    pub(crate) fn new(board: &'a mut LinearBoard<u128, u64, C>, values: &'a [[f64; C]]) -> Self {
        let (gathered, births) = ([Gathered::default(); WIDTH], [[0; 2]; WIDTH]);
        GatherLinear { board, values, gathered, births, event: PhantomData }
    }
}

impl<V: Event, const C: usize> Scorer<C> for GatherLinear<'_, V, C> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, birth: u32) {
        self.gathered[lane] = Gathered { birth, scores: [0.0; C] };
        self.board.count(birth);
    }

    #[inline(always)]
    fn born_at(&mut self, lane: usize, surface: &Surface, cell: u32, uv: [f64; 2]) {
        self.births[lane] = slopes_at(surface.place_in_cell(cell, uv), surface.is_triangle());
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        V::scoring(decided).each(|lane| {
            self.gathered[lane].gather(weights[lane], self.values[faces[lane] as usize]);
        });
    }

    /// Scores are rounded as without slopes, and slopes by the other half of the same draws.
    #[inline(always)]
    fn end(&mut self, lane: usize, mut rng: WalkRng) {
        let Gathered { birth, scores } = self.gathered[lane];
        if scores.iter().any(|&score| score > 0.0) {
            let mut rounding = [0; C];
            let mut channels = rounding.iter_mut();
            let units = scores.map(|score| {
                let (units, other) = dithered::<MOMENTS>(score, &mut rng);
                *channels.next().expect("one for each channel") = (other * SLOPE_UNITS as f64) as i64;
                units as u64
            });
            self.board.add_path(&[birth], |_| fixed(units, self.births[lane], rounding));
        }
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.gathered[to] = self.gathered[from];
        self.births[to] = self.births[from];
    }
}
