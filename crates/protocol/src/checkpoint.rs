//! `tally.bin`: the exact tally of a run and its ledger, to resume, merge and audit from.
//!
//! Little-endian, without padding:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | magic `RWTALLY` and a zero byte |
//! | 4 | u32 format version, 5 |
//! | 1 | u8 scores S: one per channel, or per estimator that is compared |
//! | 1 | u8 moments K: each patch keeps Σx … Σx^K of each score |
//! | 2 | u16 1 where a count of events stands beside them, else 0; M is S·K plus this |
//! | 8 | u64 patches P |
//! | 8 | u64 bytes of the book L |
//! | 32 | scene hash |
//! | 240 | u128 × 15: walks N, rays, absorbed, absorbed_back, escaped, truncated; weights of the last three, three channels each, in 2⁻⁴⁰ |
//! | 16·P·M | u128 sums, patch-major |
//! | L | the book, in bincode: whose walks these are, who delivered them, what waits beyond gaps, looks, sessions, the job |
//! | 32 | BLAKE3 of all the bytes before |
//!
//! If chains of rays take the place of walks, N counts chains, and absorbed … truncated count rays; if batches of walks
//! do, N counts batches.
//!
//! A file is accepted if its checksum is right, the walks of its parts add up to N, and the digests of all deliveries
//! add up to that of its tally. Files of format 4, which had an entry for every lease and no out-of-order ranges, are read as well.

mod v4;

use std::fs;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bincode::{Decode, Encode};
use radiosity::{Counts, Layout, Tally};
use thiserror::Error;

use crate::codec::{decode_book, encode};
use crate::deliveries::Deliveries;
use crate::digest::{self, Digest, Digester};
use crate::effort::Effort;
use crate::ledger::OutOfOrderRange;
use crate::roster::Contributor;

const MAGIC: [u8; 8] = *b"RWTALLY\0";
const VERSION: u32 = 5;
const HEADER_BYTES: usize = 304;
const HASH_BYTES: usize = 32;

/// A range of consecutive walks of one job.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct WalkRange {
    /// The hash of the job.
    pub job_hash: [u8; 32],
    /// The seed of the job.
    pub seed: u64,
    /// The number of the first walk.
    pub first: u64,
    /// The workers that brought the walks, and their digests.
    pub deliveries: Deliveries,
}

impl WalkRange {
    /// The number of walks in the part.
    pub fn walks(&self) -> u64 {
        u64::try_from(self.deliveries.walks()).unwrap_or(u64::MAX)
    }

    /// The number of the walk after the last.
    pub fn end(&self) -> u64 {
        self.first.saturating_add(self.walks())
    }
}

/// What was seen of a prefix at one of the walk counts that the job fixes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Encode, Decode)]
pub struct Look {
    /// The number of walks in the prefix.
    pub walks: u64,
    /// The number of rays in the prefix.
    pub rays: u64,
    /// The relative error that half of the area does not exceed; infinite if nothing is known yet.
    pub median_relative_error: f64,
    /// The largest relative error of a patch.
    pub max_relative_error: f64,
    /// The probability, at most, that chance makes the walks since the previous look (or since the run was resumed, if that
    /// was later) and those before differ as much as they do. It is not a number if there is no previous look. Looks of
    /// earlier versions hold a mean squared difference in its place, about 1.
    pub drift: f64,
    /// Whether twice as many walks will reach the target.
    pub promising: bool,
    /// Whether the job ends here because its target is reached.
    pub reached: bool,
}

/// A process that coordinated a part of the run.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Session {
    /// The name of the machine.
    pub host: String,
    /// The version and commit of the program.
    pub build: String,
    /// The time of its start, in seconds since 1970-01-01 UTC.
    pub began: u64,
    /// The time of its last checkpoint, in seconds since 1970-01-01 UTC.
    pub ended: u64,
}

/// The books of a prefix, with which a coordinator begins and which it leaves behind.
#[derive(Clone, Debug, PartialEq)]
pub struct Past {
    /// The tally of the prefix.
    pub tally: Arc<Tally>,
    /// The deliveries of the prefix.
    pub deliveries: Deliveries,
    /// The out-of-order ranges beyond gaps, in the order of walks.
    pub out_of_order: Vec<OutOfOrderRange>,
    /// The workers that deliveries name by number.
    pub workers: Vec<Contributor>,
    /// The looks so far.
    pub looks: Vec<Look>,
    /// What the run has taken so far.
    pub effort: Effort,
}

