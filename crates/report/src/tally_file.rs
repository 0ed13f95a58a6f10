//! `tally.bin`: the exact tally of walks 0 … N − 1, to resume, merge and audit from.
//!
//! Little-endian, without padding:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic `RWTALLY` and a zero byte |
//! | 4 | u32 format version, 2 |
//! | 1 | u8 scores S: one per channel, or per estimator that is compared |
//! | 1 | u8 moments K: each patch keeps Σx … Σx^K of each score |
//! | 2 | u16 1 where a count of events stands beside them, else 0; M is S·K plus this |
//! | 8 | u64 patches P |
//! | 32 | job hash |
//! | 32 | scene hash |
//! | 240 | u128 × 15: walks N, rays, absorbed, absorbed_back, escaped, truncated; weights of the last three, three channels each, in 2⁻⁴⁰ |
//! | 16·P·M | u128 sums, patch-major |
//! | 32 | BLAKE3 of all the bytes before |

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use radiosity::{Counts, Layout, Tally};
use thiserror::Error;

const MAGIC: [u8; 8] = *b"RWTALLY\0";
const VERSION: u32 = 2;
const HEADER_BYTES: usize = 328;
const HASH_BYTES: usize = 32;

/// What a tally file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TallyFile {
    /// The job whose walks these are.
    pub job_hash: [u8; 32],
    /// The scene they ran in.
    pub scene_hash: [u8; 32],
    /// Walks 0 … `tally.counts.walks` − 1.
    pub tally: Tally,
}

/// A tally file that cannot be used.
#[derive(Debug, Error)]
#[error("cannot use the tally {}: {fault}", path.display())]
pub struct TallyFileError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    #[source]
    pub fault: TallyFault,
}

/// What can be wrong with a tally file.
#[derive(Debug, Error)]
pub enum TallyFault {
    /// The operating system refused.
    #[error("{0}; check that the file exists and is readable")]
    Io(#[from] io::Error),
    /// It begins with other bytes.
    #[error("it is not a tally file (it does not begin as one); give the tally.bin of an output folder")]
    Magic,
    /// It is of another format.
    #[error("it is of format {0} (this program knows {VERSION}); use the program that wrote it")]
    Version(u32),
    /// It is shorter or longer than its header says.
    #[error("it has {found} bytes instead of {expected} (it was cut off or added to); start the run anew")]
    Length {
        /// Bytes that its header asks for.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// Its content is not what was written.
    #[error("its checksum is wrong (bytes were changed after it was written); start the run anew")]
    Checksum,
    /// It belongs to another job.
    #[error(
        "its walks are those of another job (scene, method or seed differ); use the job that it was written by"
    )]
    ForeignJob,
    /// It belongs to another scene.
    #[error("its walks ran in another scene (the scene file has changed); restore the scene or start anew")]
    ForeignScene,
}

/// Writes a tally and what it belongs to.
///
/// # Errors
/// Those of `writer`.
pub fn write_tally(
    writer: &mut impl Write,
    job_hash: &[u8; 32],
    scene_hash: &[u8; 32],
    tally: &Tally,
) -> io::Result<()> {
    let mut writer = HashingWriter { inner: writer, hasher: blake3::Hasher::new() };
    writer.write(&header(job_hash, scene_hash, tally))?;
    let mut bytes = Vec::with_capacity(16 * CHUNK_SUMS);
    for sums in tally.sums().chunks(CHUNK_SUMS) {
        bytes.clear();
        bytes.extend(sums.iter().flat_map(|sum| sum.to_le_bytes()));
        writer.write(&bytes)?;
    }
    writer.inner.write_all(writer.hasher.finalize().as_bytes())
}

/// How many sums are hashed and written at a time.
const CHUNK_SUMS: usize = 4096;

struct HashingWriter<'a, W> {
    inner: &'a mut W,
    hasher: blake3::Hasher,
}

impl<W: Write> HashingWriter<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hasher.update(bytes);
        self.inner.write_all(bytes)
    }
}

fn header(job_hash: &[u8; 32], scene_hash: &[u8; 32], tally: &Tally) -> Vec<u8> {
    let mut header = Vec::with_capacity(HEADER_BYTES);
    header.extend(MAGIC);
    header.extend(VERSION.to_le_bytes());
    let Layout { scores, moments, events } = tally.layout();
    header.extend([scores as u8, moments as u8]);
    header.extend(u16::from(events).to_le_bytes());
    header.extend((tally.patches() as u64).to_le_bytes());
    header.extend(job_hash);
    header.extend(scene_hash);
    for count in tally.counts.to_array() {
        header.extend(count.to_le_bytes());
    }
    header
}

