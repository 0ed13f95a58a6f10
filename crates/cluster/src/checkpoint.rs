//! `tally.bin`: the exact tally of a run and its ledger, to resume, merge and audit from.
//!
//! Little-endian, without padding:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic `RWTALLY` and a zero byte |
//! | 4 | u32 format version, 4 |
//! | 1 | u8 scores S: one per channel, or per estimator that is compared |
//! | 1 | u8 moments K: each patch keeps Σx … Σx^K of each score |
//! | 2 | u16 1 where a count of events stands beside them, else 0; M is S·K plus this |
//! | 8 | u64 patches P |
//! | 8 | u64 bytes of the book L |
//! | 32 | scene hash |
//! | 240 | u128 × 15: walks N, rays, absorbed, absorbed_back, escaped, truncated; weights of the last three, three channels each, in 2⁻⁴⁰ |
//! | 16·P·M | u128 sums, patch-major |
//! | L | the book, in bincode: whose walks these are, who delivered them, looks, sessions, the job |
//! | 32 | BLAKE3 of all the bytes before |
//!
//! Where chains of rays take the place of walks, N counts chains, and absorbed … truncated count rays; where batches of
//! walks do, N counts batches.
//!
//! A file is believed when its checksum is right, the walks of its parts add up to N, and the digests of all deliveries
//! to that of its tally.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bincode::{Decode, Encode};
use radiosity::{Counts, Layout, Tally};
use thiserror::Error;

use crate::codec::{decode, encode};
use crate::crew::Effort;
use crate::digest::{self, Digester};
use crate::ledger::Delivery;

const MAGIC: [u8; 8] = *b"RWTALLY\0";
const VERSION: u32 = 4;
const HEADER_BYTES: usize = 304;
const HASH_BYTES: usize = 32;

/// Some consecutive walks of one job.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Part {
    /// The job.
    pub job_hash: [u8; 32],
    /// Its seed.
    pub seed: u64,
    /// The number of the first walk.
    pub first: u64,
    /// The leases that the walks came in, in their order.
    pub deliveries: Vec<Delivery>,
}

impl Part {
    /// How many walks.
    pub fn walks(&self) -> u64 {
        self.deliveries.iter().map(|delivery| delivery.walks).sum()
    }

    /// The number of the walk after the last.
    pub fn end(&self) -> u64 {
        self.first + self.walks()
    }
}

/// What was seen of a prefix at a number of walks that the job fixes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Encode, Decode)]
pub struct Look {
    /// Walks of the prefix.
    pub walks: u64,
    /// Their rays.
    pub rays: u64,
    /// Area-weighted root mean square of the relative errors.
    pub rms_relative_error: f64,
    /// The largest relative error.
    pub max_relative_error: f64,
    /// Mean squared difference between the estimates of the walks since the look before and those up to it, over its
    /// variance: about 1, if walks are independent. Not a number where there is none to compare with.
    pub drift: f64,
    /// Whether twice as many walks will do.
    pub promising: bool,
    /// Whether the job ends here: its target is reached.
    pub reached: bool,
}

/// One process that coordinated a part of the run.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Session {
    /// The machine.
    pub host: String,
    /// Version and commit of the program.
    pub build: String,
    /// Seconds since 1970-01-01 UTC.
    pub began: u64,
    /// Likewise, of the last checkpoint.
    pub ended: u64,
}

/// The books of a prefix, which a coordinator begins with and leaves behind.
#[derive(Clone, Debug, PartialEq)]
pub struct Past {
    /// The tally of the prefix.
    pub tally: Arc<Tally>,
    /// The leases it was made of, in the order of walks.
    pub deliveries: Vec<Delivery>,
    /// The workers that deliveries name.
    pub workers: Vec<String>,
    /// The looks so far.
    pub looks: Vec<Look>,
    /// What it took.
    pub effort: Effort,
}

impl Past {
    /// Of a job that begins; `tally` is empty.
    pub fn none(tally: Tally) -> Self {
        let (deliveries, workers, looks) = (vec![], vec![], vec![]);
        Past { tally: tally.into(), deliveries, workers, looks, effort: Effort::default() }
    }
}

