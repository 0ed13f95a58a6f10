//! Counting of rows on threads, in the order in which they are written.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use exchange::{Intervals, SparseRow};
use radiosity::{
    Sequence,
    daylight::SkyPatches,
    exchange::{ExchangeRows, RowBoard},
};
use report::OutputFolder;

use super::super::question::FactorsQuestion;
use super::answer::sparse_files;
use super::journal::{Heading, Journal, ROWS, StoredRow, join};
use super::{RowWalks, SparseAsked};
use crate::error::Error;

/// Rows that a thread takes at once.
const CHUNK: usize = 8;

/// Rows that wait to be written, at most.
const WAITING: usize = 1024;

/// Between two calls of the watcher.
const WATCH: Duration = Duration::from_millis(100);

/// How often rows are handed to the system, so that a process which is killed has lost no more.
const FLUSH: Duration = Duration::from_millis(250);

/// Walks of a row at its first look, where it ends at an error.
const FIRST_LOOK: u64 = 1 << 10;

/// Who counts, and whether it goes on.
pub struct RowWatcher<'a> {
    /// The number of threads.
    pub threads: usize,
    /// Is told what part of the rows is done; where it says no, the count ends.
    pub watch: &'a mut dyn FnMut(f64) -> bool,
}

/// What was counted.
#[derive(Clone, Debug)]
pub struct SparseCounted {
    pub(super) heading: Heading,
    /// Wall time of this count [s].
    pub(super) seconds: f64,
    /// Whether it ended before the last row.
    pub interrupted: bool,
}

/// Counts the rows of a part that the folder has not, or takes them from the folders of other counts (`parts`).
///
/// # Errors
/// Where the rows cannot be counted, read or written.
pub fn count_rows(
    question: &FactorsQuestion,
    asked: &SparseAsked,
    folder: &OutputFolder,
    resume: bool,
    parts: &[PathBuf],
    watcher: RowWatcher<'_>,
) -> Result<SparseCounted, Error> {
    let began = Instant::now();
    let rows = exchange_rows(question, asked)?;
    let heading = Heading::of(question, asked, rows.columns());
    if !parts.is_empty() {
        join(parts, folder, &heading)?;
    }
    let mut journal = Journal::open(folder, &heading, resume || !parts.is_empty())?;
    if !resume {
        let replaced: Vec<&str> = sparse_files().into_iter().filter(|&file| file != ROWS).collect();
        folder.remove(&replaced)?;
    }
    let count = Count {
        rows: &rows,
        sequence: Sequence::new(question.job.seed),
        most: asked.walks.of_rows(&question.subject().weights()),
        by_variance: matches!(asked.walks, RowWalks::Shared(_)),
        tolerance: question.tolerance.as_ref().map(|tolerance| (tolerance.relative, tolerance.level)),
        next: AtomicUsize::new(journal.next),
        range: heading.rows.clone(),
        stopped: AtomicBool::new(false),
    };
    count.run(&mut journal, watcher)?;
    let interrupted = journal.next < heading.rows.end;
    journal.close()?;
    Ok(SparseCounted { heading, seconds: began.elapsed().as_secs_f64(), interrupted })
}

fn exchange_rows(question: &FactorsQuestion, asked: &SparseAsked) -> Result<ExchangeRows, Error> {
    let FactorsQuestion { job, scene, groups, kind, .. } = question;
    let sky = asked.sky.map(|patches| SkyPatches::new(patches).expect("the sizes of skies are checked"));
    let of_faces = (groups.of_face.clone(), groups.count() as u32);
    Ok(ExchangeRows::new(scene.clone(), (*kind, job.method.space), of_faces, sky)?)
}

/// Rows that are being counted.
struct Count<'a> {
    rows: &'a ExchangeRows,
    sequence: Sequence,
    /// The most walks of each row.
    most: Vec<u32>,
    /// Whether a row without tolerance takes what its variance asks for.
    by_variance: bool,
    /// The relative error at which rows end, and the level of the intervals.
    tolerance: Option<(f64, f64)>,
    /// The first row that no thread has taken.
    next: AtomicUsize,
    range: Range<usize>,
    stopped: AtomicBool,
}

