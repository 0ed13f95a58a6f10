//! The worker: joins a coordinator, shoots the walks it is leased, sends what they came to.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, Select, Sender, bounded, unbounded};
use radiosity::{Overflow, Tally};

use crate::access::Access;
use crate::codec::{MAX_FRAME, SHORT_FRAME, pack};
use crate::digest::Digester;
use crate::limits::Limits;
use crate::link::{Ear, Link, connect};
use crate::message::{Hello, LeaseResult, PROTOCOL, SMALL_TALLY, ToCoordinator, ToWorker};
use crate::pace::MOST_KEPT;
use crate::provenance::Provenance;
pub use crate::worker_error::WorkerError;

/// Walks between two marks of progress, at first.
const FIRST_CHUNK: u64 = 512;

/// At most so many: a batch of walks that is nearly done has idle places, but hardly any after so many walks.
const LARGEST_CHUNK: u64 = 1 << 16;

/// Chunks that take less than this grow, those that take ten times as long shrink.
const CHUNK_TIME: Duration = Duration::from_millis(5);

/// The most walks between two emptyings of a board: its 64-bit sums must not wrap.
const BOARD_WALKS: u64 = 1 << 22;

/// What a worker does for a living. The cluster knows no more of physics than this.
pub trait Work: Sync {
    /// Where the walks of one thread score.
    type Board: Send;

    /// (scene hash, job hash) of this replica.
    fn hashes(&self) -> ([u8; 32], [u8; 32]);
    /// An empty tally.
    fn empty(&self) -> Tally;
    /// What its walks can come to at most.
    fn limits(&self) -> Limits {
        Limits::NONE
    }
    /// An empty board.
    fn board(&self) -> Self::Board;
    /// Shoots walks by number.
    fn shoot(&self, walks: Range<u64>, board: &mut Self::Board);
    /// The same for walks that take long: asks `go_on` many times a second, which marks progress, and may leave the
    /// board as it is once that says no, since nobody will ask for it.
    fn shoot_while(&self, walks: Range<u64>, board: &mut Self::Board, go_on: &dyn Fn() -> bool) {
        let _ = go_on;
        self.shoot(walks, board);
    }
    /// Empties the board onto a tally.
    ///
    /// # Errors
    /// Where a sum overflowed.
    fn hand_over(&self, board: &mut Self::Board, tally: &mut Tally) -> Result<(), Overflow>;
}

/// How a worker introduces itself.
pub struct Identity {
    /// Version and commit; must be the coordinator's.
    pub build: String,
    /// For messages to people.
    pub name: String,
    /// Leases to work on at once.
    pub threads: usize,
    /// Whether to leave before the job is done; asked some times a second.
    pub leave: fn() -> bool,
}

/// Works for the coordinator of `access` until the job is done. `build` makes the work from what the
/// coordinator sends; `cpu_seconds` tells the processor time of its walks so far.
///
/// # Errors
/// Where the coordinator cannot be reached, refuses, or goes away.
pub fn work<W: Work>(
    access: &Access,
    identity: &Identity,
    build: impl FnOnce(&[u8]) -> Result<W, String>,
    cpu_seconds: impl Fn() -> f64 + Sync,
) -> Result<(), WorkerError> {
    join(access, identity, false, |Welcome { job, .. }, ear, link| {
        let work = build_from(&job, link, build)?;
        drop(job);
        let (scene_hash, job_hash) = work.hashes();
        // Where this fails, whoever receives learns why: the job may have been done meanwhile.
        let _ = link.send(&ToCoordinator::Ready { scene_hash, job_hash });
        shoot_leases(&work, identity.threads, ear, link, &cpu_seconds)
    })
}

/// What whoever is let in learns.
pub(crate) struct Welcome {
    pub job: Arc<[u8]>,
    pub stream_walks: u64,
    pub leases_per_thread: usize,
}