/// Reads a tally file, whatever job it belongs to.
///
/// # Errors
/// Where the file cannot be read, is no tally of this format, or is damaged.
pub fn read_tally(path: &Path) -> Result<TallyFile, TallyFileError> {
    let read = || parse(&fs::read(path)?);
    read().map_err(|fault| TallyFileError { path: path.to_path_buf(), fault })
}

/// Reads the tally of a job in a scene.
///
/// # Errors
/// As [`read_tally`], and where the file belongs to another job or scene.
pub fn read_tally_of(
    path: &Path,
    job_hash: &[u8; 32],
    scene_hash: &[u8; 32],
) -> Result<Tally, TallyFileError> {
    let file = read_tally(path)?;
    let fault = if file.scene_hash != *scene_hash {
        TallyFault::ForeignScene
    } else if file.job_hash != *job_hash {
        TallyFault::ForeignJob
    } else {
        return Ok(file.tally);
    };
    Err(TallyFileError { path: path.to_path_buf(), fault })
}

fn parse(bytes: &[u8]) -> Result<TallyFile, TallyFault> {
    let mut fields = Fields { rest: bytes, found: bytes.len() as u64 };
    if !bytes.starts_with(&MAGIC) {
        return Err(TallyFault::Magic);
    }
    fields.take::<8>()?;
    let version = u32::from_le_bytes(fields.take()?);
    if version != VERSION {
        return Err(TallyFault::Version(version));
    }
    let [scores, moments] = fields.take()?;
    let events = u16::from_le_bytes(fields.take()?);
    let layout = Layout { scores: scores.into(), moments: moments.into(), events: events == 1 };
    let columns = layout.columns() as u32;
    let patches = u64::from_le_bytes(fields.take()?);
    check_length(bytes, patches, columns)?;
    check_sum(bytes)?;
    let (job_hash, scene_hash) = (fields.take()?, fields.take()?);
    let mut counts = [0; 15];
    for count in &mut counts {
        *count = u128::from_le_bytes(fields.take()?);
    }
    let sums = (0..patches * u64::from(columns)).map(|_| Ok(u128::from_le_bytes(fields.take()?)));
    let sums = sums.collect::<Result<_, TallyFault>>()?;
    let counts = Counts::from_array(counts).ok_or(TallyFault::Checksum)?;
    let tally = Tally::from_parts(counts, patches as usize, layout, sums)
        .expect("there are as many sums as the header says");
    Ok(TallyFile { job_hash, scene_hash, tally })
}

/// The bytes that are still to be read.
struct Fields<'a> {
    rest: &'a [u8],
    /// The size of the file.
    found: u64,
}

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], TallyFault> {
        let expected = (HEADER_BYTES + HASH_BYTES) as u64;
        let (field, rest) =
            self.rest.split_first_chunk().ok_or(TallyFault::Length { expected, found: self.found })?;
        self.rest = rest;
        Ok(*field)
    }
}

/// Before anything of that size is allocated: a damaged header may ask for more than there is memory.
fn check_length(bytes: &[u8], patches: u64, columns: u32) -> Result<(), TallyFault> {
    let sums = patches.saturating_mul(u64::from(columns)).saturating_mul(16);
    let expected = sums.saturating_add((HEADER_BYTES + HASH_BYTES) as u64);
    let found = bytes.len() as u64;
    if found == expected { Ok(()) } else { Err(TallyFault::Length { expected, found }) }
}

