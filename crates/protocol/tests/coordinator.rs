//! Tests of the coordinator's state machine with a fake transport: every message that the coordinator sends is one that
//! the test expects, and time is a number.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::time::Duration;

use crate::toy::{Dice, JOB, JOB_HASH, PATCHES, READY, SCENE_HASH, hash, judge, plan, result, straight};
use protocol::codec::{pack, unpack};
use protocol::message::{Hello, LeaseResult, PROTOCOL, ToCoordinator, ToWorker};
use protocol::{
    Action, Coordinator, Delivery, Ending, JobPlan, Lead, LeaseProvenance, Notice, Past, PeerId, SILENCE,
    STALL,
};
use radiosity::Tally;

const SECOND: Duration = Duration::from_secs(1);

/// A lease as its worker knows it.
#[derive(Clone, Debug, PartialEq)]
struct Lease {
    id: u64,
    walks: Range<u64>,
}

/// The fake transport. It checks what no sequence of events may break: nothing is sent to a peer that is gone; no walk
/// is leased again once it is in; walks are out twice only as a whole lease with different workers; and only farewells
/// follow the end.
struct Stage {
    coordinator: Coordinator,
    now: Duration,
    next_peer: PeerId,
    stream: u64,
    /// The messages that every open connection was sent and has not read.
    wires: BTreeMap<PeerId, VecDeque<ToWorker>>,
    /// The messages that closed connections had been sent.
    closed: BTreeMap<PeerId, VecDeque<ToWorker>>,
    /// The leases that are out, by peer.
    out: Vec<(PeerId, Lease)>,
    /// The ranges of walks that are in.
    taken: Vec<Range<u64>>,
    /// The number of leases that were given out a second time.
    again: u64,
    /// The number of workers that sent an impossible result; their walks may be out again.
    liars: u64,
    /// Whether a thread may be given the walks that another thread of the same worker has.
    several_threads: bool,
    /// The leases whose walks another worker has brought.
    stale: BTreeSet<u64>,
    /// The number of results that came in.
    done: u64,
    notices: Vec<Notice>,
    /// The notices of standstills.
    quiet: Vec<String>,
}

impl Stage {
    fn new(plan: JobPlan) -> Self {
        let past = Past::none(Tally::new(plan.patches, plan.layout));
        Stage::resuming(plan, past)
    }

    /// A stage whose coordinator goes on from the books of another.
    fn resuming(plan: JobPlan, past: Past) -> Self {
        let stream = plan.stream_paths;
        let walks = past.tally.counts.walks;
        Stage {
            coordinator: Coordinator::new(plan, past),
            now: Duration::ZERO,
            next_peer: 0,
            stream,
            wires: BTreeMap::new(),
            closed: BTreeMap::new(),
            out: Vec::new(),
            taken: Vec::from_iter((walks > 0).then_some(0..walks)),
            again: 0,
            liars: 0,
            several_threads: false,
            stale: BTreeSet::new(),
            done: 0,
            notices: Vec::new(),
            quiet: Vec::new(),
        }
    }

    /// Carries out the coordinator's actions.
    fn act(&mut self, actions: Vec<Action>) {
        for action in actions {
            match action {
                Action::Send(id, message) => {
                    if let ToWorker::Lease { id: lease, first_walk, walks } = message {
                        self.check_lease(id, Lease { id: lease, walks: first_walk..first_walk + walks });
                    } else if self.coordinator.ending().is_some() {
                        assert_eq!(message, ToWorker::Done);
                    }
                    self.wires.get_mut(&id).expect("messages go to open connections").push_back(message);
                }
                Action::Close(id) => {
                    let wire = self.wires.remove(&id).expect("open connections are closed");
                    self.closed.insert(id, wire);
                    self.out.retain(|(peer, _)| *peer != id);
                }
                Action::Tell(quiet @ Notice::Quiet { .. }) => self.quiet.push(quiet.to_string()),
                Action::Tell(Notice::Joined { .. }) => {}
                Action::Tell(notice) => self.notices.push(notice),
            }
        }
    }

    fn check_lease(&mut self, peer: PeerId, lease: Lease) {
        let several_threads = self.several_threads;
        let Range { start, end } = lease.walks;
        assert!(self.coordinator.ending().is_none(), "no work is given out after the end");
        assert!(start < end, "a lease of nothing");
        let apart = |other: &Range<u64>| end <= other.start || other.end <= start;
        let is_void = |out: &Lease| self.liars > 0 && self.stale.contains(&out.id);
        for (of, out) in self.out.iter().filter(|(_, out)| !is_void(out)) {
            let copy = (*of != peer || several_threads) && out.walks == lease.walks;
            assert!(out.id != lease.id && (copy || apart(&out.walks)), "{lease:?} is out");
        }
        if self.liars > 0 && start >= self.coordinator.prefix().counts.walks {
            self.taken.retain(apart);
        }
        assert!(self.taken.iter().all(apart), "{lease:?} is in");
        self.again += u64::from(self.out.iter().any(|(_, out)| out.walks == lease.walks));
        self.out.push((peer, lease));
    }

    /// Takes the result of a lease that is out; only the first of the same walks counts.
    fn take(&mut self, out: usize) {
        let (_, lease) = self.out.swap_remove(out);
        self.done += 1;
        let copies = self.out.iter().filter(|(_, out)| out.walks == lease.walks);
        self.stale.extend(copies.map(|(_, out)| out.id));
        if !self.taken.contains(&lease.walks) {
            self.taken.push(lease.walks);
        }
    }

    /// Connects a peer that knows the key.
    fn connect(&mut self) -> PeerId {
        let id = self.next_peer;
        self.next_peer += 1;
        self.wires.insert(id, VecDeque::new());
        let actions = self.coordinator.on_connect(id);
        self.act(actions);
        id
    }

    fn say(&mut self, id: PeerId, message: ToCoordinator) {
        let actions = self.coordinator.on_message(id, message, self.now);
        self.act(actions);
    }

    /// The next message to a peer, open or closed.
    fn hear(&mut self, id: PeerId) -> ToWorker {
        let wire = self.wires.get_mut(&id).or(self.closed.get_mut(&id)).expect("a peer");
        wire.pop_front().unwrap_or_else(|| panic!("peer {id} was to hear something"))
    }

    fn hello(&self, id: PeerId) -> Hello {
        crate::toy::hello(&format!("worker {id}"), 1)
    }

    fn introduce(&mut self, hello: impl FnOnce(Hello) -> Hello) -> PeerId {
        let id = self.connect();
        let hello = hello(self.hello(id));
        self.say(id, ToCoordinator::Hello(hello));
        id
    }

