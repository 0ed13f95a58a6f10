//! A worker's end of the connection, shared by its threads.

use std::collections::HashMap;
use std::convert::Infallible;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};

use crate::access::Access;
use crate::channel::Inbound;
use crate::codec::{CodecError, frame};
use crate::message::{LeaseResult, PIECE, ToCoordinator, ToWorker};
use crate::noise::{Greeting, Sealer, Session};
use crate::worker_error::WorkerError;

/// How often a worker says that it is alive.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// A coordinator that cannot be reached, or hangs up at once, is tried for so long.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

/// Between two tries.
const RETRY: Duration = Duration::from_millis(100);

/// Until the job has arrived, a coordinator that says nothing for so long is none.
const HANDSHAKE_PATIENCE: Duration = Duration::from_secs(30);

/// A coordinator that says nothing for so long is gone, or the way to it is cut. It speaks every second, but large merges
/// and looks hold it up.
const PATIENCE: Duration = Duration::from_secs(60);

/// How often a worker is asked whether it is to leave.
const LEAVE_LOOK: Duration = Duration::from_millis(200);

/// A worker that leaves waits so long for the coordinator to hear of it. Launchers kill after a second.
const FAREWELL: Duration = Duration::from_millis(400);

/// Bytes that are read at once.
const READ_BYTES: usize = 1 << 16;

/// The half that listens.
pub(crate) struct Ear {
    stream: TcpStream,
    inbound: Inbound,
    buffer: Vec<u8>,
}

/// The half that speaks.
pub(crate) struct Link {
    stream: TcpStream,
    /// Held while a message is sealed and written, so that messages go out whole and in the order of their records.
    sealer: Mutex<Sealer>,
    /// Chunks of walks that were shot.
    pub progress: AtomicU64,
    /// Whether nobody wants results any more.
    pub over: AtomicBool,
    /// The first thing that went wrong here.
    failure: Mutex<Option<String>>,
    /// Large results that were offered; none any more once the link is over.
    kept: Mutex<Option<HashMap<u64, Kept>>>,
}

/// A large result that waits to be asked for; its shooter hears when it is gone.
struct Kept {
    result: LeaseResult,
    _gone: Sender<Infallible>,
}

