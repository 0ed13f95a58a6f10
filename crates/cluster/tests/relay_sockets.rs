//! Tests of relays over real sockets of this machine, in one process.

use std::net::TcpListener;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{self, Scope, ScopedJoinHandle};

use crate::net::{
    BULK, Bulky, Raw, SINGLE, Toy, access_of, assert_done, await_that, bulky, honest, identity, never, run,
};
use crate::toy::{READY, SCENE_HASH, plan, straight, welcome};
use cluster::{Access, Work, WorkerError, WorkerIntroduction, relay, work};
use protocol::digest::Digester;
use protocol::message::{ToCoordinator, ToWorker};
use protocol::{Coordinator, Ending, JobPlan, Limits};

type Ended<'s> = ScopedJoinHandle<'s, Result<(), WorkerError>>;

/// Starts a relay; the access for its workers comes once it has joined.
fn start<'s, W: Work + 's>(
    scope: &'s Scope<'s, '_>,
    access: Access,
    leave: fn() -> bool,
    make: fn() -> W,
) -> (Ended<'s>, Receiver<Access>) {
    let (sender, receiver) = channel();
    let open = move |_| {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let own = access_of(&listener);
        sender.send(own.clone()).unwrap();
        Ok((listener, own))
    };
    let identity = WorkerIntroduction { name: "a relay".into(), leave, ..identity(0) };
    let ended = scope.spawn(move || relay(&access, &identity, |_| Ok(make()), open, |_| {}));
    (ended, receiver)
}

/// The workers of a relay, and one beside it; none delivers before all are in.
fn tree<W: Work + 'static>(access: &Access, make: fn() -> W) {
    let all_in = std::sync::Barrier::new(6);
    thread::scope(|scope| {
        let spawn = |access: Access| {
            let all_in = &all_in;
            let build = move |_: &[u8]| {
                all_in.wait();
                Ok(make())
            };
            scope.spawn(move || work(&access, &identity(1), build, || 1.0).unwrap());
        };
        let mut relays = Vec::new();
        for _ in 0..2 {
            let (ended, open) = start(scope, access.clone(), || false, make);
            let own = open.recv().unwrap();
            (0..2).for_each(|_| spawn(own.clone()));
            relays.push((ended, own));
        }
        // This relay joins another relay.
        let (ended, open) = start(scope, relays[0].1.clone(), || false, make);
        let own = open.recv().unwrap();
        spawn(own.clone());
        relays.push((ended, own));
        spawn(access.clone());
        for (ended, _) in relays {
            ended.join().unwrap().unwrap();
        }
    });
}

#[test]
fn relays_of_relays_and_workers_come_to_the_same_tally() {
    let run = run(plan(300_000, 100), never, |access| tree(access, || Toy));
    assert_done(&run, 300_000);
    assert_eq!(run.notices, [""; 0]);
    let effort = run.coordinator.effort();
    assert_eq!((effort.workers_seen, effort.workers_lost), (3, 0));
}

/// The job goes on until workers at every level have brought something.
#[test]
fn workers_behind_relays_and_relays_of_relays_are_in_the_book() {
    let all = |coordinator: &Coordinator| {
        coordinator.contributors().len() == 3 && coordinator.prefix().counts.walks > 0
    };
    let run = run(plan(1 << 50, 100), all, |access| tree(access, || Toy));
    assert_eq!(run.ending, Ending::Interrupted);
    is_accounted_for(&run.coordinator);
}

/// Checks that every entry of the book has the digest of its walks, and that all workers of the tree are named.
fn is_accounted_for(coordinator: &Coordinator) {
    let past = coordinator.past();
    let digester = Digester::new(&SCENE_HASH);
    let mut next = 0;
    for entry in past.deliveries.entries() {
        let walks = next..next + entry.walks;
        next = walks.end;
        assert_eq!(entry.digest, digester.digest(&straight(walks)));
    }
    let mut names: Vec<&str> = past.workers.iter().map(|worker| &worker.name[..]).collect();
    names.sort_unstable();
    assert_eq!(
        names,
        ["a relay > a relay > a worker", "a relay > a worker", "a worker"],
        "all are called so"
    );
}

