//! A job that threads of this process walk by themselves, without workers and sockets. Leases come from a coordinator's ledger and
//! looks from a coordinator's ladder, so the answer is that of the cluster.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

use job::{Budget, Job};
use judge::MOMENTS;
use judge::target::{Observer, looks};
use protocol::codec::pack;
use protocol::digest::Digester;
use protocol::{Deliveries, Delivery, Effort, LeaseId, Ledger, Look, Parcel, Past, Roster};
use radiosity::{Board, Experiment, Overflow, Tally};
use rustix::time::{ClockId, clock_gettime};

use crate::checkpoints::Identity;
use crate::error::Error;
use crate::kept::Kept;
use crate::replica::Replica;
use crate::settings::Settings;

/// Between two calls of the watcher.
const WATCH: Duration = Duration::from_millis(100);

/// How long a lease should take: short enough that the last ones end together.
const LEASE: Duration = Duration::from_millis(200);

/// Added to it for each sum of a tally, so that packing a large tally stays a small part of its lease.
const LEASE_PER_SUM: Duration = Duration::from_micros(1);

/// How long walks go on without asking whether they should.
const CHUNK: Duration = Duration::from_millis(5);

/// Walks of the first chunk, and of the largest.
const CHUNKS: Range<u64> = 512..1 << 16;

/// The most walks of a lease: the 64-bit sums of a board must not wrap.
const LONGEST_LEASE: u64 = 1 << 22;

/// How long walks under way are waited for when the wall clock has run out.
const GRACE: Duration = Duration::from_secs(3);

/// Why the walks of a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WalkEnding {
    /// Every walk is in.
    BudgetSpent,
    /// The target was met at a look.
    TargetReached,
    /// The wall-clock limit came first.
    WallClock,
}

/// Where a job stands that this process walks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Paths that are in.
    pub paths: u64,
    /// Paths of the whole job.
    pub paths_total: u64,
    /// Since the first walk [s].
    pub seconds: f64,
    /// What half of the area is known within, at the latest look; `None` before the first.
    pub median_relative_error: Option<f64>,
}

/// Walks a job on some threads of this process, a build of the program. `watch` hears ten times a second where the job stands, on the
/// calling thread; where it says no, walks are given up and there is no result.
///
/// # Errors
/// Where a sum overflows, and where the system refuses a thread.
pub fn walk_here(
    job: &Job,
    experiment: Experiment,
    threads: usize,
    build: &str,
    watch: &mut dyn FnMut(Stage) -> bool,
) -> Result<Option<(Kept, WalkEnding)>, Error> {
    let settings = Settings::of(job);
    let identity = Identity::new(job, &settings, &experiment, build)?;
    let replica = Replica::new(experiment, &settings, settings.seed);
    let hall = Hall::new(&replica, &settings, &job.budget);
    let goes_on = thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            hall.books().threads += 1;
            let shoot = || {
                let _leaving = Leaving(&hall);
                hall.shoot();
            };
            if let Err(source) = thread::Builder::new().spawn_scoped(scope, shoot) {
                hall.books().threads -= 1;
                hall.over.store(true, Ordering::Relaxed);
                return Err(Error::System { doing: "starting a thread", source });
            }
        }
        Ok(hall.watch(watch))
    })?;
    let books = hall.books.into_inner().expect("no thread panics while it holds this");
    match books.ending {
        Some(Err(Overflow)) => Err(Error::Overflow),
        Some(Ok(ending)) if goes_on => {
            let checkpoint = identity.checkpoint(books.past(threads));
            let experiment = replica.into_experiment();
            Ok(Some((Kept { checkpoint, settings, experiment }, ending)))
        }
        _ => Ok(None),
    }
}

/// Where threads take leases and bring what became of them.
struct Hall<'a> {
    replica: &'a Replica,
    digester: Digester,
    books: Mutex<Books>,
    /// A thread has left, or the job has ended.
    news: Condvar,
    /// Whether walks under way are of no use any more.
    over: AtomicBool,
    began: Instant,
    wall: Option<Duration>,
    /// Whether walks are leased one by one, because each is a batch or a chain.
    one_by_one: bool,
}