/// Connects to the coordinator of `access`, and proves both ends to each other.
pub(crate) fn connect(access: &Access) -> Result<(Ear, Link), WorkerError> {
    let began = Instant::now();
    loop {
        let failure = match try_connect(&access.address) {
            Ok(stream) => match shake_hands(&stream, access) {
                Ok(session) => return Ok(halves(stream, session)?),
                // It may have had too many strangers at its door.
                Err(failure @ (CodecError::Closed | CodecError::Io(_))) => WorkerError::Lost(failure),
                Err(CodecError::Foreign(foreign)) => return Err(WorkerError::Impostor(foreign)),
                Err(failure) => return Err(failure.into()),
            },
            Err(source) => WorkerError::Unreachable { address: access.address.clone(), source },
        };
        if began.elapsed() > CONNECT_PATIENCE {
            return Err(failure);
        }
        thread::sleep(RETRY);
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

fn shake_hands(mut stream: &TcpStream, access: &Access) -> Result<Session, CodecError> {
    // Without it small messages wait for company; with a failure they only come later.
    let _ = stream.set_nodelay(true);
    stream.set_read_timeout(Some(HANDSHAKE_PATIENCE))?;
    let (greeting, record) = Greeting::new(access);
    stream.write_all(&record)?;
    let mut length = [0; 2];
    stream.read_exact(&mut length)?;
    let mut answer = vec![0; Greeting::answer_bytes(length)?];
    stream.read_exact(&mut answer)?;
    Ok(greeting.finish(&answer)?)
}

fn halves(stream: TcpStream, session: Session) -> Result<(Ear, Link), CodecError> {
    let ear = Ear {
        stream: stream.try_clone()?,
        inbound: Inbound::new(session.opener),
        buffer: vec![0; READ_BYTES],
    };
    let link = Link {
        stream,
        sealer: Mutex::new(session.sealer),
        progress: AtomicU64::new(0),
        over: AtomicBool::new(false),
        failure: Mutex::new(None),
        kept: Mutex::new(Some(HashMap::new())),
    };
    Ok((ear, link))
}

impl Ear {
    /// The next message, of at most `cap` bytes.
    pub(crate) fn hear(&mut self, cap: usize) -> Result<ToWorker, CodecError> {
        loop {
            if let Some(message) = self.inbound.next(cap)? {
                return Ok(message);
            }
            match self.stream.read(&mut self.buffer) {
                Ok(0) => return Err(CodecError::Closed),
                Ok(bytes) => self.inbound.arrived(&self.buffer[..bytes]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// From now on only heartbeats may come for a long time; without those, nobody is there.
    pub(crate) fn be_patient(&self) -> Result<(), CodecError> {
        Ok(self.stream.set_read_timeout(Some(PATIENCE))?)
    }
}

impl Link {
    /// Sends a message.
    pub(crate) fn send(&self, message: &ToCoordinator) -> Result<(), CodecError> {
        // Outside the lock, which heartbeats wait for, too.
        let frame = frame(message)?;
        let mut sealer = lock(&self.sealer);
        let mut wire = Vec::new();
        sealer.seal_all(&frame, &mut wire);
        Ok((&self.stream).write_all(&wire)?)
    }

    /// Keeps a large result and offers it. What is returned ends when the result is gone.
    pub(crate) fn offer(&self, result: LeaseResult) -> Result<Receiver<Infallible>, CodecError> {
        let (lease, bytes) = (result.lease, result.sums.len() as u64);
        let (_gone, gone) = bounded(0);
        match &mut *lock(&self.kept) {
            Some(kept) => kept.insert(lease, Kept { result, _gone }),
            None => return Err(CodecError::Closed),
        };
        self.send(&ToCoordinator::Offer { lease, bytes })?;
        Ok(gone)
    }

    /// Sends a result that was kept, piece by piece.
    pub(crate) fn send_kept(&self, lease: u64) -> Result<(), CodecError> {
        let kept = lock(&self.kept).as_mut().and_then(|kept| kept.remove(&lease));
        let Some(Kept { mut result, .. }) = kept else { return Ok(()) };
        let sums = std::mem::take(&mut result.sums);
        let mut pieces = sums.chunks(PIECE).peekable();
        while let Some(piece) = pieces.next() {
            if pieces.peek().is_some() {
                self.send(&ToCoordinator::Piece { lease, sums: piece.into() })?;
            } else {
                result.sums = piece.into();
            }
        }
        self.send(&ToCoordinator::Result(result))
    }

    /// Drops a result that nobody needs.
    pub(crate) fn drop_kept(&self, lease: u64) {
        let _ = lock(&self.kept).as_mut().and_then(|kept| kept.remove(&lease));
    }

    /// Tells the coordinator why this worker cannot go on, and remembers it.
    pub(crate) fn give_up(&self, reason: String) -> WorkerError {
        let message = ToCoordinator::Failed { reason: reason.clone() };
        self.end(reason, &message)
    }

    /// Tells the coordinator that this worker leaves because it was told to.
    pub(crate) fn leave(&self) -> WorkerError {
        self.end("it was asked to leave".into(), &ToCoordinator::Leave)
    }

    fn end(&self, reason: String, message: &ToCoordinator) -> WorkerError {
        let reason = lock(&self.failure).get_or_insert(reason).clone();
        // Whether or not it hears, this worker is of no more use. It hangs up when it has heard.
        let _ = self.send(message);
        self.over.store(true, Ordering::Relaxed);
        WorkerError::Failed(reason)
    }

    /// The first thing that went wrong here.
    pub(crate) fn failure(&self) -> Option<String> {
        lock(&self.failure).take()
    }

    /// Says that the worker is alive, until it is over, is to leave, or nobody listens.
    pub(crate) fn beat(&self, stop: &Receiver<Infallible>, leave: fn() -> bool) {
        let mut due = Instant::now();
        loop {
            if leave() {
                self.leave();
                let _ = stop.recv_timeout(FAREWELL);
                return self.hang_up();
            }
            if Instant::now() >= due {
                due += HEARTBEAT;
                let progress = self.progress.load(Ordering::Relaxed);
                if self.send(&ToCoordinator::Alive { progress }).is_err() {
                    return;
                }
            }
            if stop.recv_timeout(LEAVE_LOOK) != Err(RecvTimeoutError::Timeout) {
                return;
            }
        }
    }

    /// Ends everything that waits for the other end, or shoots for it.
    pub(crate) fn hang_up(&self) {
        self.over.store(true, Ordering::Relaxed);
        lock(&self.kept).take();
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

/// Locks what no panic can leave half done: a sealer seals in memory.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
