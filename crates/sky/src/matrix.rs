//! Matrices in the layout of Radiance: sky vectors and matrices of `gendaymtx` and `genskyvec`, daylight coefficients of `rfluxmtx`.
//!
//! A header of lines ends with an empty one: `#?RADIANCE`, then `NROWS=`, `NCOLS=`, `NCOMP=3` and `FORMAT=ascii`, `float` or `double`
//! (with `BigEndian=0`). Numbers follow row by row, in three components. A file without a header is text, in rows of lines or in rows apart by an empty line.

use std::io::{self, Write};

use thiserror::Error;

/// The luminous efficacy by which Radiance turns light as eyes see it into radiance [lm/W]: luminance is the brightness in its matrices times this number.
pub const EFFICACY: f64 = 179.0;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// As text.
    Ascii,
    /// In 32 bits, the lowest first.
    Float,
}

/// A matrix of which the three components of each number are alike, or of which their luminous mean is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Row by row.
    pub numbers: Vec<f64>,
}

/// The rule that a matrix breaks.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{0}")]
pub struct MatrixError(String);

/// The parts of red, green and blue in Radiance's brightness.
const BRIGHTNESS: [f64; 3] = [0.265, 0.670, 0.065];

/// The most numbers that are read.
const MOST: usize = 1 << 28;

impl Matrix {
    /// A number.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.numbers[row * self.columns + column]
    }

    /// Writes the matrix, each number in three components.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write(&self, encoding: Encoding, out: &mut dyn Write) -> io::Result<()> {
        let format = match encoding {
            Encoding::Ascii => "FORMAT=ascii",
            Encoding::Float => "BigEndian=0\nFORMAT=float",
        };
        write!(out, "#?RADIANCE\nNROWS={}\nNCOLS={}\nNCOMP=3\n{format}\n\n", self.rows, self.columns)?;
        for row in self.numbers.chunks(self.columns.max(1)) {
            for number in row {
                let number = *number as f32;
                match encoding {
                    Encoding::Ascii => writeln!(out, "{number:e} {number:e} {number:e}")?,
                    Encoding::Float => {
                        [number; 3].iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?
                    }
                }
            }
            if encoding == Encoding::Ascii && self.columns > 1 {
                writeln!(out)?;
            }
        }
        Ok(())
    }

    /// Reads a matrix: of three components, whose brightness is kept, or of one.
    ///
    /// # Errors
    /// A header without sizes, another format, a number that is none or is not finite, more numbers or fewer than the header says.
    pub fn read(bytes: &[u8]) -> Result<Self, MatrixError> {
        let (header, body) = MatrixHeader::split(bytes)?;
        let count = header.numbers()?;
        let big = header.value("BigEndian") == Some("1");
        let parts = match header.value("FORMAT") {
            Some("ascii") | None => ascii(body, count)?,
            Some("float") => binary(body, count, |b: [u8; 4]| {
                f64::from(if big { f32::from_be_bytes(b) } else { f32::from_le_bytes(b) })
            })?,
            Some("double") => {
                let number = |b: [u8; 8]| if big { f64::from_be_bytes(b) } else { f64::from_le_bytes(b) };
                binary(body, count, number)?
            }
            Some(other) => {
                return Err(MatrixError(format!(
                    "FORMAT={other} (ascii, float and double are read); convert it by `rmtxop -fa`"
                )));
            }
        };
        if let Some(at) = parts.iter().position(|number| !number.is_finite()) {
            return Err(MatrixError(format!("number {} is not finite", at + 1)));
        }
        let bright = |parts: &[f64]| match parts {
            [one] => *one,
            // Three that are alike are that number, without rounding.
            [r, g, b] if r == g && g == b => *r,
            _ => parts.iter().zip(BRIGHTNESS).map(|(part, weight)| part * weight).sum(),
        };
        let [rows, columns, components] = header.sizes()?;
        Ok(Matrix { rows, columns, numbers: parts.chunks(components).map(bright).collect() })
    }
}

/// The lines of a header.
struct MatrixHeader<'a>(Vec<&'a str>);

impl<'a> MatrixHeader<'a> {
    /// The header, and what follows it.
    fn split(bytes: &'a [u8]) -> Result<(Self, &'a [u8]), MatrixError> {
        let parts = split(bytes).ok_or_else(|| {
            let problem =
                "the header does not end (an empty line ends it); give a matrix of gendaymtx or rfluxmtx";
            MatrixError(problem.into())
        });
        parts.map(|(header, body)| (MatrixHeader(header), body))
    }

    /// What a key stands for; the last one counts.
    fn value(&self, key: &str) -> Option<&'a str> {
        let after = |line: &&'a str| line.trim().strip_prefix(key)?.strip_prefix('=').map(str::trim);
        self.0.iter().rev().find_map(after)
    }

    fn size(&self, key: &str) -> Result<usize, MatrixError> {
        let size = self.value(key).and_then(|value| value.parse::<usize>().ok());
        size.filter(|size| (1..MOST).contains(size)).ok_or_else(|| {
            MatrixError(format!("the header has no {key} (a matrix says its size); write {key}=…"))
        })
    }

    /// Rows, columns and components.
    fn sizes(&self) -> Result<[usize; 3], MatrixError> {
        let (rows, columns) = (self.size("NROWS")?, self.size("NCOLS")?);
        let components = if self.value("NCOMP").is_some() { self.size("NCOMP")? } else { 3 };
        if components != 3 && components != 1 {
            return Err(MatrixError(format!("NCOMP={components} (numbers have three components, or one)")));
        }
        Ok([rows, columns, components])
    }

    /// How many numbers follow.
    fn numbers(&self) -> Result<usize, MatrixError> {
        let [rows, columns, components] = self.sizes()?;
        let count = rows.checked_mul(columns).and_then(|count| count.checked_mul(components));
        count
            .filter(|&count| count < MOST)
            .ok_or_else(|| MatrixError(format!("NROWS={rows}, NCOLS={columns} (more than 2^28 numbers)")))
    }
}

