//! Tests of coordinator and workers over real sockets of this machine, in one process, with everything that may go
//! wrong between them. Deadlines here only end a test that hangs.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::ops::Range;
use std::sync::Barrier;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use crate::net::{
    BULK, Bulky, Raw, SINGLE, Toy, access_of, assert_done, await_that, bulky, honest, identity, knock, never,
    run, toy_of, until_dropped,
};
use crate::toy::{
    BUILD, Board, JOB_HASH, LAYOUT, PATCHES, READY, SCENE_HASH, coordinator, hash, judge, plan, result,
    straight,
};
use cluster::noise::{self, HANDSHAKE_RECORD};
use cluster::{Access, JobHashes, Wish, Work, WorkerError, WorkerIntroduction, serve, work};
use protocol::message::{Hello, LeaseResult, ToCoordinator, ToWorker};
use protocol::{Coordinator, Ending, Foreign, JobPlan, Limits};
use radiosity::{Overflow, Tally, parallel::ThreadPool};

/// Whether the prefix has reached `walks` walks, to stop there.
fn far(walks: u64) -> impl Fn(&Coordinator) -> bool {
    move |coordinator| coordinator.prefix().counts.walks >= walks
}

/// Several workers with the given numbers of threads. None begins before all have been let in: the first alone might
/// end the job before the last has connected.
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
        // Two connections send nothing and stay to the end, one before and one after the handshake.
        let silent = (knock(access), Raw::connect(access));
        // One connection sends nothing and leaves.
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

        // A short frame claims to hold a reason of 2³⁰ bytes.
        let mut swollen = Raw::connect(access);
        swollen.say_bytes(&[6, 0, 0, 0, 6, 252, 0, 0, 0, 64]);
        swollen.until_dropped();

        // This connection sends no message, but many records.
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
    let noticed = |words: &str| run.notices.iter().any(|notice| notice.contains(words));
    assert!(noticed("does not speak radwalk's protocol"), "{:?}", run.notices);
    assert!(noticed("exceeds the limit of 4096"), "{:?}", run.notices);
    assert!(noticed("LimitExceeded") && noticed("unexpected message"), "{:?}", run.notices);
}

#[test]
fn a_worker_with_another_key_or_build_is_told_why_it_is_refused() {
    let run = run(plan(50_000, 1000), never, |access| {
        let keyless = Access::new(access.address.clone(), BUILD, SCENE_HASH).unwrap();
        let error = work(&keyless, &identity(1), toy_of, || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::Impostor(Foreign::NoEntry)), "{error}");
        let old = WorkerIntroduction { build: "0.0.1".into(), ..identity(1) };
        let error = work(access, &old, toy_of, || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::OtherBuild { ours, .. } if ours == "0.0.1"), "{error}");
        // The coordinator finds out another build whose access file was made to fit.
        let mut lying = Raw::connect(access);
        lying.say(&ToCoordinator::Hello(Hello { build: "0.0.1".into(), ..crate::toy::hello("old", 1) }));
        assert!(matches!(lying.message(), ToWorker::Refused { reason } if reason.contains("0.0.1")));
        let error = work(access, &identity(0), toy_of, || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::Refused(reason) if reason.contains("threads")), "{error}");
        let error = work(access, &identity(1), |_| Ok(Stranger), || 0.0).unwrap_err();
        assert!(matches!(&error, WorkerError::Refused(reason) if reason.contains("replica")), "{error}");
        honest(access, 1);
    });
    assert_done(&run, 50_000);
    assert_eq!(run.notices.len(), 4, "{:?}", run.notices);
}

/// Work of another scene than the coordinator's.
struct Stranger;

impl Work for Stranger {
    type Board = ();

    fn hashes(&self) -> JobHashes {
        JobHashes { scene: [0; 32], job: JOB_HASH }
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
        // The last result is whole, but its sender is gone when it arrives.
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
    // A fake coordinator hands out an endless lease and vanishes.
    for farewell in [None, Some(ToWorker::Done), Some(crate::toy::welcome(10))] {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let access = access_of(&listener);
        let shooting = AtomicU64::new(0);
        thread::scope(|scope| {
            let worker =
                scope.spawn(|| work(&access, &identity(3), |_| Ok(Endless { shooting: &shooting }), || 0.0));
            let mut raw = Raw::accept(&listener, &access);
            assert_eq!(raw.hear::<ToCoordinator>(), ToCoordinator::Hello(crate::toy::hello("a worker", 3)));
            raw.say(&crate::toy::welcome(10));
            for id in 0..6 {
                // The lease goes beyond all numbers of walks.
                let lease = ToWorker::Lease { id, first_walk: 1 << 60, walks: u64::MAX };
                raw.say(&lease);
            }
            await_that(|| shooting.load(Ordering::Relaxed) > 100);
            let expect_ok = farewell == Some(ToWorker::Done);
            if let Some(farewell) = &farewell {
                raw.say(farewell);
                // The worker does not wait for the connection to close.
                assert_eq!(worker.join().unwrap().is_ok(), expect_ok);
            } else {
                drop(raw);
                assert!(matches!(worker.join().unwrap(), Err(WorkerError::Lost(_))));
            }
        });
    }
}

/// Work whose walks never end.
struct Endless<'a> {
    shooting: &'a AtomicU64,
}

