//! Walks that are told apart by where they are born, and by the materials that they have met.
//!
//! Both scorers here stand between the kernel and the scorer of a method, which is reached by reference: once for a batch of
//! walks, so that this costs little, and the kernel is compiled once for all of them.

use super::estimator::Event;
use super::score::{Scorer, fixed_units};
use crate::random::rng::WalkRng;
use crate::simd::batch::{Decisions, Lanes, WIDTH};
use crate::simd::prefetch::prefetch;

/// Of a face that is of no material whose influence is measured.
pub(crate) const NO_MATERIAL: u32 = u32::MAX;

/// Hands the scores of each walk to the class that the walk belongs to: face i of a class is the slot i of a board, counted
/// from the first slot of the class.
pub(crate) struct ByClass<'a, const C: usize> {
    inner: &'a mut dyn Scorer<C>,
    /// By the face of birth.
    first_slots: &'a [u32],
    /// Of the classes of the walks in the batch.
    offsets: [u32; WIDTH],
}

impl<'a, const C: usize> ByClass<'a, C> {
    pub(crate) fn new(inner: &'a mut dyn Scorer<C>, first_slots: &'a [u32]) -> Self {
        ByClass { inner, first_slots, offsets: [0; WIDTH] }
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

impl<const C: usize> Scorer<C> for ByClass<'_, C> {
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

/// Where the marks of materials are summed up: rows of a tally, face by face for each material.
#[derive(Clone, Debug)]
pub(crate) struct MarkBoard {
    faces: usize,
    /// Power sums of each score.
    moments: usize,
    /// Numbers of a row.
    columns: usize,
    /// Units of a mark of weight 1.
    units: f64,
    sums: Vec<u128>,
    /// Whether no sum has left its range.
    fits: bool,
}

impl MarkBoard {
    /// An empty board. Marks count as hits do, or in fixed point.
    pub(crate) fn new([faces, materials]: [usize; 2], moments: usize, columns: usize, counts: bool) -> Self {
        let units = if counts { 1.0 } else { fixed_units(moments) };
        let sums = vec![0; materials * faces * columns];
        MarkBoard { faces, moments, columns, units, sums, fits: true }
    }

    /// Asks for a row ahead of time.
    #[inline(always)]
    fn expect(&self, row: u32) {
        prefetch(self.sums.as_ptr().wrapping_add(row as usize * self.columns), 1);
    }

    /// Adds what a whole walk has scored in one row.
    #[inline(always)]
    fn add<const C: usize>(&mut self, row: usize, marks: [f64; C]) {
        let row = &mut self.sums[row * self.columns..][..self.columns];
        for (sums, mark) in row.chunks_exact_mut(self.moments).zip(marks) {
            // The square of 64 bits has 128; higher powers may not fit.
            let x = (mark * self.units + 0.5) as u64;
            self.fits &= x < u64::MAX;
            let mut power = Some(u128::from(x));
            for (k, sum) in sums.iter_mut().enumerate() {
                power = match k {
                    0 => power,
                    1 => Some(u128::from(x) * u128::from(x)),
                    _ => power.and_then(|power| power.checked_mul(x.into())),
                };
                match power.and_then(|power| sum.checked_add(power)) {
                    Some(raised) => *sum = raised,
                    None => self.fits = false,
                }
            }
        }
    }

    /// Hands over the rows and empties the board; `None` where a sum has left its range.
    pub(crate) fn take(&mut self) -> Option<Vec<u128>> {
        let sums = vec![0; self.sums.len()];
        let sums = std::mem::replace(&mut self.sums, sums);
        std::mem::replace(&mut self.fits, true).then_some(sums)
    }
}

/// One arrival of a walk.
#[derive(Clone, Copy)]
struct Arrival<const C: usize> {
    face: u32,
    weights: [f64; C],
    scores: bool,
    survives: bool,
}

/// Scores, beside what the scorer of a method does, what materials do to the light of every face (the likelihood ratio).
///
/// A path that has been reflected k times by material m, and then scores w on face i, has a probability, or a weight, that
/// grows with R_m as R_m^k. So ∂b_i/∂R_m is the mean of Σ w·(k + \[i is of m\])/R_m over all that a walk scores on i; the mark
/// of m is that number without the division. It holds for every estimator whose mean is Σ over paths of Φ·F·R·F … F, whatever
/// of R is probability and what is weight.
pub(crate) struct Marks<'a, const C: usize> {
    inner: &'a mut dyn Scorer<C>,
    board: &'a mut MarkBoard,
    material_of_face: &'a [u32],
    event: Event,
    walks: Vec<Vec<Arrival<C>>>,
    /// How often the walk at hand was reflected, by material.
    reflections: Vec<(u32, f64)>,
    /// What the walk at hand has scored, by row.
    marks: Vec<(u32, [f64; C])>,
}

impl<'a, const C: usize> Marks<'a, C> {
    pub(crate) fn new(
        inner: &'a mut dyn Scorer<C>,
        board: &'a mut MarkBoard,
        material_of_face: &'a [u32],
        event: Event,
    ) -> Self {
        let (walks, reflections, marks) = (vec![Vec::new(); WIDTH], Vec::new(), Vec::new());
        Marks { inner, board, material_of_face, event, walks, reflections, marks }
    }