    /// A worker joins, up to the point where it builds its replica.
    fn welcome(&mut self, threads: u32) -> PeerId {
        let id = self.introduce(|hello| Hello { threads, ..hello });
        assert!(matches!(self.hear(id), ToWorker::Welcome { job, .. } if *job == *JOB));
        id
    }

    /// Lets a worker join and build its replica.
    fn join(&mut self, threads: u32) -> PeerId {
        let id = self.welcome(threads);
        self.say(id, READY);
        id
    }

    /// Reads everything that a worker was sent, which must be leases.
    fn leases(&mut self, id: PeerId) -> Vec<Lease> {
        let wire = std::mem::take(self.wires.get_mut(&id).expect("an open connection"));
        wire.into_iter()
            .map(|message| match message {
                ToWorker::Lease { id, first_walk, walks } => {
                    let walks = first_walk..first_walk + walks;
                    assert!(walks.start.is_multiple_of(self.stream));
                    Lease { id, walks }
                }
                other => panic!("peer {id} was to hear of leases, not {other:?}"),
            })
            .collect()
    }

    fn send(&mut self, id: PeerId, result: LeaseResult) {
        let honest = self.out.iter().position(|(peer, lease)| {
            *peer == id
                && lease.id == result.lease
                && result == crate::toy::result(lease.id, lease.walks.clone())
        });
        if let Some(honest) = honest {
            self.take(honest);
        }
        self.say(id, ToCoordinator::Result(result));
    }

    fn finish(&mut self, id: PeerId, lease: &Lease) {
        self.send(id, result(lease.id, lease.walks.clone()));
    }

    fn cut(&mut self, id: PeerId) {
        let actions = self.coordinator.on_lost(id, "the connection was closed", self.now);
        self.act(actions);
    }

    fn stop(&mut self) {
        let actions = self.coordinator.stop(Ending::Interrupted, self.now);
        self.act(actions);
    }

    /// Lets time pass in ticks of at most a second; the peers in `alive` send heartbeats with progress.
    fn pass(&mut self, time: Duration, alive: &[PeerId]) {
        let until = self.now + time;
        while self.now < until && self.coordinator.ending().is_none() {
            self.now = until.min(self.now + SECOND);
            for &id in alive {
                self.say(id, ToCoordinator::Alive { progress: self.now.as_millis() as u64 });
            }
            let actions = self.coordinator.on_tick(self.now);
            self.act(actions);
        }
    }

    /// Lets workers do all they are given until the job ends.
    fn work_off(&mut self, workers: &[PeerId]) {
        let mut mine: BTreeMap<PeerId, VecDeque<Lease>> = BTreeMap::new();
        while self.coordinator.ending().is_none() {
            let before = self.done;
            for &id in workers {
                if self.coordinator.ending().is_none() {
                    let leases = self.leases(id);
                    let queue = mine.entry(id).or_default();
                    queue.extend(leases);
                    if let Some(lease) = queue.pop_front() {
                        self.finish(id, &lease);
                    }
                }
            }
            assert!(self.done > before, "no worker has anything to do");
        }
    }

    fn notice(&mut self) -> String {
        assert_eq!(self.notices.len(), 1, "{:?}", self.notices);
        self.notices.remove(0).to_string()
    }

    /// Checks that the job has ended for a reason, with a tally of `walks` walks, and that every worker was told so.
    #[track_caller]
    fn ends(&mut self, ending: Ending, walks: u64) {
        assert_eq!(self.coordinator.ending(), Some(ending));
        assert_eq!(self.coordinator.prefix(), &straight(0..walks));
        assert!(self.wires.is_empty(), "a connection is left open");
        let late = self.connect();
        assert_eq!(self.hear(late), ToWorker::Done);
        assert!(self.closed.contains_key(&late));
    }

    #[track_caller]
    fn goes_on(&self) {
        assert_eq!(self.coordinator.ending(), None);
    }
}

#[test]
fn one_worker_shoots_everything() {
    let mut stage = Stage::new(plan(1000, 64));
    let worker = stage.join(1);
    stage.work_off(&[worker]);
    stage.ends(Ending::BudgetSpent, 1000);
    let effort = stage.coordinator.effort();
    assert_eq!((effort.workers_seen, effort.workers_lost), (1, 0));
    assert_eq!(effort.streams_reissued, 0);
    assert_eq!(stage.notices, []);
}

#[test]
fn three_workers_of_several_threads_share_the_work() {
    let mut stage = Stage::new(plan(5000, 10));
    let workers = [stage.join(1), stage.join(3), stage.join(2)];
    assert_eq!(stage.coordinator.progress().workers, 3);
    assert_eq!(workers.map(|id| stage.wires[&id].len()), [2, 6, 4], "one under way and one waiting a thread");
    stage.work_off(&workers);
    stage.ends(Ending::BudgetSpent, 5000);
    assert_eq!(stage.coordinator.effort().workers_seen, 3);
}

#[test]
fn every_worker_gets_a_lease_when_there_is_little() {
    let mut stage = Stage::new(plan(3, 1));
    let first = stage.welcome(1);
    let second = stage.join(1);
    assert_eq!(stage.leases(second).len(), 2);
    stage.say(first, READY);
    assert_eq!(stage.leases(first).len(), 1);
}

#[test]
fn a_job_without_walks_is_done() {
    let mut stage = Stage::new(plan(0, 10));
    stage.ends(Ending::BudgetSpent, 0);
}

#[test]
fn foreigners_are_refused_with_the_reason() {
    let cases: [(&dyn Fn(Hello) -> Hello, &str); 3] = [
        (&|hello| Hello { protocol: PROTOCOL + 1, ..hello }, "protocol"),
        (
            &|hello| Hello { build: "0.0.9 \u{1b}[31m".into(), ..hello },
            "it is radwalk 0.0.9 [31m, this coordinator",
        ),
        (&|hello| Hello { threads: 0, ..hello }, "no threads"),
    ];
    let mut stage = Stage::new(plan(100, 10));
    for (change, words) in cases {
        let id = stage.introduce(change);
        let ToWorker::Refused { reason } = stage.hear(id) else { panic!("peer {id} was let in") };
        assert!(reason.contains(words), "{reason}");
        assert!(stage.closed[&id].is_empty(), "nothing follows");
        assert_eq!(stage.notice(), format!("refused worker worker {id}: {reason}"));
        // The refused worker goes on as if it had been let in.
        stage.say(id, READY);
    }
    assert_eq!(stage.coordinator.effort().workers_seen, 0);
}

