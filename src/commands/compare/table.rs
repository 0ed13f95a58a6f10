//! `compare.csv`: the rows measured so far, each added to the file when it is measured.

use std::fs;

use report::OutputFolder;
use studies::compare::{Point, Rows};
use tracing::warn;

use crate::build::BUILD;
use crate::fault::Fault;

/// The name of the table.
pub(crate) const TABLE: &str = "compare.csv";

/// What a table becomes of which not all rows can be used.
const PREVIOUS: &str = "compare.previous.csv";

/// The rows of an output folder.
pub(crate) struct Table<'a> {
    folder: &'a OutputFolder,
    rows: Rows,
}

impl<'a> Table<'a> {
    /// An empty table, or one with the usable rows of the file.
    ///
    /// # Errors
    /// Where the file cannot be read.
    pub(crate) fn new(folder: &'a OutputFolder, resume: bool) -> Result<Self, Fault> {
        let mut table = Table { folder, rows: Rows::default() };
        let path = folder.file(TABLE);
        if resume && path.exists() {
            let bytes = fs::read(&path).map_err(|source| Fault::Table { path: path.clone(), source })?;
            let (rows, lost) = Rows::read(&bytes, BUILD);
            if lost > 0 {
                let previous = folder.file(PREVIOUS);
                fs::copy(&path, &previous).map_err(|source| Fault::Table { path: path.clone(), source })?;
                warn!(
                    "{lost} rows of {} cannot be used (damaged, or measured by another build); they are measured \
                     again, the table is kept as {}",
                    path.display(),
                    previous.display()
                );
            }
            table.rows = rows;
        }
        Ok(table)
    }

    /// How many rows there are.
    pub(crate) fn len(&self) -> usize {
        self.rows.count()
    }

    /// A row that was measured before.
    pub(crate) fn find(&self, key: &str, method: &str, rays: u64, runs: usize) -> Option<&Point> {
        self.rows.find(key, method, rays, runs)
    }

    /// Adds a row, on disk too.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(crate) fn add(&mut self, point: Point) -> Result<(), Fault> {
        self.rows.add(point);
        Ok(self.folder.write(TABLE, |file| self.rows.write(file))?)
    }
}
