//! Where the walks of a batch have scored before, and what.

use std::collections::BTreeMap;

use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, Kernel, Simd};
use crate::tally::LinearScore;

/// The number of visits of a walk in which an earlier visit to the same face is searched; further visits are scored at
/// the walk's end.
pub(super) const SEARCHED: usize = 64;

/// The number of visits of a walk that are kept apart before they are scored: of a walk of millions all would take memory without end.
const APART: usize = 1 << 14;

/// What is kept of a visit, and of several visits of one walk to a face together.
pub(crate) trait VisitRecord: Copy {
    /// What is kept of no visits.
    const NONE: Self;
    /// What is kept of a visit of each walk of a batch.
    type Row: Copy;
    /// A row of no visits.
    const NO_ROW: Self::Row;
    /// What is found of earlier visits, while they are searched, for each walk of a batch: all, or nothing.
    type Sums;
    /// The sums of no visits.
    const NO_SUMS: Self::Sums;
    /// What is kept of a walk.
    fn of(row: &Self::Row, lane: usize) -> Self;
    /// Puts what is kept of a walk in its row.
    fn put(self, row: &mut Self::Row, lane: usize);
    /// The sum of two, part by part.
    fn plus(self, other: Self) -> Self;
    /// Adds to the sums of a walk what is kept of it in a row, where `same` is 1, and nothing where it is 0.
    fn add_if(same: u32, sums: &mut Self::Sums, row: &Self::Row, lane: usize);
}

/// What walks have scored is added up where a walk comes back to a face, which few do; that takes no sums beside the search.
macro_rules! score {
    ($score:ty, $none:expr, $plus:expr) => {
        impl<const C: usize> VisitRecord for $score {
            const NONE: Self = $none;
            type Row = [Self; WIDTH];
            const NO_ROW: Self::Row = [Self::NONE; WIDTH];
            type Sums = ();
            const NO_SUMS: () = ();
            #[inline(always)]
            fn of(row: &Self::Row, lane: usize) -> Self {
                row[lane]
            }
            #[inline(always)]
            fn put(self, row: &mut Self::Row, lane: usize) {
                row[lane] = self;
            }
            #[inline(always)]
            fn plus(self, other: Self) -> Self {
                $plus(self, other)
            }
            #[inline(always)]
            fn add_if(_: u32, (): &mut (), _: &Self::Row, _: usize) {}
        }
    };
}

score!([u64; C], [0; C], |a: Self, b: Self| std::array::from_fn(|c| a[c] + b[c]));
score!(LinearScore<u64, C>, LinearScore { units: [0; C], slopes: [[0; 2]; C] }, |a: Self, b: Self| LinearScore::plus(a, b));

/// Visits of every walk of a batch, each the walk's k-th.
#[derive(Clone, Copy)]
pub(super) struct Visit<P: VisitRecord> {
    pub(super) faces: [u32; WIDTH],
    pub(super) spots: P::Row,
}

impl<P: VisitRecord> Visit<P> {
    /// In place of visits.
    pub(super) const NONE: Self = Visit { faces: [0; WIDTH], spots: P::NO_ROW };
}

/// The first visits of each walk of a batch that scored; the later ones of a long walk are kept apart.
pub(super) struct Visits<P: VisitRecord> {
    /// `first[k].faces[lane]`: face number k of a walk.
    pub(super) first: Vec<Visit<P>>,
    pub(super) len: [u32; WIDTH],
    later: Vec<Vec<(u32, P)>>,
    /// By face, how many visits of a walk that were kept apart have been scored, and their sum.
    scored: Vec<BTreeMap<u32, (u64, P)>>,
    /// Whether some walk has as many visits apart as may be.
    pub(super) is_full: bool,
}

/// How often each walk of a batch has been on its face, and the sums of its spots there.
pub(super) struct Earlier<P: VisitRecord> {
    pub(super) visits: [u32; WIDTH],
    pub(super) spots: P::Sums,
}

impl<P: VisitRecord> Visits<P> {
    pub(super) fn new() -> Self {
        let (later, scored) = (0..WIDTH).map(|_| (Vec::new(), BTreeMap::new())).unzip();
        Visits { first: Vec::new(), len: [0; WIDTH], later, scored, is_full: false }
    }

    /// What each walk has scored on its face before.
    #[inline(always)]
    pub(super) fn earlier(&self, isa: Isa, faces: &[u32; WIDTH]) -> Earlier<P> {
        let mut earlier = Earlier { visits: [0; WIDTH], spots: P::NO_SUMS };
        isa.run(VisitSearch { visits: self, faces, earlier: &mut earlier });
        earlier
    }

