//! The coordinator's sockets: threads that turn connections into events, and one loop that feeds them to the
//! state machine.

use std::collections::HashMap;
use std::convert::Infallible;
use std::io::{self, Read, Write};
use std::iter;
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};

use crate::access::random_bytes;
use crate::codec::{SHORT_FRAME, read_frame, write_frame};
use crate::coordinator::{Action, Coordinator, Ending, Notice, PeerId};
use crate::message::{ToCoordinator, ToWorker};

/// How often time is looked at.
const TICK: Duration = Duration::from_millis(50);

/// How often the acceptor looks whether somebody knocks. It does not block: what would wake it up at the end
/// may fail, and the run would hang.
const POLL: Duration = Duration::from_millis(5);

/// A peer that does not take what it is sent for so long is cut off.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);

/// After the last message to a peer, its own are read and thrown away for so long: a connection that is
/// closed with bytes unread is reset, and the reset may overtake the message.
const LINGER: Duration = Duration::from_secs(2);

/// Results that may wait to be merged; then readers wait, and TCP slows the senders down.
const EVENTS_IN_FLIGHT: usize = 4;

/// So many connections that came as the job ended are told that it did.
const LATE_CONNECTIONS: usize = 1024;

enum Event {
    Connected(TcpStream),
    Said(PeerId, ToCoordinator),
    Lost(PeerId, String),
}

/// What the owner of the run wants, asked at every turn of the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Go on.
    Continue,
    /// End in good order.
    Stop,
    /// No worker will come any more: end when none is left.
    GiveUp,
}

/// Serves a job to its end. `owner` is called at every turn, at least every 50 ms, and says what it wants;
/// `tell` gets what the owner should know. No thread of it is left when it returns.
///
/// # Errors
/// Where the listener fails.
pub fn serve(
    listener: TcpListener,
    coordinator: &mut Coordinator,
    mut owner: impl FnMut(&Coordinator) -> Wish,
    mut tell: impl FnMut(Notice),
) -> io::Result<Ending> {
    let began = Instant::now();
    let (events, inbox) = bounded(EVENTS_IN_FLIGHT);
    let closing = Arc::new(AtomicBool::new(false));
    listener.set_nonblocking(true)?;
    let acceptor = thread::Builder::new().spawn({
        let (events, closing) = (events.clone(), closing.clone());
        move || accept(listener, &events, &closing)
    })?;
    let mut shell = Shell { connections: HashMap::new(), threads: Vec::new(), next_peer: 0, events };
    let ending = loop {
        if let Some(ending) = coordinator.ending() {
            break ending;
        }
        shell.turn(&inbox, coordinator, began, &mut tell);
        let actions = match owner(coordinator) {
            Wish::Continue => vec![],
            Wish::Stop => coordinator.stop(Ending::Interrupted, began.elapsed()),
            Wish::GiveUp => coordinator.on_no_workers(),
        };
        shell.act(actions, coordinator, &mut tell);
    };
    closing.store(true, Ordering::Relaxed);
    for stream in late_connections(acceptor, inbox) {
        shell.greet(stream, coordinator, &mut tell);
    }
    shell.finish();
    Ok(ending)
}

fn accept(listener: TcpListener, events: &Sender<Event>, closing: &AtomicBool) -> TcpListener {
    while !closing.load(Ordering::Relaxed) {
        match listener.accept() {
            Ok((stream, _)) => {
                if events.send(Event::Connected(stream)).is_err() {
                    break;
                }
            }
            // Nobody is there, or there are too many open files. Either may change.
            Err(_) => thread::sleep(POLL),
        }
    }
    listener
}