/// What a tally file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The scene of the walks.
    pub scene_hash: [u8; 32],
    /// The sums.
    pub tally: Arc<Tally>,
    /// All beside the sums.
    pub book: Book,
}

/// Whose walks these are, and how they came here.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct Book {
    /// The walks, by job and number.
    pub parts: Vec<Part>,
    /// The workers that deliveries name.
    pub workers: Vec<String>,
    /// What was seen on the way.
    pub looks: Vec<Look>,
    /// Names the target that the looks were held against.
    pub goal: [u8; 32],
    /// What it took.
    pub effort: Effort,
    /// The processes that coordinated it.
    pub sessions: Vec<Session>,
    /// The job, for the program to read.
    pub job: Vec<u8>,
}

/// A tally file that cannot be used.
#[derive(Debug, Error)]
#[error("cannot use the tally {}: {fault}", path.display())]
pub struct CheckpointError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    #[source]
    pub fault: CheckpointFault,
}

/// What can be wrong with a tally file.
#[derive(Debug, Error)]
pub enum CheckpointFault {
    /// The operating system refused.
    #[error("{0}; check that the file exists and is readable")]
    Io(#[from] io::Error),
    /// It begins with other bytes.
    #[error("it is not a tally file (it does not begin as one); give the folder of a run")]
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
    /// Its parts contradict each other.
    #[error("{0} (memory failed when it was written, or it was forged); start the run anew")]
    Contradiction(&'static str),
    /// It belongs to another job.
    #[error(
        "its walks are those of another job (method, seed or first walk differ); use the job that it was written by"
    )]
    ForeignJob,
    /// It belongs to another scene.
    #[error("its walks ran in another scene (the scene file has changed); restore the scene or start anew")]
    ForeignScene,
}

impl Checkpoint {
    /// Writes the file.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn write(&self, writer: &mut impl Write) -> io::Result<()> {
        let book = encode(&self.book).map_err(io::Error::other)?;
        let mut writer = HashingWriter { inner: writer, hasher: blake3::Hasher::new() };
        writer.write(&self.header(book.len()))?;
        let mut bytes = Vec::with_capacity(16 * CHUNK_SUMS);
        for sums in self.tally.sums().chunks(CHUNK_SUMS) {
            bytes.clear();
            bytes.extend(sums.iter().flat_map(|sum| sum.to_le_bytes()));
            writer.write(&bytes)?;
        }
        writer.write(&book)?;
        writer.inner.write_all(writer.hasher.finalize().as_bytes())
    }

    fn header(&self, book_bytes: usize) -> Vec<u8> {
        let mut header = Vec::with_capacity(HEADER_BYTES);
        header.extend(MAGIC);
        header.extend(VERSION.to_le_bytes());
        let Layout { scores, moments, events } = self.tally.layout();
        header.extend([scores as u8, moments as u8]);
        header.extend(u16::from(events).to_le_bytes());
        header.extend((self.tally.patches() as u64).to_le_bytes());
        header.extend((book_bytes as u64).to_le_bytes());
        header.extend(self.scene_hash);
        for count in self.tally.counts.to_array() {
            header.extend(count.to_le_bytes());
        }
        header
    }

    /// Whether the books balance: every walk is accounted for once and ended once, and the digests of the deliveries
    /// add up to that of the tally.
    ///
    /// # Errors
    /// Where they do not: the memory that held them failed.
    pub fn verify(&self) -> Result<(), CheckpointFault> {
        let Counts { walks, rays, absorbed, absorbed_back, escaped, truncated, .. } = self.tally.counts;
        let fault = |what| Err(CheckpointFault::Contradiction(what));
        let sum = |of: &[u64]| of.iter().map(|&count| u128::from(count)).sum::<u128>();
        // A walk ends once. Where batches take the place of walks, each of their rays or walks does.
        let ended = sum(&[absorbed, absorbed_back, escaped, truncated]);
        let alike = ended >= u128::from(walks) && ended.is_multiple_of(u128::from(walks.max(1)));
        if !alike && ended != u128::from(rays) {
            return fault("not every walk ended once");
        }
        let deliveries = || self.book.parts.iter().flat_map(|part| &part.deliveries);
        if deliveries().map(|delivery| u128::from(delivery.walks)).sum::<u128>() != u128::from(walks) {
            return fault("its walks are not those of its ledger");
        }
        if deliveries().any(|delivery| delivery.worker as usize >= self.book.workers.len()) {
            return fault("nobody delivered some of its walks");
        }
        let delivered = deliveries().fold(0, |sum, delivery| digest::add(sum, delivery.digest));
        if Digester::new(&self.scene_hash).digest(&self.tally) != delivered {
            return fault("its sums are not those that were delivered");
        }
        Ok(())
    }

    /// Whether these are the first walks of a job from its walk `first` on.
    ///
    /// # Errors
    /// Where they are others.
    pub fn check_job(
        &self,
        scene_hash: &[u8; 32],
        job_hash: &[u8; 32],
        first: u64,
    ) -> Result<(), CheckpointFault> {
        if self.scene_hash != *scene_hash {
            return Err(CheckpointFault::ForeignScene);
        }
        match &self.book.parts[..] {
            [part] if (part.job_hash, part.first) == (*job_hash, first) => Ok(()),
            _ => Err(CheckpointFault::ForeignJob),
        }
    }
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

