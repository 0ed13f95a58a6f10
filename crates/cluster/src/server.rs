//! The sockets of a leader of workers: one loop that turns messages on connections into events for the state machine,
//! and carries out its actions. One thread serves all connections, so that each costs only a file descriptor and its
//! buffers; a peer is read only as fast as its messages are handled.

use std::collections::{BTreeSet, HashMap};
use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mio::net::TcpStream;
use mio::{Events, Interest, Poll, Token};
use protocol::codec::{CodecError, SHORT_FRAME, frame};
use protocol::message::ToWorker;
use protocol::{Action, Coordinator, Ending, Lead, Notice, Now, PeerId};

use crate::access::Access;
use crate::line::{Connection, Heard, LINGER, TURN_BYTES};
use crate::notice_limiter::NoticeLimiter;
use crate::pending::{PATIENCE, PendingHandshakes, Served};

/// The time between two ticks of the state machine.
const TICK: Duration = Duration::from_millis(50);

/// The time between two heartbeats to workers.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// The most connections that are accepted before others are served.
const ACCEPTED_AT_ONCE: usize = 256;

/// The most workers that may be connected at once.
const MOST_WORKERS: usize = 1 << 15;

/// After the end, new connections have this long to introduce themselves and be told of it.
const LATE: Duration = Duration::from_millis(500);

/// The most events that are fetched at once.
const EVENTS: usize = 1024;

const LISTENER: Token = Token(usize::MAX);

/// The owner's wish, asked for at every turn of the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// The run goes on.
    Continue,
    /// The run is to end in good order.
    Stop,
    /// No worker will come any more: the run ends when none is left.
    GiveUp,
}

/// Serves a job to its end, to workers that know the key of `access`. `owner` is called at every turn, at least every
/// 50 ms, and returns its wish; `tell` receives the notices for the owner.
///
/// # Errors
/// Where the listener fails.
pub fn serve(
    listener: TcpListener,
    access: &Access,
    coordinator: &mut Coordinator,
    mut owner: impl FnMut(&Coordinator) -> Wish,
    tell: impl FnMut(Notice),
) -> io::Result<Ending> {
    let mut shell = Shell::new(listener, access, tell)?;
    let ending = loop {
        if let Some(ending) = coordinator.ending() {
            break ending;
        }
        shell.turn(coordinator)?;
        let actions = match owner(coordinator) {
            Wish::Continue => vec![],
            Wish::Stop => coordinator.stop(Ending::Interrupted, shell.now()),
            Wish::GiveUp => coordinator.on_no_workers(),
        };
        shell.act(actions);
    };
    shell.finish(coordinator)?;
    Ok(ending)
}

/// Raises the limit of open files: every worker takes one, and many systems begin with 1,024 and allow far more.
fn raise_file_limit() {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
        // If this is refused, strangers are dropped to make room for workers.
        let _ = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
    }
}

/// The sockets around a state machine that leads workers.
pub(crate) struct Shell<'a, T> {
    access: &'a Access,
    tell: T,
    limiter: NoticeLimiter,
    began: Instant,
    poll: Poll,
    listener: mio::net::TcpListener,
    /// Whether a connection may wait to be accepted.
    knocking: bool,
    /// Whether too many files are open to accept it.
    starved: bool,
    next_peer: PeerId,
    pending: PendingHandshakes,
    lines: HashMap<PeerId, Connection>,
    /// The connections that may have something to read or to write.
    ready: BTreeSet<PeerId>,
    /// The time of the last tick.
    ticked: Now,
    /// The time of the last heartbeat to workers.
    beaten: Now,
    /// The frame of the welcome, which all workers share.
    welcome: Option<Arc<[u8]>>,
    buffer: Vec<u8>,
}

impl<'a, T: FnMut(Notice)> Shell<'a, T> {
    /// A shell without connections around a listener.
    pub(crate) fn new(listener: TcpListener, access: &'a Access, tell: T) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        raise_file_limit();
        let mut listener = mio::net::TcpListener::from_std(listener);
        let poll = Poll::new()?;
        poll.registry().register(&mut listener, LISTENER, Interest::READABLE)?;
        Ok(Shell {
            access,
            tell,
            limiter: NoticeLimiter::new(),
            began: Instant::now(),
            poll,
            listener,
            knocking: true,
            starved: false,
            next_peer: 0,
            pending: PendingHandshakes::default(),
            lines: HashMap::new(),
            ready: BTreeSet::new(),
            ticked: Duration::ZERO,
            beaten: Duration::ZERO,
            welcome: None,
            buffer: vec![0; TURN_BYTES],
        })
    }

    /// The time since the shell was made.
    pub(crate) fn now(&self) -> Now {
        self.began.elapsed()
    }

    /// Waits for an event, for one tick at most, and serves every connection that is ready.
    pub(crate) fn turn(&mut self, lead: &mut impl Lead) -> io::Result<()> {
        let mut events = Events::with_capacity(EVENTS);
        let wait =
            if self.ready.is_empty() && (!self.knocking || self.starved) { TICK } else { Duration::ZERO };
        match self.poll.poll(&mut events, Some(wait)) {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => return Err(error),
            _ => {}
        }
        for event in &events {
            match event.token() {
                LISTENER => self.knocking = true,
                Token(id) => {
                    self.ready.insert(id as PeerId);
                }
            }
        }
        self.accept();
        for id in std::mem::take(&mut self.ready) {
            if self.pending.holds(id) {
                self.serve_stranger(id, lead);
            } else {
                self.serve_line(id, lead);
            }
        }
        self.tick(lead);
        Ok(())
    }

