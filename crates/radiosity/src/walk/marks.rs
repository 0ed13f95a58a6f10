//! What materials do to the light of every face (the likelihood ratio): marks of walks, and the board that sums them up.
//!
//! A path that has been reflected k times by material m, and then scores w on face i, has a probability, or a weight, that
//! grows with R_m as R_m^k. So ∂b_i/∂R_m is the mean of Σ w·(k + \[i is of m\])/R_m over all that a walk scores on i; the mark
//! of m is that number without the division. It holds for every estimator whose mean is Σ over paths of Φ·F·R·F … F, whatever
//! of R is probability and what is weight.
//!
//! A walk that arrives on i was reflected by all that it has met before. With i itself counted, the numbers k + \[i is of m\] are
//! those of arrivals on m up to now: bytes of a word for eight materials, which one addition keeps up to date.

use super::estimator::Event;
use super::score::{SEARCHED, Scorer, Visits, fixed_units};
use crate::random::rng::WalkRng;
use crate::simd::batch::{Decisions, Lanes, WIDTH};
use crate::simd::isa::{Isa, Kernel, Simd};
use crate::simd::prefetch::prefetch;

/// The number that a face has whose material's influence is not measured.
pub(crate) const NO_MATERIAL: u32 = u32::MAX;

/// The materials of a block: one for each byte of a word.
const BLOCK: usize = 8;

/// Up to this many blocks all are added up; of more, those that the walk has met.
const FEW_BLOCKS: usize = 3;

// Arrivals that are counted in bytes must fit them.
const _: () = assert!(SEARCHED < 1 << 8);

/// A whole number in which marks are summed up: u32 for hits, u64 for weights in fixed point.
pub(crate) trait Amount: Copy + Default + Into<u64> {
    /// The largest sum that a cell may hold.
    const MOST: u64;
    /// Whether scores have weights.
    const WEIGHTED: bool;
    /// A weight, `scale` being 1.
    fn of_weight(weight: f64, scale: f64) -> Self;
    /// A small number times this one.
    fn times(self, count: u8) -> Self;
    /// The sum, modulo the width.
    fn plus(self, other: Self) -> Self;
    /// The difference, modulo the width.
    fn minus(self, other: Self) -> Self;
    /// The square of the amount over 2^shift, which is rounded up, so that no variance comes out too small.
    fn square(self, shift: u32) -> Self;
}

impl Amount for u32 {
    const MOST: u64 = u32::MAX as u64;
    const WEIGHTED: bool = false;
    #[inline(always)]
    fn of_weight(_: f64, _: f64) -> Self {
        1
    }
    #[inline(always)]
    fn times(self, count: u8) -> Self {
        self.wrapping_mul(count.into())
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.wrapping_add(other)
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.wrapping_sub(other)
    }
    #[inline(always)]
    fn square(self, _: u32) -> Self {
        self.wrapping_mul(self)
    }
}

impl Amount for u64 {
    const MOST: u64 = u64::MAX >> 1;
    const WEIGHTED: bool = true;
    #[inline(always)]
    fn of_weight(weight: f64, scale: f64) -> Self {
        (weight * scale + 0.5) as u64
    }
    #[inline(always)]
    fn times(self, count: u8) -> Self {
        self.wrapping_mul(count.into())
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.wrapping_add(other)
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.wrapping_sub(other)
    }
    #[inline(always)]
    fn square(self, shift: u32) -> Self {
        let rounded = (self >> shift) + u64::from(self & ((1 << shift) - 1) != 0);
        rounded.wrapping_mul(rounded)
    }
}

/// What the materials of a block have scored on a face, channel by channel.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Cell<T, const C: usize> {
    sums: [[T; BLOCK]; C],
    squares: [[T; BLOCK]; C],
}

impl<T: Amount, const C: usize> Cell<T, C> {
    fn empty() -> Self {
        Cell { sums: [[T::default(); BLOCK]; C], squares: [[T::default(); BLOCK]; C] }
    }

    /// Raises what a walk has scored here.
    #[inline(always)]
    fn raise(&mut self, before: &[[T; BLOCK]; C], amounts: &[[T; BLOCK]; C], shift: u32) {
        for c in 0..C {
            for m in 0..BLOCK {
                let (was, amount) = (before[c][m], amounts[c][m]);
                let grown = was.plus(amount).square(shift).minus(was.square(shift));
                self.sums[c][m] = self.sums[c][m].plus(amount);
                self.squares[c][m] = self.squares[c][m].plus(grown);
            }
        }
    }