fn check_sum(bytes: &[u8]) -> Result<(), TallyFault> {
    let (content, checksum) = bytes.split_at(bytes.len() - HASH_BYTES);
    if blake3::hash(content).as_bytes() == checksum { Ok(()) } else { Err(TallyFault::Checksum) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: Layout = Layout { scores: 1, moments: 2, events: false };

    const JOB: [u8; 32] = [1; 32];
    const SCENE: [u8; 32] = [2; 32];

    fn tally() -> Tally {
        let counts = Counts {
            walks: 100,
            rays: 250,
            absorbed: 90,
            absorbed_back: 1,
            escaped: 9,
            escaped_weight: [9 << 40, 1, 0],
            ..Counts::default()
        };
        Tally::from_parts(counts, 3, PAIR, vec![1, 2, 3, 4, u128::MAX, 1 << 100]).unwrap()
    }

    fn bytes() -> Vec<u8> {
        let mut bytes = Vec::new();
        write_tally(&mut bytes, &JOB, &SCENE, &tally()).unwrap();
        bytes
    }

    fn fault_of(bytes: &[u8]) -> TallyFault {
        parse(bytes).unwrap_err()
    }

    #[test]
    fn what_was_written_is_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("tally.bin");
        fs::write(&path, bytes()).unwrap();
        let expected = TallyFile { job_hash: JOB, scene_hash: SCENE, tally: tally() };
        assert_eq!(read_tally(&path).unwrap(), expected);
        assert_eq!(read_tally_of(&path, &JOB, &SCENE).unwrap(), tally());
    }

    #[test]
    fn more_sums_than_one_chunk_are_read_in_order() {
        let sums: Vec<u128> = (0..3 * CHUNK_SUMS as u128 + 2).map(|i| i << 40).collect();
        let tally = Tally::from_parts(Counts::default(), sums.len() / 2, PAIR, sums).unwrap();
        let mut bytes = Vec::new();
        write_tally(&mut bytes, &JOB, &SCENE, &tally).unwrap();
        assert_eq!(parse(&bytes).unwrap().tally, tally);
    }

    #[test]
    fn the_bytes_are_laid_out_as_documented() {
        let bytes = bytes();
        assert_eq!(bytes.len(), HEADER_BYTES + 6 * 16 + HASH_BYTES);
        assert_eq!(&bytes[..24], b"RWTALLY\0\x02\0\0\0\x01\x02\0\0\x03\0\0\0\0\0\0\0");
        assert_eq!(bytes[24..88], [JOB, SCENE].concat());
        assert_eq!(bytes[88..104], 100_u128.to_le_bytes());
        assert_eq!(bytes[152..168], 9_u128.to_le_bytes());
        assert_eq!(bytes[232..264], [(9_u128 << 40).to_le_bytes(), 1_u128.to_le_bytes()].concat());
        assert_eq!(bytes[328..344], 1_u128.to_le_bytes());
    }

    #[test]
    fn other_files_and_formats_are_refused() {
        assert!(matches!(fault_of(b""), TallyFault::Magic));
        assert!(matches!(fault_of(b"patch,surface,u,v"), TallyFault::Magic));
        let mut newer = bytes();
        newer[8] = 3;
        assert!(matches!(fault_of(&newer), TallyFault::Version(3)));
    }

    #[test]
    fn a_file_of_any_other_length_is_refused() {
        let whole = bytes();
        for length in MAGIC.len()..whole.len() {
            assert!(matches!(fault_of(&whole[..length]), TallyFault::Length { .. }), "{length}");
        }
        assert!(matches!(fault_of(&[&whole[..], b"x"].concat()), TallyFault::Length { .. }));
        let mut huge = whole;
        huge[16..24].fill(0xFF);
        assert!(matches!(fault_of(&huge), TallyFault::Length { expected: u64::MAX, .. }));
    }

    #[test]
    fn any_flipped_bit_is_noticed() {
        let whole = bytes();
        for byte in 0..whole.len() {
            let mut changed = whole.clone();
            changed[byte] ^= 0x10;
            assert!(parse(&changed).is_err(), "byte {byte}");
        }
        let mut changed = whole;
        changed[130] ^= 1;
        assert!(matches!(fault_of(&changed), TallyFault::Checksum));
    }

    #[test]
    fn foreign_tallies_are_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("tally.bin");
        fs::write(&path, bytes()).unwrap();
        let fault = |job, scene| read_tally_of(&path, job, scene).unwrap_err().fault;
        assert!(matches!(fault(&[9; 32], &SCENE), TallyFault::ForeignJob));
        assert!(matches!(fault(&JOB, &[9; 32]), TallyFault::ForeignScene));
        let missing = read_tally(&dir.path().join("none.bin")).unwrap_err();
        assert!(missing.to_string().contains("none.bin"), "{missing}");
        assert!(matches!(missing.fault, TallyFault::Io(_)));
    }
}
