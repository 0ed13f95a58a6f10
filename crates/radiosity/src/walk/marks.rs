//! What materials do to the light of every face (the likelihood ratio): marks of walks, and the board that sums them up.
//!
//! A path that has been reflected k times by material m, and then scores w on face i, has a probability, or a weight, that
//! grows with R_m as R_m^k. So ∂b_i/∂R_m is the mean of Σ w·(k + \[i is of m\])/R_m over all that a walk scores on i; the mark
//! of m is that number without the division. It holds for every estimator whose mean is Σ over paths of Φ·F·R·F … F, whatever
//! of R is probability and what is weight.
//!
//! A walk that arrives on i was reflected by all that it has met before. With i itself counted, the numbers k + \[i is of m\] are
//! those of arrivals on m up to now: bytes of a word for eight materials, which one addition keeps up to date.

mod board;
#[cfg(test)]
mod tests;

pub(crate) use board::{MarkBoard, Marked};

use self::board::{BLOCK, FEW_BLOCKS, MarkRow, amount_of, amounts, is_weighted};
use super::estimator::Event;
use super::score::Scorer;
use super::visits::{SEARCHED, Visit, Visits};
use crate::random::rng::WalkRng;
use crate::simd::batch::{Decisions, WIDTH};
use crate::simd::isa::{Isa, Kernel, Simd};
use crate::tally::Word;

/// The number that a face has whose material's influence is not measured.
pub(crate) const NO_MATERIAL: u32 = u32::MAX;

// Arrivals that are counted in bytes must fit them.
const _: () = assert!(SEARCHED < 1 << 8);

/// An arrival of a walk that has arrived more often than is kept side by side.
#[derive(Clone, Copy)]
struct LateArrival<T, const C: usize> {
    face: u32,
    units: [T; C],
    scores: bool,
}

/// Scores the marks of materials, beside what the scorer of a method does.
pub(crate) struct LikelihoodRatio<'a, T, const C: usize> {
    inner: &'a mut dyn Scorer<C>,
    board: &'a mut Marked<T, C>,
    material_of_face: &'a [u32],
    event: Event,
    isa: Isa,
    visits: Visits<()>,
    /// By block: how often each walk has arrived on each material, byte by byte.
    arrivals: Vec<[u64; WIDTH]>,
    /// What `arrivals` was after each visit, block by block.
    history: Vec<[u64; WIDTH]>,
    /// What each visit has scored; empty for hits, which score 1.
    units: Vec<[[T; C]; WIDTH]>,
    late: Vec<Vec<LateArrival<T, C>>>,
}

impl<'a, T: Word, const C: usize> LikelihoodRatio<'a, T, C> {
    pub(crate) fn new(
        isa: Isa,
        (inner, board): (&'a mut dyn Scorer<C>, &'a mut Marked<T, C>),
        material_of_face: &'a [u32],
        event: Event,
    ) -> Self {
        let arrivals = vec![[0; WIDTH]; board.blocks];
        let (visits, history, units) = (Visits::new(), Vec::new(), Vec::new());
        let late = (0..WIDTH).map(|_| Vec::new()).collect();
        LikelihoodRatio { inner, board, material_of_face, event, isa, visits, arrivals, history, units, late }
    }

    /// What a visit has scored.
    #[inline(always)]
    fn units(&self, visit: usize, lane: usize) -> [T; C] {
        if is_weighted::<T>() { self.units[visit][lane] } else { [amount_of(1.0, 1.0); C] }
    }

    /// What the first `visits` visits of a walk have scored on a face for the materials of a block.
    fn scored(&self, lane: usize, face: u32, visits: usize, block: usize) -> [[T; BLOCK]; C] {
        let mut scored = [[T::default(); BLOCK]; C];
        for visit in (0..visits).filter(|&visit| self.visits.first[visit].faces[lane] == face) {
            let counts = self.history[visit * self.board.blocks + block][lane];
            let more = amounts(&self.units(visit, lane), counts);
            for (sum, more) in scored.as_flattened_mut().iter_mut().zip(more.as_flattened()) {
                *sum = sum.plus(*more);
            }
        }
        scored
    }

    /// One walk has arrived on a face, where it has been `earlier` times.
    #[inline(always)]
    fn arrive(&mut self, lane: usize, face: u32, units: [T; C], (scores, earlier): (bool, u32)) {
        let visit = self.visits.len[lane] as usize;
        if visit == SEARCHED {
            return self.late[lane].push(LateArrival { face, units, scores });
        }
        let blocks = self.board.blocks;
        if visit == self.visits.first.len() {
            self.remember_more();
        }
        self.visits.first[visit].faces[lane] = face;
        self.visits.len[lane] = visit as u32 + 1;
        if is_weighted::<T>() {
            self.units[visit][lane] = units;
        }
        let unit = units.into_iter().map(|unit| unit.into() as u64).max().unwrap_or(1);
        let begins = scores && earlier == 0 && self.board.make_room((visit as u64 + 1) * unit);
        let material = self.material_of_face[face as usize] as usize;
        let own = 1_u64 << (material % BLOCK * 8);
        for block in 0..blocks {
            let counts = &mut self.arrivals[block][lane];
            *counts += if material / BLOCK == block { own } else { 0 };
            let counts = *counts;
            self.history[visit * blocks + block][lane] = counts;
            if begins && (blocks <= FEW_BLOCKS || counts > 0) {
                let (scored, shift) = (amounts(&units, counts), self.board.shift);
                self.board.cells[face as usize * blocks + block].begin(&scored, shift);
            }
        }
        if scores && !begins {
            self.score_again(lane, face, units, visit);
        }
    }

