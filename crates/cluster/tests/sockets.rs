//! Coordinator and workers over real sockets of this machine, in one process, with all that may go wrong
//! between them. No deadline here decides anything but that a test hangs.

mod toy;

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::ops::Range;
use std::sync::Barrier;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use cluster::access::Access;
use cluster::channel::Inbound;
use cluster::codec::frame;
use cluster::coordinator::{Coordinator, Ending, Plan};
use cluster::message::{Hello, LeaseResult, ToCoordinator, ToWorker};
use cluster::noise::{self, Foreign, Greeting, HANDSHAKE_RECORD, Sealer};
use cluster::server::{Wish, serve};
use cluster::worker::{Identity, Work, WorkerError, work};
use radiosity::{Counts, Layout, Overflow, Tally};
use toy::{
    BUILD, Board, JOB, JOB_HASH, LAYOUT, PATCHES, READY, SCENE_HASH, coordinator, hash, judge, plan, result,
    straight,
};

/// A test that takes so long hangs.
const HANG: Duration = Duration::from_secs(120);

/// What came of a run.
struct Run {
    ending: Ending,
    coordinator: Coordinator,
    notices: Vec<String>,
}

/// Serves a job to workers and others, who know how to get in, until it is done or `stop` says so.
fn run(plan: Plan, stop: impl Fn(&Coordinator) -> bool, others: impl FnOnce(&Access) + Send) -> Run {
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
        serve(listener, &access, &mut coordinator, owner, |notice| notices.push(notice.to_string())).unwrap()
    });
    Run { ending, coordinator, notices }
}

/// The access to a coordinator that listens there.
fn access_of(listener: &TcpListener) -> Access {
    Access::new(listener.local_addr().unwrap().to_string(), BUILD, SCENE_HASH).unwrap()
}

/// Stops when the prefix has come so far.
fn far(walks: u64) -> impl Fn(&Coordinator) -> bool {
    move |coordinator| coordinator.prefix().counts.walks >= walks
}

fn never(_: &Coordinator) -> bool {
    false
}

/// The job without physics.
struct Toy;

impl Work for Toy {
    type Board = Board;

