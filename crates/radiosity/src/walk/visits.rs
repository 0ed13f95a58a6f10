//! Where the walks of a batch have scored before, and what.

use super::spots::Spot;
use crate::simd::batch::WIDTH;
use crate::simd::isa::{Isa, Kernel, Simd};
use crate::tally::Sum;

/// The number of visits of a walk in which an earlier visit to the same face is searched; further visits are scored at
/// the walk's end.
pub(super) const SEARCHED: usize = 64;

/// Visits of every walk of a batch, each the walk's k-th.
#[derive(Clone, Copy)]
pub(super) struct Visit<P: Spot> {
    pub(super) faces: [u32; WIDTH],
    pub(super) spots: P::Row,
}

impl<P: Spot> Visit<P> {
    /// In place of visits.
    pub(super) const NONE: Self = Visit { faces: [0; WIDTH], spots: P::NONE };
}

/// The first visits of each walk of a batch that scored; the later ones of a long walk are kept apart.
pub(super) struct Visits<P: Spot> {
    /// `first[k].faces[lane]`: face number k of a walk.
    pub(super) first: Vec<Visit<P>>,
    pub(super) len: [u32; WIDTH],
    later: Vec<Vec<(u32, P)>>,
}

/// How often each walk of a batch has been on its face, and the sums of its spots there.
pub(super) struct Earlier<P: Spot> {
    pub(super) visits: [u32; WIDTH],
    pub(super) spots: P::Row,
}

impl<P: Spot> Visits<P> {
    pub(super) fn new() -> Self {
        Visits { first: Vec::new(), len: [0; WIDTH], later: (0..WIDTH).map(|_| Vec::new()).collect() }
    }

    /// What each walk has scored on its face before.
    #[inline(always)]
    pub(super) fn earlier(&self, isa: Isa, faces: &[u32; WIDTH]) -> Earlier<P> {
        let mut earlier = Earlier { visits: [0; WIDTH], spots: P::NONE };
        isa.run(Search { visits: self, faces, earlier: &mut earlier });
        earlier
    }

    /// Remembers a visit; false where too many are remembered already, and it is kept apart.
    #[inline(always)]
    pub(super) fn push(&mut self, lane: usize, face: u32, spot: P) -> bool {
        let searched = self.note(lane, face, spot);
        if !searched {
            self.later[lane].push((face, spot));
        }
        searched
    }

    /// Remembers a visit; false where too many are remembered already.
    #[inline(always)]
    pub(super) fn note(&mut self, lane: usize, face: u32, spot: P) -> bool {
        let len = self.len[lane] as usize;
        if len == self.first.len() {
            if len == SEARCHED {
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

    /// Hands over the visits of a walk that were kept apart, with the number of earlier visits to the same face and the sum of
    /// their spots.
    pub(super) fn take_later(&mut self, lane: usize, mut score: impl FnMut(u32, (u64, P), P)) {
        let mut later = std::mem::take(&mut self.later[lane]);
        later.sort_unstable_by_key(|&(face, _)| face);
        for visits in later.chunk_by(|(a, _), (b, _)| a == b) {
            let face = visits[0].0;
            let plus = |(number, sum): (u64, P), spot: P| (number + 1, sum.plus(spot));
            let first = self.first.iter().filter(|visit| visit.faces[lane] == face);
            let mut before = first.map(|visit| P::of(&visit.spots, lane)).fold((0, P::default()), plus);
            for &(_, spot) in visits {
                score(face, before, spot);
                before = plus(before, spot);
            }
        }
    }

    pub(super) fn relocate(&mut self, from: usize, to: usize) {
        self.len[to] = self.len[from];
        for visit in &mut self.first {
            visit.faces[to] = visit.faces[from];
            P::of(&visit.spots, from).put(&mut visit.spots, to);
        }
        self.later.swap(from, to);
    }
}

/// Looks for the faces of a batch among earlier visits.
struct Search<'a, P: Spot> {
    visits: &'a Visits<P>,
    faces: &'a [u32; WIDTH],
    earlier: &'a mut Earlier<P>,
}

impl<P: Spot> Kernel for Search<'_, P> {
    #[inline(always)]
    fn run<S: Simd>(self) {
        let Search { visits, faces, earlier } = self;
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

impl<U: Sum> Path<U> {
    /// What it has scored on a face.
    pub(super) fn on(&self, face: u32) -> U {
        let visits = self.faces.iter().zip(&self.units).filter(|&(&visited, _)| visited == face);
        visits.fold(U::NONE, |sum, (_, &units)| sum.plus(units))
    }
}

pub(super) fn empty_paths<U: Clone>() -> Vec<Path<U>> {
    vec![Path::default(); WIDTH]
}