impl Past {
    /// The past of a job of which nothing is known but its tally, which is empty where it is new.
    pub fn none(tally: Tally) -> Self {
        let (deliveries, effort) = (Deliveries::default(), Effort::default());
        Past { tally: tally.into(), deliveries, out_of_order: vec![], workers: vec![], looks: vec![], effort }
    }
}

/// The content of a tally file.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The hash of the scene of the walks.
    pub scene_hash: [u8; 32],
    /// The exact sums of all walks.
    pub tally: Arc<Tally>,
    /// Everything beside the sums.
    pub book: Book,
}

/// The jobs that the walks belong to, the workers that delivered them, and the looks at them.
#[derive(Clone, Debug, PartialEq, Encode, Decode)]
pub struct Book {
    /// The walks, by job and number.
    pub parts: Vec<WalkRange>,
    /// The out-of-order ranges beyond gaps, in the order of walks; their first walks count from the first walk of the only part.
    /// With several parts there are none.
    pub out_of_order: Vec<OutOfOrderRange>,
    /// The workers that deliveries name by number.
    pub workers: Vec<Contributor>,
    /// The looks at the prefix so far.
    pub looks: Vec<Look>,
    /// A digest of the target that the looks were judged by.
    pub goal: [u8; 32],
    /// What the run has taken.
    pub effort: Effort,
    /// The processes that coordinated the run.
    pub sessions: Vec<Session>,
    /// The job, encoded for the program to read.
    pub job: Arc<[u8]>,
}

/// The error of a tally file that cannot be used.
#[derive(Debug, Error)]
#[error("cannot use the tally {}: {fault}", path.display())]
pub struct CheckpointError {
    /// The path of the file.
    pub path: PathBuf,
    /// The fault of the file.
    #[source]
    pub fault: CheckpointFault,
}

/// The faults that a tally file can have.
#[derive(Debug, Error)]
pub enum CheckpointFault {
    /// The operating system could not read the file.
    #[error("{0}; check that the file exists and is readable")]
    Io(#[from] io::Error),
    /// The file does not begin as a tally file.
    #[error("it is not a tally file (it does not begin as one); give the folder of a run")]
    Magic,
    /// The file is of a format that this program does not know.
    #[error("it is of format {0} (this program knows {old} and {VERSION}); use the program that wrote it", old = v4::VERSION)]
    Version(u32),
    /// The file is shorter or longer than its header says.
    #[error(
        "it has {found} bytes instead of {expected} (it was cut off or added to); go on from the checkpoint before it with --resume, or start the run anew"
    )]
    Length {
        /// The bytes that its header asks for.
        expected: u64,
        /// The bytes that the file has.
        found: u64,
    },
    /// The content is not what was written.
    #[error(
        "its checksum is wrong (bytes were changed after it was written); go on from the checkpoint before it with --resume, or start the run anew"
    )]
    Checksum,
    /// The parts of the checkpoint contradict each other.
    #[error("{0} (memory failed when it was written, or it was forged); start the run anew")]
    Contradiction(&'static str),
    /// The file keeps something that is now kept in another way.
    #[error("{0} (it was written by an earlier version); start the run anew, or read it with that version")]
    Superseded(&'static str),
    /// The file belongs to another job.
    #[error(
        "its walks are those of another job (method, seed or first walk differ); use the job that it was written by"
    )]
    ForeignJob,
    /// The file belongs to another scene.
    #[error("its walks ran in another scene (the scene file has changed); restore the scene or start anew")]
    ForeignScene,
}

