//! The sockets of whoever leads workers: one loop that turns what connections say into events for the state machine, and
//! does what that asks for. One thread serves all, so that what a connection can cost is a file descriptor and what is
//! held of it; and a peer is read only as fast as what it says is handled.

use std::collections::{BTreeSet, HashMap};
use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::time::{Duration, Instant};

use mio::net::TcpStream;
use mio::{Events, Interest, Poll, Token};

use crate::access::Access;
use crate::codec::{CodecError, SHORT_FRAME, frame};
use crate::coordinator::{Coordinator, Ending};
use crate::doorstep::{Doorstep, PATIENCE, Served};
use crate::gossip::Gossip;
use crate::lead::{Action, Lead, Notice, Now, PeerId};
use crate::line::{Heard, LINGER, Line, TURN_BYTES};
use crate::message::ToWorker;

/// How often time is looked at.
const TICK: Duration = Duration::from_millis(50);

/// How often workers hear that somebody is here.
const HEARTBEAT: Duration = Duration::from_secs(1);

/// Connections that are accepted before others are heard.
const ACCEPTED_AT_ONCE: usize = 256;

/// So many workers, and no more.
const MOST_WORKERS: usize = 1 << 15;

/// After the end, those that have just come have so long to introduce themselves and hear of it.
const LATE: Duration = Duration::from_millis(500);

/// Events that are fetched at once.
const EVENTS: usize = 1024;

const LISTENER: Token = Token(usize::MAX);

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

/// Serves a job to its end, to workers that know the key of `access`. `owner` is called at every turn, at least every
/// 50 ms, and says what it wants; `tell` gets what the owner should know.
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

/// Every worker takes a file, and many systems begin with 1,024 and allow far more.
fn raise_file_limit() {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
        // Where it is refused, strangers make room for workers.
        let _ = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
    }
}

/// Sockets around a state machine that leads workers.
pub(crate) struct Shell<'a, T> {
    access: &'a Access,
    tell: T,
    gossip: Gossip,
    began: Instant,
    poll: Poll,
    listener: mio::net::TcpListener,
    /// Whether somebody may wait to be accepted.
    knocking: bool,
    /// Whether there are too many open files for that.
    starved: bool,
    next_peer: PeerId,
    doorstep: Doorstep,
    lines: HashMap<PeerId, Line>,
    /// Connections that may have something to say or to take.
    ready: BTreeSet<PeerId>,
    /// When time was last looked at.
    ticked: Now,
    /// When workers last heard that somebody is here.
    beaten: Now,
    /// The frame that every worker gets first.
    welcome: Option<Arc<[u8]>>,
    buffer: Vec<u8>,
}

impl<'a, T: FnMut(Notice)> Shell<'a, T> {
    /// Nobody yet.
    pub(crate) fn new(listener: TcpListener, access: &'a Access, tell: T) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        raise_file_limit();
        let mut listener = mio::net::TcpListener::from_std(listener);
        let poll = Poll::new()?;
        poll.registry().register(&mut listener, LISTENER, Interest::READABLE)?;
        Ok(Shell {
            access,
            tell,
            gossip: Gossip::new(),
            began: Instant::now(),
            poll,
            listener,
            knocking: true,
            starved: false,
            next_peer: 0,
            doorstep: Doorstep::default(),
            lines: HashMap::new(),
            ready: BTreeSet::new(),
            ticked: Duration::ZERO,
            beaten: Duration::ZERO,
            welcome: None,
            buffer: vec![0; TURN_BYTES],
        })
    }

    /// Time since it began.
    pub(crate) fn now(&self) -> Now {
        self.began.elapsed()
    }

    /// Waits for something to happen, not for long, and hears everybody who has something to say.
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
            if self.doorstep.holds(id) {
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
                // There are too many open files, or whoever knocked is gone.
                Err(_) => {
                    self.starved = !self.doorstep.drop_first();
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
        // Without it small messages wait for company; with a failure they only come later.
        let _ = stream.set_nodelay(true);
        let interest = Interest::READABLE | Interest::WRITABLE;
        if let Err(error) = self.poll.registry().register(&mut stream, Token(id as usize), interest) {
            return self.tell(Notice::Failed(error.to_string()));
        }
        let now = self.now();
        if !self.doorstep.arrived(id, stream, now) {
            let reason = "too many others have not introduced themselves either";
            self.tell(Notice::Failed(reason.into()));
        }
    }

    fn serve_stranger(&mut self, id: PeerId, lead: &mut impl Lead) {
        match self.doorstep.serve(id, self.access) {
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
                // It may have said more.
                self.ready.insert(id);
            }
        }
    }

    /// Takes a connection's turn: sends what it takes, hears what it says.
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
        // What follows looks at everybody.
        if now.saturating_sub(self.ticked) < TICK {
            return;
        }
        self.ticked = now;
        for _ in 0..self.doorstep.tidy(now) {
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

    /// Does what is to be done.
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
        // What goes wrong in sending shows when it is its turn.
        self.ready.insert(id);
    }

    fn tell(&mut self, notice: Notice) {
        let now = self.began.elapsed();
        self.gossip.pass(notice, now, &mut self.tell);
    }

    /// Lets the last messages go out, and tells those that come now that it is over.
    pub(crate) fn finish(mut self, lead: &mut impl Lead) -> io::Result<()> {
        let ended = Instant::now();
        loop {
            self.knocking = true;
            self.turn(lead)?;
            let late = !self.doorstep.is_empty() && ended.elapsed() < LATE;
            let leaving = !self.lines.is_empty() && ended.elapsed() < LINGER;
            if !late && !leaving {
                break;
            }
        }
        self.gossip.finish(&mut self.tell);
        Ok(())
    }
}
