//! What walks look up of surfaces, many at a time.

use crate::executor::{ParallelFor, collect};
use crate::simd::prefetch::prefetch;

/// Tables with up to this many rows are kept by columns, too.
const FEW: usize = 16;

/// A row of a table. It begins with a cache line: an allocation of its own alignment would spread each row over one line more.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct TableRow<const K: usize>([f64; K]);

/// A row of K numbers for each surface.
#[derive(Clone, Debug)]
pub(crate) struct Table<const K: usize> {
    rows: Vec<TableRow<K>>,
    /// The columns of a table with few rows.
    columns: Option<Box<[[f64; FEW]; K]>>,
}

impl<const K: usize> Table<K> {
    pub(crate) fn new(rows: Vec<[f64; K]>) -> Self {
        Table::of_rows(rows.into_iter().map(TableRow).collect())
    }

    /// A table whose rows are made one by one, on the threads of an executor.
    pub(crate) fn make(executor: &ParallelFor, count: usize, row: impl Fn(usize) -> [f64; K] + Sync) -> Self {
        Table::of_rows(collect(executor, count, |number| TableRow(row(number))))
    }

    fn of_rows(rows: Vec<TableRow<K>>) -> Self {
        let few = rows.len() <= FEW;
        let column =
            |k: usize| std::array::from_fn(|i| rows.get(i).map_or(0.0, |row: &TableRow<K>| row.0[k]));
        let columns = few.then(|| Box::new(std::array::from_fn(column)));
        Table { rows, columns }
    }

    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// What the table takes of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.rows[..]) + self.columns.as_ref().map_or(0, |columns| size_of_val(&**columns))
    }

    /// A row; the last one for numbers beyond the table, which rays that meet nothing have.
    #[inline(always)]
    pub(crate) fn row(&self, number: u32) -> &[f64; K] {
        &self.rows[(number as usize).min(self.rows.len() - 1)].0
    }

    /// Asks for rows ahead of time, of any numbers.
    #[inline(always)]
    pub(crate) fn expect(&self, numbers: &[u32]) {
        if self.columns.is_none() {
            for &number in numbers {
                prefetch(self.rows.as_ptr().wrapping_add(number as usize), (8 * K).div_ceil(64));
            }
        }
    }

    /// The columns of a table with few rows.
    #[cfg_attr(not(target_arch = "x86_64"), allow(dead_code, reason = "one instruction set picks from them"))]
    #[inline(always)]
    pub(crate) fn columns(&self) -> Option<&[[f64; FEW]; K]> {
        self.columns.as_deref()
    }
}
