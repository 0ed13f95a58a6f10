//! Sparse matrices in the format of Matrix Market (Boisvert, Pozo & Remington, NISTIR 5935).

use std::io::{self, Write};

use super::matrix_rows::MatrixRows;

/// Writes the entries of a matrix that are not 0, row by row, below some words.
///
/// # Errors
/// Those of `writer` and of the matrix.
pub fn write(mut writer: impl Write, words: &str, matrix: &dyn MatrixRows) -> io::Result<()> {
    writeln!(writer, "%%MatrixMarket matrix coordinate real general")?;
    words.lines().try_for_each(|line| writeln!(writer, "% {line}"))?;
    writeln!(writer, "{} {} {}", matrix.rows(), matrix.columns(), matrix.entries())?;
    matrix.each(&mut |row| {
        let i = row.row + 1;
        row.entries.iter().try_for_each(|(j, x)| writeln!(writer, "{i} {} {x:?}", j + 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_count_from_one() {
        let mut text = Vec::new();
        write(&mut text, "of a test", &vec![vec![0.0, 0.25, 0.0], vec![1e-7, 0.0, 0.5]]).unwrap();
        assert_eq!(
            String::from_utf8(text).unwrap(),
            "%%MatrixMarket matrix coordinate real general\n% of a test\n2 3 3\n1 2 0.25\n2 1 1e-7\n2 3 0.5\n"
        );
    }
}