/// Connections that no turn of the loop has seen: in the inbox, or not accepted yet.
fn late_connections(acceptor: JoinHandle<TcpListener>, inbox: Receiver<Event>) -> Vec<TcpStream> {
    let mut late = Vec::new();
    // The acceptor may be waiting for room in the inbox.
    while !acceptor.is_finished() {
        late.extend(inbox.recv_timeout(POLL).ok());
    }
    late.extend(inbox.try_iter());
    let listener = acceptor.join().ok();
    let mut streams: Vec<TcpStream> = late
        .into_iter()
        .filter_map(|event| if let Event::Connected(stream) = event { Some(stream) } else { None })
        .collect();
    if let Some(listener) = listener {
        streams.extend(iter::from_fn(|| Some(listener.accept().ok()?.0)).take(LATE_CONNECTIONS));
    }
    streams
}

/// What the threads of a connection share.
struct Line {
    stream: TcpStream,
    /// The largest frame that is read; grows when the peer has proved itself.
    cap: AtomicUsize,
    /// Whether bytes of a long message have passed since it was last asked.
    stirred: AtomicBool,
    /// Whether a message of the peer waits for room in the inbox.
    waiting: AtomicBool,
}

/// Reads or writes one message, and marks that a long one gets on.
struct Passing<'a> {
    line: &'a Line,
    bytes: usize,
}

impl Passing<'_> {
    fn passed(&mut self, bytes: usize) {
        self.bytes += bytes;
        if self.bytes > SHORT_FRAME {
            self.line.stirred.store(true, Ordering::Relaxed);
        }
    }
}

impl Read for Passing<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let bytes = (&self.line.stream).read(buffer)?;
        self.passed(bytes);
        Ok(bytes)
    }
}

impl Write for Passing<'_> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let bytes = (&self.line.stream).write(buffer)?;
        self.passed(bytes);
        Ok(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        (&self.line.stream).flush()
    }
}

/// The shell's side of a connection.
struct Connection {
    outbox: Sender<ToWorker>,
    line: Arc<Line>,
}

/// The threads of a connection, which may outlive it for a while.
struct Threads {
    line: Arc<Line>,
    reader: JoinHandle<()>,
    writer: JoinHandle<()>,
}

struct Shell {
    connections: HashMap<PeerId, Connection>,
    threads: Vec<Threads>,
    next_peer: PeerId,
    events: Sender<Event>,
}

impl Shell {
    /// Handles one event, or a tick where none comes.
    fn turn(
        &mut self,
        inbox: &Receiver<Event>,
        coordinator: &mut Coordinator,
        began: Instant,
        tell: &mut impl FnMut(Notice),
    ) {
        let event = inbox.recv_timeout(TICK);
        let now = began.elapsed();
        let mut actions = match event {
            Ok(Event::Connected(stream)) => {
                self.greet(stream, coordinator, tell);
                vec![]
            }
            Ok(Event::Said(id, message)) => coordinator.on_message(id, message, now),
            Ok(Event::Lost(id, reason)) => {
                self.connections.remove(&id);
                coordinator.on_lost(id, &reason, now)
            }
            Err(RecvTimeoutError::Timeout) => vec![],
            Err(RecvTimeoutError::Disconnected) => unreachable!("the shell holds a sender"),
        };
        for (&id, Connection { line, .. }) in &self.connections {
            if line.stirred.swap(false, Ordering::Relaxed) || line.waiting.load(Ordering::Relaxed) {
                coordinator.on_stir(id);
            }
        }
        actions.extend(coordinator.on_tick(now));
        self.act(actions, coordinator, tell);
    }

    /// Somebody connected.
    fn greet(&mut self, stream: TcpStream, coordinator: &mut Coordinator, tell: &mut impl FnMut(Notice)) {
        let id = self.next_peer;
        self.next_peer += 1;
        let cap = coordinator.frame_cap(false);
        let actions = match random_bytes().and_then(|nonce| self.connect(id, stream, cap).map(|()| nonce)) {
            Ok(nonce) => coordinator.on_connect(id, nonce),
            Err(error) => vec![Action::Tell(Notice::Failed(error.to_string()))],
        };
        self.act(actions, coordinator, tell);
    }