    /// Scores a visit to a face where the walk may have been before, or that cells have no room for.
    fn score_again(&mut self, lane: usize, face: u32, units: [T; C], visit: usize) {
        let (blocks, shift) = (self.board.blocks, self.board.shift);
        for block in 0..blocks {
            let more = amounts(&units, self.history[visit * blocks + block][lane]);
            let before = match self.event {
                Event::Absorption => [[T::default(); BLOCK]; C],
                Event::Arrival | Event::Survival => self.scored(lane, face, visit, block),
            };
            let sums = before.as_flattened().iter().zip(more.as_flattened());
            let most = sums.map(|(before, more)| before.plus(*more).into() as u64).max().unwrap_or(0);
            if self.board.make_room(most) {
                self.board.cells[face as usize * blocks + block].raise(&before, &more, shift);
                continue;
            }
            for (c, m) in (0..C).flat_map(|c| (0..BLOCK).map(move |m| (c, m))) {
                let [before, more]: [u128; 2] = [&before, &more].map(|x| x[c][m].into());
                if more > 0 {
                    let row = MarkRow { face: face as usize, material: block * BLOCK + m, channel: c };
                    self.board.raise_row(row, before, more);
                }
            }
        }
    }

    #[cold]
    fn remember_more(&mut self) {
        self.visits.first.push(Visit::NONE);
        self.history.extend(vec![[0; WIDTH]; self.board.blocks]);
        if is_weighted::<T>() {
            self.units.push([[T::default(); C]; WIDTH]);
        }
    }

    /// Scores the late arrivals of a walk, in rows.
    #[cold]
    fn score_late(&mut self, lane: usize) {
        let late = std::mem::take(&mut self.late[lane]);
        let materials = self.board.materials;
        let byte = |word: u64, m: usize| word.to_le_bytes()[m % BLOCK];
        let mut counts: Vec<u64> =
            (0..materials).map(|m| byte(self.arrivals[m / BLOCK][lane], m).into()).collect();
        let mut faces: Vec<u32> = late.iter().filter(|late| late.scores).map(|late| late.face).collect();
        faces.sort_unstable();
        faces.dedup();
        let mut totals = vec![[0_u128; C]; faces.len() * materials];
        for LateArrival { face, units, scores } in late {
            if let Some(count) = counts.get_mut(self.material_of_face[face as usize] as usize) {
                *count += 1;
            }
            let Some(row) = faces.binary_search(&face).ok().filter(|_| scores) else { continue };
            for (total, &count) in totals[row * materials..].iter_mut().zip(&counts) {
                let more = units.map(|units| Into::<u128>::into(units) * u128::from(count));
                total.iter_mut().zip(more).for_each(|(total, more)| *total += more);
            }
        }
        for (&face, totals) in faces.iter().zip(totals.chunks_exact(materials)) {
            for block in 0..self.board.blocks {
                let before = match self.event {
                    Event::Absorption => [[T::default(); BLOCK]; C],
                    Event::Arrival | Event::Survival => self.scored(lane, face, SEARCHED, block),
                };
                let of_block = totals.iter().enumerate().skip(block * BLOCK).take(BLOCK);
                for ((m, total), c) in of_block.flat_map(|it| (0..C).map(move |c| (it, c))) {
                    let before = before[c][m % BLOCK].into();
                    let row = MarkRow { face: face as usize, material: m, channel: c };
                    self.board.raise_row(row, before, total[c]);
                }
            }
        }
    }
}

/// The arrivals of a batch.
struct BatchArrivals<'a, 'b, T, const C: usize> {
    marks: &'a mut LikelihoodRatio<'b, T, C>,
    faces: &'a [u32; WIDTH],
    decided: &'a Decisions,
    weights: &'a [[f64; C]; WIDTH],
    earlier: [u32; WIDTH],
}

impl<T: Word, const C: usize> Kernel for BatchArrivals<'_, '_, T, C> {
    #[inline(always)]
    fn run<S: Simd>(self) {
        let BatchArrivals { marks, faces, decided, weights, earlier } = self;
        let (scoring, scale) = (marks.event.scoring(decided), marks.board.scale);
        decided.arrived.each(
            #[inline(always)]
            |lane| {
                let units = weights[lane].map(|weight| amount_of(weight, scale));
                marks.arrive(lane, faces[lane], units, (scoring.has(lane), earlier[lane]));
            },
        );
    }
}

impl<T: Word, const C: usize> Scorer<C> for LikelihoodRatio<'_, T, C> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, birth: u32) {
        self.visits.len[lane] = 0;
        self.arrivals.iter_mut().for_each(|block| block[lane] = 0);
        self.inner.begin(lane, birth);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        // A walk is absorbed once.
        let earlier = match self.event {
            Event::Absorption => [0; WIDTH],
            Event::Arrival | Event::Survival => self.visits.earlier(self.isa, faces).visits,
        };
        let isa = self.isa;
        isa.run(BatchArrivals { marks: self, faces, decided, weights, earlier });
        self.inner.score(faces, decided, weights);
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, rng: WalkRng) {
        if self.visits.len[lane] == SEARCHED as u32 {
            self.score_late(lane);
        }
        self.inner.end(lane, rng);
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.visits.relocate(from, to);
        self.arrivals.iter_mut().chain(&mut self.history).for_each(|row| row[to] = row[from]);
        self.units.iter_mut().for_each(|row| row[to] = row[from]);
        self.late.swap(from, to);
        self.inner.relocate(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.board.expect(faces);
        self.inner.expect(faces);
    }
}