impl Count<'_> {
    fn run(&self, journal: &mut Journal, watcher: RowWatcher<'_>) -> Result<(), Error> {
        let (sender, receiver) = sync_channel(WAITING);
        thread::scope(|scope| {
            for _ in 0..watcher.threads.max(1) {
                let sender = sender.clone();
                thread::Builder::new()
                    .spawn_scoped(scope, move || self.work(&sender))
                    .map_err(|source| Error::System { doing: "starting a thread", source })?;
            }
            drop(sender);
            let written = self.write(journal, receiver, watcher.watch);
            self.stopped.store(true, Ordering::Relaxed);
            written
        })
    }

    /// One thread's work: it counts rows until none is left or the receiver is gone.
    fn work(&self, sender: &SyncSender<(usize, Vec<u8>)>) {
        let mut board = self.rows.board();
        let mut intervals = Intervals::new(self.tolerance.map_or(0.5, |(_, level)| level));
        loop {
            let first = self.next.fetch_add(CHUNK, Ordering::Relaxed);
            for row in first..(first + CHUNK).min(self.range.end) {
                let content = self.row(row as u32, &mut board, &mut intervals).pack();
                if self.stopped.load(Ordering::Relaxed) || sender.send((row, content)).is_err() {
                    return;
                }
            }
            if first + CHUNK >= self.range.end {
                return;
            }
        }
    }

    /// Counts a row: all its walks; or what its variance asks for, by the first quarter of them; or until its error is what is asked for, with
    /// twice as many at each look.
    fn row(&self, group: u32, board: &mut RowBoard, intervals: &mut Intervals) -> StoredRow {
        let most = u64::from(self.most[group as usize]);
        let mut kept = StoredRow { reached: true, ..StoredRow::default() };
        let mut walk = |kept: &mut StoredRow, walks: Range<u64>| {
            self.rows.walk(&self.sequence, group, walks, board);
            let (row, rays) = taken(board);
            kept.row = kept.row.plus(&row);
            kept.rays += rays;
        };
        let Some((tolerance, _)) = self.tolerance else {
            let first = if self.by_variance { most.div_ceil(4) } else { most };
            walk(&mut kept, 0..first);
            let wanted = if self.by_variance { (kept.row.need() * most as f64) as u64 } else { most };
            walk(&mut kept, first..wanted.max(first));
            return kept;
        };
        let (mut have, mut look) = (0, FIRST_LOOK.min(most));
        loop {
            walk(&mut kept, have..look);
            kept.reached = kept.row.error(intervals) <= tolerance;
            if kept.reached || look == most {
                return kept;
            }
            (have, look) = (look, (2 * look).min(most));
        }
    }

    /// Writes rows in their order, whatever the order that they come in.
    fn write(
        &self,
        journal: &mut Journal,
        receiver: Receiver<(usize, Vec<u8>)>,
        watch: &mut dyn FnMut(f64) -> bool,
    ) -> Result<(), Error> {
        let (mut waiting, mut reported, mut flushed) = (BTreeMap::new(), Instant::now(), Instant::now());
        let all = self.range.len().max(1) as f64;
        loop {
            match receiver.recv_timeout(WATCH) {
                Ok((row, content)) => drop(waiting.insert(row, content)),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return journal.flush(),
            }
            while let Some(content) = waiting.remove(&journal.next) {
                journal.add(&content)?;
            }
            if flushed.elapsed() > FLUSH {
                journal.flush()?;
                flushed = Instant::now();
            }
            if reported.elapsed() > WATCH {
                reported = Instant::now();
                if !watch((journal.next - self.range.start) as f64 / all) {
                    return journal.flush();
                }
            }
        }
    }
}

/// The row that a board has counted, and its rays.
fn taken(board: &mut RowBoard) -> (SparseRow, u64) {
    let (entries, rays) = board.take();
    (SparseRow::new(entries), rays)
}