    /// Starts the two threads of a connection.
    fn connect(&mut self, id: PeerId, stream: TcpStream, cap: usize) -> io::Result<()> {
        self.threads.retain(|threads| !(threads.reader.is_finished() && threads.writer.is_finished()));
        // On some systems a connection inherits this from the listener.
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
        let line = Arc::new(Line {
            stream,
            cap: AtomicUsize::new(cap),
            stirred: AtomicBool::new(false),
            waiting: AtomicBool::new(false),
        });
        let (outbox, messages) = unbounded();
        let (reading, reader_left) = bounded(0);
        let writer = thread::Builder::new().spawn({
            let line = line.clone();
            move || write(&line, &messages, &reader_left)
        })?;
        let reader = thread::Builder::new().spawn({
            let (line, events) = (line.clone(), self.events.clone());
            move || read(id, &line, &events, reading)
        })?;
        self.threads.push(Threads { line: line.clone(), reader, writer });
        self.connections.insert(id, Connection { outbox, line });
        Ok(())
    }

    fn act(&mut self, actions: Vec<Action>, coordinator: &Coordinator, tell: &mut impl FnMut(Notice)) {
        for action in actions {
            match action {
                Action::Send(id, message) => {
                    let Some(connection) = self.connections.get(&id) else { continue };
                    if matches!(message, ToWorker::Welcome { .. }) {
                        // Its reader knows when it has read one more message, which is not a result yet.
                        connection.line.cap.store(coordinator.frame_cap(true), Ordering::Relaxed);
                    }
                    // A writer that is gone has reported the loss, or is about to.
                    let _ = connection.outbox.send(message);
                }
                Action::Close(id) => {
                    if let Some(connection) = self.connections.remove(&id) {
                        // Nothing that it says matters any more.
                        connection.line.cap.store(0, Ordering::Relaxed);
                    }
                }
                Action::Tell(notice) => tell(notice),
            }
        }
    }

    /// Lets the last messages go out, then ends whatever is left.
    fn finish(self) {
        drop(self.connections);
        let deadline = Instant::now() + LINGER;
        for Threads { line, reader, writer } in self.threads {
            while !(reader.is_finished() && writer.is_finished()) && Instant::now() < deadline {
                thread::sleep(Duration::from_millis(1));
            }
            // Threads that still wait for their peer wake up to an error.
            let _ = line.stream.shutdown(Shutdown::Both);
            let _ = reader.join();
            let _ = writer.join();
        }
    }
}

/// Sends what is in the outbox until it closes, then closes the connection, when the peer has, or soon.
fn write(line: &Line, messages: &Receiver<ToWorker>, reader_left: &Receiver<Infallible>) {
    let sent = messages.iter().try_for_each(|message| write_frame(&mut Passing { line, bytes: 0 }, &message));
    if sent.is_ok() {
        let _ = line.stream.shutdown(Shutdown::Write);
        let _ = reader_left.recv_timeout(LINGER);
    }
    let _ = line.stream.shutdown(Shutdown::Both);
}

/// Hands over what the peer says until it makes no sense or ends; `_reading` is dropped at the end.
fn read(id: PeerId, line: &Line, events: &Sender<Event>, _reading: Sender<Infallible>) {
    let failure = loop {
        let message = match read_frame(&mut Passing { line, bytes: 0 }, line.cap.load(Ordering::Relaxed)) {
            Ok(message) => message,
            Err(error) => break error,
        };
        line.waiting.store(true, Ordering::Relaxed);
        let taken = events.send(Event::Said(id, message));
        line.waiting.store(false, Ordering::Relaxed);
        if taken.is_err() {
            break io::Error::from(io::ErrorKind::ConnectionAborted).into();
        }
    };
    let _ = events.send(Event::Lost(id, failure.to_string()));
    let _ = io::copy(&mut &line.stream, &mut io::sink());
}