#[test]
fn a_replica_that_differs_is_refused() {
    let mut stage = Stage::new(plan(100, 10));
    for (scene_hash, job_hash) in [([0; 32], JOB_HASH), (SCENE_HASH, [0; 32])] {
        let id = stage.welcome(1);
        stage.say(id, ToCoordinator::Ready { scene_hash, job_hash });
        assert!(matches!(stage.hear(id), ToWorker::Refused { reason } if reason.contains("replica")));
        assert!(stage.closed.contains_key(&id));
        assert!(stage.notice().contains("replica"));
    }
}

#[test]
fn who_speaks_out_of_turn_is_dropped() {
    let alive = ToCoordinator::Alive { progress: 1 };
    let unasked = ToCoordinator::Result(result(0, 0..10));
    let mut stage = Stage::new(plan(100, 10));
    for message in [alive, unasked.clone(), READY] {
        let stranger = stage.connect();
        stage.say(stranger, message);
        assert!(stage.closed.contains_key(&stranger));
        assert!(stage.notice().contains("sent an unexpected message"));
    }
    for message in [unasked, ToCoordinator::Hello(stage.hello(0))] {
        let builder = stage.welcome(1);
        stage.say(builder, message);
        assert!(stage.closed.contains_key(&builder));
        assert!(stage.notice().contains("sent an unexpected message"));
    }
    let worker = stage.join(1);
    stage.say(worker, READY);
    assert!(stage.closed.contains_key(&worker));
    assert_eq!(stage.coordinator.effort().workers_lost, 3, "strangers are no workers");
}

#[test]
fn a_stranger_that_fails_says_nothing_to_terminals() {
    let mut stage = Stage::new(plan(100, 10));
    let stranger = stage.connect();
    stage.say(stranger, ToCoordinator::Failed { reason: "\u{1b}]0;owned\u{7}".repeat(300) });
    let notice = stage.notice();
    assert!(notice.starts_with("a connection failed: gave up: ]0;owned]0;"), "{notice}");
    assert!(notice.len() < 500);
}

#[test]
fn a_flood_of_heartbeats_is_cut_off_but_not_those_of_a_long_sleep() {
    let mut stage = Stage::new(plan(100, 10));
    let (faulty, sound) = (stage.join(1), stage.join(1));
    // Either end was suspended for two hours.
    (0..7200).for_each(|progress| stage.say(sound, ToCoordinator::Alive { progress }));
    (0..10_000).for_each(|_| stage.say(faulty, ToCoordinator::Alive { progress: 1 }));
    assert!(stage.wires.contains_key(&faulty));
    stage.say(faulty, ToCoordinator::Alive { progress: 1 });
    assert!(stage.closed.contains_key(&faulty));
    assert!(stage.notice().contains("too often"));
    stage.pass(100 * SECOND, &[sound]);
    (0..9000).for_each(|progress| stage.say(sound, ToCoordinator::Alive { progress }));
    assert!(stage.wires.contains_key(&sound));
}

#[test]
fn a_result_counts_once() {
    let mut stage = Stage::new(plan(100, 10));
    let worker = stage.join(1);
    let lease = stage.leases(worker).remove(0);
    stage.finish(worker, &lease);
    assert_eq!(stage.coordinator.prefix(), &straight(0..10));
    stage.finish(worker, &lease);
    assert!(stage.closed.contains_key(&worker));
    assert!(stage.notice().contains("not asked for"));
    let other = stage.join(1);
    stage.work_off(&[other]);
    stage.ends(Ending::BudgetSpent, 100);
}

#[test]
fn a_result_of_anothers_lease_is_not_taken() {
    let mut stage = Stage::new(plan(100, 10));
    let (thief, worker) = (stage.join(1), stage.join(1));
    let lease = stage.leases(worker).remove(0);
    stage.say(thief, ToCoordinator::Result(result(lease.id, lease.walks.clone())));
    assert!(stage.closed.contains_key(&thief));
    stage.finish(worker, &lease);
    stage.goes_on();
    assert_eq!(stage.coordinator.progress().walks, 10);
}

#[test]
fn a_result_that_comes_after_its_sender_was_given_up_is_not_taken() {
    let mut stage = Stage::new(plan(100, 10));
    let lost = stage.join(1);
    let leases = stage.leases(lost);
    stage.cut(lost);
    stage.notice();
    stage.finish(lost, &leases[0]);
    assert_eq!(stage.coordinator.progress().walks, 0);
    let worker = stage.join(1);
    let again = stage.leases(worker);
    assert_eq!(again[0].walks, leases[0].walks);
    assert_ne!(again[0].id, leases[0].id, "a lease has its own number");
    // The old number is no lease of the new worker either.
    stage.send(worker, result(leases[1].id, leases[1].walks.clone()));
    assert!(stage.closed.contains_key(&worker));
    assert_eq!(stage.coordinator.effort().streams_reissued, 4);
}

#[test]
fn a_result_that_does_not_fit_is_not_taken_and_its_walks_go_to_others() {
    let cases: [fn(&mut LeaseResult); 7] = [
        |result| result.counts[0] -= 1,
        |result| result.counts[0] = u64::MAX.into(),
        // The result was changed on its way: the digest is still that of what was sent.
        |result| result.sums[0] ^= 1,
        |result| result.counts[1] += 1,
        |result| result.sums.push(0),
        |result| result.sums.clear(),
        // A count that exceeds 64 bits.
        |result| result.counts[1] = u128::MAX,
    ];
    let mut stage = Stage::new(plan(100, 10));
    let heir = stage.join(1);
    stage.leases(heir);
    for spoil in cases {
        let worker = stage.join(1);
        let lease = stage.leases(worker).remove(0);
        let mut result = result(lease.id, lease.walks);
        spoil(&mut result);
        stage.send(worker, result);
        assert!(stage.closed.contains_key(&worker));
        assert!(stage.notice().contains("does not fit"));
        assert_eq!(stage.coordinator.progress().walks, 0);
    }
    let out: Vec<_> = stage.out.iter().map(|(_, lease)| Lease { ..lease.clone() }).collect();
    out.iter().for_each(|lease| stage.finish(heir, lease));
    stage.work_off(&[heir]);
    stage.ends(Ending::BudgetSpent, 100);
}

