//! The worker: joins a coordinator, shoots the walks that it is leased, and sends their tallies.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::atomic::Ordering;
use std::sync::{Arc, MutexGuard};
use std::thread;
use std::time::Instant;

use crossbeam::channel::{Receiver, Select, Sender, bounded, unbounded};
use protocol::codec::{MAX_FRAME, SHORT_FRAME, pack};
use protocol::digest::Digester;
use protocol::message::{Hello, LeaseResult, PROTOCOL, SMALL_TALLY, ToCoordinator, ToWorker};
use protocol::pace::{BOARD_WALKS, FIRST_CHUNK, MOST_KEPT, next_chunk};
use protocol::{LeaseProvenance, Limits};
use radiosity::{Overflow, Tally, parallel::ThreadPool};

use crate::access::Access;
use crate::lending::{Lending, LentThreads};
use crate::link::{Ear, ResultSender, connect};
use crate::worker_error::WorkerError;

/// The hash of a scene, and that of a job in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JobHashes {
    /// The hash of the scene.
    pub scene: [u8; 32],
    /// The hash of the job.
    pub job: [u8; 32],
}

/// The work of a job. The cluster knows no more of physics than this.
pub trait Work: Sync {
    /// The board on which the walks of one thread score.
    type Board: Send;

    /// The hashes of this replica.
    fn hashes(&self) -> JobHashes;
    /// An empty tally of the job.
    fn empty(&self) -> Tally;
    /// The most that the walks can come to.
    fn limits(&self) -> Limits {
        Limits::NONE
    }
    /// An empty board for one thread.
    fn board(&self) -> Self::Board;
    /// Shoots a range of walks onto the board.
    fn shoot(&self, walks: Range<u64>, board: &mut Self::Board);
    /// Shoots walks that take long. It asks `pool` many times a second whether to go on, which marks progress, and may
    /// share work with the threads that have no lease. Once it is not to go on, the board may be left as it is, since it is not
    /// used any more.
    fn shoot_while(&self, walks: Range<u64>, board: &mut Self::Board, pool: &dyn ThreadPool) {
        let _ = pool;
        self.shoot(walks, board);
    }
    /// Moves the board's scores onto a tally and empties the board.
    ///
    /// # Errors
    /// Where a sum overflowed.
    fn hand_over(&self, board: &mut Self::Board, tally: &mut Tally) -> Result<(), Overflow>;
}

/// The introduction of a worker.
pub struct WorkerIntroduction {
    /// The version and commit of the program; it must be the coordinator's.
    pub build: String,
    /// The name of the worker in messages to people.
    pub name: String,
    /// The leases that the worker works on at once.
    pub threads: usize,
    /// Whether to leave before the job is done; it is called a few times per second.
    pub leave: fn() -> bool,
}

/// Works for the coordinator of `access` until the job is done. `build` makes the work from the job that the
/// coordinator sends; `cpu_seconds` returns the processor time of all walks so far [s].
///
/// # Errors
/// Where the coordinator cannot be reached, refuses, or goes away.
pub fn work<W: Work>(
    access: &Access,
    identity: &WorkerIntroduction,
    build: impl FnOnce(&[u8]) -> Result<W, String>,
    cpu_seconds: impl Fn() -> f64 + Sync,
) -> Result<(), WorkerError> {
    join(access, identity, false, |Welcome { job, .. }, ear, link| {
        let work = build_from(&job, link, build)?;
        drop(job);
        let JobHashes { scene: scene_hash, job: job_hash } = work.hashes();
        // If this fails, the receiving thread learns why: the job may have been done meanwhile.
        let _ = link.send(&ToCoordinator::Ready { scene_hash, job_hash });
        shoot_leases(&work, identity.threads, ear, link, &cpu_seconds)
    })
}

/// The coordinator's answer to a worker that it lets in.
pub(crate) struct Welcome {
    pub job: Arc<[u8]>,
    pub stream_walks: u64,
    pub leases_per_thread: usize,
}

/// Joins the coordinator (or relay) of `access` and runs `live` there, while another thread sends heartbeats.
pub(crate) fn join(
    access: &Access,
    identity: &WorkerIntroduction,
    relays: bool,
    live: impl FnOnce(Welcome, Ear, &ResultSender) -> Result<(), WorkerError>,
) -> Result<(), WorkerError> {
    if access.build != identity.build {
        let (theirs, ours) = (access.build.clone(), identity.build.clone());
        return Err(WorkerError::OtherBuild { theirs, ours });
    }
    let (mut ear, link) = connect(access)?;
    let Some(welcome) = introduce(&mut ear, &link, identity, relays)? else { return Ok(()) };
    ear.be_patient()?;
    thread::scope(|scope| {
        // The heartbeat ends when `_beating` is dropped.
        let (link, (_beating, stop)) = (&link, bounded(0));
        let _hangup = Hangup { link };
        thread::Builder::new()
            .spawn_scoped(scope, move || link.beat(&stop, identity.leave))
            .map_err(|error| link.give_up(format!("a thread cannot be started ({error})")))?;
        live(welcome, ear, link)
    })
}

/// Makes the work from the job; tells the coordinator if that fails.
pub(crate) fn build_from<W: Work>(
    job: &[u8],
    link: &ResultSender,
    build: impl FnOnce(&[u8]) -> Result<W, String>,
) -> Result<W, WorkerError> {
    build(job).map_err(|reason| {
        link.give_up(reason.clone());
        WorkerError::Job(reason)
    })
}

/// Introduces the worker. Returns the coordinator's answer, or `None` if the job is over already.
fn introduce(
    ear: &mut Ear,
    link: &ResultSender,
    identity: &WorkerIntroduction,
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

/// Ends the connection when dropped, also if the job's own code panics: the coordinator would wait for a worker that
/// only seems to be alive.
pub(crate) struct Hangup<'a> {
    pub link: &'a ResultSender,
}

