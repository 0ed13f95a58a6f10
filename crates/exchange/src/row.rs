//! A counted row of exchange factors that keeps what it has met, however many groups there are.

use std::collections::HashMap;

use stats::mid_p_interval;

use crate::factors::{Factor, factors_of};

/// One counted row: the columns that walks have met, in ascending order, and how many walks met each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SparseRow {
    entries: Vec<(u32, u32)>,
}

/// What a threshold took out of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// How many factors.
    pub entries: u64,
    /// The walks of all of them.
    pub walks: u64,
}

impl SparseRow {
    /// A row of columns in ascending order, each with its walks.
    ///
    /// # Panics
    /// Where columns are not in ascending order, or one has no walk.
    pub fn new(entries: Vec<(u32, u32)>) -> Self {
        assert!(entries.is_sorted_by(|a, b| a.0 < b.0), "columns ascend");
        assert!(entries.iter().all(|&(_, count)| count > 0), "columns without walks are left out");
        SparseRow { entries }
    }

    /// The row with the walks of another one of the same group.
    #[must_use]
    pub fn plus(&self, other: &SparseRow) -> SparseRow {
        let mut entries = Vec::with_capacity(self.entries.len() + other.entries.len());
        let mut others = other.entries.iter().copied().peekable();
        for &(column, count) in &self.entries {
            entries.extend(std::iter::from_fn(|| others.next_if(|&(other, _)| other < column)));
            let more = others.next_if(|&(other, _)| other == column).map_or(0, |(_, more)| more);
            entries.push((column, count + more));
        }
        entries.extend(others);
        SparseRow { entries }
    }

    /// The columns that walks have met, each with their number.
    pub fn entries(&self) -> &[(u32, u32)] {
        &self.entries
    }

    /// N, the walks of the row.
    pub fn walks(&self) -> u64 {
        self.entries.iter().map(|&(_, count)| u64::from(count)).sum()
    }

    /// The walks that met a column.
    pub fn count(&self, column: u32) -> u32 {
        self.entries.binary_search_by_key(&column, |&(column, _)| column).map_or(0, |at| self.entries[at].1)
    }

    /// The factors of the entries, n/N to 52 bits, which add up to exactly 1 in any order.
    pub fn factors(&self) -> impl Iterator<Item = f64> + '_ {
        factors_of(self.walks(), self.entries.iter().map(|&(_, count)| u64::from(count)))
    }

    /// Moves the factors below `least` that go to one of the first `groups` columns into column `rest`, which is beyond all others.
    pub fn drop_below(&mut self, least: f64, groups: u32, rest: u32) -> Dropped {
        let fewest = least * self.walks() as f64;
        let mut dropped = Dropped::default();
        self.entries.retain(|&(column, count)| {
            let small = column < groups && f64::from(count) < fewest;
            dropped.entries += u64::from(small);
            dropped.walks += if small { u64::from(count) } else { 0 };
            !small
        });
        if dropped.walks > 0 {
            self.entries.push((rest, dropped.walks as u32));
        }
        dropped
    }

    /// The sum of the variances of the factors, (1 − Σ p²)/N.
    pub fn variance(&self) -> f64 {
        let walks = self.walks() as f64;
        let squares: f64 = self.entries.iter().map(|&(_, count)| (f64::from(count) / walks).powi(2)).sum();
        (1.0 - squares) / walks
    }

    /// The part of some walks that the row needs beside others, √(1 − Σ p²), by those that it has: of rows of one area the sum of variances is
    /// least where walks go in this proportion. One walk more is taken to have gone elsewhere, so that none seems certain.
    pub fn need(&self) -> f64 {
        let walks = self.walks() as f64 + 1.0;
        let squares: f64 = self.entries.iter().map(|&(_, count)| (f64::from(count) / walks).powi(2)).sum();
        (1.0 - squares).max(0.0).sqrt()
    }

    /// The relative error of the row: the half-width of each interval over its factor, in the mean square, each factor counting by its
    /// size, as [`Factors::row_error`](crate::Factors::row_error) has it.
    pub fn error(&self, intervals: &mut Intervals) -> f64 {
        let walks = self.walks();
        let square = |&(_, count): &(u32, u32)| {
            let factor = f64::from(count) / walks as f64;
            intervals.of(count, walks).half_width().powi(2) / factor
        };
        self.entries.iter().map(square).sum::<f64>().sqrt()
    }

    /// Appends the row to some bytes: numbers of 7 bits a byte, the lowest first, the highest bit set but in the last byte. The
    /// number of entries, then the step from the column before and the count of each.
    pub fn pack(&self, bytes: &mut Vec<u8>) {
        put(bytes, self.entries.len() as u64);
        let mut next = 0;
        for &(column, count) in &self.entries {
            put(bytes, u64::from(column - next));
            put(bytes, u64::from(count));
            next = column;
        }
    }

    /// The row that [`SparseRow::pack`] made these bytes of, and no more than it; `None` where they are of no row.
    pub fn unpack(mut bytes: &[u8]) -> Option<Self> {
        let count = take(&mut bytes)? as usize;
        let mut entries = Vec::with_capacity(count.min(bytes.len()));
        let mut next = 0_u32;
        for place in 0..count {
            let step = u32::try_from(take(&mut bytes)?).ok()?;
            next = next.checked_add(step).filter(|_| step > 0 || place == 0)?;
            entries.push((next, u32::try_from(take(&mut bytes)?).ok().filter(|&count| count > 0)?));
        }
        bytes.is_empty().then_some(SparseRow { entries })
    }
}

