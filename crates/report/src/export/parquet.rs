//! `patches.parquet`: the columns of `patches.csv` and the corners, for data frames. `factors.parquet`: counted factors.
//!
//! Corners are columns `x0, y0, z0 … x3, y3, z3` [m] of 64-bit numbers; a triangle has no fourth corner. What no walk
//! could tell is missing.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use radiosity::Estimates;
use stats::Interval;

use super::table::{Column, ColumnCells, columns_of};

/// Rows that are written at a time, and stand together in the file.
const GROUP: usize = 1 << 16;

/// Writes the table with the corners of the patches.
///
/// # Errors
/// Those of `writer`.
pub fn write_parquet(writer: impl Write + Send, estimates: &Estimates) -> std::io::Result<()> {
    let rows: Vec<usize> = estimates.scene().faces().by_patch().collect();
    let mut groups = rows.chunks(GROUP).map(|rows| {
        let mut columns = columns_of(estimates, rows.iter().copied())?;
        columns.extend(corner_columns(estimates, rows));
        Ok::<_, std::io::Error>(columns)
    });
    let first = groups.next().expect("a scene has faces")?;
    let mut file = open(writer, &first).map_err(std::io::Error::other)?;
    for columns in std::iter::once(Ok(first)).chain(groups) {
        write_group(&mut file, &columns?).map_err(std::io::Error::other)?;
    }
    file.close().map(drop).map_err(std::io::Error::other)
}

/// Writes columns part by part; all parts have the columns of the first.
///
/// # Errors
/// Those of `writer`.
pub(crate) fn write_columns_parquet(
    writer: impl Write + Send,
    parts: usize,
    part: impl Fn(usize) -> Vec<Column>,
) -> io::Result<()> {
    let mut file = open(writer, &part(0)).map_err(io::Error::other)?;
    (0..parts).try_for_each(|number| write_group(&mut file, &part(number)).map_err(io::Error::other))?;
    file.close().map(drop).map_err(io::Error::other)
}

/// A counted factor that is not 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactorEntry {
    /// The number of the row.
    pub from: usize,
    /// The number of the column.
    pub to: u32,
    /// The walks that met it.
    pub count: u32,
    /// The factor n/N.
    pub factor: f64,
    /// The interval of the factor.
    pub interval: Interval,
}

/// Writes factors in columns `from`, `to`, `count`, `factor`, `ci_low` and `ci_high`; `each` hands over all of them.
///
/// # Errors
/// Those of `writer` and of `each`.
pub fn write_factors_parquet(
    writer: impl Write + Send,
    each: impl FnOnce(&mut dyn FnMut(FactorEntry) -> io::Result<()>) -> io::Result<()>,
) -> io::Result<()> {
    let mut file = open(writer, &factor_columns(&[])).map_err(io::Error::other)?;
    let mut entries = Vec::with_capacity(GROUP);
    each(&mut |entry| {
        entries.push(entry);
        if entries.len() == GROUP {
            write_group(&mut file, &factor_columns(&entries)).map_err(io::Error::other)?;
            entries.clear();
        }
        Ok(())
    })?;
    write_group(&mut file, &factor_columns(&entries)).map_err(io::Error::other)?;
    file.close().map(drop).map_err(io::Error::other)
}

fn factor_columns(entries: &[FactorEntry]) -> [Column; 6] {
    let whole = |name: &str, of: fn(&FactorEntry) -> i64| Column {
        name: name.into(),
        cells: ColumnCells::Whole(entries.iter().map(|entry| Some(of(entry))).collect()),
    };
    let number = |name: &str, of: fn(&FactorEntry) -> f64| Column {
        name: name.into(),
        cells: ColumnCells::Number(entries.iter().map(|entry| Some(of(entry))).collect()),
    };
    [
        whole("from", |entry| entry.from as i64),
        whole("to", |entry| entry.to.into()),
        whole("count", |entry| entry.count.into()),
        number("factor", |entry| entry.factor),
        number("ci_low", |entry| entry.interval.low),
        number("ci_high", |entry| entry.interval.high),
    ]
}

/// A file whose columns are like these.
fn open<W: Write + Send>(writer: W, columns: &[Column]) -> Result<SerializedFileWriter<W>, ParquetError> {
    let fields = columns.iter().map(|column| field(column).map(Arc::new)).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("patches").with_fields(fields).build()?;
    let properties = WriterProperties::builder().set_compression(Compression::UNCOMPRESSED).build();
    SerializedFileWriter::new(writer, Arc::new(schema), Arc::new(properties))
}

fn write_group<W: Write + Send>(
    file: &mut SerializedFileWriter<W>,
    columns: &[Column],
) -> Result<(), ParquetError> {
    let mut rows = file.next_row_group()?;
    columns.iter().try_for_each(|column| write_column(&mut rows, column))?;
    rows.close().map(drop)
}

