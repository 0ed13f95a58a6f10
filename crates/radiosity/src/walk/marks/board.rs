//! Where marks are summed up: cells of eight materials, face by face, and rows of a tally for what cells have no room for.

use crate::simd::prefetch::prefetch;
use crate::tally::MOMENTS;
use crate::tally::Word;
use crate::walk::score::FIXED_UNITS;

/// The materials of a block: one for each byte of a word.
pub(super) const BLOCK: usize = 8;

/// Up to this many blocks all are added up; of more, those that the walk has met.
pub(super) const FEW_BLOCKS: usize = 3;

/// Whether marks summed up in such words have weights in fixed point: 64 bits do, 32 are for hits.
pub(super) const fn is_weighted<W: Word>() -> bool {
    W::BITS > u32::BITS
}

/// The largest sum that a cell may hold.
const fn capacity<W: Word>() -> u64 {
    if is_weighted::<W>() { u64::MAX >> 1 } else { u32::MAX as u64 }
}

/// What a mark of a weight adds to its sum, `scale` being 1.
#[inline(always)]
pub(super) fn amount_of<W: Word>(weight: f64, scale: f64) -> W {
    if is_weighted::<W>() { W::from_units(weight * scale + 0.5) } else { W::from(1) }
}

/// The square of an amount over 2^shift, which is rounded up, so that no variance comes out too small; of hits as they are.
#[inline(always)]
fn square<W: Word>(amount: W, shift: u32) -> W {
    let coarse = if is_weighted::<W>() { amount.over(shift) } else { amount };
    coarse.times(coarse)
}

/// What the materials of a block have scored on a face, channel by channel.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct MaterialScores<T, const C: usize> {
    sums: [[T; BLOCK]; C],
    squares: [[T; BLOCK]; C],
}

impl<T: Word, const C: usize> MaterialScores<T, C> {
    pub(super) fn empty() -> Self {
        MaterialScores { sums: [[T::default(); BLOCK]; C], squares: [[T::default(); BLOCK]; C] }
    }

    /// Raises what a walk has scored here.
    #[inline(always)]
    pub(super) fn raise(&mut self, before: &[[T; BLOCK]; C], amounts: &[[T; BLOCK]; C], shift: u32) {
        for c in 0..C {
            for m in 0..BLOCK {
                let (was, amount) = (before[c][m], amounts[c][m]);
                let grown = square(was.plus(amount), shift).minus(square(was, shift));
                self.sums[c][m] = self.sums[c][m].plus(amount);
                self.squares[c][m] = self.squares[c][m].plus(grown);
            }
        }
    }

    /// The first score of a walk here.
    #[inline(always)]
    pub(super) fn begin(&mut self, amounts: &[[T; BLOCK]; C], shift: u32) {
        let rows = self.sums.iter_mut().zip(&mut self.squares).zip(amounts);
        for ((sums, squares), amounts) in rows {
            for ((sum, sum_of_squares), amount) in sums.iter_mut().zip(squares).zip(amounts) {
                *sum = sum.plus(*amount);
                *sum_of_squares = sum_of_squares.plus(square(*amount, shift));
            }
        }
    }
}

/// The units of a score in each channel, times the bytes of a word.
#[inline(always)]
pub(super) fn amounts<T: Word, const C: usize>(units: &[T; C], counts: u64) -> [[T; BLOCK]; C] {
    let counts = counts.to_le_bytes();
    std::array::from_fn(|c| std::array::from_fn(|m| units[c].times(counts[m].into())))
}

/// The row of a tally that holds the marks of a material on a face, and the channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct MarkRow {
    pub(super) face: usize,
    pub(super) material: usize,
    pub(super) channel: usize,
}

/// The boards of marks that there are.
#[derive(Clone, Debug)]
pub(crate) enum MarkBoard {
    /// Marks of walks that score whole hits.
    Hits(Marked<u32, 1>),
    /// Marks of walks that score weights in fixed point.
    Fixed(Marked<u64, 1>),
    /// Marks of walks that carry weights in three channels.
    Coloured(Marked<u64, 3>),
}