impl Work for Endless<'_> {
    type Board = ();

    fn hashes(&self) -> JobHashes {
        JobHashes { scene: SCENE_HASH, job: JOB_HASH }
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

/// A worker of one thread that keeps two results shoots its next lease as soon as either is taken: the other may wait
/// beyond a gap that only this worker is free to fill.
#[test]
fn a_worker_goes_on_when_either_of_its_results_is_taken_or_dropped() {
    let offer = |raw: &mut Raw, id| {
        raw.say(&ToWorker::Lease { id, first_walk: 0, walks: 1 });
        loop {
            match raw.hear() {
                ToCoordinator::Offer { lease, .. } => return assert_eq!(lease, id),
                ToCoordinator::Alive { .. } => {}
                other => panic!("{other:?}"),
            }
        }
    };
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let access = access_of(&listener);
    thread::scope(|scope| {
        let worker = scope.spawn(|| work(&access, &identity(1), |_| Ok(Bulky), || 0.0));
        let mut raw = Raw::accept(&listener, &access);
        assert_eq!(raw.hear::<ToCoordinator>(), ToCoordinator::Hello(crate::toy::hello("a worker", 1)));
        raw.say(&crate::toy::welcome(10));
        while raw.hear::<ToCoordinator>() != READY {}
        offer(&mut raw, 0);
        offer(&mut raw, 1);
        raw.say(&ToWorker::Drop { lease: 1 });
        offer(&mut raw, 2);
        raw.say(&ToWorker::Send { lease: 2 });
        while !matches!(raw.hear(), ToCoordinator::Result(LeaseResult { lease: 2, .. })) {}
        offer(&mut raw, 3);
        raw.say(&ToWorker::Drop { lease: 0 });
        offer(&mut raw, 4);
        raw.say(&ToWorker::Done);
        worker.join().unwrap().unwrap();
    });
}

/// A tunnel or a balancer takes connections and closes them where its coordinator is gone. A worker has then found nobody whom it could lose.
#[test]
fn what_closes_every_connection_is_no_coordinator() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let access = access_of(&listener);
    thread::spawn(move || listener.incoming().for_each(drop));
    let ended = work(&access, &identity(1), |_| Ok(Toy), || 0.0);
    assert!(matches!(ended, Err(WorkerError::Unreachable { .. })), "{ended:?}");
}

#[test]
fn an_impostor_is_found_out() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let access = access_of(&listener);
    thread::scope(|scope| {
        let worker = scope.spawn(|| work(&access, &identity(1), toy_of, || 0.0));
        // The fake coordinator has the address and all the rest, but not the key.
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
            // The worker returns before the job is done, which needs another worker.
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
    // The whole job would take years.
    let run = run(plan(1 << 60, 1000), far(20_000), |access| together(access, &[1, 2, 2], || Toy));
    assert_eq!(run.ending, Ending::Interrupted);
    let walks = run.coordinator.prefix().counts.walks;
    assert!(walks >= 20_000);
    assert_eq!(run.coordinator.prefix(), &straight(0..walks));
    assert_eq!(run.notices, [""; 0]);
}

#[test]
fn large_results_come_in_whole_and_a_stop_during_a_transfer_does_no_harm() {
    let bulky_plan =
        |paths| JobPlan { patches: BULK, layout: SINGLE, limits: Limits::NONE, ..plan(paths, 10) };
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
fn a_target_that_is_reached_dismisses_all_workers() {
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
        // The worker is let in, sends nothing more, and hangs up only when the run is over.
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
                // The stream is connected, but not accepted yet.
                let stream = knock(&access);
                all_in.wait();
                let mut raw = Raw::greet(stream, &access);
                raw.say(&ToCoordinator::Hello(crate::toy::hello("late", 1)));
                assert_eq!(raw.message(), ToWorker::Done);
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
        let ToWorker::Lease { id, first_walk, walks: second } = raw.message() else { panic!("no lease") };
        raw.say(&ToCoordinator::Result(result(id, first_walk..first_walk + second)));
        let last = LeaseResult { seconds: f64::NAN, ..result(lease, walks) };
        raw.say(&ToCoordinator::Result(last));
    });
    assert_done(&run, 20);
}

/// Work that reports progress for ever and never ends.
struct Sisyphus<'a>(&'a AtomicU64);

impl Work for Sisyphus<'_> {
    type Board = ();

    fn hashes(&self) -> JobHashes {
        JobHashes { scene: SCENE_HASH, job: JOB_HASH }
    }
    fn empty(&self) -> Tally {
        Tally::new(PATCHES, LAYOUT)
    }
    fn board(&self) {}
    fn shoot(&self, _: Range<u64>, (): &mut ()) {
        unreachable!()
    }
    fn shoot_while(&self, _: Range<u64>, (): &mut (), pool: &dyn ThreadPool) {
        while pool.go_on() {
            self.0.fetch_add(1, Ordering::Relaxed);
            thread::sleep(Duration::from_millis(1));
        }
    }
    fn hand_over(&self, (): &mut (), _: &mut Tally) -> Result<(), Overflow> {
        Ok(())
    }
}

/// The coordinator would never give such a worker up. Unless late leases are given out twice, the job would wait for it
/// for ever.
#[test]
fn a_worker_that_lives_and_never_delivers_does_not_hold_the_end() {
    let shooting = AtomicU64::new(0);
    let run = run(plan(50_000, 1000), never, |access| {
        thread::scope(|scope| {
            scope.spawn(|| work(access, &identity(1), |_| Ok(Sisyphus(&shooting)), || 1.0).unwrap());
            await_that(|| shooting.load(Ordering::Relaxed) > 0);
            honest(access, 1);
        });
    });
    assert_done(&run, 50_000);
    assert_eq!(run.notices, [""; 0]);
    let effort = run.coordinator.effort();
    assert_eq!((effort.workers_seen, effort.workers_lost), (2, 0));
    assert!(effort.streams_reissued > 0, "its walks were given to the other one, too");
}
