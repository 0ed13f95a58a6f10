//! The columns of `patches.csv` and its fellows with their types, and the corners of rows.
//!
//! They are read back from the table as it is written, so that what is exported cannot differ from it.

use std::io;

use radiosity::{Estimates, surfaces::Corners};

use crate::patches::{Digits, write_some};

/// A column of a table.
pub struct Column {
    /// The name in the header of the table.
    pub name: String,
    /// The cells of the column, in the order of rows.
    pub cells: ColumnCells,
}

/// The cells of a column.
pub enum ColumnCells {
    /// Whole numbers; a cell is missing if no walk gives an estimate.
    Whole(Vec<Option<i64>>),
    /// Numbers as the table has them; a cell is missing if no walk gives an estimate.
    Number(Vec<Option<f64>>),
    /// Words, one for each row.
    Words(Vec<String>),
}

/// Columns of whole numbers.
const WHOLE: &[&str] = &["patch", "u", "v", "hits"];

/// The columns that hold words.
const WORDS: &[&str] = &["surface", "side", "flags", "sensor", "source", "material", "property"];

/// The columns of `patches.csv`.
///
/// # Errors
/// A number that its column cannot hold.
pub fn columns(estimates: &Estimates) -> io::Result<Vec<Column>> {
    columns_of(estimates, estimates.scene().faces().by_patch())
}

/// [`columns`] of some rows, each the number of a face.
pub(super) fn columns_of(
    estimates: &Estimates,
    rows: impl Iterator<Item = usize>,
) -> io::Result<Vec<Column>> {
    let mut csv = Vec::new();
    write_some(&mut csv, (estimates, Digits::All), rows)?;
    read_table(&csv)
}

/// The columns of a table that this crate wrote.
///
/// # Errors
/// A cell that is none of its column.
pub fn read_table(csv: &[u8]) -> io::Result<Vec<Column>> {
    let mut reader = csv::Reader::from_reader(csv);
    let empty = |name: &str| match name {
        name if WHOLE.contains(&name) => ColumnCells::Whole(Vec::new()),
        name if WORDS.contains(&name) => ColumnCells::Words(Vec::new()),
        _ => ColumnCells::Number(Vec::new()),
    };
    let mut columns: Vec<Column> =
        reader.headers()?.iter().map(|name| Column { name: name.into(), cells: empty(name) }).collect();
    let mut row = csv::StringRecord::new();
    while reader.read_record(&mut row)? {
        columns.iter_mut().zip(&row).try_for_each(|(column, cell)| column.cells.push(cell))?;
    }
    Ok(columns)
}

impl ColumnCells {
    fn push(&mut self, cell: &str) -> io::Result<()> {
        match self {
            ColumnCells::Whole(cells) => cells.push(parse(cell)?),
            ColumnCells::Number(cells) => cells.push(parse(cell)?),
            ColumnCells::Words(cells) => cells.push(cell.into()),
        }
        Ok(())
    }
}

/// The number in a cell; `None` where the cell is empty.
fn parse<T: std::str::FromStr>(cell: &str) -> io::Result<Option<T>> {
    let bad = |_| io::Error::other(format!("{cell:?} is no number"));
    if cell.is_empty() { Ok(None) } else { cell.parse().map(Some).map_err(bad) }
}

impl ColumnCells {
    /// Makes a column of the given rows, in their order.
    pub(super) fn of_rows(&self, rows: &[usize]) -> ColumnCells {
        match self {
            ColumnCells::Whole(cells) => ColumnCells::Whole(rows.iter().map(|&row| cells[row]).collect()),
            ColumnCells::Number(cells) => ColumnCells::Number(rows.iter().map(|&row| cells[row]).collect()),
            ColumnCells::Words(cells) => {
                ColumnCells::Words(rows.iter().map(|&row| cells[row].clone()).collect())
            }
        }
    }
}

/// The outlines that the rows are drawn by, in the order of rows: (row, corners [m] as [`radiosity::surfaces::Faces::piece_corners`] has
/// them). A row has one, and that of a group one for each of its cells.
pub fn corners<'a>(estimates: &'a Estimates) -> impl Iterator<Item = (usize, Corners)> + 'a {
    let faces = estimates.scene().faces();
    let rows = faces.by_patch().enumerate();
    rows.flat_map(move |(row, face)| faces.pieces(face).map(move |piece| (row, faces.piece_corners(piece))))
}