/// The lines of the header, and what follows it.
fn split(bytes: &[u8]) -> Option<(Vec<&str>, &[u8])> {
    let end = bytes.windows(2).position(|pair| pair == b"\n\n")?;
    Some((std::str::from_utf8(&bytes[..end]).ok()?.lines().collect(), &bytes[end + 2..]))
}

fn ascii(body: &[u8], count: usize) -> Result<Vec<f64>, MatrixError> {
    let text = std::str::from_utf8(body)
        .map_err(|_| MatrixError("the numbers are not text (FORMAT=ascii says so)".into()))?;
    let mut numbers = Vec::with_capacity(count.min(body.len()));
    for word in text.split_ascii_whitespace() {
        let number = word.parse().map_err(|_| {
            MatrixError(format!("number {} is {word:?}, which is no number", numbers.len() + 1))
        })?;
        numbers.push(number);
    }
    checked(numbers, count)
}

fn binary<const B: usize>(
    body: &[u8],
    count: usize,
    number: impl Fn([u8; B]) -> f64,
) -> Result<Vec<f64>, MatrixError> {
    let (whole, rest) = body.as_chunks::<B>();
    if !rest.is_empty() {
        return Err(MatrixError(format!("{} bytes are left over behind the last number", rest.len())));
    }
    checked(whole.iter().map(|bytes| number(*bytes)).collect(), count)
}

fn checked(numbers: Vec<f64>, count: usize) -> Result<Vec<f64>, MatrixError> {
    match numbers.len() == count {
        true => Ok(numbers),
        false => Err(MatrixError(format!(
            "there are {} numbers, where the header asks for {count}",
            numbers.len()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(matrix: &Matrix, encoding: Encoding) -> Vec<u8> {
        let mut bytes = Vec::new();
        matrix.write(encoding, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn matrices_are_read_as_they_are_written() {
        let numbers: Vec<f64> = (0..12).map(|i| f64::from(0.1_f32 * (i * i) as f32)).collect();
        for (rows, columns) in [(3, 4), (12, 1), (1, 12)] {
            let matrix = Matrix { rows, columns, numbers: numbers.clone() };
            for encoding in [Encoding::Ascii, Encoding::Float] {
                let read = Matrix::read(&written(&matrix, encoding)).unwrap();
                assert_eq!((read.rows, read.columns), (rows, columns));
                assert!(read.numbers.iter().zip(&numbers).all(|(a, b)| *a as f32 == *b as f32));
            }
        }
        assert_eq!(Matrix { rows: 3, columns: 4, numbers }.get(2, 1), f64::from(0.1_f32 * 81.0));
    }

    /// Files as `gendaymtx` writes them, with other lines in the header, and in doubles of either order.
    #[test]
    fn files_of_radiance_are_read() {
        let text = b"#?RADIANCE\ngendaymtx -m 1 x.wea\nLATLONG= 1 2\nNROWS=2\nNCOLS=2\nNCOMP=3\nFORMAT=ascii\n\n1 1 1\n.96 1.004 1.118\n\n0 0 0\n3e-1 3e-1 3e-1\n\n";
        let matrix = Matrix::read(text).unwrap();
        assert!((matrix.get(0, 1) - (0.265 * 0.96 + 0.67 * 1.004 + 0.065 * 1.118)).abs() < 1e-12);
        assert_eq!((matrix.get(0, 0), matrix.get(1, 0), matrix.get(1, 1)), (1.0, 0.0, 0.3));
        for (order, bytes) in [("1", 2.5_f64.to_be_bytes()), ("0", 2.5_f64.to_le_bytes())] {
            let mut file =
                format!("#?RADIANCE\nNROWS=1\nNCOLS=1\nNCOMP=1\nBigEndian={order}\nFORMAT=double\n\n")
                    .into_bytes();
            file.extend(bytes);
            assert_eq!(Matrix::read(&file).unwrap().numbers, [2.5]);
        }
    }

    #[test]
    fn broken_matrices_are_refused_in_words() {
        let refused = |text: &str| Matrix::read(text.as_bytes()).unwrap_err().to_string();
        assert!(refused("NROWS=1").contains("does not end"));
        assert!(refused("NCOLS=1\n\n1").contains("no NROWS"));
        assert!(refused("NROWS=99999999999\nNCOLS=1\n\n1").contains("no NROWS"));
        assert!(refused("NROWS=99999999\nNCOLS=99999999\n\n1").contains("2^28"));
        assert!(refused("NROWS=1\nNCOLS=1\nNCOMP=3\n\n1 2").contains("there are 2 numbers"));
        assert!(refused("NROWS=1\nNCOLS=1\nNCOMP=3\n\n1 x 2").contains("number 2 is \"x\""));
        assert!(refused("NROWS=1\nNCOLS=1\nNCOMP=3\n\n1 inf 2").contains("not finite"));
        assert!(refused("NROWS=1\nNCOLS=1\nNCOMP=2\n\n1 2").contains("NCOMP=2"));
        assert!(refused("NROWS=1\nNCOLS=1\nFORMAT=32-bit_rle_rgbe\n\n1 2").contains("rmtxop"));
        assert!(refused("NROWS=1\nNCOLS=1\nFORMAT=float\n\n12345").contains("left over"));
    }
}