    fn hashes(&self) -> ([u8; 32], [u8; 32]) {
        (SCENE_HASH, JOB_HASH)
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

fn toy_of(job: &[u8]) -> Result<Toy, String> {
    assert_eq!(job, JOB);
    Ok(Toy)
}

fn identity(threads: usize) -> Identity {
    Identity { build: BUILD.into(), name: "a worker".into(), threads }
}

fn honest(access: &Access, threads: usize) {
    work(access, &identity(threads), toy_of, || 1.0).unwrap();
}

/// Several workers, of so many threads each. None begins before all have been let in: the first alone might
/// end the job before the last has found the door.
fn together<W: Work>(access: &Access, threads: &[usize], make: impl Fn() -> W + Sync) {
    let all_in = Barrier::new(threads.len());
    thread::scope(|scope| {
        for &threads in threads {
            let build = |_: &[u8]| {
                all_in.wait();
                Ok(make())
            };
            scope.spawn(move || work(access, &identity(threads), build, || 1.0).unwrap());
        }
    });
}

/// A connection that a test speaks on itself.
struct Raw {
    stream: TcpStream,
    sealer: Sealer,
    inbound: Inbound,
}

impl Raw {
    /// A connection that has shown to know the key, but has not said who it is.
    fn connect(access: &Access) -> Self {
        Raw::greet(knock(access), access)
    }

    fn greet(mut stream: TcpStream, access: &Access) -> Self {
        let (greeting, record) = Greeting::new(access);
        stream.write_all(&record).unwrap();
        let mut answer = [0; HANDSHAKE_RECORD];
        stream.read_exact(&mut answer).unwrap();
        let session = greeting.finish(&answer[2..]).unwrap();
        Raw { stream, sealer: session.sealer, inbound: Inbound::new(session.opener) }
    }

    /// The other end of a connection, of a coordinator that a test plays.
    fn accept(listener: &TcpListener, access: &Access) -> Self {
        let (mut stream, _) = listener.accept().unwrap();
        stream.set_read_timeout(Some(HANG)).unwrap();
        let mut record = [0; HANDSHAKE_RECORD];
        stream.read_exact(&mut record).unwrap();
        let (session, answer) = noise::answer(access, &record).unwrap();
        stream.write_all(&answer).unwrap();
        Raw { stream, sealer: session.sealer, inbound: Inbound::new(session.opener) }
    }

    /// A worker that is let in.
    fn enter(access: &Access) -> Self {
        let mut raw = Raw::connect(access);
        raw.say(&ToCoordinator::Hello(toy::hello("raw", 1)));
        assert_eq!(raw.hear::<ToWorker>(), ToWorker::Welcome { job: JOB.into() });
        raw
    }

    /// A worker that has been given its first lease.
    fn join(access: &Access) -> (Self, u64, Range<u64>) {
        let mut raw = Raw::enter(access);
        raw.say(&READY);
        let ToWorker::Lease { id, first_walk, walks } = raw.hear() else { panic!("no lease") };
        (raw, id, first_walk..first_walk + walks)
    }

    /// Records of a message.
    fn sealed(&mut self, message: &impl bincode::Encode) -> Vec<u8> {
        let mut wire = Vec::new();
        self.sealer.seal_all(&frame(message).unwrap(), &mut wire);
        wire
    }

    fn say(&mut self, message: &impl bincode::Encode) {
        let wire = self.sealed(message);
        self.stream.write_all(&wire).unwrap();
    }

    /// Says what is no message.
    fn say_bytes(&mut self, frame: &[u8]) {
        let mut wire = Vec::new();
        self.sealer.seal_all(frame, &mut wire);
        // The coordinator may hang up in the middle of it.
        let _ = self.stream.write_all(&wire);
    }

    fn hear<T: bincode::Decode<()>>(&mut self) -> T {
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
    fn until_dropped(self) {
        until_dropped(self.stream);
    }
}

fn knock(access: &Access) -> TcpStream {
    let stream = TcpStream::connect(&access.address).unwrap();
    stream.set_read_timeout(Some(HANG)).unwrap();
    stream
}

fn until_dropped(mut stream: TcpStream) {
    match io::copy(&mut stream, &mut io::sink()) {
        Ok(_) => {}
        Err(error) => assert_eq!(error.kind(), io::ErrorKind::ConnectionReset),
    }
}

#[track_caller]
fn assert_done(run: &Run, paths: u64) {
    assert_eq!(run.ending, Ending::BudgetSpent, "{:?}", run.notices);
    assert_eq!(run.coordinator.prefix(), &straight(0..paths));
}

#[test]
fn workers_of_any_number_of_threads_come_to_the_same_tally() {
    for threads in [vec![1], vec![3], vec![1, 2, 4]] {
        let run = run(plan(200_000, 1000), never, |access| together(access, &threads, || Toy));
        assert_done(&run, 200_000);
        assert_eq!(run.notices, [""; 0]);
        assert_eq!(run.coordinator.effort().workers_lost, 0);
    }
}

#[test]
fn strangers_are_dropped_and_the_run_goes_on() {
    let run = run(plan(50_000, 1000), never, |access| {
        // Say nothing and stay to the end, before and after the handshake.
        let silent = (knock(access), Raw::connect(access));
        // Says nothing and leaves.
        drop(knock(access));

        let mut garbage = knock(access);
        let noise: Vec<u8> = (0..100_000).map(|n| hash(n) as u8).collect();
        // The coordinator may hang up in the middle of it.
        let _ = garbage.write_all(&noise);
        until_dropped(garbage);

        let mut browser = knock(access);
        browser.write_all(b"GET / HTTP/1.1\r\n\r\n").unwrap();
        until_dropped(browser);

        let mut huge = Raw::connect(access);
        huge.say_bytes(&u32::MAX.to_le_bytes());
        huge.until_dropped();

        // A short frame that claims to hold 2³⁰ bytes of a reason.
        let mut swollen = Raw::connect(access);
        swollen.say_bytes(&[6, 0, 0, 0, 6, 252, 0, 0, 0, 64]);
        swollen.until_dropped();

        // Says no word, but many records.
        let mut verbose = Raw::connect(access);
        (0..1000).for_each(|_| verbose.say_bytes(&[0]));
        verbose.until_dropped();

        let mut presumptuous = Raw::connect(access);
        presumptuous.say(&READY);
        presumptuous.until_dropped();

        honest(access, 2);
        drop(silent);
    });
    assert_done(&run, 50_000);
    assert_eq!(run.coordinator.effort().workers_seen, 1);
    assert_eq!(run.coordinator.effort().workers_lost, 0);
    let told = |words: &str| run.notices.iter().any(|notice| notice.contains(words));
    assert!(told("does not speak as radwalk does"), "{:?}", run.notices);
    assert!(told("exceeds the limit of 4096"), "{:?}", run.notices);
    assert!(told("LimitExceeded") && told("out of turn"), "{:?}", run.notices);
}

#[test]
fn a_worker_with_another_key_or_build_is_told_why_it_is_refused() {
    let run = run(plan(50_000, 1000), never, |access| {
        let keyless = Access::new(access.address.clone(), BUILD, SCENE_HASH).unwrap();
        let error = work(&keyless, &identity(1), toy_of, || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::Impostor(Foreign::NoEntry)), "{error}");
        let old = Identity { build: "0.0.1".into(), ..identity(1) };
        let error = work(access, &old, toy_of, || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::OtherBuild { ours, .. } if ours == "0.0.1"), "{error}");
        // Another build whose access file was made to fit is found out by the coordinator.
        let mut lying = Raw::connect(access);
        lying.say(&ToCoordinator::Hello(Hello { build: "0.0.1".into(), ..toy::hello("old", 1) }));
        assert!(matches!(lying.hear(), ToWorker::Refused { reason } if reason.contains("0.0.1")));
        let error = work(access, &identity(0), toy_of, || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::Refused(reason) if reason.contains("threads")), "{error}");
        let error = work(access, &identity(1), |_| Ok(Stranger), || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::Refused(reason) if reason.contains("replica")), "{error}");
        honest(access, 1);
    });
    assert_done(&run, 50_000);
    assert_eq!(run.notices.len(), 4, "{:?}", run.notices);
}