/// Where the marks of materials are summed up: face by face, the cells of a face next to each other.
#[derive(Clone, Debug)]
pub(crate) struct Marked<T, const C: usize> {
    faces: usize,
    pub(super) materials: usize,
    pub(super) blocks: usize,
    /// Numbers of a row in a tally.
    columns: usize,
    /// Units of a weight of 1.
    pub(super) scale: f64,
    /// Squares are those of units over 2^shift.
    pub(super) shift: u32,
    pub(super) cells: Vec<MaterialScores<T, C>>,
    /// No number of a cell is larger than this.
    largest: u64,
    /// Rows of a tally, face by face for each material: what cells had no room for. Empty until there is such a thing.
    rows: Vec<u128>,
    /// Whether no sum has left its range.
    fits: bool,
}

impl<T: Word, const C: usize> Marked<T, C> {
    /// An empty board for rows of `columns` numbers.
    pub(crate) fn new([faces, materials]: [usize; 2], columns: usize) -> Self {
        let blocks = materials.div_ceil(BLOCK);
        let scale = if is_weighted::<T>() { FIXED_UNITS } else { 1.0 };
        let shift = (scale.log2() as u32).saturating_sub(20);
        let cells = vec![MaterialScores::empty(); faces * blocks];
        let rows = Vec::new();
        Marked { faces, materials, blocks, columns, scale, shift, cells, largest: 0, rows, fits: true }
    }

    /// Asks for the cells of faces ahead of time.
    #[inline(always)]
    pub(super) fn expect(&self, faces: &[u32]) {
        let lines = size_of::<MaterialScores<T, C>>() / 64 * self.blocks.min(FEW_BLOCKS);
        for &face in faces {
            prefetch(self.cells.as_ptr().wrapping_add(face as usize * self.blocks), lines);
        }
    }

    /// Makes room for a score on a face after which no amount of the walk there is larger than `most`. False where cells have
    /// no room for it.
    #[inline(always)]
    pub(super) fn make_room(&mut self, most: u64) -> bool {
        let rounded = (most >> self.shift) + 1;
        let grown = rounded.saturating_mul(rounded).max(most);
        self.largest = self.largest.saturating_add(grown);
        self.largest <= capacity::<T>() || self.make_room_by_emptying(grown)
    }

    #[cold]
    fn make_room_by_emptying(&mut self, grown: u64) -> bool {
        self.empty_cells();
        let has_room = grown <= capacity::<T>();
        self.largest = if has_room { grown } else { 0 };
        has_room
    }

    /// Raises what a walk has scored in a row.
    pub(super) fn raise_row(&mut self, row: MarkRow, before: u128, more: u128) {
        let square = |x: u128| x.div_ceil(1 << self.shift).pow(2);
        let grown = square(before + more) - square(before);
        self.add_to_row(row, more, grown);
    }

    /// Adds to the sums of a row.
    fn add_to_row(&mut self, row: MarkRow, sum: u128, squares: u128) {
        let MarkRow { face, material, channel } = row;
        if self.rows.is_empty() {
            self.rows = vec![0; self.materials * self.faces * self.columns];
        }
        let first = (material * self.faces + face) * self.columns + channel * MOMENTS;
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
            let MaterialScores { sums, squares } =
                std::mem::replace(&mut self.cells[number], MaterialScores::empty());
            let (face, first) = (number / self.blocks, number % self.blocks * BLOCK);
            for (c, m) in (0..C).flat_map(|c| (0..BLOCK).map(move |m| (c, m))) {
                let sum = sums[c][m].into();
                if sum > 0 {
                    let row = MarkRow { face, material: first + m, channel: c };
                    self.add_to_row(row, sum, squares[c][m].into());
                }
            }
        }
        self.largest = 0;
    }

    /// Hands over the rows and empties the board; `None` where a sum has left its range.
    pub(super) fn take(&mut self) -> Option<Vec<u128>> {
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