impl Checkpoint {
    /// Reads a tally file of any job.
    ///
    /// # Errors
    /// Where the file cannot be read, is no tally of a known format, is damaged or contradicts itself.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let read = || {
            let file = fs::File::open(path)?;
            let length = file.metadata()?.len();
            parse(BufReader::with_capacity(READ_BYTES, file), length)
        };
        read().map_err(|fault| CheckpointError { path: path.to_path_buf(), fault })
    }

    /// Reads a tally of `length` bytes without keeping its sums, to see whether [`Checkpoint::read`] would take it.
    ///
    /// # Errors
    /// As [`Checkpoint::read`].
    pub fn prove(tally: impl Read, length: u64) -> Result<(), CheckpointFault> {
        let mut incoming = Incoming::new(tally, length);
        let header = incoming.header()?;
        let (mut failure, digester) = (Ok(()), Digester::new(&header.scene_hash));
        let sums = (0..header.sums).map_while(|_| incoming.sum().map_err(|fault| failure = Err(fault)).ok());
        let digest = digester.digest_sums(&header.counts, sums);
        failure?;
        let book = incoming.book(&header)?;
        book.balances(&header.scene_hash, &header.counts, digest, header.sums)
    }

    /// Writes the checkpoint.
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
        let Layout { scores, moments, slopes, events } = self.tally.layout();
        header.extend([scores as u8, moments as u8, u8::from(events), slopes as u8]);
        header.extend((self.tally.patches() as u64).to_le_bytes());
        header.extend((book_bytes as u64).to_le_bytes());
        header.extend(self.scene_hash);
        for count in self.tally.counts.to_array() {
            header.extend(count.to_le_bytes());
        }
        header
    }

    /// Checks that the books balance: every walk is accounted for once and ended once, and the digests of the
    /// deliveries add up to that of the tally.
    ///
    /// # Errors
    /// Where they do not: the memory that held them failed.
    pub fn verify(&self) -> Result<(), CheckpointFault> {
        let digest = Digester::new(&self.scene_hash).digest(&self.tally);
        self.book.balances(&self.scene_hash, &self.tally.counts, digest, self.tally.sums().len())
    }

    /// Checks that these are the first walks of a job from its walk `first` on.
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

impl Book {
    /// Checks that the book accounts for a tally with these counts, this digest and this number of sums.
    fn balances(
        &self,
        scene_hash: &[u8; 32],
        counts: &Counts,
        digest: Digest,
        sums: usize,
    ) -> Result<(), CheckpointFault> {
        let fault = |what| Err(CheckpointFault::Contradiction(what));
        let deliveries = || self.parts.iter().map(|part| &part.deliveries);
        let out_of_order = || self.out_of_order.iter().map(|range| &range.deliveries);
        let digester = Digester::new(scene_hash);
        let is_whole =
            |range: &OutOfOrderRange| range.parcel(&digester).is_some_and(|parcel| parcel.sums() == sums);
        if !each_walk_ended(counts) {
            return fault("not every walk ended once");
        }
        if deliveries().map(Deliveries::walks).sum::<u128>() != u128::from(counts.walks) {
            return fault("the number of its walks is not that of its book");
        }
        if !deliveries().chain(out_of_order()).all(|deliveries| deliveries.is_sound(self.workers.len())) {
            return fault("no worker delivered some of its walks");
        }
        if deliveries().fold(0, |sum, deliveries| digest::add(sum, deliveries.digest())) != digest {
            return fault("its sums are not those that were delivered");
        }
        if !self.out_of_order.iter().all(is_whole) {
            return fault("its results beyond a gap are not those that were delivered");
        }
        Ok(())
    }
}

/// Whether each walk ended once or, with batches in place of walks, each of their rays or walks.
fn each_walk_ended(counts: &Counts) -> bool {
    let Counts { walks, rays, absorbed, absorbed_back, escaped, truncated, .. } = *counts;
    let ended: u128 = [absorbed, absorbed_back, escaped, truncated].into_iter().map(u128::from).sum();
    let alike = ended >= u128::from(walks) && ended.is_multiple_of(u128::from(walks.max(1)));
    alike || ended == u128::from(rays)
}

/// The number of sums that are hashed and written at a time.
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

fn parse(tally: impl Read, length: u64) -> Result<Checkpoint, CheckpointFault> {
    let mut incoming = Incoming::new(tally, length);
    let header = incoming.header()?;
    let sums = (0..header.sums).map(|_| incoming.sum()).collect::<Result<_, CheckpointFault>>()?;
    let book = incoming.book(&header)?;
    let tally = Tally::from_parts(header.counts, header.patches, header.layout, sums)
        .expect("there are as many sums as the header says");
    let checkpoint = Checkpoint { scene_hash: header.scene_hash, tally: tally.into(), book };
    checkpoint.verify()?;
    Ok(checkpoint)
}