/// Reads a tally file, whatever job it belongs to.
///
/// # Errors
/// Where the file cannot be read, is no tally of this format, is damaged or contradicts itself.
pub fn read(path: &Path) -> Result<Checkpoint, CheckpointError> {
    let read = || parse(&fs::read(path)?);
    read().map_err(|fault| CheckpointError { path: path.to_path_buf(), fault })
}

fn parse(bytes: &[u8]) -> Result<Checkpoint, CheckpointFault> {
    let mut fields = Fields { rest: bytes, found: bytes.len() as u64 };
    if !bytes.starts_with(&MAGIC) {
        return Err(CheckpointFault::Magic);
    }
    fields.take::<8>()?;
    let version = u32::from_le_bytes(fields.take()?);
    if version != VERSION {
        return Err(CheckpointFault::Version(version));
    }
    let [scores, moments] = fields.take()?;
    let events = u16::from_le_bytes(fields.take()?);
    let layout = Layout { scores: scores.into(), moments: moments.into(), events: events == 1 };
    let patches = u64::from_le_bytes(fields.take()?);
    let book_bytes = u64::from_le_bytes(fields.take()?);
    let sums = patches.saturating_mul(layout.columns() as u64);
    check_length(bytes, sums, book_bytes)?;
    check_sum(bytes)?;
    let scene_hash = fields.take()?;
    let mut counts = [0; 15];
    for count in &mut counts {
        *count = u128::from_le_bytes(fields.take()?);
    }
    let sums = (0..sums).map(|_| Ok(u128::from_le_bytes(fields.take()?)));
    let sums = sums.collect::<Result<_, CheckpointFault>>()?;
    let book = decode(&fields.rest[..book_bytes as usize])
        .map_err(|_| CheckpointFault::Contradiction("its book cannot be read"))?;
    let counts =
        Counts::from_array(counts).ok_or(CheckpointFault::Contradiction("its counts exceed 64 bits"))?;
    let tally = Tally::from_parts(counts, patches as usize, layout, sums)
        .expect("there are as many sums as the header says");
    let checkpoint = Checkpoint { scene_hash, tally: tally.into(), book };
    checkpoint.verify()?;
    Ok(checkpoint)
}

/// The bytes that are still to be read.
struct Fields<'a> {
    rest: &'a [u8],
    /// The size of the file.
    found: u64,
}

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], CheckpointFault> {
        let expected = (HEADER_BYTES + HASH_BYTES) as u64;
        let (field, rest) =
            self.rest.split_first_chunk().ok_or(CheckpointFault::Length { expected, found: self.found })?;
        self.rest = rest;
        Ok(*field)
    }
}