/// Has built something else.
struct Stranger;

impl Work for Stranger {
    type Board = ();

    fn hashes(&self) -> ([u8; 32], [u8; 32]) {
        ([0; 32], JOB_HASH)
    }
    fn empty(&self) -> Tally {
        unreachable!()
    }
    fn board(&self) {}
    fn shoot(&self, _: Range<u64>, (): &mut ()) {
        unreachable!()
    }
    fn hand_over(&self, (): &mut (), _: &mut Tally) -> Result<(), Overflow> {
        unreachable!()
    }
}

#[test]
fn a_result_that_is_cut_short_is_not_taken() {
    let run = run(plan(50_000, 1000), never, |access| {
        for kept in [1, 2, 4, 5, 40] {
            let (mut raw, lease, walks) = Raw::join(access);
            let whole = raw.sealed(&ToCoordinator::Result(result(lease, walks)));
            raw.stream.write_all(&whole[..kept.min(whole.len() - 1)]).unwrap();
            drop(raw);
        }
        // The last is whole, but its sender is gone when it arrives.
        let (mut raw, lease, walks) = Raw::join(access);
        raw.say(&ToCoordinator::Result(result(lease, walks)));
        drop(raw);
        honest(access, 2);
    });
    assert_done(&run, 50_000);
    let effort = run.coordinator.effort();
    assert_eq!((effort.workers_seen, effort.workers_lost), (7, 6));
    assert_eq!(run.notices.len(), 6);
}

#[test]
fn a_worker_that_is_cut_off_while_it_shoots_leaves_nothing_behind() {
    // A fake coordinator that hands out an endless lease and vanishes.
    for farewell in [None, Some(ToWorker::Done), Some(ToWorker::Welcome { job: JOB.into() })] {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let access = access_of(&listener);
        let shooting = AtomicU64::new(0);
        thread::scope(|scope| {
            let worker =
                scope.spawn(|| work(&access, &identity(3), |_| Ok(Endless { shooting: &shooting }), || 0.0));
            let mut raw = Raw::accept(&listener, &access);
            assert_eq!(raw.hear::<ToCoordinator>(), ToCoordinator::Hello(toy::hello("a worker", 3)));
            raw.say(&ToWorker::Welcome { job: JOB.into() });
            for id in 0..6 {
                // Beyond all numbers.
                let lease = ToWorker::Lease { id, first_walk: 1 << 60, walks: u64::MAX };
                raw.say(&lease);
            }
            await_that(|| shooting.load(Ordering::Relaxed) > 100);
            let expect_ok = farewell == Some(ToWorker::Done);
            if let Some(farewell) = &farewell {
                raw.say(farewell);
                // It does not wait for the connection to close.
                assert_eq!(worker.join().unwrap().is_ok(), expect_ok);
            } else {
                drop(raw);
                assert!(matches!(worker.join().unwrap(), Err(WorkerError::Lost(_))));
            }
        });
    }
}

fn await_that(condition: impl Fn() -> bool) {
    let began = Instant::now();
    while !condition() {
        assert!(began.elapsed() < HANG, "waited in vain");
        thread::sleep(Duration::from_millis(1));
    }
}

/// Shoots for ever.
struct Endless<'a> {
    shooting: &'a AtomicU64,
}