    fn scoring(&self, decided: &Decisions) -> Lanes {
        match self.event {
            Event::Arrival => decided.arrived,
            Event::Survival => decided.survived,
            Event::Absorption => decided.died,
        }
    }

    /// What one walk has scored, row by row.
    fn mark(&mut self, lane: usize) {
        self.reflections.clear();
        self.marks.clear();
        for &Arrival { face, weights, scores, survives } in &self.walks[lane] {
            let material = self.material_of_face[face as usize];
            let row = |material: u32| material * self.board.faces as u32 + face;
            let has_material = material != NO_MATERIAL;
            if scores {
                let mut is_met = !has_material;
                for &(met, times) in &self.reflections {
                    let times = times + f64::from(u8::from(met == material));
                    is_met |= met == material;
                    self.board.expect(row(met));
                    self.marks.push((row(met), weights.map(|weight| weight * times)));
                }
                if !is_met {
                    self.board.expect(row(material));
                    self.marks.push((row(material), weights));
                }
            }
            if survives && has_material {
                match self.reflections.iter_mut().find(|(met, _)| *met == material) {
                    Some((_, times)) => *times += 1.0,
                    None => self.reflections.push((material, 1.0)),
                }
            }
        }
        if self.marks.len() > 1 {
            self.marks.sort_unstable_by_key(|&(row, _)| row);
        }
        for of_row in self.marks.chunk_by(|(a, _), (b, _)| a == b) {
            let sum = |c: usize| of_row.iter().map(|(_, marks)| marks[c]).sum();
            self.board.add::<C>(of_row[0].0 as usize, std::array::from_fn(sum));
        }
    }
}

impl<const C: usize> Scorer<C> for Marks<'_, C> {
    #[inline(always)]
    fn begin(&mut self, lane: usize, birth: u32) {
        self.walks[lane].clear();
        self.inner.begin(lane, birth);
    }

    #[inline(always)]
    fn score(&mut self, faces: &[u32; WIDTH], decided: &Decisions, weights: &[[f64; C]; WIDTH]) {
        let (scoring, survived) = (self.scoring(decided), decided.survived);
        decided.arrived.each(|lane| {
            self.walks[lane].push(Arrival {
                face: faces[lane],
                weights: weights[lane],
                scores: scoring.has(lane),
                survives: survived.has(lane),
            });
        });
        self.inner.score(faces, decided, weights);
    }

    #[inline(always)]
    fn end(&mut self, lane: usize, rng: WalkRng) {
        self.mark(lane);
        self.inner.end(lane, rng);
    }

    fn relocate(&mut self, from: usize, to: usize) {
        self.walks.swap(from, to);
        self.inner.relocate(from, to);
    }

    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        self.inner.expect(faces);
    }
}