#[test]
fn numbers_that_a_worker_invents_do_no_harm() {
    for invented in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0, f64::MIN_POSITIVE, f64::MAX] {
        let mut stage = Stage::new(plan(1000, 10));
        let worker = stage.join(1);
        let mut leases = VecDeque::new();
        while stage.coordinator.ending().is_none() {
            leases.extend(stage.leases(worker));
            let lease = leases.pop_front().unwrap();
            let at = stage.out.iter().position(|(_, out)| *out == lease).unwrap();
            stage.take(at);
            let result = result(lease.id, lease.walks);
            let result = LeaseResult { seconds: invented, cpu_seconds: invented, ..result };
            stage.say(worker, ToCoordinator::Result(result));
        }
        stage.ends(Ending::BudgetSpent, 1000);
        let cpu_seconds = stage.coordinator.effort().cpu_seconds;
        assert!(cpu_seconds >= 0.0 && cpu_seconds.is_finite(), "{cpu_seconds}");
    }
}

#[test]
fn a_worker_of_four_billion_threads_is_not_given_everything() {
    let mut stage = Stage::new(plan(1 << 40, 1));
    let boaster = stage.join(u32::MAX);
    assert!(stage.leases(boaster).len() <= 1 << 14);
}

#[test]
fn the_longest_possible_job_can_be_leased() {
    let mut stage = Stage::new(plan(u64::MAX, u64::MAX / 2));
    let worker = stage.join(2);
    let leases = stage.leases(worker);
    assert_eq!(leases.last().unwrap().walks.end, u64::MAX);
    assert!(leases.len() <= 3);
}

#[test]
fn silence_is_loss_and_the_leases_go_to_others() {
    let mut stage = Stage::new(plan(60, 10));
    let (silent, mute, worker) = (stage.join(1), stage.join(1), stage.join(1));
    let lost: Vec<Range<u64>> =
        [silent, mute].into_iter().flat_map(|id| stage.leases(id)).map(|lease| lease.walks).collect();
    stage.pass(SILENCE, &[worker]);
    assert_eq!(stage.notices, []);
    stage.pass(SECOND, &[worker]);
    let texts: Vec<String> = stage.notices.drain(..).map(|notice| notice.to_string()).collect();
    assert_eq!(texts.len(), 2);
    assert!(texts.iter().all(|texts| texts.contains("it went silent; its walks go to others")), "{texts:?}");
    stage.work_off(&[worker]);
    stage.ends(Ending::BudgetSpent, 60);
    let effort = stage.coordinator.effort();
    assert_eq!((effort.workers_seen, effort.workers_lost), (3, 2));
    // Neither of the two was given the other's leases on the way.
    assert_eq!(effort.streams_reissued, lost.len() as u64);
}

#[test]
fn a_worker_that_builds_for_long_is_waited_for_while_it_lives() {
    let mut stage = Stage::new(plan(60, 10));
    let worker = stage.welcome(1);
    stage.pass(10 * STALL, &[worker]);
    stage.say(worker, READY);
    stage.work_off(&[worker]);
    stage.ends(Ending::BudgetSpent, 60);
    let mut stage = Stage::new(plan(60, 10));
    stage.welcome(1);
    stage.pass(SILENCE + SECOND, &[]);
    assert!(stage.notice().contains("silent"));
}

#[test]
fn a_worker_without_progress_is_given_up() {
    let mut stage = Stage::new(plan(60, 10));
    let (stuck, idle) = (stage.join(2), stage.join(1));
    let leases = [stage.leases(stuck), stage.leases(idle)];
    leases[1].iter().for_each(|lease| stage.finish(idle, lease));
    for _ in 0..STALL.as_secs() {
        stage.say(stuck, ToCoordinator::Alive { progress: 3 });
        stage.say(idle, ToCoordinator::Alive { progress: 3 });
        stage.pass(SECOND, &[]);
        assert_eq!(stage.notices, []);
    }
    stage.say(stuck, ToCoordinator::Alive { progress: 3 });
    stage.say(idle, ToCoordinator::Alive { progress: 3 });
    stage.pass(SECOND, &[]);
    assert!(stage.notice().contains("no progress"));
    // A worker that had nothing to do has not stalled.
    stage.work_off(&[idle]);
    stage.ends(Ending::BudgetSpent, 60);
}

#[test]
fn a_coordinator_that_was_held_up_gives_up_no_worker() {
    let mut stage = Stage::new(plan(60, 10));
    let worker = stage.join(1);
    for _ in 0..5 {
        stage.now += 10 * STALL;
        let actions = stage.coordinator.on_tick(stage.now);
        stage.act(actions);
    }
    assert_eq!(stage.notices, []);
    stage.work_off(&[worker]);
    stage.ends(Ending::BudgetSpent, 60);
}

#[test]
fn a_long_message_on_its_way_is_neither_silence_nor_a_stall() {
    let mut stage = Stage::new(plan(60, 10));
    let (builder, worker) = (stage.welcome(1), stage.join(1));
    for _ in 0..5 * STALL.as_secs() {
        [builder, worker].into_iter().for_each(|id| stage.coordinator.on_stir(id));
        stage.pass(SECOND, &[]);
    }
    assert_eq!(stage.notices, []);
    stage.coordinator.on_stir(99);
    stage.pass(SILENCE + SECOND, &[worker]);
    assert!(stage.notice().contains("silent"));
}

#[test]
fn a_worker_that_fails_is_replaced_by_others() {
    let mut stage = Stage::new(plan(60, 10));
    let failing = stage.join(1);
    stage.say(failing, ToCoordinator::Failed { reason: "out of \u{1b}[1mmemory\n".into() });
    assert_eq!(stage.notice(), "lost worker worker 0: gave up: out of [1mmemory; its walks go to others");
    assert_eq!(stage.out, []);
    let worker = stage.join(1);
    stage.work_off(&[worker]);
    stage.ends(Ending::BudgetSpent, 60);
}

#[test]
fn the_cpu_time_of_lost_workers_is_remembered() {
    let mut stage = Stage::new(plan(30, 10));
    let first = stage.join(1);
    let lease = stage.leases(first).remove(0);
    stage.finish(first, &lease);
    stage.cut(first);
    let second = stage.join(1);
    stage.work_off(&[second]);
    // The first of the disconnections after the end.
    stage.cut(second);
    assert!((stage.coordinator.effort().cpu_seconds - 0.5).abs() < 1e-12);
}

#[test]
fn a_stop_without_gaps_ends_at_once() {
    let mut stage = Stage::new(plan(100, 10));
    let worker = stage.join(1);
    let lease = stage.leases(worker).remove(0);
    stage.finish(worker, &lease);
    stage.stop();
    stage.ends(Ending::Interrupted, 10);
    let mut stage = Stage::new(plan(100, 10));
    stage.stop();
    stage.ends(Ending::Interrupted, 0);
}