/// The number of bytes that are read at once.
const READ_BYTES: usize = 1 << 18;

/// The header of a tally file.
struct TallyHeader {
    version: u32,
    layout: Layout,
    patches: usize,
    sums: usize,
    book_bytes: usize,
    scene_hash: [u8; 32],
    counts: Counts,
}

/// A tally file that is being read.
struct Incoming<R> {
    inner: R,
    hasher: blake3::Hasher,
    /// The size of the file in bytes.
    found: u64,
}

impl<R: Read> Incoming<R> {
    fn new(inner: R, found: u64) -> Self {
        Incoming { inner, hasher: blake3::Hasher::new(), found }
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), CheckpointFault> {
        let found = self.found;
        self.inner.read_exact(bytes).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => {
                CheckpointFault::Length { expected: found.max((HEADER_BYTES + HASH_BYTES) as u64), found }
            }
            _ => error.into(),
        })
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], CheckpointFault> {
        let mut field = [0; N];
        self.fill(&mut field)?;
        self.hasher.update(&field);
        Ok(field)
    }

    fn header(&mut self) -> Result<TallyHeader, CheckpointFault> {
        if self.found < MAGIC.len() as u64 || self.take()? != MAGIC {
            return Err(CheckpointFault::Magic);
        }
        let version = u32::from_le_bytes(self.take()?);
        if !(v4::VERSION..=VERSION).contains(&version) {
            return Err(CheckpointFault::Version(version));
        }
        let [scores, moments, events, slopes] = self.take()?;
        let layout = Layout {
            scores: scores.into(),
            moments: moments.into(),
            slopes: slopes.into(),
            events: events == 1,
        };
        let patches = u64::from_le_bytes(self.take()?);
        let book_bytes = u64::from_le_bytes(self.take()?);
        let sums = patches.saturating_mul(layout.columns() as u64);
        self.check_length(sums, book_bytes)?;
        let scene_hash = self.take()?;
        let mut counts = [0; 15];
        for count in &mut counts {
            *count = u128::from_le_bytes(self.take()?);
        }
        let contradiction = CheckpointFault::Contradiction;
        let counts = Counts::from_array(counts).ok_or(contradiction("its counts exceed 64 bits"))?;
        if scores == 0 || moments == 0 {
            return Err(contradiction("its patches keep no sums"));
        }
        // They fit into a `usize`: the file is no shorter.
        let (patches, sums, book_bytes) = (patches as usize, sums as usize, book_bytes as usize);
        Ok(TallyHeader { version, layout, patches, sums, book_bytes, scene_hash, counts })
    }

    /// Checks the length before anything of that size is allocated: a damaged header may ask for more than there is
    /// memory.
    fn check_length(&self, sums: u64, book_bytes: u64) -> Result<(), CheckpointFault> {
        let around = (HEADER_BYTES + HASH_BYTES) as u64;
        let expected = sums.saturating_mul(16).saturating_add(book_bytes).saturating_add(around);
        let found = self.found;
        if found == expected { Ok(()) } else { Err(CheckpointFault::Length { expected, found }) }
    }

    fn sum(&mut self) -> Result<u128, CheckpointFault> {
        Ok(u128::from_le_bytes(self.take()?))
    }

    /// The book of the file, if the checksum of the whole file is right.
    fn book(mut self, header: &TallyHeader) -> Result<Book, CheckpointFault> {
        let mut bytes = vec![0; header.book_bytes];
        self.fill(&mut bytes)?;
        self.hasher.update(&bytes);
        let mut checksum = [0; HASH_BYTES];
        self.fill(&mut checksum)?;
        if *self.hasher.finalize().as_bytes() != checksum {
            return Err(CheckpointFault::Checksum);
        }
        let book = match header.version {
            v4::VERSION => v4::book(&bytes),
            _ => decode_book(&bytes).ok(),
        };
        book.ok_or(CheckpointFault::Contradiction("its book cannot be read"))
    }
}

#[cfg(test)]
mod tests;
