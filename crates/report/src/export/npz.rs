//! Arrays for NumPy: `.npy` files in an archive without compression (NEP 1, version 1.0; PKZIP's application note, 4.3).

use std::io::{self, Write};

use flate2::Crc;

/// An array with its name.
pub(crate) struct Array {
    name: String,
    npy: Vec<u8>,
}

/// What precedes a header: a magic word and the version.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// The data begin at a multiple of this.
const ALIGNMENT: usize = 64;

impl Array {
    /// Numbers in rows of equal length.
    pub(crate) fn matrix(name: &str, rows: &[Vec<f64>]) -> Self {
        let columns = rows.first().map_or(0, Vec::len);
        let bytes = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        Array::new(name, "<f8", &format!("({}, {columns})", rows.len()), bytes)
    }

    /// Words, each padded to the longest.
    pub(crate) fn words<'a>(name: &str, words: impl Iterator<Item = &'a str>) -> Self {
        let words: Vec<Vec<char>> = words.map(|word| word.chars().collect()).collect();
        let longest = words.iter().map(Vec::len).max().unwrap_or(0).max(1);
        let padded = words.iter().flat_map(|word| {
            let fill = std::iter::repeat_n('\0', longest - word.len());
            word.iter().copied().chain(fill)
        });
        let bytes = padded.flat_map(|character| u32::from(character).to_le_bytes()).collect();
        Array::new(name, &format!("<U{longest}"), &format!("({},)", words.len()), bytes)
    }

    fn new(name: &str, kind: &str, shape: &str, data: Vec<u8>) -> Self {
        let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
        let before = MAGIC.len() + 2 + header.len() + 1;
        header.extend(std::iter::repeat_n(' ', before.next_multiple_of(ALIGNMENT) - before));
        header.push('\n');
        let length = (header.len() as u16).to_le_bytes();
        let npy = [MAGIC, &length, header.as_bytes(), &data].concat();
        Array { name: format!("{name}.npy"), npy }
    }
}

/// Writes an archive of arrays.
///
/// # Errors
/// Those of `writer`, and more than 4 GiB, which the format does not hold.
pub(crate) fn write(mut writer: impl Write, arrays: &[Array]) -> io::Result<()> {
    let whole: usize = arrays.iter().map(|array| array.npy.len() + 2 * (array.name.len() + 64)).sum();
    if u32::try_from(whole + 64).is_err() {
        return Err(io::Error::other("an archive holds 4 GiB at most; export fewer groups"));
    }
    let (mut offset, mut directory) = (0, Vec::new());
    for Array { name, npy } in arrays {
        let mut crc = Crc::new();
        crc.update(npy);
        // Version, flags, no compression, the first moment of 1980, checksum, both sizes, length of name, nothing more.
        let size = (npy.len() as u32).to_le_bytes();
        let common = [
            &[20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0][..],
            &crc.sum().to_le_bytes(),
            &size,
            &size,
            &(name.len() as u16).to_le_bytes(),
            &[0, 0],
        ]
        .concat();
        let local = [b"PK\x03\x04", &common[..], name.as_bytes()].concat();
        directory.extend(
            [b"PK\x01\x02\x14\x00", &common[..], &[0; 10], &u32::to_le_bytes(offset), name.as_bytes()]
                .concat(),
        );
        writer.write_all(&local)?;
        writer.write_all(npy)?;
        offset += (local.len() + npy.len()) as u32;
    }
    let entries = (arrays.len() as u16).to_le_bytes();
    let size = (directory.len() as u32).to_le_bytes();
    let end = [b"PK\x05\x06\0\0\0\0", &entries[..], &entries, &size, &offset.to_le_bytes(), &[0, 0]].concat();
    writer.write_all(&directory)?;
    writer.write_all(&end)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Byte for byte what `zipfile` and `numpy.load` of Python 3 read back: two arrays, one of words.
    #[test]
    fn archives_are_as_the_formats_say() {
        let arrays = [
            Array::matrix("m", &[vec![1.0, -2.5], vec![0.0, 4.0]]),
            Array::words("w", ["a", "bcd"].into_iter()),
        ];
        let mut bytes = Vec::new();
        write(&mut bytes, &arrays).unwrap();
        let end = &bytes[bytes.len() - 22..];
        let number = |at: usize| u32::from_le_bytes(end[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&end[..4], end[8], end[10]), (&b"PK\x05\x06"[..], 2, 2));
        let (size, directory) = (number(12), number(16));
        assert_eq!(directory + size + 22, bytes.len());
        assert_eq!(&bytes[directory..directory + 4], b"PK\x01\x02");
        assert_eq!(&bytes[directory + 46..directory + 51], b"m.npy");
        // The second local header stands where its entry says.
        let second = directory + 46 + 5;
        let at = u32::from_le_bytes(bytes[second + 42..second + 46].try_into().unwrap()) as usize;
        assert_eq!((&bytes[at..at + 4], &bytes[at + 30..at + 35]), (&b"PK\x03\x04"[..], &b"w.npy"[..]));
        let npy = &bytes[30 + 5..];
        assert!(npy.starts_with(MAGIC));
        let header = u16::from_le_bytes([npy[8], npy[9]]) as usize;
        assert!((10 + header).is_multiple_of(ALIGNMENT));
        let text = std::str::from_utf8(&npy[10..10 + header]).unwrap();
        assert_eq!(text.trim_end(), "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }");
        assert_eq!(&npy[10 + header + 8..10 + header + 16], (-2.5_f64).to_le_bytes());
    }
}