#[test]
fn a_stop_waits_for_the_leases_that_fill_gaps_and_for_no_other() {
    let mut stage = Stage::new(plan(100, 10));
    let workers = [stage.join(1), stage.join(1)];
    let [mine, theirs] = workers.map(|id| stage.leases(id));
    stage.finish(workers[1], &theirs[0]);
    stage.leases(workers[1]);
    stage.stop();
    stage.goes_on();
    assert!(mine[0].walks.start < theirs[0].walks.start);
    stage.pass(SECOND, &workers);
    stage.finish(workers[0], &mine[0]);
    if stage.coordinator.ending().is_none() {
        stage.finish(workers[0], &mine[1]);
    }
    let walks = stage.coordinator.prefix().counts.walks;
    assert!(walks >= theirs[0].walks.end);
    stage.ends(Ending::Interrupted, walks);
}

/// A stage after a stop, with walks 0..10 and 10..20 out at a first worker and 20..30 in.
fn stage_with_gap() -> (Stage, PeerId, PeerId, Vec<Lease>) {
    let mut stage = Stage::new(plan(100, 10));
    let (first, second) = (stage.join(1), stage.join(1));
    let (mine, theirs) = (stage.leases(first), stage.leases(second));
    assert_eq!((mine[1].walks.end, theirs[0].walks.start), (20, 20));
    stage.finish(second, &theirs[0]);
    let queued: Vec<Lease> = theirs.into_iter().skip(1).chain(stage.leases(second)).collect();
    stage.stop();
    stage.goes_on();
    (stage, first, second, queued)
}

#[test]
fn a_gap_that_is_lost_while_stopping_is_shot_by_others() {
    let (mut stage, first, second, queued) = stage_with_gap();
    stage.cut(first);
    stage.goes_on();
    assert_eq!(stage.leases(second), [], "it has its hands full");
    stage.finish(second, &queued[0]);
    let gap = stage.leases(second);
    assert_eq!(gap[0].walks, 0..10);
    stage.finish(second, &gap[0]);
    let rest = stage.leases(second);
    let done = rest.into_iter().chain(queued.into_iter().skip(1)).filter(|lease| lease.walks.start < 30);
    done.collect::<Vec<_>>().iter().for_each(|lease| stage.finish(second, lease));
    let walks = stage.coordinator.prefix().counts.walks;
    assert!(walks >= 30, "{walks}");
    stage.ends(Ending::Interrupted, walks);
}

#[test]
fn a_gap_that_no_worker_can_fill_is_not_waited_for() {
    let (mut stage, first, second, _) = stage_with_gap();
    stage.cut(second);
    stage.goes_on();
    stage.cut(first);
    stage.ends(Ending::Interrupted, 0);
}

#[test]
fn a_worker_that_joins_a_stop_is_given_the_gaps_alone() {
    let (mut stage, first, _, _) = stage_with_gap();
    let third = stage.welcome(4);
    stage.cut(first);
    stage.say(third, READY);
    let walks: Vec<Range<u64>> = stage.leases(third).into_iter().map(|lease| lease.walks).collect();
    assert_eq!(walks, [0..10, 10..20]);
}

#[test]
fn the_grace_of_a_stop_ends() {
    let (mut stage, first, second, _) = stage_with_gap();
    stage.pass(2 * SECOND, &[first, second]);
    stage.stop();
    stage.goes_on();
    stage.pass(2 * SECOND, &[first, second]);
    stage.ends(Ending::Interrupted, 0);
}

#[test]
fn the_wall_clock_ends_a_job() {
    let mut stage = Stage::new(JobPlan { wall: Some(5 * SECOND), ..plan(100, 10) });
    let worker = stage.join(1);
    let lease = stage.leases(worker).remove(0);
    stage.pass(4 * SECOND, &[worker]);
    stage.finish(worker, &lease);
    stage.goes_on();
    stage.pass(SECOND, &[worker]);
    stage.ends(Ending::WallClock, 10);
    let mut stage = Stage::new(JobPlan { wall: Some(Duration::ZERO), ..plan(100, 10) });
    stage.pass(SECOND, &[]);
    stage.ends(Ending::WallClock, 0);
}

#[test]
fn without_workers_the_job_ends_only_when_none_is_left() {
    let mut stage = Stage::new(plan(30, 10));
    let give_up = |stage: &mut Stage| {
        let actions = stage.coordinator.on_no_workers();
        stage.act(actions);
    };
    let (worker, builder) = (stage.join(1), stage.welcome(1));
    stage.connect();
    let lease = stage.leases(worker).remove(0);
    give_up(&mut stage);
    stage.goes_on();
    // The result that the worker had sent before it died arrives.
    stage.finish(worker, &lease);
    stage.cut(worker);
    give_up(&mut stage);
    stage.goes_on();
    stage.cut(builder);
    give_up(&mut stage);
    // A connection that was not let in is no worker.
    stage.ends(Ending::NoWorkers, 10);
}

/// Checks resuming at every point: after each result the coordinator dies, and another goes on from its books. No walk
/// is leased again (the stage checks that), every look is taken once, and the job ends as it would have without a
/// death.
#[test]
fn coordinators_that_go_on_from_the_books_of_others_come_to_the_same_end() {
    let job = || JobPlan {
        looks: vec![300, 600],
        judge: judge(|tally| tally.counts.walks >= 600),
        ..plan(1000, 100)
    };
    let mut past = Past::none(Tally::new(PATCHES, crate::toy::LAYOUT));
    for session in 0..100 {
        let mut stage = Stage::resuming(job(), past);
        if stage.coordinator.ending().is_some() {
            assert_eq!(stage.coordinator.ending(), Some(Ending::TargetReached));
            assert_eq!(stage.coordinator.prefix(), &straight(0..600));
            let looks: Vec<u64> = stage.coordinator.past().looks.iter().map(|look| look.walks).collect();
            assert_eq!(looks, [300, 600]);
            let past = stage.coordinator.past();
            assert_eq!(past.deliveries.walks(), 600);
            assert!(past.deliveries.is_sound(past.workers.len()));
            assert!(session > 3, "600 walks in leases of about 100");
            return;
        }
        let worker = stage.join(1);
        let lease = stage.leases(worker).remove(0);
        stage.finish(worker, &lease);
        past = stage.coordinator.past();
    }
    panic!("the job gets nowhere");
}