    /// The first score of a walk here.
    #[inline(always)]
    fn begin(&mut self, amounts: &[[T; BLOCK]; C], shift: u32) {
        for c in 0..C {
            for m in 0..BLOCK {
                self.sums[c][m] = self.sums[c][m].plus(amounts[c][m]);
                self.squares[c][m] = self.squares[c][m].plus(amounts[c][m].square(shift));
            }
        }
    }
}

/// A score of so many units in each channel, times the bytes of a word.
#[inline(always)]
fn amounts<T: Amount, const C: usize>(units: &[T; C], counts: u64) -> [[T; BLOCK]; C] {
    let counts = counts.to_le_bytes();
    std::array::from_fn(|c| std::array::from_fn(|m| units[c].times(counts[m])))
}

/// The boards of marks that there are.
#[derive(Clone, Debug)]
pub(crate) enum MarkBoard {
    /// Of hits.
    Hits(Marked<u32, 1>),
    /// Of weights in fixed point.
    Fixed(Marked<u64, 1>),
    /// Of weights in three channels.
    Coloured(Marked<u64, 3>),
}

/// Where the marks of materials are summed up: face by face, the cells of a face next to each other.
#[derive(Clone, Debug)]
pub(crate) struct Marked<T, const C: usize> {
    faces: usize,
    materials: usize,
    blocks: usize,
    /// Power sums of each score in a tally.
    moments: usize,
    /// Numbers of a row in a tally.
    columns: usize,
    /// Units of a weight of 1.
    scale: f64,
    /// Squares are those of units over 2^shift.
    shift: u32,
    cells: Vec<Cell<T, C>>,
    /// No number of a cell is larger than this.
    largest: u64,
    /// Rows of a tally, face by face for each material: what cells had no room for. Empty until there is such a thing.
    rows: Vec<u128>,
    /// Whether no sum has left its range.
    fits: bool,
}

impl<T: Amount, const C: usize> Marked<T, C> {
    /// An empty board for rows of `columns` numbers, of `moments` power sums each, of which marks have the first two.
    pub(crate) fn new([faces, materials]: [usize; 2], moments: usize, columns: usize) -> Self {
        let blocks = materials.div_ceil(BLOCK);
        let scale = if T::WEIGHTED { fixed_units(moments) } else { 1.0 };
        // Units of squares are 2⁻⁴⁰, whatever those of scores are.
        let shift = (scale.log2() as u32).saturating_sub(20);
        let cells = vec![Cell::empty(); faces * blocks];
        let rows = Vec::new();
        Marked {
            faces,
            materials,
            blocks,
            moments,
            columns,
            scale,
            shift,
            cells,
            largest: 0,
            rows,
            fits: true,
        }
    }

    /// Asks for the cells of faces ahead of time.
    #[inline(always)]
    fn expect(&self, faces: &[u32]) {
        let lines = size_of::<Cell<T, C>>() / 64 * self.blocks.min(FEW_BLOCKS);
        for &face in faces {
            prefetch(self.cells.as_ptr().wrapping_add(face as usize * self.blocks), lines);
        }
    }

    /// Makes room for a score on a face after which no amount of the walk there is larger than `most`. False where cells have
    /// no room for it.
    #[inline(always)]
    fn make_room(&mut self, most: u64) -> bool {
        let rounded = (most >> self.shift) + 1;
        let grown = rounded.saturating_mul(rounded).max(most);
        self.largest = self.largest.saturating_add(grown);
        self.largest <= T::MOST || self.make_room_by_emptying(grown)
    }

    #[cold]
    fn make_room_by_emptying(&mut self, grown: u64) -> bool {
        self.empty_cells();
        let has_room = grown <= T::MOST;
        self.largest = if has_room { grown } else { 0 };
        has_room
    }

    /// Raises what a walk has scored in a row.
    fn raise_row(&mut self, row: (usize, usize, usize), before: u128, more: u128) {
        let square = |x: u128| x.div_ceil(1 << self.shift).pow(2);
        let grown = square(before + more) - square(before);
        self.add_to_row(row, more, grown);
    }

    /// Adds to the sums of a row: of a face and a material, in a channel.
    fn add_to_row(&mut self, (face, material, c): (usize, usize, usize), sum: u128, squares: u128) {
        if self.rows.is_empty() {
            self.rows = vec![0; self.materials * self.faces * self.columns];
        }
        let first = (material * self.faces + face) * self.columns + c * self.moments;
        for (row, part) in
            self.rows[first..][..2].iter_mut().zip([Some(sum), squares.checked_shl(2 * self.shift)])
        {
            match part.and_then(|part| row.checked_add(part)) {
                Some(raised) => *row = raised,
                None => self.fits = false,
            }
        }
    }