/// Before anything of that size is allocated: a damaged header may ask for more than there is memory.
fn check_length(bytes: &[u8], sums: u64, book_bytes: u64) -> Result<(), CheckpointFault> {
    let around = (HEADER_BYTES + HASH_BYTES) as u64;
    let expected = sums.saturating_mul(16).saturating_add(book_bytes).saturating_add(around);
    let found = bytes.len() as u64;
    if found == expected { Ok(()) } else { Err(CheckpointFault::Length { expected, found }) }
}

fn check_sum(bytes: &[u8]) -> Result<(), CheckpointFault> {
    let (content, checksum) = bytes.split_at(bytes.len() - HASH_BYTES);
    if blake3::hash(content).as_bytes() == checksum { Ok(()) } else { Err(CheckpointFault::Checksum) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAIR: Layout = Layout { scores: 1, moments: 2, events: false };
    const SCENE: [u8; 32] = [2; 32];

    fn tally(walks: u64, sums: &[u128]) -> Tally {
        let counts = Counts {
            walks,
            rays: 250,
            absorbed: walks - 10,
            absorbed_back: 1,
            escaped: 9,
            escaped_weight: [9 << 40, 1, 0],
            ..Counts::default()
        };
        Tally::from_parts(counts, sums.len() / 2, PAIR, sums.to_vec()).unwrap()
    }

    fn of(tally: Tally) -> Checkpoint {
        let digest = Digester::new(&SCENE).digest(&tally);
        let deliveries = vec![Delivery { walks: tally.counts.walks, worker: 0, digest }];
        let book = Book {
            parts: vec![Part { job_hash: [1; 32], seed: 42, first: 7, deliveries }],
            workers: vec!["here:1".into()],
            looks: vec![Look { walks: 50, rms_relative_error: 0.1, promising: true, ..Look::default() }],
            goal: [3; 32],
            effort: Effort { seconds: 1.5, workers_seen: 2, ..Effort::default() },
            sessions: vec![Session { host: "here".into(), build: "0.1".into(), began: 1, ended: 2 }],
            job: b"a job".to_vec(),
        };
        Checkpoint { scene_hash: SCENE, tally: tally.into(), book }
    }

    fn checkpoint() -> Checkpoint {
        of(tally(100, &[1, 2, 3, 4, u128::MAX, 1 << 100]))
    }

    fn bytes_of(checkpoint: &Checkpoint) -> Vec<u8> {
        let mut bytes = Vec::new();
        checkpoint.write(&mut bytes).unwrap();
        bytes
    }

    fn bytes() -> Vec<u8> {
        bytes_of(&checkpoint())
    }

    fn fault_of(bytes: &[u8]) -> CheckpointFault {
        parse(bytes).unwrap_err()
    }

    #[test]
    fn what_was_written_is_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("tally.bin");
        fs::write(&path, bytes()).unwrap();
        assert_eq!(read(&path).unwrap(), checkpoint());
    }

    #[test]
    fn more_sums_than_one_chunk_are_read_in_order() {
        let sums: Vec<u128> = (0..3 * CHUNK_SUMS as u128 + 2).map(|i| i << 40).collect();
        let checkpoint = of(tally(100, &sums));
        assert_eq!(parse(&bytes_of(&checkpoint)).unwrap(), checkpoint);
    }

    /// Of chains every ray ends once, or every walk of walks; nothing in between.
    #[test]
    fn chains_of_rays_are_read_where_every_ray_ended_once() {
        let ended = |absorbed: u64| {
            let counts = Counts { walks: 8, rays: 250, absorbed, escaped: 9, ..Counts::default() };
            let tally = Tally::from_parts(counts, 1, PAIR, vec![1, 2]).unwrap();
            parse(&bytes_of(&of(tally)))
        };
        assert!(ended(241).is_ok());
        assert!(matches!(ended(240).unwrap_err(), CheckpointFault::Contradiction(_)));
    }

    #[test]
    fn the_bytes_are_laid_out_as_documented() {
        let bytes = bytes();
        assert_eq!(&bytes[..24], b"RWTALLY\0\x04\0\0\0\x01\x02\0\0\x03\0\0\0\0\0\0\0");
        let book = u64::from_le_bytes(bytes[24..32].try_into().unwrap()) as usize;
        assert_eq!(bytes.len(), HEADER_BYTES + 6 * 16 + book + HASH_BYTES);
        assert_eq!(bytes[32..64], SCENE);
        assert_eq!(bytes[64..80], 100_u128.to_le_bytes());
        assert_eq!(bytes[128..144], 9_u128.to_le_bytes());
        assert_eq!(bytes[304..320], 1_u128.to_le_bytes());
    }

    #[test]
    fn other_files_and_formats_are_refused() {
        assert!(matches!(fault_of(b""), CheckpointFault::Magic));
        assert!(matches!(fault_of(b"patch,surface,u,v"), CheckpointFault::Magic));
        let mut newer = bytes();
        newer[8] = 5;
        assert!(matches!(fault_of(&newer), CheckpointFault::Version(5)));
    }

    #[test]
    fn a_file_of_any_other_length_is_refused() {
        let whole = bytes();
        for length in MAGIC.len()..whole.len() {
            assert!(matches!(fault_of(&whole[..length]), CheckpointFault::Length { .. }), "{length}");
        }
        assert!(matches!(fault_of(&[&whole[..], b"x"].concat()), CheckpointFault::Length { .. }));
        let mut huge = whole;
        huge[16..24].fill(0xFF);
        assert!(matches!(fault_of(&huge), CheckpointFault::Length { expected: u64::MAX, .. }));
    }

    #[test]
    fn any_flipped_bit_is_noticed() {
        let whole = bytes();
        for byte in 0..whole.len() {
            for bit in 0..8 {
                let mut changed = whole.clone();
                changed[byte] ^= 1 << bit;
                assert!(parse(&changed).is_err(), "bit {bit} of byte {byte}");
            }
        }
        let mut changed = whole;
        changed[130] ^= 1;
        assert!(matches!(fault_of(&changed), CheckpointFault::Checksum));
    }

    /// As memory that fails before the checksum is taken would leave it.
    #[test]
    fn sums_that_were_not_delivered_are_refused_though_the_checksum_is_right() {
        let contradicts = |change: &dyn Fn(&mut Checkpoint)| {
            let mut checkpoint = checkpoint();
            change(&mut checkpoint);
            assert!(matches!(fault_of(&bytes_of(&checkpoint)), CheckpointFault::Contradiction(_)));
        };
        contradicts(&|checkpoint| Arc::make_mut(&mut checkpoint.tally).counts.rays ^= 1 << 20);
        contradicts(&|checkpoint| Arc::make_mut(&mut checkpoint.tally).counts.walks += 1);
        contradicts(&|checkpoint| checkpoint.tally = tally(100, &[1, 2, 3, 5, u128::MAX, 1 << 100]).into());
        contradicts(&|checkpoint| checkpoint.book.parts[0].deliveries[0].walks -= 1);
        contradicts(&|checkpoint| checkpoint.book.parts[0].deliveries[0].worker = 1);
        contradicts(&|checkpoint| checkpoint.book.parts.clear());
    }

    #[test]
    fn foreign_tallies_are_refused_by_name() {
        let fault = |scene, job, first| checkpoint().check_job(scene, job, first).unwrap_err();
        assert!(checkpoint().check_job(&SCENE, &[1; 32], 7).is_ok());
        assert!(matches!(fault(&SCENE, &[9; 32], 7), CheckpointFault::ForeignJob));
        assert!(matches!(fault(&SCENE, &[1; 32], 0), CheckpointFault::ForeignJob));
        assert!(matches!(fault(&[9; 32], &[1; 32], 7), CheckpointFault::ForeignScene));
        let missing = read(Path::new("/nowhere/none.bin")).unwrap_err();
        assert!(missing.to_string().contains("none.bin"), "{missing}");
        assert!(matches!(missing.fault, CheckpointFault::Io(_)));
    }
}