/// Claims of a worker that no walks can come to. Each result is digested as it is, as failing memory would leave it.
#[test]
fn a_result_that_cannot_be_is_refused_and_its_worker_named_and_banned() {
    let with_sum = |result: &mut LeaseResult, place: usize, change: fn(u128) -> u128| {
        let mut sums: Vec<u128> = unpack(&result.sums).map(Result::unwrap).collect();
        sums[place] = change(sums[place]);
        result.sums = pack(&sums);
    };
    let lies: [&dyn Fn(&mut LeaseResult); 8] = [
        &|result| result.counts[2] += 1,
        &|result| result.counts[2] -= 1,
        &|result| result.counts[1] = u64::MAX.into(),
        &|result| result.counts[7] = u128::MAX,
        &|result| with_sum(result, 0, |_| u128::MAX),
        &|result| with_sum(result, 1, |_| u128::MAX),
        &|result| with_sum(result, 2, |_| 1 << 90),
        &|result| with_sum(result, 3, |_| 0),
    ];
    let mut stage = Stage::new(plan(1000, 10));
    let honest = stage.join(1);
    for (n, lie) in lies.into_iter().enumerate() {
        let liar = stage.introduce(|hello| Hello { name: format!("liar {n}"), ..hello });
        stage.hear(liar);
        stage.say(liar, READY);
        // One honest result waits beyond the gap that the other worker leaves.
        let leases = stage.leases(liar);
        stage.finish(liar, &leases[0]);
        let walks = stage.coordinator.progress().walks;
        let mut result = result(leases[1].id, leases[1].walks.clone());
        lie(&mut result);
        stage.liars += 1;
        stage.say(liar, ToCoordinator::Result(crate::toy::sealed(result)));
        assert!(stage.closed.contains_key(&liar), "lie {n}");
        let text = stage.notice();
        assert!(text.contains(&format!("lost worker liar {n}: sent a result that does not fit")), "{text}");
        assert!(stage.coordinator.progress().walks < walks, "what waits is walked again");
        let again = stage.introduce(|hello| Hello { name: format!("liar {n}"), ..hello });
        assert!(
            matches!(stage.hear(again), ToWorker::Refused { reason } if reason.contains("impossible result"))
        );
        stage.notice();
    }
    stage.work_off(&[honest]);
    stage.ends(Ending::BudgetSpent, 1000);
    let workers = stage.coordinator.past().workers;
    assert_eq!(workers.iter().filter(|worker| worker.faults > 0).count(), 8);
}

#[test]
fn one_thread_that_is_stuck_does_not_hold_the_prefix() {
    // Three threads of one worker, and three workers of one thread.
    for threads in [vec![3], vec![1, 1, 1]] {
        let mut stage = Stage::new(plan(1_000_000, 10));
        stage.several_threads = threads[0] > 1;
        let workers: Vec<PeerId> = threads.into_iter().map(|threads| stage.join(threads)).collect();
        let mut todo: VecDeque<(PeerId, Lease)> = VecDeque::new();
        for &id in &workers {
            todo.extend(stage.leases(id).into_iter().map(|lease| (id, lease)));
        }
        let stuck = todo[0].1.clone();
        // Ten leases take a second; every worker reports progress.
        for _ in 0..30 {
            for _ in 0..10 {
                let Some(at) = todo.iter().position(|(_, lease)| lease.id != stuck.id) else { break };
                let (id, lease) = todo.remove(at).unwrap();
                if stage.out.iter().any(|(_, out)| out.id == lease.id) {
                    stage.finish(id, &lease);
                } else {
                    stage.say(id, ToCoordinator::Result(result(lease.id, lease.walks)));
                }
                assert!(stage.notices.is_empty(), "{:?}", stage.notices);
                for &id in &workers {
                    todo.extend(stage.leases(id).into_iter().map(|lease| (id, lease)));
                }
            }
            stage.pass(SECOND, &workers);
            for &id in &workers {
                todo.extend(stage.leases(id).into_iter().map(|lease| (id, lease)));
            }
        }
        let (prefix, all) = (stage.coordinator.prefix().counts.walks, stage.coordinator.progress().walks);
        assert!(prefix > stuck.walks.end && 10 * prefix > 9 * all, "{prefix} of {all} walks");
        assert!(stage.again >= 1, "it was given once more");
    }
}

#[test]
fn a_job_that_stands_still_says_so_every_minute() {
    let mut stage = Stage::new(plan(100, 10));
    stage.pass(SECOND * 59, &[]);
    assert!(stage.quiet.is_empty());
    stage.pass(SECOND * 2, &[]);
    assert_eq!(stage.quiet, ["no result has come in for 60 s: no worker is there"]);
    // A worker that reports progress and delivers nothing is not given up, but the owner is told.
    let worker = stage.join(1);
    stage.pass(SECOND * 60, &[worker]);
    assert_eq!(
        stage.quiet[1..],
        [
            "no result has come in for 120 s: 1 workers hold 2 leases, and keep 0 results that wait for those before them"
        ]
    );
    stage.goes_on();
}

/// A fault of the program, whatever its cause: a worker is there, walks are left, and the worker is given none.
#[test]
fn the_watchdog_ends_a_job_in_which_nothing_can_move() {
    let mut stage = Stage::new(JobPlan { leases_per_thread: 0, ..plan(100, 10) });
    let worker = stage.join(1);
    let alive = |stage: &mut Stage, seconds: u32| {
        for _ in 0..seconds {
            if stage.wires.contains_key(&worker) {
                stage.say(worker, ToCoordinator::Alive { progress: 0 });
            }
            stage.pass(SECOND, &[]);
        }
    };
    alive(&mut stage, 179);
    stage.goes_on();
    assert_eq!(stage.quiet.len(), 2, "at 60 and 120 s");
    alive(&mut stage, 2);
    stage.ends(Ending::Stuck, 0);
}

#[test]
fn a_relay_that_waits_for_workers_is_waited_for() {
    let mut stage = Stage::new(plan(100, 10));
    let relay = stage.introduce(|hello| Hello { relays: true, threads: 0, ..hello });
    stage.hear(relay);
    stage.say(relay, READY);
    for _ in 0..600 {
        stage.say(relay, ToCoordinator::Alive { progress: 0 });
        stage.pass(SECOND, &[]);
    }
    stage.goes_on();
    assert_eq!(stage.quiet.len(), 10);
    assert!(stage.quiet.iter().all(|why| why.ends_with("all relays wait for workers")), "{:?}", stage.quiet);
}

#[test]
fn a_claim_of_many_threads_or_of_long_leases_is_believed_as_far_as_results_bear_it_out() {
    let mut stage = Stage::new(plan(1 << 40, 1));
    let boaster = stage.join(4096);
    let first = stage.leases(boaster);
    assert_eq!(first.len(), 2 * 64);
    first.iter().for_each(|lease| stage.finish(boaster, lease));
    assert!(stage.out.len() > 2000, "it has shown that it works: {}", stage.out.len());
    let relay = stage.introduce(|hello| Hello { relays: true, threads: 0, ..hello });
    stage.hear(relay);
    stage.say(relay, READY);
    stage.say(relay, ToCoordinator::Capacity { threads: u32::MAX, lease_seconds: 1e300 });
    let walks: u64 = stage.leases(relay).iter().map(|lease| lease.walks.end - lease.walks.start).sum();
    assert!(walks <= 4 * 4 * 64, "{walks} walks for a relay that has brought nothing yet");
}