    /// Moves what the cells hold to the rows.
    #[cold]
    fn empty_cells(&mut self) {
        for number in 0..self.cells.len() {
            let Cell { sums, squares } = std::mem::replace(&mut self.cells[number], Cell::empty());
            let (face, first) = (number / self.blocks, number % self.blocks * BLOCK);
            for (c, m) in (0..C).flat_map(|c| (0..BLOCK).map(move |m| (c, m))) {
                let sum: u64 = sums[c][m].into();
                if sum > 0 {
                    self.add_to_row((face, first + m, c), sum.into(), squares[c][m].into().into());
                }
            }
        }
        self.largest = 0;
    }

    /// Hands over the rows and empties the board; `None` where a sum has left its range.
    fn take(&mut self) -> Option<Vec<u128>> {
        self.empty_cells();
        let mut rows = std::mem::take(&mut self.rows);
        rows.resize(self.materials * self.faces * self.columns, 0);
        std::mem::replace(&mut self.fits, true).then_some(rows)
    }
}

impl MarkBoard {
    /// Hands over the rows and empties the board; `None` where a sum has left its range.
    pub(crate) fn take(&mut self) -> Option<Vec<u128>> {
        match self {
            MarkBoard::Hits(board) => board.take(),
            MarkBoard::Fixed(board) => board.take(),
            MarkBoard::Coloured(board) => board.take(),
        }
    }
}

/// An arrival of a walk that has arrived more often than is kept side by side.
#[derive(Clone, Copy)]
struct Late<T, const C: usize> {
    face: u32,
    units: [T; C],
    scores: bool,
}

/// Scores the marks of materials, beside what the scorer of a method does.
pub(crate) struct Marks<'a, T, const C: usize> {
    inner: &'a mut dyn Scorer<C>,
    board: &'a mut Marked<T, C>,
    material_of_face: &'a [u32],
    event: Event,
    isa: Isa,
    visits: Visits,
    /// By block: how often each walk has arrived on each material, byte by byte.
    arrivals: Vec<[u64; WIDTH]>,
    /// What `arrivals` was after each visit, block by block.
    history: Vec<[u64; WIDTH]>,
    /// What each visit has scored; empty for hits, which score 1.
    units: Vec<[[T; C]; WIDTH]>,
    late: Vec<Vec<Late<T, C>>>,
}

impl<'a, T: Amount, const C: usize> Marks<'a, T, C> {
    pub(crate) fn new(
        isa: Isa,
        (inner, board): (&'a mut dyn Scorer<C>, &'a mut Marked<T, C>),
        material_of_face: &'a [u32],
        event: Event,
    ) -> Self {
        let arrivals = vec![[0; WIDTH]; board.blocks];
        let (visits, history, units) = (Visits::new(), Vec::new(), Vec::new());
        let late = (0..WIDTH).map(|_| Vec::new()).collect();
        Marks { inner, board, material_of_face, event, isa, visits, arrivals, history, units, late }
    }

    fn scoring(&self, decided: &Decisions) -> Lanes {
        match self.event {
            Event::Arrival => decided.arrived,
            Event::Survival => decided.survived,
            Event::Absorption => decided.died,
        }
    }

    /// What a visit has scored.
    #[inline(always)]
    fn units(&self, visit: usize, lane: usize) -> [T; C] {
        if T::WEIGHTED { self.units[visit][lane] } else { [T::of_weight(1.0, 1.0); C] }
    }

