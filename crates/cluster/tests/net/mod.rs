//! Coordinators and workers over real sockets of this machine, and connections on which a test itself sends messages.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::Range;
use std::thread;
use std::time::{Duration, Instant};

use cluster::noise::{self, Greeting, HANDSHAKE_RECORD, Sealer};
use cluster::{Access, Inbound, JobHashes, Wish, Work, WorkerIntroduction, serve, work};
use protocol::codec::frame;
use protocol::message::{ToCoordinator, ToWorker};
use protocol::{Coordinator, Ending, JobPlan, Notice};
use radiosity::{Counts, Layout, Overflow, Tally};

use crate::toy::{
    self, BUILD, Board, JOB, JOB_HASH, LAYOUT, PATCHES, READY, SCENE_HASH, coordinator, straight,
};

/// The time after which a test is taken to hang.
pub const HANG: Duration = Duration::from_secs(120);

/// The outcome of a run.
pub struct Run {
    pub ending: Ending,
    pub coordinator: Coordinator,
    pub notices: Vec<String>,
}

/// Serves a job to workers and `others`, which get the access, until it is done or `stop` returns true.
pub fn run(plan: JobPlan, stop: impl Fn(&Coordinator) -> bool, others: impl FnOnce(&Access) + Send) -> Run {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let access = access_of(&listener);
    let mut coordinator = coordinator(plan);
    let mut notices = Vec::new();
    let began = Instant::now();
    let ending = thread::scope(|scope| {
        let others = scope.spawn(|| others(&access));
        let owner = |coordinator: &Coordinator| {
            assert!(began.elapsed() < HANG, "the job hangs");
            match () {
                () if stop(coordinator) => Wish::Stop,
                // The workers of a test that failed will not come any more.
                () if others.is_finished() => Wish::GiveUp,
                () => Wish::Continue,
            }
        };
        let tell = |notice| match notice {
            // Notices of new workers are left out.
            Notice::Joined { .. } => {}
            notice => notices.push(notice.to_string()),
        };
        serve(listener, &access, &mut coordinator, owner, tell).unwrap()
    });
    Run { ending, coordinator, notices }
}

/// The access to a coordinator that listens at `listener`.
pub fn access_of(listener: &TcpListener) -> Access {
    Access::new(listener.local_addr().unwrap().to_string(), BUILD, SCENE_HASH).unwrap()
}

pub fn never(_: &Coordinator) -> bool {
    false
}

pub fn await_that(condition: impl Fn() -> bool) {
    let began = Instant::now();
    while !condition() {
        assert!(began.elapsed() < HANG, "waited in vain");
        thread::sleep(Duration::from_millis(1));
    }
}

/// The work of the job without physics.
pub struct Toy;

impl Work for Toy {
    type Board = Board;

    fn hashes(&self) -> JobHashes {
        JobHashes { scene: SCENE_HASH, job: JOB_HASH }
    }
    fn empty(&self) -> Tally {
        Tally::new(PATCHES, LAYOUT)
    }
    fn board(&self) -> Board {
        Board::default()
    }
    fn shoot(&self, walks: Range<u64>, board: &mut Board) {
        board.shoot(walks);
    }
    fn hand_over(&self, board: &mut Board, tally: &mut Tally) -> Result<(), Overflow> {
        tally.merge(&board.take()).map_err(|_| Overflow)
    }
}

pub fn toy_of(job: &[u8]) -> Result<Toy, String> {
    assert_eq!(job, JOB);
    Ok(Toy)
}

pub fn identity(threads: usize) -> WorkerIntroduction {
    WorkerIntroduction { build: BUILD.into(), name: "a worker".into(), threads, leave: || false }
}

pub fn honest(access: &Access, threads: usize) {
    work(access, &identity(threads), toy_of, || 1.0).unwrap();
}

/// A connection on which a test itself sends messages.
pub struct Raw {
    pub stream: TcpStream,
    pub sealer: Sealer,
    pub inbound: Inbound,
}

impl Raw {
    /// A connection that has proved that it knows the key, but has not introduced itself.
    pub fn connect(access: &Access) -> Self {
        Raw::greet(knock(access), access)
    }

    pub fn greet(mut stream: TcpStream, access: &Access) -> Self {
        let (greeting, record) = Greeting::new(access);
        stream.write_all(&record).unwrap();
        let mut answer = [0; HANDSHAKE_RECORD];
        stream.read_exact(&mut answer).unwrap();
        let session = greeting.finish(&answer[2..]).unwrap();
        Raw { stream, sealer: session.sealer, inbound: Inbound::new(session.opener) }
    }