impl Drop for Hangup<'_> {
    fn drop(&mut self) {
        self.link.hang_up();
    }
}

/// A range of walks under a lease number.
struct WorkerLease {
    id: u64,
    walks: Range<u64>,
}

/// Receives leases and lets the threads shoot them until the coordinator says that the job is done.
fn shoot_leases<W: Work>(
    work: &W,
    threads: usize,
    mut ear: Ear,
    link: &ResultSender,
    cpu_seconds: &(impl Fn() -> f64 + Sync),
) -> Result<(), WorkerError> {
    let (queue, leases) = unbounded();
    let (asked, wanted) = unbounded();
    let lending = &Lending::new(threads);
    let done = thread::scope(|scope| {
        let mut shooters = Vec::new();
        for _ in 0..threads {
            let leases = leases.clone();
            let shoot = move || {
                let _alarm = Alarm(link);
                shoot_queue(work, &leases, (link, lending), cpu_seconds);
            };
            match thread::Builder::new().spawn_scoped(scope, shoot) {
                Ok(shooter) => shooters.push(shooter),
                Err(error) => {
                    link.give_up(format!("a thread cannot be started ({error})"));
                    break;
                }
            }
        }
        // This thread runs beside the shooters, which are busy with their next leases when a result is asked for.
        let send = move || {
            for lease in wanted {
                // If the link fails here, it fails for the receiving thread too, which reports it.
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
            // The thread's alarm has reported the panic.
            let _ = shooter.join();
        }
        done
    });
    // The coordinator hangs up on a worker that has failed; the failure itself is the reason to report.
    match link.failure() {
        Some(reason) => Err(WorkerError::Failed(reason)),
        None => done,
    }
}

/// Passes leases to the shooters, and requests for results to the thread that sends them.
fn receive_leases(
    ear: &mut Ear,
    link: &ResultSender,
    queue: Sender<WorkerLease>,
    asked: Sender<u64>,
) -> Result<(), WorkerError> {
    loop {
        match ear.hear(SHORT_FRAME)? {
            ToWorker::Lease { id, first_walk, walks } => {
                let lease = WorkerLease { id, walks: first_walk..first_walk.saturating_add(walks) };
                // If the shooters are gone, they have reported why.
                let _ = queue.send(lease);
            }
            ToWorker::Send { lease } => {
                // If the sending thread is gone, it has reported why.
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

/// Tells the coordinator if a thread panics, since its lease would never come in.
struct Alarm<'a>(&'a ResultSender);

impl Drop for Alarm<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.give_up("a thread panicked".into());
        }
    }
}

/// The work of one thread: lease after lease, until there are no more or the link is over.
fn shoot_queue<W: Work>(
    work: &W,
    leases: &Receiver<WorkerLease>,
    (link, lending): (&ResultSender, &Lending),
    cpu_seconds: &impl Fn() -> f64,
) {
    let (mut board, mut chunk) = (work.board(), FIRST_CHUNK);
    let digester = Digester::new(&work.hashes().scene);
    let mut kept = Vec::new();
    for lease in leases {
        let (began, at_lease) = (Instant::now(), lending.begin());
        let (tally, turn) = match shoot_lease(work, lease.walks, &mut board, &mut chunk, (link, lending)) {
            Ok(Some(handed_over)) => handed_over,
            Ok(None) => return,
            Err(reason) => {
                link.give_up(reason);
                return;
            }
        };
        drop(at_lease);
        let result = LeaseResult {
            lease: lease.id,
            seconds: began.elapsed().as_secs_f64(),
            cpu_seconds: cpu_seconds(),
            digest: digester.digest(&tally),
            counts: Box::new(tally.counts.to_array()),
            sums: pack(tally.sums()),
            provenance: LeaseProvenance::default(),
        };
        let is_small = tally.sums().len() <= SMALL_TALLY;
        drop((tally, turn));
        let sent = if is_small {
            link.send(&ToCoordinator::Result(result))
        } else {
            link.offer(result).map(|gone| {
                kept.push(gone);
                await_room(&mut kept);
            })
        };
        // If the link fails here, it fails for the receiving thread too, which reports it.
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

/// Shoots a lease, `chunk_walks` walks at a time; `None` if the job was over before the lease was done. With the tally comes the
/// thread's turn to have one: a tally is as large as a board, and threads that take turns need one for all of them.
fn shoot_lease<'a, W: Work>(
    work: &W,
    walks: Range<u64>,
    board: &mut W::Board,
    chunk_walks: &mut u64,
    (link, lending): (&ResultSender, &'a Lending),
) -> Result<Option<(Tally, MutexGuard<'a, ()>)>, String> {
    let go_on = || {
        link.progress.fetch_add(1, Ordering::Relaxed);
        !link.over.load(Ordering::Relaxed)
    };
    let pool = LentThreads { lending, go_on };
    let mut total: Option<Tally> = None;
    let mut next = walks.start;
    loop {
        let end = walks.end.min(next.saturating_add(BOARD_WALKS));
        while next < end {
            let chunk = next..end.min(next + *chunk_walks);
            next = chunk.end;
            let start = Instant::now();
            work.shoot_while(chunk, board, &pool);
            *chunk_walks = next_chunk(*chunk_walks, start.elapsed());
            if !pool.go_on() {
                return Ok(None);
            }
        }
        let turn = lending.turn();
        let mut handed_over = total.take().unwrap_or_else(|| work.empty());
        work.hand_over(board, &mut handed_over).map_err(|overflow| overflow.to_string())?;
        if next == walks.end {
            return Ok(Some((handed_over, turn)));
        }
        total = Some(handed_over);
    }
}