    /// What the first `visits` visits of a walk have scored on a face for the materials of a block.
    fn scored(&self, lane: usize, face: u32, visits: usize, block: usize) -> [[T; BLOCK]; C] {
        let mut scored = [[T::default(); BLOCK]; C];
        for visit in (0..visits).filter(|&visit| self.visits.faces[visit][lane] == face) {
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
            return self.late[lane].push(Late { face, units, scores });
        }
        let blocks = self.board.blocks;
        if visit == self.visits.faces.len() {
            self.remember_more();
        }
        self.visits.faces[visit][lane] = face;
        self.visits.len[lane] = visit as u32 + 1;
        if T::WEIGHTED {
            self.units[visit][lane] = units;
        }
        let unit = units.into_iter().map(Into::into).max().unwrap_or(1);
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
            let most = sums.map(|(before, more)| before.plus(*more).into()).max().unwrap_or(0);
            if self.board.make_room(most) {
                self.board.cells[face as usize * blocks + block].raise(&before, &more, shift);
                continue;
            }
            for (c, m) in (0..C).flat_map(|c| (0..BLOCK).map(move |m| (c, m))) {
                let [before, more] = [&before, &more].map(|x| u128::from(x[c][m].into()));
                if more > 0 {
                    self.board.raise_row((face as usize, block * BLOCK + m, c), before, more);
                }
            }
        }
    }

    #[cold]
    fn remember_more(&mut self) {
        self.visits.faces.push([0; WIDTH]);
        self.history.extend(vec![[0; WIDTH]; self.board.blocks]);
        if T::WEIGHTED {
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
        for Late { face, units, scores } in late {
            if let Some(count) = counts.get_mut(self.material_of_face[face as usize] as usize) {
                *count += 1;
            }
            let Some(row) = faces.binary_search(&face).ok().filter(|_| scores) else { continue };
            for (total, &count) in totals[row * materials..].iter_mut().zip(&counts) {
                let more = units.map(|units| u128::from(units.into()) * u128::from(count));
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
                    let before = u128::from(before[c][m % BLOCK].into());
                    self.board.raise_row((face as usize, m, c), before, total[c]);
                }
            }
        }
    }
}

/// The arrivals of a batch.
struct Step<'a, 'b, T, const C: usize> {
    marks: &'a mut Marks<'b, T, C>,
    faces: &'a [u32; WIDTH],
    decided: &'a Decisions,
    weights: &'a [[f64; C]; WIDTH],
    earlier: [u32; WIDTH],
}

impl<T: Amount, const C: usize> Kernel for Step<'_, '_, T, C> {
    #[inline(always)]
    fn run<S: Simd>(self) {
        let Step { marks, faces, decided, weights, earlier } = self;
        let (scoring, scale) = (marks.scoring(decided), marks.board.scale);
        decided.arrived.each(
            #[inline(always)]
            |lane| {
                let units = weights[lane].map(|weight| T::of_weight(weight, scale));
                marks.arrive(lane, faces[lane], units, (scoring.has(lane), earlier[lane]));
            },
        );
    }
}