fn field(column: &Column) -> Result<Type, ParquetError> {
    let builder = match column.cells {
        ColumnCells::Whole(_) => Type::primitive_type_builder(&column.name, Physical::INT64),
        ColumnCells::Number(_) => Type::primitive_type_builder(&column.name, Physical::DOUBLE),
        ColumnCells::Words(_) => Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
            .with_logical_type(Some(LogicalType::String)),
    };
    builder.with_repetition(Repetition::OPTIONAL).build()
}

fn write_column<W: Write + Send>(
    rows: &mut SerializedRowGroupWriter<'_, W>,
    column: &Column,
) -> Result<(), ParquetError> {
    let mut writer = rows.next_column()?.expect("a column of the schema");
    match &column.cells {
        ColumnCells::Whole(cells) => {
            let (values, there) = present(cells);
            writer.typed::<Int64Type>().write_batch(&values, Some(&there), None)?;
        }
        ColumnCells::Number(cells) => {
            let (values, there) = present(cells);
            writer.typed::<DoubleType>().write_batch(&values, Some(&there), None)?;
        }
        ColumnCells::Words(cells) => {
            let words: Vec<ByteArray> = cells.iter().map(|word| word.as_str().into()).collect();
            writer.typed::<ByteArrayType>().write_batch(&words, Some(&vec![1; words.len()]), None)?;
        }
    }
    writer.close()
}

/// The values that exist, and for each row whether it has one: 1 or 0.
fn present<T: Copy>(cells: &[Option<T>]) -> (Vec<T>, Vec<i16>) {
    (cells.iter().flatten().copied().collect(), cells.iter().map(|cell| cell.is_some().into()).collect())
}

/// The corners of faces, a column a coordinate. Those of groups, which are outlines of several cells, are left out.
fn corner_columns(estimates: &Estimates, rows: &[usize]) -> Vec<Column> {
    let faces = estimates.scene().faces();
    let mut columns: Vec<Vec<Option<f64>>> = vec![Vec::new(); 12];
    for &face in rows {
        let mut pieces = faces.pieces(face);
        let alone = pieces.next().filter(|_| pieces.next().is_none());
        let corners = alone.map(|piece| faces.piece_corners(piece)).unwrap_or_default();
        for (at, column) in columns.iter_mut().enumerate() {
            column.push(corners.get(at / 3).map(|corner| corner[at % 3]));
        }
    }
    let name = |at: usize| format!("{}{}", ["x", "y", "z"][at % 3], at / 3);
    (0..)
        .zip(columns)
        .map(|(at, cells)| Column { name: name(at), cells: ColumnCells::Number(cells) })
        .collect()
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;
    use radiosity::Estimates;

    use super::*;
    use crate::scenes::{cube, experiment, shot};

    /// Read by the library's own reader, row by row.
    #[test]
    fn rows_have_the_numbers_of_the_table() {
        let experiment = experiment(&cube());
        let tally = shot(&experiment);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let mut file = Vec::new();
        write_parquet(&mut file, &estimates).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(file)).unwrap();
        let mut rows = 0;
        for (number, row) in reader.get_row_iter(None).unwrap().enumerate() {
            let row = row.unwrap();
            assert_eq!(row.get_long(0).unwrap(), number as i64);
            let at = row.get_column_iter().position(|(name, _)| name == "radiosity").unwrap();
            assert_eq!(row.get_double(at).unwrap(), estimates.face(number).unwrap()[0].radiosity);
            rows += 1;
        }
        assert_eq!(rows, 54);
    }

    /// One row group more than is full, read back.
    #[test]
    fn factors_are_read_back() {
        let entry = |number: usize| FactorEntry {
            from: number / 1000,
            to: (number % 1000) as u32,
            count: 3,
            factor: 0.25 / (number + 1) as f64,
            interval: Interval { low: 0.0, high: 1.0 },
        };
        let mut file = Vec::new();
        let all = GROUP + 5;
        write_factors_parquet(&mut file, |take| (0..all).try_for_each(|number| take(entry(number)))).unwrap();
        let reader = SerializedFileReader::new(bytes::Bytes::from(file)).unwrap();
        let mut rows = 0;
        for (number, row) in reader.get_row_iter(None).unwrap().enumerate() {
            let (row, entry) = (row.unwrap(), entry(number));
            let names: Vec<&String> = row.get_column_iter().map(|(name, _)| name).collect();
            assert_eq!(names, ["from", "to", "count", "factor", "ci_low", "ci_high"]);
            assert_eq!(
                (row.get_long(0).unwrap(), row.get_long(1).unwrap()),
                (entry.from as i64, entry.to.into())
            );
            assert_eq!((row.get_long(2).unwrap(), row.get_double(3).unwrap()), (3, entry.factor));
            assert_eq!((row.get_double(4).unwrap(), row.get_double(5).unwrap()), (0.0, 1.0));
            rows += 1;
        }
        assert_eq!(rows, all);
    }
}
