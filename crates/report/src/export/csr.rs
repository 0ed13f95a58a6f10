//! Sparse matrices in compressed rows for SciPy (`scipy.sparse.load_npz`), with further numbers of the same entries beside them.

use std::io::{self, Seek, Write};

use super::matrix_rows::MatrixRows;
use super::npz::{Archive, Sink};

/// One array of numbers, with a name, for all entries of a sparse matrix.
pub struct CsrNumbers<'a> {
    /// The name of the array.
    pub name: &'a str,
    /// How they are written.
    pub kind: CsrKind,
    /// The numbers, in the entries of the matrix.
    pub numbers: &'a dyn MatrixRows,
}

/// How numbers of entries are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CsrKind {
    /// In 64 bits.
    F64,
    /// In 32 bits, rounded down.
    LowF32,
    /// In 32 bits, rounded up.
    HighF32,
    /// As whole numbers of 32 bits.
    U32,
}

impl CsrKind {
    fn descr(self) -> &'static str {
        match self {
            CsrKind::F64 => "<f8",
            CsrKind::LowF32 | CsrKind::HighF32 => "<f4",
            CsrKind::U32 => "<u4",
        }
    }

    fn put<W: Write>(self, sink: &mut Sink<'_, W>, x: f64) -> io::Result<()> {
        let near = x as f32;
        match self {
            CsrKind::F64 => sink.put(&x.to_le_bytes()),
            CsrKind::LowF32 => {
                sink.put(&if f64::from(near) > x { near.next_down() } else { near }.to_le_bytes())
            }
            CsrKind::HighF32 => {
                sink.put(&if f64::from(near) < x { near.next_up() } else { near }.to_le_bytes())
            }
            CsrKind::U32 => sink.put(&(x as u32).to_le_bytes()),
        }
    }
}

/// Writes a matrix in compressed rows; `more` numbers of its entries; a number of each row for each of `of_rows`; and the names of the
/// columns behind those that are rows, too, as `extra`.
///
/// # Errors
/// Those of `writer` and of the matrices.
pub fn write_csr(
    writer: impl Write + Seek,
    matrix: &dyn MatrixRows,
    more: &[CsrNumbers<'_>],
    of_rows: &[(&str, Vec<f64>)],
    extra: &[String],
) -> io::Result<()> {
    let mut archive = Archive::new(writer);
    archive.array("format", ("|S3", "()"), |sink| sink.put(b"csr"))?;
    archive.array("shape", ("<i8", "(2,)"), |sink| {
        [matrix.rows(), matrix.columns()].iter().try_for_each(|&size| sink.put(&(size as i64).to_le_bytes()))
    })?;
    archive.array("indptr", ("<i8", &format!("({},)", matrix.rows() + 1)), |sink| {
        let mut end = 0_i64;
        sink.put(&end.to_le_bytes())?;
        matrix.each(&mut |row| {
            end += row.entries.len() as i64;
            sink.put(&end.to_le_bytes())
        })
    })?;
    let shape = format!("({},)", matrix.entries());
    archive.array("indices", ("<i4", &shape), |sink| {
        matrix.each(&mut |row| row.entries.iter().try_for_each(|(column, _)| sink.put(&column.to_le_bytes())))
    })?;
    let data = CsrNumbers { name: "data", kind: CsrKind::F64, numbers: matrix };
    for CsrNumbers { name, kind, numbers } in [&data].into_iter().chain(more) {
        archive.array(name, (kind.descr(), &shape), |sink| {
            numbers.each(&mut |row| row.entries.iter().try_for_each(|&(_, x)| kind.put(sink, x)))
        })?;
    }
    for (name, numbers) in of_rows {
        archive.array(name, ("<f8", &format!("({},)", numbers.len())), |sink| {
            numbers.iter().try_for_each(|x| sink.put(&x.to_le_bytes()))
        })?;
    }
    archive.words("extra", extra.iter().map(String::as_str))?;
    archive.finish()
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::export::npz::tests::arrays;

    /// As `scipy.sparse.load_npz` of Python 3 reads it back: the arrays that it asks for, in the types of its own `save_npz`.
    #[test]
    fn matrices_are_as_scipy_reads_them() {
        let matrix = vec![vec![0.0, 0.25, 0.75], vec![0.1, 0.0, 0.9]];
        let more = CsrNumbers { name: "ci_low", kind: CsrKind::LowF32, numbers: &matrix };
        let high = CsrNumbers { name: "ci_high", kind: CsrKind::HighF32, numbers: &matrix };
        let mut bytes = Vec::new();
        let of_rows = [("area", vec![2.0, 3.0])];
        write_csr(Cursor::new(&mut bytes), &matrix, &[more, high], &of_rows, &["escape".into()]).unwrap();
        let arrays = arrays(&bytes);
        let data = |name: &str| {
            let npy = &arrays.iter().find(|(own, _)| own == name).unwrap().1;
            let header = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
            (String::from_utf8(npy[10..header].to_vec()).unwrap(), npy[header..].to_vec())
        };
        let floats = |bytes: Vec<u8>| -> Vec<f64> {
            bytes.chunks(8).map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect()
        };
        assert_eq!(data("format.npy").1, b"csr");
        assert!(data("format.npy").0.contains("'shape': ()"));
        assert_eq!(data("shape.npy").1, [2_i64.to_le_bytes(), 3_i64.to_le_bytes()].concat());
        let ends = [0_i64, 2, 4].map(i64::to_le_bytes);
        assert_eq!(data("indptr.npy").1, ends.concat());
        assert_eq!(data("indices.npy").1, [1, 2, 0, 2].map(i32::to_le_bytes).concat());
        assert_eq!(floats(data("data.npy").1), [0.25, 0.75, 0.1, 0.9]);
        assert_eq!(floats(data("area.npy").1), [2.0, 3.0]);
        let single = |name: &str| -> Vec<f32> {
            data(name).1.chunks(4).map(|x| f32::from_le_bytes(x.try_into().unwrap())).collect()
        };
        for ((low, high), x) in
            single("ci_low.npy").iter().zip(single("ci_high.npy")).zip([0.25, 0.75, 0.1, 0.9])
        {
            assert!(f64::from(*low) <= x && x <= f64::from(high) && high - low < 1e-7, "{low} {x} {high}");
        }
    }
}
