//! Counted rows as matrices: read from their file whenever a writer goes through them.

use std::cell::RefCell;
use std::io;
use std::path::PathBuf;

use exchange::{Dropped, Intervals, SmoothedRows, SparseRow};
use report::{MatrixRow, MatrixRows};

use super::journal::{RowsReader, StoredRow};
use crate::error::Error;

/// The rows of a file, below whose threshold factors are dropped.
#[derive(Clone, Debug)]
pub(super) struct RowsFile {
    pub(super) path: PathBuf,
    pub(super) groups: usize,
    /// Columns of the rows, and one more where factors may be dropped.
    pub(super) columns: usize,
    pub(super) least: f64,
}

impl RowsFile {
    /// Visits all rows, each with what was dropped of it.
    ///
    /// # Errors
    /// Those of `visit`, and where the file is not whole.
    pub(super) fn each(
        &self,
        visit: &mut dyn FnMut(usize, &StoredRow, Dropped) -> io::Result<()>,
    ) -> Result<(), Error> {
        let mut reader = RowsReader::open(&self.path)?;
        let failed = |source| Error::Rows { path: self.path.clone(), source };
        let mut number = reader.heading.rows.start;
        while let Some(mut kept) = reader.next().map_err(failed)? {
            let dropped = self.drop_small(&mut kept.row);
            visit(number, &kept, dropped).map_err(failed)?;
            number += 1;
        }
        Ok(())
    }

    fn drop_small(&self, row: &mut SparseRow) -> Dropped {
        match self.least > 0.0 {
            true => row.drop_below(self.least, self.groups as u32, self.columns as u32 - 1),
            false => Dropped::default(),
        }
    }
}

/// What of the entries a matrix holds.
pub(super) enum EntryFilter {
    /// n/N.
    Factor,
    /// n.
    Count,
    /// The ends of their intervals.
    Low(RefCell<Intervals>),
    /// The upper ones.
    High(RefCell<Intervals>),
}

/// Numbers of the entries of all rows.
pub(super) struct RowsMatrix<'a> {
    pub(super) file: &'a RowsFile,
    pub(super) entries: u64,
    pub(super) view: EntryFilter,
}

impl RowsMatrix<'_> {
    fn numbers(&self, row: &SparseRow) -> Vec<(u32, f64)> {
        let walks = row.walks();
        let each = |of: &dyn Fn(u32) -> f64| {
            row.entries().iter().map(|&(column, count)| (column, of(count))).collect()
        };
        match &self.view {
            EntryFilter::Factor => {
                row.entries().iter().map(|&(column, _)| column).zip(row.factors()).collect()
            }
            EntryFilter::Count => each(&|count| f64::from(count)),
            EntryFilter::Low(intervals) => {
                each(&|count| intervals.borrow_mut().of(count, walks).interval.low)
            }
            EntryFilter::High(intervals) => {
                each(&|count| intervals.borrow_mut().of(count, walks).interval.high)
            }
        }
    }
}

/// Smoothed factors of all rows.
pub(super) struct SmoothedMatrix<'a> {
    pub(super) file: &'a RowsFile,
    pub(super) rows: &'a SmoothedRows,
}

impl MatrixRows for SmoothedMatrix<'_> {
    fn rows(&self) -> usize {
        self.file.groups
    }

    fn columns(&self) -> usize {
        self.file.columns
    }

    fn entries(&self) -> u64 {
        self.rows.entries()
    }

    fn each(&self, visit: &mut dyn FnMut(MatrixRow<'_>) -> io::Result<()>) -> io::Result<()> {
        let mut entries = Vec::new();
        (0..self.file.groups).try_for_each(|row| {
            entries.clear();
            entries.extend(self.rows.row(row));
            visit(MatrixRow { row, entries: &entries })
        })
    }
}

impl MatrixRows for RowsMatrix<'_> {
    fn rows(&self) -> usize {
        self.file.groups
    }

    fn columns(&self) -> usize {
        self.file.columns
    }

    fn entries(&self) -> u64 {
        self.entries
    }

    fn each(&self, visit: &mut dyn FnMut(MatrixRow<'_>) -> io::Result<()>) -> io::Result<()> {
        let rows =
            self.file.each(&mut |row, kept, _| visit(MatrixRow { row, entries: &self.numbers(&kept.row) }));
        rows.map_err(|error| match error {
            Error::Rows { source, .. } => source,
            other => io::Error::other(other.to_string()),
        })
    }
}
