//! View factors as NetCDF: the file `vf.nc.inp` of uDALES, a matrix that holds every pair.
//!
//! The classic format (*The NetCDF Classic Format Specification*, Unidata) with one variable is a header and the numbers. It is written
//! here: the crate `netcdf3` takes a variable whole, which would be n² numbers in memory.

use std::io::{self, Write};

use super::matrix_rows::MatrixRows;
use super::view_factors::square;

/// The tags of the lists of dimensions and of variables.
const DIMENSIONS: u32 = 10;
const VARIABLES: u32 = 11;

/// A list that is not there, as of attributes.
const ABSENT: [u32; 2] = [0, 0];

/// The type of 32-bit numbers.
const FLOAT: u32 = 5;

/// Writes the variable `view factor` of uDALES, whose Fortran reads `vf(i, j)`, the factor from facet i to facet j: i runs fastest, so that
/// the numbers are the columns of the matrix in turn. They are 32-bit.
///
/// # Errors
/// Those of `writer` and of the matrix, and where there are more facets than the format counts.
pub fn write_udales_netcdf(mut writer: impl Write, matrix: &dyn MatrixRows) -> io::Result<()> {
    let facets = u32::try_from(matrix.rows()).map_err(io::Error::other)?;
    writer.write_all(&header(facets))?;
    let columns = SparseColumns::of(matrix)?;
    let mut line = vec![0.0_f32; matrix.rows()];
    for column in 0..matrix.rows() {
        columns.entries(column).for_each(|(row, factor)| line[row as usize] = factor);
        let bytes: Vec<u8> = line.iter().flat_map(|factor| factor.to_be_bytes()).collect();
        writer.write_all(&bytes)?;
        columns.entries(column).for_each(|(row, _)| line[row as usize] = 0.0);
    }
    Ok(())
}

/// All bytes before the numbers.
fn header(facets: u32) -> Vec<u8> {
    let mut bytes = b"CDF\x01".to_vec();
    let words = |bytes: &mut Vec<u8>, words: &[u32]| {
        words.iter().for_each(|word| bytes.extend(word.to_be_bytes()));
    };
    let named = |bytes: &mut Vec<u8>, name: &str| {
        bytes.extend((name.len() as u32).to_be_bytes());
        bytes.extend(name.bytes());
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    };
    // No records.
    words(&mut bytes, &[0, DIMENSIONS, 2]);
    for name in ["columns", "rows"] {
        named(&mut bytes, name);
        words(&mut bytes, &[facets]);
    }
    words(&mut bytes, &ABSENT);
    words(&mut bytes, &[VARIABLES, 1]);
    named(&mut bytes, "view factor");
    words(&mut bytes, &[2, 0, 1]);
    words(&mut bytes, &ABSENT);
    // The one variable may be larger than its size can say.
    let size = 4 * u64::from(facets) * u64::from(facets);
    let begin = bytes.len() as u32 + 12;
    words(&mut bytes, &[FLOAT, u32::try_from(size).unwrap_or(u32::MAX), begin]);
    bytes
}

/// The entries of a matrix that are not 0, by their columns.
struct SparseColumns {
    /// Where the entries of each column begin, and where the last end.
    begins: Vec<usize>,
    entries: Vec<(u32, f32)>,
}

impl SparseColumns {
    /// Those of the square part.
    fn of(matrix: &dyn MatrixRows) -> io::Result<Self> {
        let mut begins = vec![0; matrix.rows() + 1];
        matrix.each(&mut |row| {
            square(matrix, &row).iter().for_each(|&(column, _)| begins[column as usize + 1] += 1);
            Ok(())
        })?;
        (0..matrix.rows()).for_each(|column| begins[column + 1] += begins[column]);
        let mut next = begins.clone();
        let mut entries = vec![(0, 0.0); begins[matrix.rows()]];
        matrix.each(&mut |row| {
            for &(column, factor) in square(matrix, &row) {
                let place = &mut next[column as usize];
                entries[*place] = (row.row as u32, factor as f32);
                *place += 1;
            }
            Ok(())
        })?;
        Ok(SparseColumns { begins, entries })
    }

    fn entries(&self, column: usize) -> impl Iterator<Item = (u32, f32)> {
        self.entries[self.begins[column]..self.begins[column + 1]].iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the grammar of the specification: two dimensions of two, one variable of floats that begins behind the header; columns in turn.
    #[test]
    fn columns_follow_the_header() {
        let matrix = vec![vec![0.0, 0.25, 0.75], vec![0.125, 0.5, 0.375]];
        let mut bytes = Vec::new();
        write_udales_netcdf(&mut bytes, &matrix).unwrap();
        let word = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((&bytes[..4], word(4), word(8), word(12)), (&b"CDF\x01"[..], 0, 10, 2));
        assert_eq!((word(16), &bytes[20..28], word(28)), (7, &b"columns\0"[..], 2));
        assert_eq!((word(32), &bytes[36..40], word(40)), (4, &b"rows"[..], 2));
        assert_eq!([44, 48, 52, 56].map(word), [0, 0, 11, 1]);
        assert_eq!((word(60), &bytes[64..76]), (11, &b"view factor\0"[..]));
        assert_eq!([76, 80, 84, 88, 92, 96, 100, 104].map(word), [2, 0, 1, 0, 0, 5, 16, 108]);
        let numbers = bytes[108..].chunks(4).map(|word| f32::from_be_bytes(word.try_into().unwrap()));
        assert_eq!(numbers.collect::<Vec<_>>(), [0.0, 0.125, 0.25, 0.5]);
    }
}