struct Books {
    ledger: Ledger,
    observer: Observer,
    looks: Vec<Look>,
    roster: Roster,
    /// The number of threads that walk.
    threads: usize,
    /// Whether no more leases are given.
    closed: bool,
    ending: Option<Result<WalkEnding, Overflow>>,
    /// Processor time of walks [s].
    cpu_seconds: f64,
    /// From the first walk to the latest that came in [s].
    seconds: f64,
}

impl<'a> Hall<'a> {
    fn new(replica: &'a Replica, settings: &Settings, budget: &Budget) -> Self {
        let experiment = replica.experiment();
        let one_by_one = !experiment.unit().is_walk();
        let stream_walks = if one_by_one { 1 } else { budget.stream_paths };
        let looks = looks(experiment, budget.paths / experiment.unit().paths());
        let walks = looks.last().copied().unwrap_or(0);
        let empty = Arc::new(experiment.tally::<MOMENTS>());
        let first = budget.first_path / experiment.unit().paths();
        let ledger = Ledger::new(walks, stream_walks, looks, empty, Deliveries::default());
        let mut roster = Roster::new(Vec::new());
        roster.number(&format!("process {}", std::process::id()));
        let books = Books {
            ledger: ledger.numbered_from(first),
            observer: settings.observer(experiment),
            looks: Vec::new(),
            roster,
            threads: 0,
            closed: false,
            ending: None,
            cpu_seconds: 0.0,
            seconds: 0.0,
        };
        Hall {
            replica,
            digester: Digester::new(&experiment.scene().hash()),
            books: Mutex::new(books),
            news: Condvar::new(),
            over: AtomicBool::new(false),
            began: Instant::now(),
            wall: budget.wall_seconds.map(Duration::from_secs_f64),
            one_by_one,
        }
    }

    fn books(&self) -> MutexGuard<'_, Books> {
        self.books.lock().expect("no thread panics while it holds this")
    }

    /// Tells where the job stands until it has ended, and once more then. Returns whether the watcher let it end.
    fn watch(&self, watch: &mut dyn FnMut(Stage) -> bool) -> bool {
        let (mut goes_on, mut ended) = (true, false);
        while !ended {
            let mut books = self.books();
            if books.threads > 0 {
                books = self.news.wait_timeout(books, WATCH).expect("no thread panics while it holds this").0;
            }
            ended = books.threads == 0;
            self.heed_clock(&mut books, ended);
            let stage = self.stage(&books);
            drop(books);
            if goes_on && !watch(stage) {
                goes_on = false;
                self.over.store(true, Ordering::Relaxed);
            }
        }
        goes_on
    }

    /// Gives no more leases when the wall clock has run out, and gives walks up where the last ones take too long.
    fn heed_clock(&self, books: &mut Books, ended: bool) {
        let Some(wall) = self.wall else { return };
        let age = self.began.elapsed();
        books.closed |= age >= wall;
        if age >= wall.saturating_add(GRACE) {
            self.over.store(true, Ordering::Relaxed);
        }
        if ended && books.closed {
            books.ending.get_or_insert(Ok(WalkEnding::WallClock));
        }
    }

    fn stage(&self, Books { ledger, looks, .. }: &Books) -> Stage {
        let paths_per_walk = self.replica.experiment().unit().paths();
        Stage {
            paths: ledger.walks_in().saturating_mul(paths_per_walk),
            paths_total: ledger.total().saturating_mul(paths_per_walk),
            seconds: self.began.elapsed().as_secs_f64(),
            median_relative_error: looks.last().map(|look| look.median_relative_error),
        }
    }

    /// One thread's work: lease after lease, until there are no more.
    fn shoot(&self) {
        let mut board = self.replica.experiment().board();
        let (mut walks, mut chunk) = (1, CHUNKS.start);
        while let Some((id, range)) = self.lease(walks) {
            let (began, cpu_began) = (Instant::now(), thread_seconds());
            let found = self.trace(range.clone(), &mut board, &mut chunk);
            if self.over.load(Ordering::Relaxed) {
                return;
            }
            let sums = found.as_ref().map_or(0, |tally| tally.sums().len());
            self.deliver(id, found, thread_seconds() - cpu_began);
            walks = paced(range.end - range.start, began.elapsed(), LEASE + LEASE_PER_SUM * sums as u32);
        }
    }

    /// The next lease of about this many walks, by the numbers that they have in the job; the last leases are shared out evenly.
    fn lease(&self, walks: u64) -> Option<(LeaseId, Range<u64>)> {
        let mut books = self.books();
        if books.closed || books.ending.is_some() {
            return None;
        }
        let share = books.ledger.unleased() / (2 * books.threads.max(1) as u64);
        let walks = if self.one_by_one { 1 } else { walks.min(share).min(LONGEST_LEASE) };
        let (id, range) = books.ledger.lease(walks)?;
        let first = books.ledger.number(range.start);
        Some((id, first..first + (range.end - range.start)))
    }

    /// The tally of some walks; any tally, where they are given up.
    fn trace(
        &self,
        walks: Range<u64>,
        board: &mut Board<MOMENTS>,
        chunk: &mut u64,
    ) -> Result<Tally, Overflow> {
        let go_on = || !self.over.load(Ordering::Relaxed);
        let (experiment, mut next) = (self.replica.experiment(), walks.start);
        while next < walks.end && go_on() {
            let end = walks.end.min(next.saturating_add(*chunk));
            let began = Instant::now();
            experiment.walk_while(self.replica.sequence(), next..end, board, &go_on);
            *chunk = paced(*chunk, began.elapsed(), CHUNK).clamp(CHUNKS.start, CHUNKS.end);
            next = end;
        }
        board.take()
    }

    /// Takes what became of a lease, and looks at the prefix where the job says so.
    fn deliver(&self, id: LeaseId, found: Result<Tally, Overflow>, cpu_seconds: f64) {
        let brought = found.map(|tally| {
            let digest = self.digester.digest(&tally);
            let parcel = Parcel::new(tally.counts, pack(tally.sums()), digest, &self.digester);
            (parcel.expect("what was just packed"), Delivery::lease(tally.counts.walks, 0, digest))
        });
        let mut books = self.books();
        books.cpu_seconds += cpu_seconds;
        books.seconds = self.began.elapsed().as_secs_f64();
        let done = brought.and_then(|(parcel, delivery)| books.take(id, parcel, delivery));
        if let Some(ending) = done.transpose() {
            books.ending.get_or_insert(ending);
            self.over.store(true, Ordering::Relaxed);
        }
    }
}

