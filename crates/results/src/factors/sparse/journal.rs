//! The file of counted rows: a line of words, a line that says what was counted, then a record for each row.
//!
//! A record is the length of its content, eight bytes of a digest of that and of the row's number, and the content. Records are in the
//! order of rows, so that the bytes do not depend on who counted them. One that was being written when the process or the machine stopped
//! is found by its digest, and is counted again.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Read, Seek, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use exchange::SparseRow;
use report::OutputFolder;
use serde::{Deserialize, Serialize};

use super::super::fault::FactorsFault;
use super::super::question::FactorsQuestion;
use super::{RowWalks, SparseAsked};
use crate::error::Error;

/// The file of rows.
pub(crate) const ROWS: &str = "factors.rows";

const WORDS: &str = "radwalk counted rows 1";

/// What was counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Heading {
    /// Digest of all that the rows depend on.
    pub(super) question: String,
    pub(super) seed: u64,
    pub(super) groups: usize,
    pub(super) columns: usize,
    /// The patches of the sky among the columns.
    pub(super) sky: u32,
    /// The rows of the file.
    pub(super) rows: Range<usize>,
    /// The most walks of a row; 0 where they follow from all.
    pub(super) rays: u32,
    /// The most walks of all rows, where they share them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) paths: Option<u64>,
    /// The relative error at which rows end.
    pub(super) tolerance: Option<f64>,
}

impl Heading {
    pub(super) fn of(question: &FactorsQuestion, asked: &SparseAsked, columns: usize) -> Self {
        let FactorsQuestion { job, scene, groups, kind, tolerance, level, .. } = question;
        let tolerance = tolerance.as_ref().map(|tolerance| tolerance.relative);
        let SparseAsked { walks, sky, .. } = *asked;
        let (rays, paths) = match walks {
            RowWalks::Each(rays) => (rays, None),
            RowWalks::Shared(paths) => (0, Some(paths)),
        };
        let all = (scene.hash(), job.seed, kind, job.method.space, &groups.of_face);
        let tolerated = tolerance.map(|tolerance| (tolerance, level));
        let all = match paths {
            None => serde_json::to_vec(&(all, rays, sky, tolerated)),
            Some(paths) => serde_json::to_vec(&(all, ("shared", paths), sky, tolerated)),
        };
        Heading {
            question: blake3::hash(&all.expect("numbers and words")).to_hex().to_string(),
            seed: job.seed,
            groups: groups.count(),
            columns,
            sky: sky.unwrap_or(0),
            rows: asked.rows(groups.count()),
            rays,
            paths,
            tolerance,
        }
    }
}

/// A row as it is kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct StoredRow {
    pub(super) row: SparseRow,
    /// The number of rays of its walks.
    pub(super) rays: u64,
    /// Whether it is known as well as was asked.
    pub(super) reached: bool,
}

impl StoredRow {
    /// The content of its record.
    pub(super) fn pack(&self) -> Vec<u8> {
        let mut bytes = self.rays.to_le_bytes().to_vec();
        bytes.push(self.reached.into());
        self.row.pack(&mut bytes);
        bytes
    }

    fn unpack(bytes: &[u8]) -> Option<Self> {
        let (rays, rest) = bytes.split_first_chunk::<8>()?;
        let (reached, row) = rest.split_first()?;
        Some(StoredRow {
            row: SparseRow::unpack(row)?,
            rays: u64::from_le_bytes(*rays),
            reached: *reached == 1,
        })
    }
}

/// Eight bytes by which a record is known.
fn seal(row: usize, content: &[u8]) -> [u8; 8] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(row as u64).to_le_bytes()).update(content);
    hasher.finalize().as_bytes()[..8].try_into().expect("digests have 32 bytes")
}

/// Writes the lines before the rows.
fn begin(file: &mut impl Write, heading: &Heading) -> io::Result<()> {
    writeln!(file, "{WORDS}")?;
    serde_json::to_writer(&mut *file, heading)?;
    writeln!(file)
}

/// Writes the record of a row.
fn write_row(file: &mut impl Write, number: usize, content: &[u8]) -> io::Result<()> {
    let parts = [&(content.len() as u32).to_le_bytes()[..], &seal(number, content), content];
    parts.iter().try_for_each(|part| file.write_all(part))
}

/// A file of rows that more are written to.
pub(super) struct Journal {
    file: BufWriter<File>,
    path: PathBuf,
    /// The number of the next row.
    pub(super) next: usize,
}

impl Journal {
    /// Opens the file in a folder: a new one, or one to `resume`.
    ///
    /// # Errors
    /// Where the rows are those of another question, or the system refuses.
    pub(super) fn open(folder: &OutputFolder, heading: &Heading, resume: bool) -> Result<Self, Error> {
        let path = folder.file(ROWS);
        let failed = |source| Error::Rows { path: path.clone(), source };
        if resume && path.exists() {
            let (next, length) = Journal::whole_rows(&path, heading)?;
            let file = OpenOptions::new().append(true).open(&path).map_err(failed)?;
            file.set_len(length).map_err(failed)?;
            return Ok(Journal { file: BufWriter::with_capacity(1 << 18, file), path, next });
        }
        // A file without its first lines could not be gone on with.
        folder.write(ROWS, |file| begin(file, heading))?;
        let file = OpenOptions::new().append(true).open(&path).map_err(failed)?;
        let file = BufWriter::with_capacity(1 << 18, file);
        Ok(Journal { file, path, next: heading.rows.start })
    }