impl<T: Amount, const C: usize> Scorer<C> for Marks<'_, T, C> {
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
            Event::Arrival | Event::Survival => self.visits.earlier(self.isa, faces),
        };
        let isa = self.isa;
        isa.run(Step { marks: self, faces, decided, weights, earlier });
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::random::rng::Sequence;
    use crate::walk::{Space, plain};
    use crate::{EstimatorKind, Experiment, IndexChoice, Method, PatchGroup};
    use crate::{Scene, SceneSpec, Shape, Sides, Spectrum, SurfaceSpec};
    use glam::DVec3;

    /// A closed cube of two patches a side, whose reflectances are those of its channels.
    fn cube(reflectance: Spectrum, emittance: Spectrum) -> SceneSpec {
        let (o, e, axes) = (DVec3::ZERO, DVec3::ONE, DVec3::AXES);
        let surface = |i: usize| {
            let (u, v) = (axes[(i + 1) % 3], axes[(i + 2) % 3]);
            let (corner, u, v) = if i < 3 { (o, u, v) } else { (e, -v, -u) };
            let (corner_u, corner_v) = (corner + u, corner + v);
            let shape = Shape::Parallelogram { corner, corner_u, corner_v, cells: [2, 1] };
            SurfaceSpec {
                name: None,
                shape,
                sides: Sides::Front,
                reflectance,
                emittance,
                cell_emittance: vec![],
            }
        };
        SceneSpec { surfaces: (0..6).map(surface).collect() }
    }

    /// Patches dealt to materials in turn; the last patch is of none.
    fn materials(count: u32) -> Vec<PatchGroup> {
        let patches = |m: u32| (m..11).step_by(count as usize).map(|patch| (patch, patch)).collect();
        (0..count).map(|m| PatchGroup { name: m.to_string(), patches: patches(m) }).collect()
    }

    /// The rows of marks of some walks.
    fn marks<const M: usize>(
        spec: &SceneSpec,
        kind: EstimatorKind,
        count: u32,
        walks: u64,
    ) -> Vec<Vec<u128>> {
        let scene = Scene::build(spec, IndexChoice::Flat).unwrap();
        let experiment = Experiment::new(scene, Method::shooting(kind)).unwrap();
        let experiment = experiment.with_groups(&[], &materials(count)).unwrap();
        let mut board = experiment.board::<M>();
        experiment.walk(&Sequence::new(3), 0..walks, &mut board);
        let tally = board.take().unwrap();
        let first = experiment.rows() - count as usize * 12;
        let columns = tally.layout().columns();
        tally.sums()[first * columns..].chunks_exact(columns).map(<[u128]>::to_vec).collect()
    }

    /// Σx and Σx² of the marks of plain walks, row by row.
    fn plain_marks(spec: &SceneSpec, kind: EstimatorKind, count: u32, walks: usize) -> Vec<Vec<u128>> {
        let scene = Scene::build(spec, IndexChoice::Flat).unwrap();
        let mut rows = vec![vec![0; 2]; 12 * count as usize];
        for rng in Sequence::new(3).walks_from(0).take(walks) {
            let mut arrivals = vec![0_u128; count as usize];
            let mut scored: BTreeMap<usize, u128> = BTreeMap::new();
            plain::walk(&scene, Space::Discrete, rng, |face, survives| {
                if face < 11 {
                    arrivals[(face % count) as usize] += 1;
                }
                let scores = match kind {
                    EstimatorKind::Absorption => !survives,
                    EstimatorKind::Survival => survives,
                    _ => true,
                };
                for (m, mark) in arrivals.iter().enumerate().filter(|_| scores) {
                    *scored.entry(m * 12 + face as usize).or_default() += mark;
                }
            });
            for (row, x) in scored {
                rows[row][0] += x;
                rows[row][1] += x * x;
            }
        }
        rows
    }

    /// Walks that are short, that are longer than is kept side by side, and of which some are; of materials in one block, in
    /// several, and in more than are looked at without a question.
    #[test]
    fn marks_are_those_of_plain_walks() {
        for (reflectance, walks) in [(0.5, 3_000), (0.93, 1_000), (0.995, 100)] {
            let spec = cube(reflectance.into(), 1.0.into());
            for kind in [EstimatorKind::Collision, EstimatorKind::Survival, EstimatorKind::Absorption] {
                for count in [1, 3, 11] {
                    let plain = plain_marks(&spec, kind, count, walks);
                    let found = marks::<2>(&spec, kind, count, walks as u64);
                    assert_eq!(found, plain, "{kind:?}, {reflectance}, {count} materials");
                }
            }
        }
    }

    /// Where all channels are alike, weights are 1, and marks those of hits: in units of 2⁻⁴⁰, or of 2⁻²⁴.
    #[test]
    fn weights_of_one_are_hits() {
        for (reflectance, walks) in [(0.6, 3_000), (0.995, 100)] {
            let hits = marks::<2>(&cube(reflectance.into(), 1.0.into()), EstimatorKind::Collision, 3, walks);
            // One channel differs where it scores nothing, so that the scene has colours.
            let coloured = cube(Spectrum::rgb([reflectance; 3]), Spectrum::rgb([1.0, 1.0, 0.0]));
            let fine = marks::<2>(&coloured, EstimatorKind::Collision, 3, walks);
            let coarse = marks::<4>(&coloured, EstimatorKind::Collision, 3, walks);
            for ((hits, fine), coarse) in hits.iter().zip(&fine).zip(&coarse) {
                let [sum, squares] = [hits[0], hits[1]];
                assert_eq!(fine[..6], [sum << 40, squares << 80, sum << 40, squares << 80, 0, 0]);
                assert_eq!(coarse[..4], [sum << 24, squares << 48, 0, 0]);
            }
        }
    }

    /// Cells that are full are emptied into rows, and nothing is lost.
    #[test]
    fn full_cells_are_emptied() {
        let mut board = Marked::<u32, 1>::new([2, 3], 2, 2);
        for _ in 0..3 {
            assert!(board.make_room(60_000));
            board.cells[1].begin(&[[0, 0, 60_000, 0, 0, 0, 0, 0]], 0);
        }
        assert!(!board.make_room(70_000), "its square has no room in 32 bits");
        board.raise_row((1, 2, 0), 10, 70_000);
        let square = |x: u128| x * x;
        let expected = [250_000, 3 * square(60_000) + square(70_010) - square(10)];
        assert_eq!(board.take().unwrap()[10..], expected);
        assert_eq!(board.take().unwrap(), [0; 12]);
    }
}