impl Books {
    fn take(
        &mut self,
        id: LeaseId,
        parcel: Parcel,
        delivery: Delivery,
    ) -> Result<Option<WalkEnding>, Overflow> {
        if self.ending.is_some() {
            return Ok(None);
        }
        let Books { ledger, observer, looks, roster, .. } = self;
        ledger.accept(id, parcel, &[delivery]).map_err(|_| Overflow)?;
        while ledger.advance(|delivery| roster.credit(delivery)).map_err(|_| Overflow)? {
            if ledger.at_look() {
                let look = observer.look(ledger.prefix(), looks);
                looks.push(look);
                if look.reached {
                    return Ok(Some(WalkEnding::TargetReached));
                }
            }
        }
        Ok(ledger.is_complete().then_some(WalkEnding::BudgetSpent))
    }

    fn past(self, threads: usize) -> Past {
        let Books { ledger, looks, roster, cpu_seconds, seconds, .. } = self;
        let effort = Effort { seconds, cpu_seconds, workers_seen: threads as u64, ..Effort::default() };
        let (tally, deliveries) = ledger.into_prefix();
        Past { tally, deliveries, out_of_order: Vec::new(), workers: roster.into_workers(), looks, effort }
    }
}

/// Counts a thread that leaves, also where its walks panic: it would be waited for.
struct Leaving<'a>(&'a Hall<'a>);

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.over.store(true, Ordering::Relaxed);
        }
        if let Ok(mut books) = self.0.books.lock() {
            books.closed |= thread::panicking();
            books.threads -= 1;
        }
        self.0.news.notify_all();
    }
}

/// The number of walks to take next, if `walks` walks took the time `took` and the next should take about `wanted`.
fn paced(walks: u64, took: Duration, wanted: Duration) -> u64 {
    match took {
        took if took < wanted / 2 => walks.saturating_mul(2),
        took if took > 2 * wanted => (walks / 2).max(1),
        _ => walks,
    }
}

/// Processor time of this thread so far [s].
fn thread_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(test)]
mod tests;