    /// The coordinator's end of a connection, played by a test.
    pub fn accept(listener: &TcpListener, access: &Access) -> Self {
        let (mut stream, _) = listener.accept().unwrap();
        stream.set_read_timeout(Some(HANG)).unwrap();
        let mut record = [0; HANDSHAKE_RECORD];
        stream.read_exact(&mut record).unwrap();
        let (session, answer) = noise::answer(access, &record).unwrap();
        stream.write_all(&answer).unwrap();
        Raw { stream, sealer: session.sealer, inbound: Inbound::new(session.opener) }
    }

    /// A connection as a worker that is let in.
    pub fn enter(access: &Access) -> Self {
        let mut raw = Raw::connect(access);
        raw.say(&ToCoordinator::Hello(toy::hello("raw", 1)));
        assert!(matches!(raw.message(), ToWorker::Welcome { job, .. } if *job == *JOB));
        raw
    }

    /// A connection as a worker that has its first lease.
    pub fn join(access: &Access) -> (Self, u64, Range<u64>) {
        let mut raw = Raw::enter(access);
        raw.say(&READY);
        let ToWorker::Lease { id, first_walk, walks } = raw.message() else { panic!("no lease") };
        (raw, id, first_walk..first_walk + walks)
    }

    /// The sealed records of a message.
    pub fn sealed(&mut self, message: &impl bincode::Encode) -> Vec<u8> {
        let mut wire = Vec::new();
        self.sealer.seal_all(&frame(message).unwrap(), &mut wire);
        wire
    }

    pub fn say(&mut self, message: &impl bincode::Encode) {
        let wire = self.sealed(message);
        self.stream.write_all(&wire).unwrap();
    }

    /// Sends bytes that are no message.
    pub fn say_bytes(&mut self, frame: &[u8]) {
        let mut wire = Vec::new();
        self.sealer.seal_all(frame, &mut wire);
        // The coordinator may hang up in the middle of it.
        let _ = self.stream.write_all(&wire);
    }

    /// The next message of a coordinator, heartbeats left out.
    pub fn message(&mut self) -> ToWorker {
        loop {
            match self.hear() {
                ToWorker::Alive => {}
                message => return message,
            }
        }
    }

    pub fn hear<T: bincode::Decode<()>>(&mut self) -> T {
        loop {
            if let Some(message) = self.inbound.next(1 << 20).unwrap() {
                return message;
            }
            let mut bytes = [0; 1000];
            let read = self.stream.read(&mut bytes).unwrap();
            assert!(read > 0, "the connection was closed");
            self.inbound.arrived(&bytes[..read]);
        }
    }

    /// Waits until the coordinator has hung up, whatever it still sends.
    pub fn until_dropped(self) {
        until_dropped(self.stream);
    }
}

pub fn knock(access: &Access) -> TcpStream {
    let stream = TcpStream::connect(&access.address).unwrap();
    stream.set_read_timeout(Some(HANG)).unwrap();
    stream
}

pub fn until_dropped(mut stream: TcpStream) {
    match io::copy(&mut stream, &mut io::sink()) {
        Ok(_) => {}
        Err(error) => assert_eq!(error.kind(), io::ErrorKind::ConnectionReset),
    }
}

#[track_caller]
pub fn assert_done(run: &Run, paths: u64) {
    assert_eq!(run.ending, Ending::BudgetSpent, "{:?}", run.notices);
    assert_eq!(run.coordinator.prefix(), &straight(0..paths));
}

/// Work whose results are far larger than what sockets hold: every walk scores a large number everywhere.
pub struct Bulky;

pub const BULK: usize = 50_000;
pub const SINGLE: Layout = Layout { scores: 1, moments: 1, slopes: 0, events: false };

pub fn bulky(walks: u64) -> Tally {
    let counts = Counts { walks, rays: walks, absorbed: walks, ..Counts::default() };
    let sums = (0..BULK as u128).map(|patch| u128::from(walks) * (u128::from(u64::MAX) + patch)).collect();
    Tally::from_parts(counts, BULK, SINGLE, sums).unwrap()
}

impl Work for Bulky {
    type Board = u64;

    fn hashes(&self) -> JobHashes {
        JobHashes { scene: SCENE_HASH, job: JOB_HASH }
    }
    fn empty(&self) -> Tally {
        Tally::new(BULK, SINGLE)
    }
    fn board(&self) -> u64 {
        0
    }
    fn shoot(&self, walks: Range<u64>, board: &mut u64) {
        *board += walks.end - walks.start;
    }
    fn hand_over(&self, board: &mut u64, tally: &mut Tally) -> Result<(), Overflow> {
        tally.merge(&bulky(std::mem::take(board))).map_err(|_| Overflow)
    }
}