    fn accept(&mut self) {
        let accepted = if self.knocking { ACCEPTED_AT_ONCE } else { 0 };
        for _ in 0..accepted {
            match self.listener.accept() {
                Ok((stream, _)) => {
                    self.starved = false;
                    self.arrived(stream);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    self.knocking = false;
                    return;
                }
                // There are too many open files, or the connection is gone already.
                Err(_) => {
                    self.starved = !self.pending.drop_first();
                    if self.starved {
                        return;
                    }
                }
            }
        }
    }

    fn arrived(&mut self, mut stream: TcpStream) {
        let id = self.next_peer;
        self.next_peer += 1;
        // Without this, small messages are delayed; if it fails, they only come later.
        let _ = stream.set_nodelay(true);
        let interest = Interest::READABLE | Interest::WRITABLE;
        if let Err(error) = self.poll.registry().register(&mut stream, Token(id as usize), interest) {
            return self.tell(Notice::Failed(error.to_string()));
        }
        let now = self.now();
        if !self.pending.arrived(id, stream, now) {
            let reason = "too many connections have not introduced themselves";
            self.tell(Notice::Failed(reason.into()));
        }
    }

    fn serve_stranger(&mut self, id: PeerId, lead: &mut impl Lead) {
        match self.pending.serve(id, self.access) {
            Served::Waits => {}
            Served::Gone(reason) => self.tell(Notice::Failed(reason)),
            Served::Admitted(..) if self.lines.len() >= MOST_WORKERS => {
                self.tell(Notice::Failed(format!("there are {MOST_WORKERS} workers already")));
            }
            Served::Admitted(line, message) => {
                self.lines.insert(id, *line);
                let mut actions = lead.on_connect(id);
                actions.extend(lead.on_message(id, message, self.now()));
                self.act(actions);
                // The worker may have sent more already.
                self.ready.insert(id);
            }
        }
    }

    /// Serves a connection: sends what its socket takes and reads its messages.
    fn serve_line(&mut self, id: PeerId, lead: &mut impl Lead) {
        match self.exchange(id, lead) {
            Ok(Heard::All) => {}
            Ok(Heard::Part(_)) => {
                self.ready.insert(id);
            }
            Err(error) => {
                self.lines.remove(&id);
                let actions = lead.on_lost(id, &error.to_string(), self.now());
                self.act(actions);
            }
        }
    }

    fn exchange(&mut self, id: PeerId, lead: &mut impl Lead) -> Result<Heard, CodecError> {
        self.flush(id, lead)?;
        let Some(line) = self.lines.get_mut(&id) else { return Ok(Heard::All) };
        let heard = line.hear(&mut self.buffer)?;
        if let Heard::Part(bytes) = heard {
            lead.on_bytes(bytes);
        }
        while let Some(line) = self.lines.get_mut(&id)
            && let Some(message) = line.next(lead.frame_cap(id))?
        {
            let actions = lead.on_message(id, message, self.now());
            self.act(actions);
        }
        Ok(heard)
    }

    fn flush(&mut self, id: PeerId, lead: &mut impl Lead) -> Result<(), CodecError> {
        let now = self.now();
        let Some(line) = self.lines.get_mut(&id) else { return Ok(()) };
        if line.flush(now)? > SHORT_FRAME {
            lead.on_stir(id);
        }
        Ok(())
    }

    fn tick(&mut self, lead: &mut impl Lead) {
        let now = self.now();
        // The rest looks at every connection, so it runs once per tick.
        if now.saturating_sub(self.ticked) < TICK {
            return;
        }
        self.ticked = now;
        for _ in 0..self.pending.tidy(now) {
            let reason = format!("it did not introduce itself within {} s", PATIENCE.as_secs());
            self.tell(Notice::Failed(reason));
        }
        self.lines.retain(|_, line| !line.is_over(now));
        if now.saturating_sub(self.beaten) >= HEARTBEAT {
            self.beaten = now;
            let alive: Arc<[u8]> = frame(&ToWorker::Alive).expect("a byte").into();
            for (&id, line) in self.lines.iter_mut().filter(|(_, line)| line.is_open()) {
                line.push(alive.clone());
                self.ready.insert(id);
            }
        }
        let actions = lead.on_tick(now);
        self.act(actions);
    }

    /// Carries out the actions of the state machine.
    pub(crate) fn act(&mut self, actions: Vec<Action>) {
        for action in actions {
            match action {
                Action::Send(id, message) => self.send(id, &message),
                Action::Close(id) => {
                    let now = self.now();
                    if let Some(line) = self.lines.get_mut(&id) {
                        line.close(now);
                        self.ready.insert(id);
                    }
                }
                Action::Tell(notice) => self.tell(notice),
            }
        }
    }

    fn send(&mut self, id: PeerId, message: &ToWorker) {
        let Some(line) = self.lines.get_mut(&id) else { return };
        let encoded = || frame(message).expect("a job that was too long was refused before").into();
        let frame = match message {
            ToWorker::Welcome { .. } => self.welcome.get_or_insert_with(encoded).clone(),
            _ => encoded(),
        };
        line.push(frame);
        // A failure to send shows when the connection is served.
        self.ready.insert(id);
    }

    fn tell(&mut self, notice: Notice) {
        let now = self.began.elapsed();
        self.limiter.pass(notice, now, &mut self.tell);
    }

    /// Lets the last messages go out, and tells new connections that the run is over.
    pub(crate) fn finish(mut self, lead: &mut impl Lead) -> io::Result<()> {
        let ended = Instant::now();
        loop {
            self.knocking = true;
            self.turn(lead)?;
            let late = !self.pending.is_empty() && ended.elapsed() < LATE;
            let leaving = !self.lines.is_empty() && ended.elapsed() < LINGER;
            if !late && !leaving {
                break;
            }
        }
        self.limiter.finish(&mut self.tell);
        Ok(())
    }
}