/// Joins the coordinator (or relay) of `access`, and does what there is to do there while a thread beside it says that it
/// lives.
pub(crate) fn join(
    access: &Access,
    identity: &Identity,
    relays: bool,
    live: impl FnOnce(Welcome, Ear, &Link) -> Result<(), WorkerError>,
) -> Result<(), WorkerError> {
    if access.build != identity.build {
        let (theirs, ours) = (access.build.clone(), identity.build.clone());
        return Err(WorkerError::OtherBuild { theirs, ours });
    }
    let (mut ear, link) = connect(access)?;
    let Some(welcome) = introduce(&mut ear, &link, identity, relays)? else { return Ok(()) };
    ear.be_patient()?;
    thread::scope(|scope| {
        // The heartbeat ends when `_beating` goes.
        let (link, (_beating, stop)) = (&link, bounded(0));
        let _hangup = Hangup { link };
        thread::Builder::new()
            .spawn_scoped(scope, move || link.beat(&stop, identity.leave))
            .map_err(|error| link.give_up(format!("a thread cannot be started ({error})")))?;
        live(welcome, ear, link)
    })
}

/// Makes the work from the job; tells the other end where that fails.
pub(crate) fn build_from<W: Work>(
    job: &[u8],
    link: &Link,
    build: impl FnOnce(&[u8]) -> Result<W, String>,
) -> Result<W, WorkerError> {
    build(job).map_err(|reason| {
        link.give_up(reason.clone());
        WorkerError::Job(reason)
    })
}

/// Says who this is. Returns what it learns, or `None` where the job is over already.
fn introduce(
    ear: &mut Ear,
    link: &Link,
    identity: &Identity,
    relays: bool,
) -> Result<Option<Welcome>, WorkerError> {
    link.send(&ToCoordinator::Hello(Hello {
        protocol: PROTOCOL,
        build: identity.build.clone(),
        name: identity.name.clone(),
        threads: u32::try_from(identity.threads).unwrap_or(u32::MAX),
        relays,
    }))?;
    match ear.hear(MAX_FRAME)? {
        ToWorker::Welcome { job, stream_walks, leases_per_thread } => {
            Ok(Some(Welcome { job, stream_walks, leases_per_thread: leases_per_thread as usize }))
        }
        ToWorker::Refused { reason } => Err(WorkerError::Refused(reason)),
        ToWorker::Done => Ok(None),
        _ => Err(WorkerError::Protocol),
    }
}

/// Ends the connection, also where the job's own code panics: a worker that only seems to be alive would be waited for.
pub(crate) struct Hangup<'a> {
    pub link: &'a Link,
}

impl Drop for Hangup<'_> {
    fn drop(&mut self) {
        self.link.hang_up();
    }
}

/// A range of walks under a lease number.
struct Lease {
    id: u64,
    walks: Range<u64>,
}

/// Receives leases and lets the threads shoot them until the coordinator says that all is done.
fn shoot_leases<W: Work>(
    work: &W,
    threads: usize,
    mut ear: Ear,
    link: &Link,
    cpu_seconds: &(impl Fn() -> f64 + Sync),
) -> Result<(), WorkerError> {
    let (queue, leases) = unbounded();
    let (asked, wanted) = unbounded();
    let done = thread::scope(|scope| {
        let mut shooters = Vec::new();
        for _ in 0..threads {
            let leases = leases.clone();
            let shoot = move || {
                let _alarm = Alarm(link);
                shoot_queue(work, &leases, link, cpu_seconds);
            };
            match thread::Builder::new().spawn_scoped(scope, shoot) {
                Ok(shooter) => shooters.push(shooter),
                Err(error) => {
                    link.give_up(format!("a thread cannot be started ({error})"));
                    break;
                }
            }
        }
        // Beside the shooters, which are at their next leases when a result is asked for.
        let send = move || {
            for lease in wanted {
                // A link that fails here fails for the receiving thread too, which reports it.
                let _ = link.send_kept(lease);
            }
        };
        if let Err(error) = thread::Builder::new().spawn_scoped(scope, send) {
            link.give_up(format!("a thread cannot be started ({error})"));
        }
        let done = receive_leases(&mut ear, link, queue, asked);
        // A thread may be waiting for the coordinator to take its result.
        link.hang_up();
        for shooter in shooters {
            // Its alarm has told of the panic.
            let _ = shooter.join();
        }
        done
    });
    // The coordinator hangs up on a worker that has failed; that is not what went wrong.
    match link.failure() {
        Some(reason) => Err(WorkerError::Failed(reason)),
        None => done,
    }
}

