//! The worker: joins a coordinator, shoots the walks it is leased, sends what they came to.

use std::convert::Infallible;
use std::io::{self, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
use radiosity::{Overflow, Tally};
use thiserror::Error;

use crate::access::{Access, Speaker, random_bytes};
use crate::codec::{CodecError, MAX_FRAME, SHORT_FRAME, frame, read_frame, write_frame};
use crate::digest::Digester;
use crate::message::{Hello, LeaseResult, PROTOCOL, ToCoordinator, ToWorker};

/// How often a worker says that it is alive.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Walks between two marks of progress, at first.
const FIRST_CHUNK: u64 = 512;

/// At most so many: a batch of walks that is nearly done has idle places, but hardly any after so many walks.
const LARGEST_CHUNK: u64 = 1 << 16;

/// Chunks that take less than this grow, those that take ten times as long shrink.
const CHUNK_TIME: Duration = Duration::from_millis(5);

/// The most walks between two emptyings of a board: its 64-bit sums must not wrap.
const BOARD_WALKS: u64 = 1 << 22;

/// A coordinator that cannot be reached is tried for so long.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

/// Until the job has arrived, a coordinator that says nothing for so long is none.
const HANDSHAKE_PATIENCE: Duration = Duration::from_secs(30);

/// What a worker does for a living. The cluster knows no more of physics than this.
pub trait Work: Sync {
    /// Where the walks of one thread score.
    type Board: Send;

    /// (scene hash, job hash) of this replica.
    fn hashes(&self) -> ([u8; 32], [u8; 32]);
    /// An empty tally.
    fn empty(&self) -> Tally;
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

/// Why a worker left before the job was done.
#[derive(Debug, Error)]
pub enum WorkerError {
    /// Nobody listens there.
    #[error(
        "cannot reach the coordinator at {address} ({source}); check that it runs and that the access file is its"
    )]
    Unreachable {
        /// host:port.
        address: String,
        /// What the system says.
        source: io::Error,
    },
    /// The coordinator does not want this worker.
    #[error("the coordinator refused this worker: {0}")]
    Refused(String),
    /// The coordinator does not know the key.
    #[error(
        "the coordinator does not know the key of the access file (another program listens there); use the access file of a running job"
    )]
    Impostor,
    /// The job that was sent cannot be built.
    #[error("the job that the coordinator sent cannot be used: {0}")]
    Job(String),
    /// One of its threads failed.
    #[error("this worker cannot go on: {0}")]
    Failed(String),
    /// The coordinator is gone.
    #[error("lost the coordinator ({0}); its job goes on without this worker if it still runs")]
    Lost(#[from] CodecError),
    /// A message made no sense here.
    #[error("the coordinator spoke out of turn (a foreign or faulty program)")]
    Protocol,
    /// There is no randomness.
    #[error("the operating system gave no random bytes ({0})")]
    Random(io::Error),
}

/// How a worker introduces itself.
pub struct Identity {
    /// Version and commit; must be the coordinator's.
    pub build: String,
    /// For messages to people.
    pub name: String,
    /// Leases to work on at once.
    pub threads: usize,
}

/// Works for the coordinator of `access` until the job is done. `build` makes the work from what the
/// coordinator sends; `cpu_seconds` tells the CPU time of this process so far.
///
/// # Errors
/// Where the coordinator cannot be reached, refuses, or goes away.
pub fn work<W: Work>(
    access: &Access,
    identity: &Identity,
    build: impl FnOnce(&[u8]) -> Result<W, String>,
    cpu_seconds: impl Fn() -> f64 + Sync,
) -> Result<(), WorkerError> {
    let mut stream = connect(&access.address)?;
    stream.set_read_timeout(Some(HANDSHAKE_PATIENCE)).map_err(CodecError::from)?;
    let Some(job) = shake_hands(&mut stream, access, identity)? else { return Ok(()) };
    stream.set_read_timeout(None).map_err(CodecError::from)?;
    let link = Link {
        stream,
        sending: Mutex::new(()),
        progress: AtomicU64::new(0),
        over: AtomicBool::new(false),
        failure: Mutex::new(None),
    };
    thread::scope(|scope| {
        let (link, (beating, stop)) = (&link, bounded(0));
        let _hangup = Hangup { link, _beating: beating };
        thread::Builder::new()
            .spawn_scoped(scope, move || link.beat(&stop))
            .map_err(|error| link.give_up(format!("a thread cannot be started ({error})")))?;
        let work = build(&job).map_err(|reason| {
            link.give_up(reason.clone());
            WorkerError::Job(reason)
        })?;
        drop(job);
        let (scene_hash, job_hash) = work.hashes();
        // Where this fails, whoever receives learns why: the job may have been done meanwhile.
        let _ = link.send(&ToCoordinator::Ready { scene_hash, job_hash });
        shoot_leases(&work, identity.threads, link, &cpu_seconds)
    })
}

fn connect(address: &str) -> Result<TcpStream, WorkerError> {
    let began = Instant::now();
    loop {
        match try_connect(address) {
            Ok(stream) => {
                // Without it small messages wait for company; with a failure they only come later.
                let _ = stream.set_nodelay(true);
                return Ok(stream);
            }
            Err(source) if began.elapsed() > CONNECT_PATIENCE => {
                return Err(WorkerError::Unreachable { address: address.into(), source });
            }
            Err(_) => thread::sleep(Duration::from_millis(100)),
        }
    }
}

