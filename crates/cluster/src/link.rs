//! A worker's end of the connection, shared by its threads.

use std::collections::HashMap;
use std::convert::Infallible;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use protocol::codec::{CodecError, frame};
use protocol::message::{LeaseResult, ToCoordinator, ToWorker};

use crate::access::Access;
use crate::channel::Inbound;
use crate::noise::{Greeting, Sealer, SecureSession};
use crate::worker_error::WorkerError;

/// The time between two heartbeats of a worker.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// The time for which a worker tries to reach a coordinator that does not answer or hangs up at once.
const CONNECT_PATIENCE: Duration = Duration::from_secs(5);

/// The time between two tries.
const RETRY: Duration = Duration::from_millis(100);

/// The longest silence of a coordinator before the job has arrived.
const HANDSHAKE_PATIENCE: Duration = Duration::from_secs(30);

/// The longest silence of a coordinator after that; then it is gone, or the connection is cut. It sends a heartbeat
/// every second, but large merges and looks hold it up.
const PATIENCE: Duration = Duration::from_secs(60);

/// The time between two checks whether the worker is to leave.
const LEAVE_LOOK: Duration = Duration::from_millis(200);

/// The time that a leaving worker waits for the coordinator to read its message. Launchers kill after a second.
const FAREWELL: Duration = Duration::from_millis(400);

/// The most bytes that are read at once.
const READ_BYTES: usize = 1 << 16;

/// The receiving half of a worker's connection.
pub(crate) struct Ear {
    stream: TcpStream,
    inbound: Inbound,
    buffer: Vec<u8>,
}

/// The sending half of a worker's connection.
pub(crate) struct ResultSender {
    stream: TcpStream,
    /// Held while a message is sealed and written, so that messages go out whole and in the order of their records.
    sealer: Mutex<Sealer>,
    /// The number of chunks of walks that were shot.
    pub progress: AtomicU64,
    /// Whether no more results are wanted.
    pub over: AtomicBool,
    /// The first failure of this worker.
    failure: Mutex<Option<String>>,
    /// The large results that were offered; `None` once the link is over.
    kept: Mutex<Option<HashMap<u64, PendingResult>>>,
}

/// A large result that waits to be asked for. Its shooter notices when it is dropped.
struct PendingResult {
    result: LeaseResult,
    _gone: Sender<Infallible>,
}

/// Connects to the coordinator of `access`; each end proves to the other that it knows the key.
pub(crate) fn connect(access: &Access) -> Result<(Ear, ResultSender), WorkerError> {
    let began = Instant::now();
    loop {
        let source = match try_connect(&access.address) {
            Ok(stream) => match shake_hands(&stream, access) {
                Ok(session) => return Ok(halves(stream, session)?),
                // The coordinator may have had too many strangers; or it is gone, and a tunnel or balancer answers in its place.
                Err(CodecError::Io(source)) => source,
                Err(CodecError::Closed) => {
                    io::Error::new(ErrorKind::ConnectionAborted, "the connection closes at once")
                }
                Err(CodecError::Foreign(foreign)) => return Err(WorkerError::Impostor(foreign)),
                Err(failure) => return Err(failure.into()),
            },
            Err(source) => source,
        };
        if began.elapsed() > CONNECT_PATIENCE {
            return Err(WorkerError::Unreachable { address: access.address.clone(), source });
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

fn shake_hands(mut stream: &TcpStream, access: &Access) -> Result<SecureSession, CodecError> {
    // Without this, small messages are delayed; if it fails, they only come later.
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

fn halves(stream: TcpStream, session: SecureSession) -> Result<(Ear, ResultSender), CodecError> {
    let ear = Ear {
        stream: stream.try_clone()?,
        inbound: Inbound::new(session.opener),
        buffer: vec![0; READ_BYTES],
    };
    let link = ResultSender {
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

    /// Waits longer from now on: only heartbeats may come for a long time. Without them the coordinator is gone.
    pub(crate) fn be_patient(&self) -> Result<(), CodecError> {
        Ok(self.stream.set_read_timeout(Some(PATIENCE))?)
    }
}

impl ResultSender {
    /// Sends a message to the coordinator.
    pub(crate) fn send(&self, message: &ToCoordinator) -> Result<(), CodecError> {
        // This is done outside the lock, for which heartbeats wait, too.
        let frame = frame(message)?;
        let mut sealer = lock(&self.sealer);
        let mut wire = Vec::new();
        sealer.seal_all(&frame, &mut wire);
        Ok((&self.stream).write_all(&wire)?)
    }

    /// Keeps a large result and offers it. The returned channel closes when the result is gone.
    pub(crate) fn offer(&self, result: LeaseResult) -> Result<Receiver<Infallible>, CodecError> {
        let (lease, bytes) = (result.lease, result.sums.len() as u64);
        let (_gone, gone) = bounded(0);
        match &mut *lock(&self.kept) {
            Some(kept) => kept.insert(lease, PendingResult { result, _gone }),
            None => return Err(CodecError::Closed),
        };
        self.send(&ToCoordinator::Offer { lease, bytes })?;
        Ok(gone)
    }

    /// Sends a result that was kept, piece by piece.
    pub(crate) fn send_kept(&self, lease: u64) -> Result<(), CodecError> {
        let kept = lock(&self.kept).as_mut().and_then(|kept| kept.remove(&lease));
        let Some(PendingResult { result, _gone }) = kept else { return Ok(()) };
        result.in_pieces().try_for_each(|message| self.send(&message))
    }

    /// Drops a result that is not needed any more.
    pub(crate) fn drop_kept(&self, lease: u64) {
        let _ = lock(&self.kept).as_mut().and_then(|kept| kept.remove(&lease));
    }

    /// Tells the coordinator why this worker cannot go on, and remembers the reason.
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
        // This worker is of no more use, whether or not the coordinator reads this. The coordinator hangs up when it
        // has.
        let _ = self.send(message);
        self.over.store(true, Ordering::Relaxed);
        WorkerError::Failed(reason)
    }

    /// The first failure of this worker.
    pub(crate) fn failure(&self) -> Option<String> {
        lock(&self.failure).take()
    }

    /// Sends heartbeats until the worker is done, is to leave, or the connection fails.
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

/// Locks a mutex whose content no panic can leave half done: a sealer seals in memory.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