/// Hands over leases to the shooters, and what is asked for to whoever sends it.
fn receive_leases(
    ear: &mut Ear,
    link: &Link,
    queue: Sender<Lease>,
    asked: Sender<u64>,
) -> Result<(), WorkerError> {
    loop {
        match ear.hear(SHORT_FRAME)? {
            ToWorker::Lease { id, first_walk, walks } => {
                let lease = Lease { id, walks: first_walk..first_walk.saturating_add(walks) };
                // Threads that are gone have told why.
                let _ = queue.send(lease);
            }
            ToWorker::Send { lease } => {
                // Likewise.
                let _ = asked.send(lease);
            }
            ToWorker::Drop { lease } => link.drop_kept(lease),
            ToWorker::Alive => {}
            ToWorker::Done => return Ok(()),
            ToWorker::Refused { reason } => return Err(WorkerError::Refused(reason)),
            _ => return Err(WorkerError::Protocol),
        }
    }
}

/// Tells the coordinator where a thread panics: its lease would never come in.
struct Alarm<'a>(&'a Link);

impl Drop for Alarm<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.give_up("a thread panicked".into());
        }
    }
}

/// One thread's work: lease after lease, until there are no more or the link is over.
fn shoot_queue<W: Work>(work: &W, leases: &Receiver<Lease>, link: &Link, cpu_seconds: &impl Fn() -> f64) {
    let (mut board, mut chunk) = (work.board(), FIRST_CHUNK);
    let digester = Digester::new(&work.hashes().0);
    let mut kept = Vec::new();
    for lease in leases {
        let began = Instant::now();
        let tally = match shoot_lease(work, lease.walks, &mut board, &mut chunk, link) {
            Ok(Some(tally)) => tally,
            Ok(None) => return,
            Err(reason) => {
                link.give_up(reason);
                return;
            }
        };
        let result = LeaseResult {
            lease: lease.id,
            seconds: began.elapsed().as_secs_f64(),
            cpu_seconds: cpu_seconds(),
            digest: digester.digest(&tally),
            counts: Box::new(tally.counts.to_array()),
            sums: pack(tally.sums()),
            provenance: Provenance::default(),
        };
        let sent = if tally.sums().len() <= SMALL_TALLY {
            link.send(&ToCoordinator::Result(result))
        } else {
            drop(tally);
            link.offer(result).map(|gone| {
                kept.push(gone);
                await_room(&mut kept);
            })
        };
        // A link that fails here fails for the receiving thread too, which reports it.
        if sent.is_err() {
            return;
        }
    }
}

/// Waits until fewer than [`MOST_KEPT`] results are kept, whichever of them goes first, or the link is over.
fn await_room(kept: &mut Vec<Receiver<Infallible>>) {
    while kept.len() >= MOST_KEPT {
        let mut any = Select::new();
        kept.iter().for_each(|gone| _ = any.recv(gone));
        let first = any.ready();
        kept.swap_remove(first);
    }
}

/// Shoots a lease, so many walks at a time; `None` where the job was over before it was done.
fn shoot_lease<W: Work>(
    work: &W,
    walks: Range<u64>,
    board: &mut W::Board,
    chunk_walks: &mut u64,
    link: &Link,
) -> Result<Option<Tally>, String> {
    let go_on = || {
        link.progress.fetch_add(1, Ordering::Relaxed);
        !link.over.load(Ordering::Relaxed)
    };
    let mut total: Option<Tally> = None;
    let mut next = walks.start;
    while next < walks.end {
        let end = walks.end.min(next.saturating_add(BOARD_WALKS));
        while next < end {
            let chunk = next..end.min(next + *chunk_walks);
            next = chunk.end;
            let start = Instant::now();
            work.shoot_while(chunk, board, &go_on);
            *chunk_walks = paced(*chunk_walks, start.elapsed());
            if !go_on() {
                return Ok(None);
            }
        }
        let total = total.get_or_insert_with(|| work.empty());
        work.hand_over(board, total).map_err(|overflow| overflow.to_string())?;
    }
    Ok(Some(total.unwrap_or_else(|| work.empty())))
}

/// How many walks to shoot next, where so many took so long.
fn paced(walks: u64, time: Duration) -> u64 {
    match time {
        time if time < CHUNK_TIME => (2 * walks).min(LARGEST_CHUNK),
        time if time > 10 * CHUNK_TIME => (walks / 2).max(1),
        _ => walks,
    }
}
