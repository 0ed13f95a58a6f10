//! Factors of all groups, of each row those that walks have met.

use crate::counts::ExchangeCounts;
use crate::row::SparseRow;

/// Factors between groups in compressed rows, in the columns of [`ExchangeCounts::row`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseFactors {
    /// Where the entries of each row end.
    ends: Vec<usize>,
    columns: Vec<u32>,
    factors: Vec<f64>,
    /// N of each row.
    walks: Vec<f64>,
}

impl SparseFactors {
    /// Adds the next row, whose columns in the sky are part of what escapes: those behind `groups` and backs.
    ///
    /// # Panics
    /// Where the row has no walks.
    pub fn push(&mut self, row: &SparseRow, groups: u32) {
        let entries = row.entries().iter().map(|&(column, count)| (column, u64::from(count)));
        self.push_counts(row.walks(), entries, groups);
    }

    fn push_counts(&mut self, walks: u64, entries: impl Iterator<Item = (u32, u64)>, groups: u32) {
        assert!(walks > 0, "each group has walks");
        let begin = self.columns.len();
        for (column, count) in entries {
            let (column, factor) = (column.min(groups + 1), count as f64 / walks as f64);
            match self.columns[begin..].last() == Some(&column) {
                true => *self.factors.last_mut().expect("there is a column") += factor,
                false => {
                    self.columns.push(column);
                    self.factors.push(factor);
                }
            }
        }
        self.ends.push(self.columns.len());
        self.walks.push(walks as f64);
    }

    /// G, the number of groups.
    pub fn groups(&self) -> usize {
        self.ends.len()
    }

    /// N, the walks of a group.
    pub fn walks(&self, i: usize) -> f64 {
        self.walks[i]
    }

    /// The factors of a row that are not 0, each with its column: a group, G for backs, G + 1 for what escapes.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let begin = i.checked_sub(1).map_or(0, |before| self.ends[before]);
        let entries = begin..self.ends[i];
        let columns = self.columns[entries.clone()].iter();
        columns.map(|&column| column as usize).zip(self.factors[entries].iter().copied())
    }
}

impl From<&ExchangeCounts> for SparseFactors {
    fn from(counts: &ExchangeCounts) -> Self {
        let mut factors = SparseFactors::default();
        for i in 0..counts.groups() {
            let met = (0..).zip(counts.row(i).iter().copied()).filter(|&(_, count)| count > 0);
            factors.push_counts(counts.walks(i), met, counts.groups() as u32);
        }
        factors
    }
}
