//! Matrices row by row: what writers of matrices go through, as often as their formats ask for it.

use std::io;

/// One row of a matrix: its number, and its entries that are not 0, by columns in ascending order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatrixRow<'a> {
    /// The number of the row.
    pub row: usize,
    /// Columns, each with its number.
    pub entries: &'a [(u32, f64)],
}

/// A matrix that is read row by row. It need not be in memory.
pub trait MatrixRows {
    /// How many rows there are.
    fn rows(&self) -> usize;
    /// How many columns there are.
    fn columns(&self) -> usize;
    /// How many entries are not 0.
    fn entries(&self) -> u64;
    /// Visits every row in order.
    ///
    /// # Errors
    /// Those of `visit`, and where the rows cannot be read.
    fn each(&self, visit: &mut dyn FnMut(MatrixRow<'_>) -> io::Result<()>) -> io::Result<()>;
}

/// Numbers in rows of equal length.
impl MatrixRows for Vec<Vec<f64>> {
    fn rows(&self) -> usize {
        self.len()
    }

    fn columns(&self) -> usize {
        self.first().map_or(0, Vec::len)
    }

    fn entries(&self) -> u64 {
        self.iter().flatten().filter(|x| **x != 0.0).count() as u64
    }

    fn each(&self, visit: &mut dyn FnMut(MatrixRow<'_>) -> io::Result<()>) -> io::Result<()> {
        self.iter().enumerate().try_for_each(|(row, numbers)| {
            let entries: Vec<(u32, f64)> =
                (0..).zip(numbers.iter().copied()).filter(|&(_, x)| x != 0.0).collect();
            visit(MatrixRow { row, entries: &entries })
        })
    }
}