impl Work for Endless<'_> {
    type Board = ();

    fn hashes(&self) -> ([u8; 32], [u8; 32]) {
        (SCENE_HASH, JOB_HASH)
    }
    fn empty(&self) -> Tally {
        Tally::new(PATCHES, LAYOUT)
    }
    fn board(&self) {}
    fn shoot(&self, walks: Range<u64>, (): &mut ()) {
        assert!(walks.start >= 1 << 60 && walks.start < walks.end);
        self.shooting.fetch_add(1, Ordering::Relaxed);
    }
    fn hand_over(&self, (): &mut (), _: &mut Tally) -> Result<(), Overflow> {
        Ok(())
    }
}

#[test]
fn an_impostor_is_found_out() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let access = access_of(&listener);
    thread::scope(|scope| {
        let worker = scope.spawn(|| work(&access, &identity(1), toy_of, || 0.0));
        // It has the address, but not the key; all else it has learnt.
        let (mut stream, _) = listener.accept().unwrap();
        let mut record = [0; HANDSHAKE_RECORD];
        stream.read_exact(&mut record).unwrap();
        assert_eq!(noise::answer(&access_of(&listener), &record).err(), Some(Foreign::Key));
        stream.write_all(&record).unwrap();
        assert!(matches!(worker.join().unwrap(), Err(WorkerError::Impostor(Foreign::Key))));
    });
}

/// The ways in which the work itself can fail.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Trouble {
    BuildFails,
    BuildPanics,
    ShootPanics,
    TakeOverflows,
}

struct Troubled(Trouble);

impl Work for Troubled {
    type Board = Board;

    fn hashes(&self) -> ([u8; 32], [u8; 32]) {
        (SCENE_HASH, JOB_HASH)
    }
    fn empty(&self) -> Tally {
        Tally::new(PATCHES, LAYOUT)
    }
    fn board(&self) -> Board {
        Board::default()
    }
    fn shoot(&self, walks: Range<u64>, board: &mut Board) {
        assert!(self.0 != Trouble::ShootPanics, "trouble that the test asked for");
        board.shoot(walks);
    }
    fn hand_over(&self, _: &mut Board, _: &mut Tally) -> Result<(), Overflow> {
        Err(Overflow)
    }
}

#[test]
fn work_that_fails_or_panics_takes_its_worker_down_and_no_other() {
    use Trouble::{BuildFails, BuildPanics, ShootPanics, TakeOverflows};
    for trouble in [BuildFails, BuildPanics, ShootPanics, TakeOverflows] {
        let lost = AtomicU64::new(0);
        let watch = |coordinator: &Coordinator| {
            lost.store(coordinator.effort().workers_lost, Ordering::Relaxed);
            false
        };
        let run = run(plan(50_000, 1000), watch, |access| {
            let build = |_: &[u8]| match trouble {
                BuildFails => Err("no such scene".into()),
                BuildPanics => panic!("trouble that the test asked for"),
                _ => Ok(Troubled(trouble)),
            };
            // It returns before the job is done, which needs another worker.
            let ended =
                thread::scope(|scope| scope.spawn(|| work(access, &identity(3), build, || 0.0)).join());
            match (trouble, ended) {
                (BuildFails, Ok(Err(WorkerError::Job(reason)))) => assert_eq!(reason, "no such scene"),
                (BuildPanics, Err(_)) => {}
                (ShootPanics, Ok(Err(WorkerError::Failed(reason)))) => assert!(reason.contains("panicked")),
                (TakeOverflows, Ok(Err(WorkerError::Failed(reason)))) => assert!(reason.contains("overflow")),
                (_, ended) => panic!("{trouble:?} came to {ended:?}"),
            }
            await_that(|| lost.load(Ordering::Relaxed) == 1);
            honest(access, 1);
        });
        assert_done(&run, 50_000);
        assert_eq!(run.notices.len(), 1, "{:?}", run.notices);
        let word = match trouble {
            BuildFails => "gave up: no such scene",
            BuildPanics => "closed",
            ShootPanics => "gave up: a thread panicked",
            TakeOverflows => "gave up: a sum of the tally overflowed",
        };
        assert!(run.notices[0].contains(word), "{trouble:?}: {}", run.notices[0]);
    }
}

#[test]
fn after_a_stop_every_worker_goes_home_in_peace() {
    // The job would take years.
    let run = run(plan(1 << 60, 1000), far(20_000), |access| together(access, &[1, 2, 2], || Toy));
    assert_eq!(run.ending, Ending::Interrupted);
    let walks = run.coordinator.prefix().counts.walks;
    assert!(walks >= 20_000);
    assert_eq!(run.coordinator.prefix(), &straight(0..walks));
    assert_eq!(run.notices, [""; 0]);
}

