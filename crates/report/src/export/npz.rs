//! Arrays for NumPy: `.npy` files in an archive without compression (NEP 1, version 1.0; PKZIP's application note, 4.3 and its
//! extension to 64 bits, 4.5.3). Arrays are written as they come, and need not be in memory.

use std::io::{self, Seek, SeekFrom, Write};

use flate2::Crc;

/// What precedes a header: a magic word and the version.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// The data begin at a multiple of this.
const ALIGNMENT: usize = 64;

/// What stands for a number of 32 bits that follows in 64.
const BEYOND: [u8; 4] = [0xff; 4];

/// An archive that is being written.
pub(crate) struct Archive<W> {
    writer: W,
    entries: Vec<NpzArray>,
}

/// An array of an archive.
struct NpzArray {
    name: String,
    crc: u32,
    size: u64,
    /// Where its header begins.
    offset: u64,
}

/// Takes the numbers of an array.
pub(crate) struct Sink<'a, W> {
    writer: &'a mut W,
    crc: Crc,
    size: u64,
}

impl<W: Write> Sink<'_, W> {
    /// Writes some bytes of the array.
    pub(crate) fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.crc.update(bytes);
        self.size += bytes.len() as u64;
        self.writer.write_all(bytes)
    }
}

impl<W: Write + Seek> Archive<W> {
    pub(crate) fn new(writer: W) -> Self {
        Archive { writer, entries: Vec::new() }
    }

    /// Adds an array of a kind of numbers and a shape, in Python's words; `numbers` writes it.
    ///
    /// # Errors
    /// Those of the writer and of `numbers`.
    pub(crate) fn array(
        &mut self,
        name: &str,
        (kind, shape): (&str, &str),
        numbers: impl FnOnce(&mut Sink<'_, W>) -> io::Result<()>,
    ) -> io::Result<()> {
        let offset = self.writer.stream_position()?;
        let mut entry = NpzArray { name: format!("{name}.npy"), crc: 0, size: 0, offset };
        self.writer.write_all(&entry.local())?;
        let mut sink = Sink { writer: &mut self.writer, crc: Crc::new(), size: 0 };
        sink.put(&header(kind, shape))?;
        numbers(&mut sink)?;
        (entry.crc, entry.size) = (sink.crc.sum(), sink.size);
        let end = self.writer.stream_position()?;
        self.writer.seek(SeekFrom::Start(offset))?;
        self.writer.write_all(&entry.local())?;
        self.writer.seek(SeekFrom::Start(end))?;
        self.entries.push(entry);
        Ok(())
    }

    /// Adds numbers in rows of equal length.
    pub(crate) fn matrix(&mut self, name: &str, rows: &[Vec<f64>]) -> io::Result<()> {
        let columns = rows.first().map_or(0, Vec::len);
        let shape = format!("({}, {columns})", rows.len());
        self.array(name, ("<f8", &shape), |sink| {
            rows.iter().flatten().try_for_each(|x| sink.put(&x.to_le_bytes()))
        })
    }

    /// Adds words, each padded to the longest.
    pub(crate) fn words<'a>(&mut self, name: &str, words: impl Iterator<Item = &'a str>) -> io::Result<()> {
        let words: Vec<Vec<char>> = words.map(|word| word.chars().collect()).collect();
        let longest = words.iter().map(Vec::len).max().unwrap_or(0).max(1);
        let shape = format!("({},)", words.len());
        self.array(name, (&format!("<U{longest}"), &shape), |sink| {
            words.iter().try_for_each(|word| {
                let fill = std::iter::repeat_n('\0', longest - word.len());
                let padded = word.iter().copied().chain(fill);
                sink.put(&padded.flat_map(|character| u32::from(character).to_le_bytes()).collect::<Vec<_>>())
            })
        })
    }

    /// Writes the directory of the archive.
    ///
    /// # Errors
    /// Those of the writer.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        let begin = self.writer.stream_position()?;
        self.entries.iter().try_for_each(|entry| self.writer.write_all(&entry.central()))?;
        let end = self.writer.stream_position()?;
        let count = self.entries.len() as u64;
        let record = [
            b"PK\x06\x06",
            &44_u64.to_le_bytes()[..],
            &[45, 0, 45, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            &count.to_le_bytes(),
            &count.to_le_bytes(),
            &(end - begin).to_le_bytes(),
            &begin.to_le_bytes(),
        ];
        let locator = [b"PK\x06\x07\0\0\0\0", &end.to_le_bytes()[..], &[1, 0, 0, 0]];
        let last = [b"PK\x05\x06\0\0\0\0", &[0xff; 12][..], &[0, 0]];
        self.writer.write_all(&[record.concat(), locator.concat(), last.concat()].concat())?;
        self.writer.flush()
    }
}