#[test]
fn a_relay_that_only_gives_back_is_dropped() {
    let mut stage = Stage::new(plan(1 << 40, 1));
    let relay = stage.introduce(|hello| Hello { relays: true, threads: 0, ..hello });
    stage.hear(relay);
    stage.say(relay, READY);
    stage.say(relay, ToCoordinator::Capacity { threads: 1, lease_seconds: 1.0 });
    for _ in 0..2000 {
        let Some(lease) =
            stage.wires.contains_key(&relay).then(|| stage.leases(relay)).and_then(|mut all| all.pop())
        else {
            break;
        };
        stage.out.retain(|(_, out)| out.id != lease.id);
        stage.say(relay, ToCoordinator::Return { lease: lease.id });
    }
    assert!(stage.closed.contains_key(&relay));
    assert!(stage.notice().contains("too often"));
}

#[test]
fn what_a_lying_relay_brought_is_walked_again_with_all_that_is_behind_it() {
    let mut stage = Stage::new(plan(10_000, 10));
    let honest = stage.join(1);
    let relay = stage.introduce(|hello| Hello { relays: true, threads: 0, name: "relay".into(), ..hello });
    stage.hear(relay);
    stage.say(relay, READY);
    stage.say(relay, ToCoordinator::Capacity { threads: 1, lease_seconds: 0.0 });
    let leases = stage.leases(relay);
    let result = |lease: &Lease| {
        let result = result(lease.id, lease.walks.clone());
        let part = Delivery::lease(lease.walks.end - lease.walks.start, 0, result.digest);
        let provenance = LeaseProvenance { names: vec!["w".into()], parts: vec![part] };
        LeaseResult { provenance, ..result }
    };
    stage.out.retain(|(id, _)| *id != relay);
    let first = result(&leases[0]);
    stage.say(relay, ToCoordinator::Result(first));
    let waits = stage.coordinator.progress().walks;
    assert!(waits > 0 && stage.coordinator.prefix().counts.walks == 0, "it waits for the honest worker's");
    let mut second = result(&leases[1]);
    second.provenance.parts[0].digest ^= 1;
    stage.say(relay, ToCoordinator::Result(second));
    assert_eq!(stage.coordinator.progress().walks, 0);
    assert!(stage.closed.contains_key(&relay));
    assert!(stage.notice().contains("the digests of its parts"));
    for lease in stage.leases(honest) {
        stage.finish(honest, &lease);
    }
    assert!(stage.coordinator.prefix().counts.walks > 0);
}

/// Shoots streams 0..10 of 100 walks by ten workers, whose results arrive in the given order, with a target that is met
/// at `target` walks and looks at 300, 600, 900. Returns the looks, the ending and the tally.
fn looks_in_order(order: &[usize], target: u64) -> (Vec<u64>, Ending, Tally) {
    let (judged, looked) = std::sync::mpsc::channel();
    let met = move |tally: &Tally| {
        judged.send(tally.counts.walks).unwrap();
        tally.counts.walks >= target
    };
    let looks = vec![300, 600, 900];
    let mut stage = Stage::new(JobPlan { looks, judge: judge(met), ..plan(1000, 100) });
    // Workers hold two leases each; five workers have all ten streams.
    let workers: Vec<PeerId> = (0..5).map(|_| stage.join(1)).collect();
    let mut leases: Vec<(PeerId, Lease)> =
        workers.iter().flat_map(|&id| stage.leases(id).into_iter().map(move |lease| (id, lease))).collect();
    leases.sort_by_key(|(_, lease)| lease.walks.start);
    assert_eq!(leases.len(), 10);
    for &stream in order {
        let (id, lease) = &leases[stream];
        stage.finish(*id, lease);
    }
    let ending = stage.coordinator.ending().unwrap();
    let prefix = stage.coordinator.prefix().clone();
    stage.ends(ending, prefix.counts.walks);
    (looked.try_iter().collect(), ending, prefix)
}

#[test]
fn the_target_is_reached_at_the_same_walk_whatever_the_order_of_arrival() {
    for (target, looks, ending, walks) in [
        (1, vec![300], Ending::TargetReached, 300),
        (301, vec![300, 600], Ending::TargetReached, 600),
        (900, vec![300, 600, 900], Ending::TargetReached, 900),
        (901, vec![300, 600, 900], Ending::BudgetSpent, 1000),
    ] {
        let forward: Vec<usize> = (0..10).collect();
        for shuffle in 0..200 {
            let mut order = forward.clone();
            match shuffle {
                0 => {}
                1 => order.reverse(),
                _ => order.sort_by_key(|&stream| hash(100 * shuffle + stream as u64)),
            }
            let (looked, ended, prefix) = looks_in_order(&order, target);
            assert_eq!((looked, ended), (looks.clone(), ending), "{order:?}");
            assert_eq!(prefix, straight(0..walks));
        }
    }
}

/// How a simulated worker behaves.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Mood {
    Honest,
    /// The worker sends nothing any more.
    Silent,
    /// The worker sends heartbeats but does nothing.
    Stuck,
}

struct Actor {
    id: PeerId,
    mood: Mood,
    building: bool,
    todo: Vec<Lease>,
    done: Vec<Lease>,
    progress: u64,
}

struct Simulation {
    stage: Stage,
    dice: Dice,
    actors: Vec<Actor>,
    /// The leases of workers that are gone, whose results may still arrive.
    ghosts: Vec<(PeerId, Lease)>,
    faults: u64,
}

/// The number of faults in a simulation, after which everything goes well.
const FAULTS: u64 = 1000;

impl Simulation {
    /// Reads what the coordinator has sent, and notes the workers that were dropped.
    fn deliver(&mut self) {
        let Simulation { stage, actors, ghosts, .. } = self;
        actors.retain_mut(|actor| {
            if stage.wires.contains_key(&actor.id) {
                actor.todo.extend(stage.leases(actor.id));
                return true;
            }
            ghosts.extend(actor.todo.drain(..).map(|lease| (actor.id, lease)));
            false
        });
    }

    fn join(&mut self) {
        let threads = 1 + self.dice.below(3) as u32;
        let id = self.stage.welcome(threads);
        self.actors.push(Actor {
            id,
            mood: Mood::Honest,
            building: true,
            todo: vec![],
            done: vec![],
            progress: 0,
        });
    }