/// Tries every address of a name. The system alone would wait minutes for a machine that does not answer.
fn try_connect(address: &str) -> io::Result<TcpStream> {
    let mut failure = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT_PATIENCE) {
            Ok(stream) => return Ok(stream),
            Err(error) => failure = error,
        }
    }
    Err(failure)
}

/// Proves both ends to each other. Returns the job, or `None` where it is over already.
fn shake_hands(
    stream: &mut TcpStream,
    access: &Access,
    identity: &Identity,
) -> Result<Option<Vec<u8>>, WorkerError> {
    let challenge = match read_frame(stream, SHORT_FRAME)? {
        ToWorker::Challenge { nonce } => nonce,
        ToWorker::Done => return Ok(None),
        ToWorker::Refused { reason } => return Err(WorkerError::Refused(reason)),
        _ => return Err(WorkerError::Protocol),
    };
    let nonce = random_bytes().map_err(WorkerError::Random)?;
    let hello = Hello {
        protocol: PROTOCOL,
        build: identity.build.clone(),
        name: identity.name.clone(),
        threads: u32::try_from(identity.threads).unwrap_or(u32::MAX),
        nonce,
        proof: access.prove(Speaker::Worker, &challenge),
    };
    write_frame(stream, &ToCoordinator::Hello(hello))?;
    match read_frame(stream, MAX_FRAME)? {
        ToWorker::Welcome { proof, job } if access.holds(Speaker::Coordinator, &nonce, &proof) => {
            Ok(Some(job))
        }
        ToWorker::Welcome { .. } => Err(WorkerError::Impostor),
        ToWorker::Refused { reason } => Err(WorkerError::Refused(reason)),
        ToWorker::Done => Ok(None),
        _ => Err(WorkerError::Protocol),
    }
}

/// A worker's end of the connection, shared by its threads.
struct Link {
    stream: TcpStream,
    /// Held while a message is written, so that messages go out whole.
    sending: Mutex<()>,
    progress: AtomicU64,
    over: AtomicBool,
    /// The first thing that went wrong here.
    failure: Mutex<Option<String>>,
}

impl Link {
    fn send(&self, message: &ToCoordinator) -> Result<(), WorkerError> {
        // Outside the lock, which heartbeats wait for, too.
        let frame = frame(message)?;
        let _sending = lock(&self.sending);
        Ok((&self.stream).write_all(&frame).map_err(CodecError::from)?)
    }

    /// Tells the coordinator why this worker leaves, and remembers it.
    fn give_up(&self, reason: String) -> WorkerError {
        let reason = lock(&self.failure).get_or_insert(reason).clone();
        // Whether or not it hears, this worker is of no more use. It hangs up when it has heard.
        let _ = self.send(&ToCoordinator::Failed { reason: reason.clone() });
        self.over.store(true, Ordering::Relaxed);
        WorkerError::Failed(reason)
    }

    /// Says that the worker is alive, until it is over or nobody listens.
    fn beat(&self, stop: &Receiver<Infallible>) {
        loop {
            let progress = self.progress.load(Ordering::Relaxed);
            if self.send(&ToCoordinator::Alive { progress }).is_err() {
                return;
            }
            if stop.recv_timeout(HEARTBEAT) != Err(RecvTimeoutError::Timeout) {
                return;
            }
        }
    }

    /// Ends everything that waits for the other end, or shoots for it.
    fn hang_up(&self) {
        self.over.store(true, Ordering::Relaxed);
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

/// Locks what no panic can leave half done.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the heartbeat and the connection, also where the job's own code panics: a worker that only seems to
/// be alive would be waited for.
struct Hangup<'a> {
    link: &'a Link,
    _beating: Sender<Infallible>,
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
    link: &Link,
    cpu_seconds: &(impl Fn() -> f64 + Sync),
) -> Result<(), WorkerError> {
    let (queue, leases) = unbounded();
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
        let done = receive_leases(link, queue);
        // A thread may be waiting for the coordinator to take its result.
        link.hang_up();
        for shooter in shooters {
            // Its alarm has told of the panic.
            let _ = shooter.join();
        }
        done
    });
    // The coordinator hangs up on a worker that has failed; that is not what went wrong.
    match lock(&link.failure).take() {
        Some(reason) => Err(WorkerError::Failed(reason)),
        None => done,
    }
}

fn receive_leases(link: &Link, queue: Sender<Lease>) -> Result<(), WorkerError> {
    loop {
        match read_frame(&mut &link.stream, SHORT_FRAME)? {
            ToWorker::Lease { id, first_walk, walks } => {
                let lease = Lease { id, walks: first_walk..first_walk.saturating_add(walks) };
                // Threads that are gone have told why.
                let _ = queue.send(lease);
            }
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
    for lease in leases {
        let began = Instant::now();
        let sent = match shoot_lease(work, lease.walks, &mut board, &mut chunk, link) {
            Ok(Some(tally)) => link.send(&ToCoordinator::Result(LeaseResult {
                lease: lease.id,
                seconds: began.elapsed().as_secs_f64(),
                cpu_seconds: cpu_seconds(),
                digest: digester.digest(&tally),
                counts: Box::new(tally.counts.to_array()),
                sums: tally.into_sums(),
            })),
            Ok(None) => return,
            Err(reason) => Err(link.give_up(reason)),
        };
        match sent {
            Ok(()) => {}
            Err(WorkerError::Lost(error @ (CodecError::TooLong { .. } | CodecError::Malformed(_)))) => {
                link.give_up(format!("a result cannot be sent: {error}"));
                return;
            }
            // A link that fails here fails for the receiving thread too, which reports it.
            Err(_) => return,
        }
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