impl NpzArray {
    /// No compression, the first moment of 1980, checksum, both sizes in 64 bits, length of name, length of the extension.
    fn common(&self, extension: u16) -> Vec<u8> {
        [
            &[45, 0, 0, 0, 0, 0, 0, 0, 0x21, 0][..],
            &self.crc.to_le_bytes(),
            &BEYOND,
            &BEYOND,
            &(self.name.len() as u16).to_le_bytes(),
            &extension.to_le_bytes(),
        ]
        .concat()
    }

    /// Both sizes in 64 bits, behind their tag and length.
    fn sizes(&self, length: u16) -> Vec<u8> {
        let size = self.size.to_le_bytes();
        [&1_u16.to_le_bytes()[..], &length.to_le_bytes(), &size, &size].concat()
    }

    fn local(&self) -> Vec<u8> {
        [b"PK\x03\x04", &self.common(20)[..], self.name.as_bytes(), &self.sizes(16)].concat()
    }

    fn central(&self) -> Vec<u8> {
        [
            b"PK\x01\x02\x2d\x00",
            &self.common(28)[..],
            &[0; 10],
            &BEYOND,
            self.name.as_bytes(),
            &self.sizes(24),
            &self.offset.to_le_bytes(),
        ]
        .concat()
    }
}

/// The header of an array.
fn header(kind: &str, shape: &str) -> Vec<u8> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let before = MAGIC.len() + 2 + header.len() + 1;
    header.extend(std::iter::repeat_n(' ', before.next_multiple_of(ALIGNMENT) - before));
    header.push('\n');
    [MAGIC, &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat()
}

#[cfg(test)]
pub(crate) mod tests {
    use std::io::Cursor;

    use super::*;

    /// The bytes of each `.npy` file of an archive, found by its directory.
    pub(crate) fn arrays(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
        let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
        let last = bytes.len() - 22;
        let locator = last - 20;
        assert_eq!(
            (&bytes[last..last + 4], &bytes[locator..locator + 4]),
            (&b"PK\x05\x06"[..], &b"PK\x06\x07"[..])
        );
        let record = number(locator + 8);
        assert_eq!(&bytes[record..record + 4], b"PK\x06\x06");
        let (count, mut at) = (number(record + 24), number(record + 48));
        let entry = |_| {
            assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
            let name = usize::from(u16::from_le_bytes([bytes[at + 28], bytes[at + 29]]));
            let extension = at + 46 + name;
            let (size, offset) = (number(extension + 4), number(extension + 20));
            assert_eq!(&bytes[offset..offset + 4], b"PK\x03\x04");
            // Version, checksum and name are those of the local header, and so are sizes.
            assert_eq!(bytes[at + 6..at + 30], bytes[offset + 4..offset + 28]);
            assert_eq!(number(offset + 30 + name + 4), size);
            let words = String::from_utf8(bytes[at + 46..extension].to_vec()).unwrap();
            let data = offset + 30 + name + 20;
            let mut crc = Crc::new();
            crc.update(&bytes[data..data + size]);
            assert_eq!(crc.sum().to_le_bytes(), bytes[at + 16..at + 20]);
            at = extension + 28;
            (words, bytes[data..data + size].to_vec())
        };
        (0..count).map(entry).collect()
    }

    /// Byte for byte what `zipfile` and `numpy.load` of Python 3 read back: two arrays, one of words.
    #[test]
    fn archives_are_as_the_formats_say() {
        let mut bytes = Vec::new();
        let mut archive = Archive::new(Cursor::new(&mut bytes));
        archive.matrix("m", &[vec![1.0, -2.5], vec![0.0, 4.0]]).unwrap();
        archive.words("w", ["a", "bcd"].into_iter()).unwrap();
        archive.finish().unwrap();
        let arrays = arrays(&bytes);
        let names: Vec<&str> = arrays.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names, ["m.npy", "w.npy"]);
        let npy = &arrays[0].1;
        assert!(npy.starts_with(MAGIC));
        let header = u16::from_le_bytes([npy[8], npy[9]]) as usize;
        assert!((10 + header).is_multiple_of(ALIGNMENT));
        let text = std::str::from_utf8(&npy[10..10 + header]).unwrap();
        assert_eq!(text.trim_end(), "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }");
        assert_eq!(&npy[10 + header + 8..10 + header + 16], (-2.5_f64).to_le_bytes());
        assert!(arrays[1].1.ends_with(b"b\0\0\0c\0\0\0d\0\0\0"));
    }
}