/// A job whose results are far larger than what sockets hold: every walk scores a large number everywhere.
struct Bulky;

const BULK: usize = 200_000;
const SINGLE: Layout = Layout { scores: 1, moments: 1, events: false };

fn bulky(walks: u64) -> Tally {
    let counts = Counts { walks, ..Counts::default() };
    let sums = (0..BULK as u128).map(|patch| u128::from(walks) * (u128::from(u64::MAX) + patch)).collect();
    Tally::from_parts(counts, BULK, SINGLE, sums).unwrap()
}

impl Work for Bulky {
    type Board = u64;

    fn hashes(&self) -> ([u8; 32], [u8; 32]) {
        (SCENE_HASH, JOB_HASH)
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

#[test]
fn large_results_come_in_whole_and_a_stop_in_their_midst_harms_nobody() {
    let bulky_plan = |paths| Plan { patches: BULK, layout: SINGLE, ..plan(paths, 10) };
    let workers = |access: &Access| together(access, &[2, 2, 2], || Bulky);
    let done = run(bulky_plan(400), never, workers);
    assert_eq!(done.ending, Ending::BudgetSpent);
    assert!(done.coordinator.prefix() == &bulky(400));
    let stopped = run(bulky_plan(1 << 50), far(300), workers);
    assert_eq!(stopped.ending, Ending::Interrupted);
    let walks = stopped.coordinator.prefix().counts.walks;
    assert!(walks >= 300 && stopped.coordinator.prefix() == &bulky(walks));
    assert!(done.notices.is_empty() && stopped.notices.is_empty());
}

#[test]
fn a_target_that_is_reached_sends_everybody_home() {
    let mut plan = plan(1 << 60, 1000);
    plan.looks = (1..20).map(|k| k * 4321).collect();
    plan.judge = judge(|tally| tally.counts.walks > 10_000);
    let run = run(plan, never, |access| together(access, &[1, 2], || Toy));
    assert_eq!(run.ending, Ending::TargetReached);
    assert_eq!(run.coordinator.prefix(), &straight(0..3 * 4321));
}

#[test]
fn a_worker_that_sits_still_does_not_hold_up_the_end() {
    let (sender, sitting) = std::sync::mpsc::channel();
    let run = run(plan(1 << 60, 1000), far(1000), |access| {
        // It is let in, says nothing more, and hangs up only when the run is over.
        sender.send(Raw::enter(access)).unwrap();
        honest(access, 1);
    });
    assert_eq!(run.ending, Ending::Interrupted);
    drop(sitting);
}

#[test]
fn who_knocks_as_the_job_ends_is_told_so() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let access = access_of(&listener);
    let mut coordinator = coordinator(plan(0, 10));
    let all_in = Barrier::new(21);
    thread::scope(|scope| {
        for _ in 0..20 {
            scope.spawn(|| {
                // Connected, but not accepted yet.
                let stream = knock(&access);
                all_in.wait();
                let mut raw = Raw::greet(stream, &access);
                raw.say(&ToCoordinator::Hello(toy::hello("late", 1)));
                assert_eq!(raw.hear::<ToWorker>(), ToWorker::Done);
                assert_eq!(raw.stream.read(&mut [0; 1]).unwrap(), 0, "and nothing else");
            });
        }
        all_in.wait();
        let ending = serve(listener, &access, &mut coordinator, |_| Wish::Continue, |_| {}).unwrap();
        assert_eq!(ending, Ending::BudgetSpent);
    });
}

#[test]
fn a_run_without_workers_ends() {
    let run = run(plan(100, 10), never, |access| drop(knock(access)));
    assert_eq!(run.ending, Ending::NoWorkers);
    assert_eq!(run.coordinator.prefix(), &straight(0..0));
}

#[test]
fn the_last_results_of_a_worker_that_died_are_counted() {
    // The owner gives up as soon as the only worker is gone, with its results on their way.
    let run = run(plan(20, 10), never, |access| {
        let (mut raw, lease, walks) = Raw::join(access);
        let ToWorker::Lease { id, first_walk, walks: second } = raw.hear() else { panic!("no lease") };
        raw.say(&ToCoordinator::Result(result(id, first_walk..first_walk + second)));
        let last = LeaseResult { seconds: f64::NAN, ..result(lease, walks) };
        raw.say(&ToCoordinator::Result(last));
    });
    assert_done(&run, 20);
}
