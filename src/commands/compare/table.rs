//! `compare.csv`: the points measured so far, a row each, added to the file when it is measured.

use std::fs;

use report::OutputFolder;
use tracing::warn;

use super::measure::ContenderResult;
use crate::build::BUILD;
use crate::fault::Fault;

/// The name of the table.
pub(crate) const TABLE: &str = "compare.csv";

/// What a table becomes of which not all rows can be used.
const PREVIOUS: &str = "compare.previous.csv";

/// The rows of an output folder.
pub(crate) struct ResultTable<'a> {
    folder: &'a OutputFolder,
    points: Vec<ContenderResult>,
}

impl<'a> ResultTable<'a> {
    /// An empty table, or one with the usable rows of the file.
    ///
    /// # Errors
    /// Where the file cannot be read.
    pub(crate) fn new(folder: &'a OutputFolder, resume: bool) -> Result<Self, Fault> {
        let path = folder.file(TABLE);
        if !resume || !path.exists() {
            return Ok(ResultTable { folder, points: Vec::new() });
        }
        let bytes = fs::read(&path).map_err(|source| Fault::Table { path: path.clone(), source })?;
        let (points, lost) = usable(&bytes);
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
        Ok(ResultTable { folder, points })
    }

    /// How many rows there are.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// A row that was measured before.
    pub(super) fn find(&self, key: &str, method: &str, rays: u64, runs: usize) -> Option<&ContenderResult> {
        let is_it =
            |p: &&ContenderResult| (&p.key[..], &p.method[..], p.rays, p.runs) == (key, method, rays, runs);
        self.points.iter().find(is_it)
    }

    /// Adds a row, on disk too.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(super) fn add(&mut self, point: ContenderResult) -> Result<(), Fault> {
        self.points.push(point);
        Ok(self.folder.write(TABLE, |file| {
            let mut writer = csv::Writer::from_writer(file);
            self.points.iter().try_for_each(|point| writer.serialize(point))?;
            writer.flush()
        })?)
    }
}

/// The rows of a table that this build measured, and how many others there are.
fn usable(table: &[u8]) -> (Vec<ContenderResult>, usize) {
    // A line without an end may lack digits of its last number.
    let whole = table.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
    let mut lost = usize::from(whole < table.len());
    let mut points = Vec::new();
    for row in csv::Reader::from_reader(&table[..whole]).deserialize::<ContenderResult>() {
        match row {
            Ok(point) if point.build == BUILD => points.push(point),
            _ => lost += 1,
        }
    }
    (points, lost)
}
