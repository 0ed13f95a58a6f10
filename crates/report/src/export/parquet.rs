//! `patches.parquet`: the columns of `patches.csv` and the corners, for data frames.
//!
//! Corners are columns `x0, y0, z0 … x3, y3, z3` [m] of 64-bit numbers; a triangle has no fourth corner. What no walk
//! could tell is missing.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use radiosity::Estimates;

use super::table::{Column, ColumnCells, columns, corners};

/// Writes the table with the corners of the patches.
///
/// # Errors
/// Those of `writer`.
pub fn write_parquet(writer: impl Write + Send, estimates: &Estimates) -> std::io::Result<()> {
    let mut columns = columns(estimates)?;
    columns.extend(corner_columns(estimates));
    write(writer, &columns).map_err(std::io::Error::other)
}

fn write(writer: impl Write + Send, columns: &[Column]) -> Result<(), ParquetError> {
    let fields = columns.iter().map(|column| field(column).map(Arc::new)).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("patches").with_fields(fields).build()?;
    let properties = WriterProperties::builder().set_compression(Compression::UNCOMPRESSED).build();
    let mut file = SerializedFileWriter::new(writer, Arc::new(schema), Arc::new(properties))?;
    let mut rows = file.next_row_group()?;
    columns.iter().try_for_each(|column| write_column(&mut rows, column))?;
    rows.close()?;
    file.close()?;
    Ok(())
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

/// The corners of the faces, a column a coordinate. Those of groups, which are outlines of several cells, are left out.
fn corner_columns(estimates: &Estimates) -> Vec<Column> {
    let mut columns: Vec<Vec<Option<f64>>> = vec![Vec::new(); 12];
    let outlines: Vec<_> = corners(estimates).collect();
    for outlines in outlines.chunk_by(|a, b| a.0 == b.0) {
        let corners = if let [(_, corners)] = outlines { &corners[..] } else { &[] };
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
}