#[test]
fn large_results_pass_relays_and_a_stop_during_a_transfer_does_no_harm() {
    let bulky_plan =
        |paths| JobPlan { patches: BULK, layout: SINGLE, limits: Limits::NONE, ..plan(paths, 10) };
    let done = run(bulky_plan(400), never, |access| tree(access, || Bulky));
    assert_eq!(done.ending, Ending::BudgetSpent);
    assert!(done.coordinator.prefix() == &bulky(400));
    let far = |coordinator: &Coordinator| coordinator.prefix().counts.walks >= 300;
    let stopped = run(bulky_plan(1 << 50), far, |access| tree(access, || Bulky));
    assert_eq!(stopped.ending, Ending::Interrupted);
    let walks = stopped.coordinator.prefix().counts.walks;
    assert!(walks >= 300 && stopped.coordinator.prefix() == &bulky(walks));
    assert!(done.notices.is_empty() && stopped.notices.is_empty());
}

#[test]
fn a_relay_that_leaves_sends_its_workers_home_and_others_do_its_walks() {
    static LEAVES: AtomicBool = AtomicBool::new(false);
    let (walks, workers) = (AtomicU64::new(0), AtomicU64::new(0));
    let watch = |coordinator: &Coordinator| {
        walks.store(coordinator.progress().walks, Ordering::Relaxed);
        workers.store(coordinator.progress().workers as u64, Ordering::Relaxed);
        coordinator.prefix().counts.walks > 3_000_000
    };
    let run = run(plan(1 << 50, 1000), watch, |access| {
        thread::scope(|scope| {
            let leave = || LEAVES.load(Ordering::Relaxed);
            let (ended, open) = start(scope, access.clone(), leave, || Toy);
            let own = open.recv().unwrap();
            let homes = [(); 2].map(|()| {
                let own = own.clone();
                scope.spawn(move || honest(&own, 1))
            });
            await_that(|| walks.load(Ordering::Relaxed) > 10_000);
            LEAVES.store(true, Ordering::Relaxed);
            let left = ended.join().unwrap();
            assert!(matches!(&left, Err(WorkerError::Failed(why)) if why.contains("leave")), "{left:?}");
            homes.into_iter().for_each(|home| home.join().unwrap());
            await_that(|| workers.load(Ordering::Relaxed) == 0);
            honest(access, 1);
        });
    });
    assert_eq!(run.ending, Ending::Interrupted);
    let walks = run.coordinator.prefix().counts.walks;
    assert!(walks > 3_000_000);
    assert_eq!(run.coordinator.prefix(), &crate::toy::straight(0..walks));
    assert_eq!(run.notices.len(), 1, "{:?}", run.notices);
    assert!(run.notices[0].contains("worker a relay left"));
}

#[test]
fn a_relay_whose_coordinator_vanishes_leaves_its_workers_without_a_word() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let access = access_of(&listener);
    thread::scope(|scope| {
        let (ended, open) = start(scope, access.clone(), || false, || Toy);
        let mut raw = Raw::accept(&listener, &access);
        let ToCoordinator::Hello(hello) = raw.hear() else { panic!("no hello") };
        assert!(hello.relays && hello.threads == 0);
        raw.say(&welcome(10));
        let own = open.recv().unwrap();
        let worker = scope.spawn(move || work(&own, &identity(3), crate::net::toy_of, || 0.0));
        let hear = |raw: &mut Raw| loop {
            match raw.hear::<ToCoordinator>() {
                ToCoordinator::Alive { .. } => {}
                message => return message,
            }
        };
        assert_eq!(hear(&mut raw), READY);
        let ToCoordinator::Capacity { threads: 3, .. } = hear(&mut raw) else {
            panic!("its worker's threads")
        };
        raw.say(&ToWorker::Lease { id: 5, first_walk: 100, walks: 300 });
        let ToCoordinator::Result(result) = hear(&mut raw) else { panic!("no result") };
        let expected = crate::toy::result(5, 100..400);
        assert_eq!((result.lease, result.counts), (5, expected.counts));
        assert_eq!((result.sums, result.digest), (expected.sums, expected.digest));
        let parts = &result.provenance.parts;
        assert_eq!(result.provenance.names, ["a worker"]);
        assert_eq!(parts.iter().map(|part| part.walks).sum::<u64>(), 300);
        drop(raw);
        assert!(matches!(ended.join().unwrap(), Err(WorkerError::Lost(_))));
        // The relay may come back, so its workers look for it again.
        assert!(matches!(worker.join().unwrap(), Err(WorkerError::Lost(_))));
    });
}