    /// Remembers a visit; false where too many are remembered already, and it is kept apart.
    #[inline(always)]
    pub(super) fn push(&mut self, lane: usize, face: u32, spot: P) -> bool {
        let len = self.len[lane] as usize;
        if len == self.first.len() {
            if len == SEARCHED {
                self.later[lane].push((face, spot));
                self.is_full |= self.later[lane].len() >= APART;
                return false;
            }
            self.first.push(Visit::NONE);
        }
        let visit = &mut self.first[len];
        visit.faces[lane] = face;
        spot.put(&mut visit.spots, lane);
        self.len[lane] += 1;
        true
    }

    /// What is kept of a walk's visits to a face, but for those that were kept apart.
    pub(super) fn on(&self, lane: usize, face: u32) -> impl Iterator<Item = P> {
        let first = self.first[..self.len[lane] as usize].iter();
        first.filter(move |visit| visit.faces[lane] == face).map(move |visit| P::of(&visit.spots, lane))
    }

    /// The walks that have as many visits apart as may be. From now on none is said to have.
    pub(super) fn take_full(&mut self) -> Vec<usize> {
        self.is_full = false;
        (0..WIDTH).filter(|&lane| self.later[lane].len() >= APART).collect()
    }

    /// The number of a walk's visits to a face that were kept apart and have been scored, and their sum.
    pub(super) fn scored_on(&self, lane: usize, face: u32) -> (u64, P) {
        self.scored[lane].get(&face).copied().unwrap_or((0, P::NONE))
    }

    /// More visits of a walk to a face that were kept apart have been scored.
    pub(super) fn add_scored(&mut self, lane: usize, face: u32, (number, sum): (u64, P)) {
        let scored = self.scored[lane].entry(face).or_insert((0, P::NONE));
        *scored = (scored.0 + number, scored.1.plus(sum));
    }

    /// Forgets what was kept apart of a walk that has ended.
    pub(super) fn forget_scored(&mut self, lane: usize) {
        self.scored[lane].clear();
    }

    /// Takes the visits of a walk that were kept apart, sorted by face.
    pub(super) fn take_later(&mut self, lane: usize) -> Vec<(u32, P)> {
        let mut later = std::mem::take(&mut self.later[lane]);
        later.sort_unstable_by_key(|&(face, _)| face);
        later
    }

    pub(super) fn relocate(&mut self, from: usize, to: usize) {
        self.len[to] = self.len[from];
        for visit in &mut self.first {
            visit.faces[to] = visit.faces[from];
            P::of(&visit.spots, from).put(&mut visit.spots, to);
        }
        self.later.swap(from, to);
        self.scored.swap(from, to);
    }
}

/// Looks for the faces of a batch among earlier visits.
struct VisitSearch<'a, P: VisitRecord> {
    visits: &'a Visits<P>,
    faces: &'a [u32; WIDTH],
    earlier: &'a mut Earlier<P>,
}

impl<P: VisitRecord> Kernel for VisitSearch<'_, P> {
    #[inline(always)]
    fn run<S: Simd>(self) {
        let VisitSearch { visits, faces, earlier } = self;
        let longest = visits.len.iter().fold(0, |longest, &len| longest.max(len));
        for (k, visit) in (0..longest).zip(&visits.first) {
            for (lane, face) in faces.iter().enumerate() {
                let same = u32::from((visit.faces[lane] == *face) & (k < visits.len[lane]));
                earlier.visits[lane] += same;
                P::add_if(same, &mut earlier.spots, &visit.spots, lane);
            }
        }
    }
}

/// The faces that a walk scored on, and what: units U each.
#[derive(Clone, Debug)]
pub(super) struct Path<U> {
    pub(super) faces: Vec<u32>,
    pub(super) units: Vec<U>,
}

impl<U> Default for Path<U> {
    fn default() -> Self {
        Path { faces: Vec::new(), units: Vec::new() }
    }
}

impl<U> Path<U> {
    #[inline(always)]
    pub(super) fn push(&mut self, face: u32, units: U) {
        self.faces.push(face);
        self.units.push(units);
    }

    pub(super) fn clear(&mut self) {
        self.faces.clear();
        self.units.clear();
    }
}

pub(super) fn empty_paths<U: Clone>() -> Vec<Path<U>> {
    vec![Path::default(); WIDTH]
}