    /// The number of the first row that a file has not, and its length without what follows the rows before.
    fn whole_rows(path: &Path, heading: &Heading) -> Result<(usize, u64), Error> {
        let mut reader = RowsReader::open(path)?;
        if reader.heading != *heading {
            return Err(FactorsFault::OtherCounts { path: path.into() }.into());
        }
        let failed = |source| Error::Rows { path: path.into(), source };
        let mut end = reader.file.stream_position().map_err(failed)?;
        loop {
            match reader.next() {
                Ok(Some(_)) => end = reader.file.stream_position().map_err(failed)?,
                Ok(None) => break,
                // A row that was written in part is counted again; a disk that cannot be read for a while has lost none.
                Err(error) => match error.kind() {
                    io::ErrorKind::UnexpectedEof | io::ErrorKind::InvalidData => break,
                    _ => return Err(failed(error)),
                },
            }
        }
        Ok((reader.next, end))
    }

    /// Adds the content of the next row.
    pub(super) fn add(&mut self, content: &[u8]) -> Result<(), Error> {
        self.next += 1;
        write_row(&mut self.file, self.next - 1, content).map_err(|source| self.failed(source))
    }

    /// Hands all over to the system, which keeps it where this process is killed.
    pub(super) fn flush(&mut self) -> Result<(), Error> {
        self.file.flush().map_err(|source| self.failed(source))
    }

    /// Sees to it that all of it outlasts a loss of power.
    pub(super) fn close(mut self) -> Result<(), Error> {
        self.flush()?;
        self.file.get_ref().sync_all().map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> Error {
        Error::Rows { path: self.path.clone(), source }
    }
}

/// A file of rows that is read.
pub(super) struct RowsReader {
    file: BufReader<File>,
    pub(super) heading: Heading,
    next: usize,
    content: Vec<u8>,
}

impl RowsReader {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::Rows { path: path.into(), source };
        let mut file = BufReader::with_capacity(1 << 18, File::open(path).map_err(failed)?);
        let (mut words, mut json) = (String::new(), String::new());
        file.read_line(&mut words).and_then(|_| file.read_line(&mut json)).map_err(failed)?;
        let heading: Option<Heading> = serde_json::from_str(&json).ok().filter(|_| words.trim_end() == WORDS);
        let heading = heading.ok_or_else(|| FactorsFault::UnreadableCounts {
            path: path.into(),
            reason: "it has no rows of this version".into(),
        })?;
        Ok(RowsReader { file, next: heading.rows.start, heading, content: Vec::new() })
    }

    /// The next row; `None` behind the last.
    ///
    /// # Errors
    /// Where the file ends before the last row, or its bytes are not those that were written.
    pub(super) fn next(&mut self) -> io::Result<Option<StoredRow>> {
        if self.next == self.heading.rows.end {
            return Ok(None);
        }
        let (mut length, mut sealed) = ([0; 4], [0; 8]);
        self.file.read_exact(&mut length)?;
        self.file.read_exact(&mut sealed)?;
        // A length that is none must not take all memory.
        self.content.clear();
        let length = u32::from_le_bytes(length);
        self.file.by_ref().take(length.into()).read_to_end(&mut self.content)?;
        let whole = self.content.len() == length as usize && seal(self.next, &self.content) == sealed;
        let row = StoredRow::unpack(&self.content).filter(|_| whole).ok_or_else(|| {
            io::Error::new(io::ErrorKind::InvalidData, format!("row {} is damaged", self.next))
        })?;
        self.next += 1;
        Ok(Some(row))
    }
}

/// Puts the rows of several folders together, which are parts of one question, as `folder` would hold them had they been counted there.
///
/// # Errors
/// Where files cannot be read or written, and where the parts are not those of one whole.
pub(super) fn join(folders: &[PathBuf], folder: &OutputFolder, whole: &Heading) -> Result<(), Error> {
    let mut parts = Vec::with_capacity(folders.len());
    for part in folders {
        parts.push((RowsReader::open(&part.join(ROWS)).map_err(|error| no_rows(error, part))?, part));
    }
    parts.sort_by_key(|(part, _)| part.heading.rows.start);
    check_parts(&parts, whole)?;
    let mut damaged = None;
    let joined = folder.draft(ROWS, |file| {
        begin(file, whole)?;
        for (part, path) in &mut parts {
            while part.next().inspect_err(|_| damaged = Some(path.join(ROWS)))?.is_some() {
                write_row(file, part.next - 1, &part.content)?;
            }
        }
        Ok(())
    });
    match (joined, damaged) {
        (Err(report::Error::Io { source, .. }), Some(path)) => Err(Error::Rows { path, source }),
        (joined, _) => {
            joined?.place()?;
            Ok(folder.sync()?)
        }
    }
}

/// The error of a folder that may have no rows.
fn no_rows(error: Error, folder: &Path) -> Error {
    match error {
        Error::Rows { source, .. } if source.kind() == io::ErrorKind::NotFound => {
            FactorsFault::NoRows { folder: folder.into() }.into()
        }
        error => error,
    }
}

/// Checks that parts in the order of their rows are those of one whole.
fn check_parts(parts: &[(RowsReader, &PathBuf)], whole: &Heading) -> Result<(), FactorsFault> {
    let mut next = whole.rows.start;
    for (part, path) in parts {
        let refused =
            |reason: &str| FactorsFault::Unmergeable { path: path.join(ROWS), reason: reason.into() };
        if (Heading { rows: whole.rows.clone(), ..part.heading.clone() }) != *whole {
            return Err(refused("they are of another question; join parts of this one"));
        }
        if part.heading.rows.start != next {
            return Err(refused(
                "the rows before them are in none of the folders, or in two; give each part once",
            ));
        }
        next = part.heading.rows.end;
    }
    if next != whole.rows.end {
        let path = parts.last().map_or_else(PathBuf::new, |(_, path)| path.join(ROWS));
        let reason = "the rows behind them are in none of the folders; give all parts".into();
        return Err(FactorsFault::Unmergeable { path, reason });
    }
    Ok(())
}