fn put(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

fn take(bytes: &mut &[u8]) -> Option<u64> {
    let end = bytes.iter().take(9).position(|byte| byte & 0x80 == 0)?;
    let (number, rest) = bytes.split_at(end + 1);
    *bytes = rest;
    Some(number.iter().rev().fold(0, |sum, byte| sum << 7 | u64::from(byte & 0x7f)))
}

/// Intervals of one level, each computed once: rows have few different counts. They hold in the mean over factors
/// ([`mid_p_interval`]), of which a sparse matrix has millions.
#[derive(Clone, Debug)]
pub struct Intervals {
    level: f64,
    known: HashMap<(u64, u32), Factor>,
}

/// Intervals that are kept; beyond these, all are computed anew.
const MOST_KEPT: usize = 1 << 20;

impl Intervals {
    /// Intervals that hold each with the probability `level`.
    pub fn new(level: f64) -> Self {
        Intervals { level, known: HashMap::new() }
    }

    /// A factor that `count` of some walks met.
    pub fn of(&mut self, count: u32, walks: u64) -> Factor {
        if self.known.len() > MOST_KEPT {
            self.known.clear();
        }
        let level = self.level;
        *self.known.entry((walks, count)).or_insert_with(|| Factor {
            interval: mid_p_interval(count.into(), walks, level),
            ..Factor::of(count.into(), walks, level)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row() -> SparseRow {
        SparseRow::new(vec![(0, 3), (7, 1), (200, 90_000), (70_000, 2), (1_000_001, 4)])
    }

    #[test]
    fn packed_rows_are_read_back() {
        for row in [row(), SparseRow::default(), SparseRow::new(vec![(u32::MAX, u32::MAX)])] {
            let mut bytes = Vec::new();
            row.pack(&mut bytes);
            assert_eq!(SparseRow::unpack(&bytes), Some(row));
            for cut in 0..bytes.len() {
                assert_eq!(SparseRow::unpack(&bytes[..cut]), None, "{cut}");
            }
            bytes.push(0);
            assert_eq!(SparseRow::unpack(&bytes), None);
        }
        // Two entries of one column, an entry without walks, a number beyond 32 bits.
        for bytes in [&[2, 1, 1, 0, 1][..], &[1, 1, 0], &[1, 1, 0xff, 0xff, 0xff, 0xff, 0x1f]] {
            assert_eq!(SparseRow::unpack(bytes), None);
        }
    }

    #[test]
    fn rows_of_one_group_add_up() {
        let [a, b] = [vec![(1, 2), (4, 1)], vec![(0, 7), (4, 2), (9, 3)]].map(SparseRow::new);
        let sum = SparseRow::new(vec![(0, 7), (1, 2), (4, 3), (9, 3)]);
        assert_eq!((a.plus(&b), b.plus(&a), a.plus(&SparseRow::default())), (sum.clone(), sum, a));
    }

    /// To the last bit, in any order, also with what was dropped.
    #[test]
    fn rows_add_up_to_one_and_say_what_was_dropped() {
        let mut row = row();
        let sums = |row: &SparseRow| {
            let factors: Vec<f64> = row.factors().collect();
            (factors.iter().sum::<f64>(), factors.iter().rev().sum::<f64>())
        };
        assert_eq!(sums(&row), (1.0, 1.0));
        let dropped = row.drop_below(3.5 / 90_010.0, 1_000_000, 1_000_002);
        assert_eq!(dropped, Dropped { entries: 3, walks: 6 });
        assert_eq!(row.entries(), [(200, 90_000), (1_000_001, 4), (1_000_002, 6)]);
        assert_eq!((sums(&row), row.walks(), row.count(200), row.count(0)), ((1.0, 1.0), 90_010, 90_000, 0));
    }

    #[test]
    fn errors_are_about_those_of_dense_rows() {
        let counts = crate::ExchangeCounts::of(&[vec![1000, 20, 0, 4], vec![1024, 0, 0, 0]]);
        let dense = crate::Factors::new(&counts, 0.95);
        let row = SparseRow::new(vec![(0, 1000), (1, 20), (3, 4)]);
        let mut intervals = Intervals::new(0.95);
        assert!((row.error(&mut intervals) / dense.row_error(0) - 1.0).abs() < 0.1);
        let [narrow, wide] = [intervals.of(20, 1024), dense.get(0, 1)];
        assert_eq!((narrow.factor, narrow.std_error), (wide.factor, wide.std_error));
        assert!(wide.interval.low < narrow.interval.low && narrow.interval.high < wide.interval.high);
        assert_eq!(intervals.of(0, 1024).interval, dense.get(0, 2).interval);
        let variance: f64 =
            [1000.0, 20.0, 4.0].iter().map(|n| n / 1024.0 * (1.0 - n / 1024.0) / 1024.0).sum();
        assert!((row.variance() - variance).abs() < 1e-15);
    }
}
