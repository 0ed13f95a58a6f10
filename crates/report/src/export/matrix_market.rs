//! Sparse matrices in the format of Matrix Market (Boisvert, Pozo & Remington, NISTIR 5935).

use std::io::{self, Write};

/// Writes the entries of a matrix that are not 0, row by row, below some words.
///
/// # Errors
/// Those of `writer`.
pub(crate) fn write(mut writer: impl Write, words: &str, rows: &[Vec<f64>]) -> io::Result<()> {
    let columns = rows.first().map_or(0, Vec::len);
    let entries = rows.iter().flatten().filter(|x| **x != 0.0).count();
    writeln!(writer, "%%MatrixMarket matrix coordinate real general")?;
    words.lines().try_for_each(|line| writeln!(writer, "% {line}"))?;
    writeln!(writer, "{} {columns} {entries}", rows.len())?;
    for (i, row) in (1..).zip(rows) {
        for (j, x) in (1..).zip(row).filter(|(_, x)| **x != 0.0) {
            writeln!(writer, "{i} {j} {x:?}")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_count_from_one() {
        let mut text = Vec::new();
        write(&mut text, "of a test", &[vec![0.0, 0.25, 0.0], vec![1e-7, 0.0, 0.5]]).unwrap();
        assert_eq!(
            String::from_utf8(text).unwrap(),
            "%%MatrixMarket matrix coordinate real general\n% of a test\n2 3 3\n1 2 0.25\n2 1 1e-7\n2 3 0.5\n"
        );
    }
}