    /// Lets something go well: a heartbeat, a replica, a result, a new worker.
    fn work(&mut self) {
        if self.actors.iter().filter(|actor| actor.mood == Mood::Honest).count() < 4 {
            return self.join();
        }
        let at = self.dice.below(self.actors.len() as u64) as usize;
        let actor = &mut self.actors[at];
        if actor.mood != Mood::Honest {
            return;
        }
        if std::mem::take(&mut actor.building) {
            self.stage.say(actor.id, READY);
        } else if !actor.todo.is_empty() {
            // The threads of a worker finish in any order.
            let lease = actor.todo.swap_remove(self.dice.below(actor.todo.len() as u64) as usize);
            let seconds = [0.0, 0.01, 1.0, f64::NAN][self.dice.below(4) as usize];
            let honest = result(lease.id, lease.walks.clone());
            let out = self.stage.out.iter().position(|(_, out)| *out == lease).expect("a lease that is out");
            self.stage.take(out);
            self.stage.say(actor.id, ToCoordinator::Result(LeaseResult { seconds, ..honest }));
            actor.done.push(lease);
        }
    }

    /// Lets something go wrong.
    fn fail(&mut self) {
        self.faults += 1;
        let kind = self.dice.below(10);
        if kind == 0 {
            // A stranger connects, sends something or nothing, and stays until it is dropped.
            let stranger = self.stage.connect();
            match self.dice.below(4) {
                0 => self.stage.say(stranger, READY),
                1 => self.stage.say(stranger, ToCoordinator::Result(result(0, 0..10))),
                2 => self.stage.cut(stranger),
                _ => {}
            }
            return;
        }
        if kind == 1 {
            // The result of a worker that is gone arrives.
            if let Some((id, lease)) = self.dice.pick(&self.ghosts).cloned() {
                self.stage.say(id, ToCoordinator::Result(result(lease.id, lease.walks)));
            }
            return;
        }
        if self.actors.is_empty() {
            return;
        }
        let at = self.dice.below(self.actors.len() as u64) as usize;
        let actor = &mut self.actors[at];
        let id = actor.id;
        match kind {
            2 | 3 => self.stage.cut(id),
            4 => actor.mood = Mood::Silent,
            5 => actor.mood = Mood::Stuck,
            6 => self.stage.say(id, ToCoordinator::Failed { reason: "bad luck".into() }),
            // A result is sent twice.
            7 => {
                if let Some(lease) = self.dice.pick(&actor.done).cloned() {
                    self.stage.say(id, ToCoordinator::Result(result(lease.id, lease.walks)));
                }
            }
            // The worker sends the result of another worker's lease.
            8 => {
                if let Some((_, lease)) = self.dice.pick(&self.stage.out).cloned().filter(|(of, _)| *of != id)
                {
                    self.stage.say(id, ToCoordinator::Result(result(lease.id, lease.walks)));
                }
            }
            // The worker sends something else than it was asked for.
            _ => {
                if let Some(lease) = actor.todo.pop() {
                    let mut result = result(lease.id, lease.walks);
                    match self.dice.below(3) {
                        0 => result.counts[0] += 1,
                        1 => result.sums.truncate(PATCHES),
                        _ => result.counts[1] = 1 << 64,
                    }
                    self.stage.liars += 1;
                    self.stage.say(id, ToCoordinator::Result(result));
                }
            }
        }
    }

    /// Lets time pass, with heartbeats of the workers.
    fn pass(&mut self) {
        for actor in &mut self.actors {
            actor.progress += u64::from(actor.mood == Mood::Honest);
            if actor.mood != Mood::Silent {
                self.stage.say(actor.id, ToCoordinator::Alive { progress: actor.progress });
            }
        }
        // Now and then the coordinator itself is held up.
        let millis = if self.dice.one_in(50) { 100_000 } else { self.dice.below(1000) };
        self.stage.now += Duration::from_millis(millis);
        let actions = self.stage.coordinator.on_tick(self.stage.now);
        self.stage.act(actions);
    }

    /// Plays until the job ends; a stop is asked for after `stop_after` steps.
    fn play(mut self, stop_after: Option<u64>) -> Self {
        for step in 0.. {
            assert!(step < 200_000, "the job does not end");
            // Carry out what the last event brought about before the next one.
            if self.stage.coordinator.ending().is_some() {
                return self;
            }
            self.deliver();
            match self.dice.below(8) {
                0 | 1 if self.faults < FAULTS => self.fail(),
                0..=2 => self.pass(),
                _ => self.work(),
            }
            if stop_after == Some(step) {
                self.stage.stop();
            }
        }
        unreachable!("the assertion above")
    }
}

#[test]
fn no_sequence_of_faults_changes_the_tally_or_hangs_the_job() {
    let (mut faults, mut reissued, mut lost, mut again) = (0, 0, 0, 0);
    for seed in 0..600 {
        let mut dice = Dice(seed << 32);
        let stream = 1 + dice.below(40);
        let paths = stream * 1000 + dice.below(stream);
        let mut plan = plan(paths, stream);
        let (mut ending, mut walks) = (Ending::BudgetSpent, paths);
        if dice.one_in(3) {
            // Looks lie on boundaries of streams or between them.
            let target = 1 + dice.below(paths);
            plan.looks = (1..10).map(|k| k * paths / 10).filter(|&look| look > 0).collect();
            plan.looks.dedup();
            if let Some(&look) = plan.looks.iter().find(|&&look| look >= target) {
                (ending, walks) = (Ending::TargetReached, look);
            }
            plan.judge = judge(move |tally| tally.counts.walks >= target);
        }
        let stop_after = dice.one_in(3).then(|| dice.below(6000));
        let mut stage = Stage::new(plan);
        // Leases begin at looks, too.
        stage.stream = 1;
        stage.several_threads = true;
        let simulation = Simulation { stage, dice, actors: vec![], ghosts: vec![], faults: 0 };
        let Simulation { mut stage, faults: more, .. } = simulation.play(stop_after);
        if stage.coordinator.ending() == Some(Ending::Interrupted) {
            assert!(stop_after.is_some());
            walks = stage.coordinator.prefix().counts.walks;
            ending = Ending::Interrupted;
        }
        let effort = stage.coordinator.effort();
        (faults, reissued, lost) =
            (faults + more, reissued + effort.streams_reissued, lost + effort.workers_lost);
        again += stage.again;
        stage.ends(ending, walks);
    }
    // The simulation must have covered such cases.
    assert!(again > 300, "{again}");
    assert!(faults > 60_000 && lost > 30_000 && reissued > 90_000, "{faults} {lost} {reissued}");
}
