//! Tests of relays without sockets: a coordinator, relays and workers as state machines, with any faults and any order
//! of messages.

use std::collections::{BTreeMap, HashSet, VecDeque};
use std::ops::Range;
use std::time::Duration;

use crate::toy::{
    BUILD, JOB, JOB_HASH, LAYOUT, LIMITS, PATCHES, READY, SCENE_HASH, coordinator, hash, hello, plan,
    straight,
};
use protocol::digest::Digester;
use protocol::message::{Hello, LeaseResult, ToCoordinator, ToWorker};
use protocol::{
    Action, Coordinator, Deliveries, Ending, JobPlan, Lead, Past, PeerId, Relay, RelayEnd, Terms,
};

const TICK: Duration = Duration::from_millis(50);

fn terms(stream_walks: u64, leases_per_thread: usize) -> Terms {
    Terms {
        job: JOB.into(),
        scene_hash: SCENE_HASH,
        job_hash: JOB_HASH,
        build: BUILD.into(),
        stream_walks,
        leases_per_thread,
        patches: PATCHES,
        layout: LAYOUT,
        limits: LIMITS,
    }
}

/// The leases that a worker was given and has not walked.
type Todo = VecDeque<(u64, Range<u64>)>;

struct Node {
    relay: Relay,
    /// The relay's number at the coordinator.
    id: PeerId,
    /// The messages that the relay was sent and has not read.
    orders: VecDeque<ToWorker>,
    /// The messages that the relay has sent and that have not arrived.
    said: VecDeque<ToCoordinator>,
}

/// All leaders and workers. The coordinator is leader 0; relays, those that are gone included, are leaders 1 ….
struct World {
    coordinator: Coordinator,
    relays: Vec<Option<Node>>,
    /// The workers, by their leader and their number there.
    workers: BTreeMap<(usize, PeerId), Todo>,
    next: PeerId,
    now: Duration,
    stream: u64,
    leases_per_thread: usize,
    sent_home: usize,
    /// The walks that were done, and the name that the coordinator should give to each one's worker.
    walked: Vec<(Range<u64>, String)>,
    /// The results that reached the coordinator, and the most parts of one.
    results: usize,
    most_parts: usize,
}

impl World {
    fn new(plan: JobPlan) -> Self {
        let (stream, leases_per_thread) = (plan.stream_paths, plan.leases_per_thread);
        let (relays, workers) = (vec![], BTreeMap::new());
        let coordinator = coordinator(plan);
        World {
            coordinator,
            relays,
            workers,
            next: 0,
            now: Duration::ZERO,
            stream,
            leases_per_thread,
            sent_home: 0,
            walked: vec![],
            results: 0,
            most_parts: 0,
        }
    }

    fn lead(&mut self, leader: usize) -> Option<&mut dyn Lead> {
        match leader {
            0 => Some(&mut self.coordinator),
            _ => self.relays[leader - 1].as_mut().map(|node| &mut node.relay as &mut dyn Lead),
        }
    }

    fn act(&mut self, leader: usize, actions: Vec<Action>) {
        for action in actions {
            let (id, message) = match action {
                Action::Send(id, message) => (id, message),
                Action::Close(id) => {
                    self.close(leader, id);
                    continue;
                }
                Action::Tell(_) => continue,
            };
            if let Some(todo) = self.workers.get_mut(&(leader, id)) {
                match message {
                    ToWorker::Lease { id, first_walk, walks } => {
                        todo.push_back((id, first_walk..first_walk + walks));
                    }
                    ToWorker::Done => self.sent_home += 1,
                    _ => {}
                }
            } else if let Some(node) = self.relays.iter_mut().flatten().find(|node| node.id == id) {
                node.orders.push_back(message);
            }
        }
    }

    /// Carries out a leader's order to close a connection.
    fn close(&mut self, leader: usize, id: PeerId) {
        self.workers.remove(&(leader, id));
        if leader == 0
            && let Some(at) = self.relays.iter().position(|node| node.as_ref().is_some_and(|n| n.id == id))
        {
            // The relay reads what it was sent before.
            while self.relays[at].as_ref().is_some_and(|node| !node.orders.is_empty()) {
                self.order(at);
            }
            self.vanish(at);
        }
    }

    /// Lets a relay vanish, and its workers with it.
    fn vanish(&mut self, at: usize) {
        if let Some(node) = self.relays[at].take() {
            assert!(self.coordinator.ending().is_none() || node.relay.end() == Some(RelayEnd::Dismissed));
        }
        self.workers.retain(|&(leader, _), _| leader != at + 1);
    }

    fn say(&mut self, leader: usize, id: PeerId, message: ToCoordinator) {
        let now = self.now;
        if let (0, ToCoordinator::Result(result)) = (leader, &message) {
            self.results += 1;
            self.most_parts = self.most_parts.max(result.provenance.parts.len());
        }
        if let Some(lead) = self.lead(leader) {
            let actions = lead.on_message(id, message, now);
            self.act(leader, actions);
        }
    }

    fn greet(&mut self, leader: usize, hello: Hello) -> PeerId {
        let id = self.next;
        let actions = self.lead(leader).expect("a leader").on_connect(id);
        self.act(leader, actions);
        self.say(leader, id, ToCoordinator::Hello(hello));
        self.say(leader, id, READY);
        id
    }

    fn join(&mut self, leader: usize) -> PeerId {
        self.next += 1;
        self.workers.insert((leader, self.next), Todo::new());
        self.greet(leader, hello(&format!("worker {}", self.next), 1))
    }

    fn add_relay(&mut self) -> usize {
        self.next += 1;
        let relay = Relay::new(terms(self.stream, self.leases_per_thread), self.next);
        let (orders, said) = (VecDeque::new(), VecDeque::new());
        self.relays.push(Some(Node { relay, id: self.next, orders, said }));
        self.greet(0, Hello { relays: true, ..hello("relay", 0) });
        self.relays.len()
    }

    /// Lets a worker finish its first lease, within a number of `seconds`.
    fn work(&mut self, leader: usize, id: PeerId, seconds: f64) {
        let next = self.workers.get_mut(&(leader, id)).and_then(VecDeque::pop_front);
        let Some((lease, walks)) = next else { return };
        let name = if leader == 0 { format!("worker {id}") } else { format!("relay > worker {id}") };
        self.walked.push((walks.clone(), name));
        self.say(
            leader,
            id,
            ToCoordinator::Result(LeaseResult { seconds, ..crate::toy::result(lease, walks) }),
        );
    }

    /// Lets a worker finish its first lease at 1,000 walks per second.
    fn work_fast(&mut self, leader: usize, id: PeerId) {
        if let Some((_, walks)) = self.workers.get(&(leader, id)).and_then(VecDeque::front) {
            let seconds = 1e-3 * (walks.end - walks.start) as f64;
            self.work(leader, id, seconds);
        }
    }

    /// Lets a relay read its next message.
    fn order(&mut self, at: usize) {
        let now = self.now;
        let Some(node) = &mut self.relays[at] else { return };
        let actions = match node.orders.pop_front() {
            Some(ToWorker::Lease { id, first_walk, walks }) => {
                node.relay.on_lease(id, first_walk, walks, now)
            }
            Some(ToWorker::Done) => node.relay.finish(RelayEnd::Dismissed),
            _ => vec![],
        };
        self.act(at + 1, actions);
    }

    /// Lets the next message of a relay arrive.
    fn pass_on(&mut self, at: usize) -> bool {
        let Some(node) = &mut self.relays[at] else { return false };
        node.said.extend(node.relay.take_outbox());
        let (id, said) = (node.id, node.said.pop_front());
        let Some(said) = said else { return false };
        self.say(0, id, said);
        true
    }

    /// Lets time pass; all workers and relays send heartbeats.
    fn pass(&mut self, time: Duration) {
        let until = self.now + time;
        while self.now < until {
            self.now += TICK;
            let progress = self.now.as_millis() as u64;
            let workers: Vec<_> = self.workers.keys().copied().collect();
            for (leader, id) in workers {
                self.say(leader, id, ToCoordinator::Alive { progress });
            }
            let relays: Vec<_> =
                self.relays.iter().flatten().map(|node| (node.id, node.relay.progress())).collect();
            for (id, progress) in relays {
                self.say(0, id, ToCoordinator::Alive { progress });
            }
            let now = self.now;
            for leader in 0..=self.relays.len() {
                if let Some(lead) = self.lead(leader) {
                    let actions = lead.on_tick(now);
                    self.act(leader, actions);
                }
            }
        }
    }

    /// Lets all messages arrive.
    fn settle(&mut self) {
        for _ in 0..10 {
            for at in 0..self.relays.len() {
                while self.pass_on(at) {}
                (0..10).for_each(|_| self.order(at));
            }
        }
    }

    /// Lets all workers walk until the job ends.
    fn work_off(&mut self) {
        for _ in 0..10_000 {
            let workers: Vec<_> = self.workers.keys().copied().collect();
            workers.into_iter().for_each(|(leader, id)| self.work_fast(leader, id));
            self.pass(TICK);
            self.settle();
            if self.coordinator.ending().is_some() {
                return;
            }
        }
        panic!("the job does not end");
    }

    /// Lets time pass until the job ends, while each worker shoots `walks` walks every `ticks` ticks.
    fn walk_all(&mut self, walks: u64, ticks: u32) {
        let mut done: BTreeMap<(usize, PeerId), u64> = BTreeMap::new();
        while self.coordinator.ending().is_none() {
            assert!(self.now < Duration::from_secs(3600), "the job does not end");
            let workers: Vec<_> = self.workers.keys().copied().collect();
            for (leader, id) in workers {
                let done = done.entry((leader, id)).or_default();
                *done += walks;
                while let Some((_, next)) = self.workers.get(&(leader, id)).and_then(VecDeque::front) {
                    let effort = (next.end - next.start) * u64::from(ticks);
                    if *done < effort {
                        break;
                    }
                    *done -= effort;
                    self.work(leader, id, effort as f64 / walks as f64 * TICK.as_secs_f64());
                }
                if self.workers.get(&(leader, id)).is_some_and(VecDeque::is_empty) {
                    *done = 0;
                }
            }
            self.pass(TICK);
            self.settle();
        }
    }

    /// The number of walks in each lease of a relay.
    fn held(&self, at: usize) -> Vec<u64> {
        let orders = &self.relays[at].as_ref().unwrap().orders;
        let walks = orders.iter().filter_map(|order| match order {
            ToWorker::Lease { walks, .. } => Some(*walks),
            _ => None,
        });
        walks.collect()
    }

    #[track_caller]
    fn ends(&self, ending: Ending) {
        assert_eq!(self.coordinator.ending(), Some(ending));
        let walks = self.coordinator.prefix().counts.walks;
        assert_eq!(self.coordinator.prefix(), &straight(0..walks));
        self.is_accounted_for();
    }

    /// Checks the book: every entry has the digest of its walks, and every single lease its worker, also behind relays.
    fn is_accounted_for(&self) {
        let Past { deliveries, workers, .. } = self.coordinator.past();
        let digester = Digester::new(&SCENE_HASH);
        let by: HashSet<_> =
            self.walked.iter().map(|(walks, name)| (walks.start, walks.end, &name[..])).collect();
        let mut next = 0;
        for entry in deliveries.entries() {
            let walks = next..next + entry.walks;
            next = walks.end;
            assert_eq!(entry.digest, digester.digest(&straight(walks.clone())), "{walks:?}");
            if entry.spared {
                let name = &workers[entry.worker as usize].name[..];
                assert!(by.contains(&(walks.start, walks.end, name)), "{walks:?} are not by {name}");
            }
        }
        assert_eq!(next, self.coordinator.prefix().counts.walks);
    }
}

#[test]
fn relays_and_workers_side_by_side_come_to_the_same_tally() {
    let mut world = World::new(JobPlan { looks: vec![123_456], first: 0, ..plan(1_000_000, 100) });
    for _ in 0..2 {
        let relay = world.add_relay();
        (0..2).for_each(|_| _ = world.join(relay));
    }
    world.join(0);
    world.work_off();
    world.ends(Ending::BudgetSpent);
    assert_eq!(world.coordinator.prefix().counts.walks, 1_000_000);
    assert_eq!(world.sent_home, 5);
    let effort = world.coordinator.effort();
    assert_eq!((effort.workers_seen, effort.workers_lost, effort.streams_reissued), (3, 0, 0));
    // Each of five workers reports 0.25 s.
    assert_eq!(effort.cpu_seconds, 1.25);
}

#[test]
fn a_relay_is_leased_nothing_before_it_has_workers_and_then_more_for_more_of_them() {
    let mut world = World::new(plan(1 << 40, 100));
    let relay = world.add_relay();
    world.pass(Duration::from_secs(1));
    world.settle();
    assert_eq!(world.held(0), [0; 0]);
    (0..10).for_each(|_| _ = world.join(relay));
    world.pass(TICK);
    while world.pass_on(0) {}
    assert_eq!(
        world.held(0),
        [1000, 1000],
        "one under way and one waiting, a stream for each of its threads"
    );
    world.settle();
    // The relay's leases take longer than those of its workers, a quarter of a second, so it brings fewer results.
    let mut longest = 0;
    for _ in 0..50 {
        let workers: Vec<_> = world.workers.keys().copied().collect();
        workers.into_iter().for_each(|(leader, id)| world.work_fast(leader, id));
        world.pass(TICK);
        while world.pass_on(0) {}
        longest = world.held(0).into_iter().fold(longest, u64::max);
        world.settle();
    }
    // The lease is 1,000 walks a second for each worker, times four times 0.25 s, and the time to take results.
    assert!((10_000..11_000).contains(&longest), "{longest}");
}

#[test]
fn a_relay_that_loses_its_workers_gives_its_leases_back() {
    let mut world = World::new(plan(10_000, 100));
    let relay = world.add_relay();
    let worker = world.join(relay);
    world.pass(TICK);
    world.settle();
    world.work_fast(relay, worker);
    world.pass(TICK);
    world.settle();
    let before = world.coordinator.effort().streams_reissued;
    let now = world.now;
    let actions = world.lead(relay).unwrap().on_lost(worker, "gone", now);
    world.act(relay, actions);
    world.workers.remove(&(relay, worker));
    world.pass(TICK);
    world.settle();
    assert!(world.coordinator.effort().streams_reissued > before);
    assert_eq!(world.coordinator.effort().workers_lost, 0, "the relay stays");
    world.join(0);
    world.work_off();
    world.ends(Ending::BudgetSpent);
    assert_eq!(world.coordinator.prefix().counts.walks, 10_000);
}

/// A worker of a relay that is a relay itself may send the result of a lease after the relay has given all leases back and taken new
/// ones: the number of a lease that is over stands for no other walks.
#[test]
fn a_relay_never_uses_the_number_of_a_lease_twice() {
    let mut world = World::new(plan(10_000, 100));
    let relay = world.add_relay();
    let mut seen = HashSet::new();
    for _ in 0..3 {
        let worker = world.join(relay);
        world.pass(TICK);
        world.settle();
        let todo = world.workers.remove(&(relay, worker)).unwrap();
        assert!(
            !todo.is_empty() && todo.iter().all(|(lease, _)| seen.insert(*lease)),
            "{todo:?}, before: {seen:?}"
        );
        let now = world.now;
        let actions = world.lead(relay).unwrap().on_lost(worker, "gone", now);
        world.act(relay, actions);
        world.settle();
    }
    world.join(0);
    world.work_off();
    world.ends(Ending::BudgetSpent);
}

#[test]
fn a_worker_that_lives_and_never_delivers_does_not_hold_its_relay() {
    let mut world = World::new(plan(10_000, 100));
    let relay = world.add_relay();
    let [_idle, diligent] = [(); 2].map(|()| world.join(relay));
    for _ in 0..10_000 {
        world.work_fast(relay, diligent);
        world.pass(TICK);
        world.settle();
    }
    world.ends(Ending::BudgetSpent);
    assert_eq!(world.coordinator.prefix().counts.walks, 10_000);
    let effort = world.coordinator.effort();
    assert_eq!((effort.workers_lost, effort.streams_reissued), (0, 0), "its relay sees to it");
}

#[test]
fn a_lease_that_meets_a_relay_without_workers_comes_back() {
    let mut relay = Relay::new(terms(10, 2), 1);
    assert!(relay.on_lease(7, 0, 10, Duration::ZERO).is_empty());
    assert_eq!(relay.take_outbox(), [ToCoordinator::Return { lease: 7 }]);
}

#[test]
fn a_worker_that_claims_to_relay_or_returns_what_it_has_not_is_dropped() {
    let capacity = ToCoordinator::Capacity { threads: 3, lease_seconds: 1.0 };
    let back = ToCoordinator::Return { lease: 99 };
    for (relays, message) in [(false, capacity), (false, back.clone()), (true, back)] {
        let mut coordinator = coordinator(plan(1000, 10));
        coordinator.on_connect(0);
        let hello = Hello { relays, ..hello("odd", u32::from(!relays)) };
        coordinator.on_message(0, ToCoordinator::Hello(hello), Duration::ZERO);
        coordinator.on_message(0, READY, Duration::ZERO);
        let actions = coordinator.on_message(0, message, Duration::ZERO);
        assert!(actions.contains(&Action::Close(0)));
    }
}

#[test]
fn numbers_that_a_relay_invents_do_no_harm() {
    for lease_seconds in [f64::NAN, f64::INFINITY, -1.0, 1e300] {
        let mut coordinator = coordinator(plan(u64::MAX, 100));
        coordinator.on_connect(0);
        let hello = Hello { relays: true, ..hello("vain", u32::MAX) };
        coordinator.on_message(0, ToCoordinator::Hello(hello), Duration::ZERO);
        coordinator.on_message(0, READY, Duration::ZERO);
        let capacity = ToCoordinator::Capacity { threads: u32::MAX, lease_seconds };
        let actions = coordinator.on_message(0, capacity, Duration::ZERO);
        for action in actions {
            let Action::Send(0, ToWorker::Lease { walks, .. }) = action else { panic!("{action:?}") };
            assert!(walks <= 100 << 20, "a stream for each thread that is believed");
        }
    }
}

/// A relay of 150 workers has some 600 leases out at once, and reports them in 256 parts at most.
#[test]
fn a_relay_of_many_workers_tells_of_some_leases_and_of_all_walks() {
    let mut world = World::new(plan(400_000, 10));
    let relay = world.add_relay();
    (0..150).for_each(|_| _ = world.join(relay));
    world.work_off();
    world.ends(Ending::BudgetSpent);
    let past = world.coordinator.past();
    let leases: u64 = past.deliveries.entries().iter().map(|entry| entry.leases).sum();
    assert_eq!(leases, world.walked.len() as u64, "none was walked twice");
    let folded = past.deliveries.entries().iter().map(|entry| entry.leases).max().unwrap();
    assert!(
        (Deliveries::MOST_PARTS / 4..=Deliveries::MOST_PARTS).contains(&world.most_parts),
        "{}",
        world.most_parts
    );
    assert!(folded > 1, "more leases came at once than are told of");
    let named = past.workers.iter().filter(|worker| worker.name.starts_with("relay > ")).count();
    assert!(named > 100, "{named}");
}

/// Checks trees of relays whose workers and relays fail at any time.
#[test]
fn no_fault_of_relays_or_workers_changes_the_tally_or_hangs_the_job() {
    let (mut relays_lost, mut reissued) = (0, 0);
    for seed in 0..200_u64 {
        let mut roll = seed << 32;
        let mut dice = |n: usize| {
            roll += 1;
            (hash(roll) >> 20) as usize % n
        };
        let stream = 1 + dice(40) as u64;
        let mut world = World::new(plan(200 * stream + dice(100) as u64, stream));
        let stops = dice(4) == 0;
        for step in 0.. {
            assert!(step < 20_000, "the job does not end");
            if world.coordinator.ending().is_some() {
                break;
            }
            let alive: Vec<usize> =
                (0..world.relays.len()).filter(|&at| world.relays[at].is_some()).collect();
            let workers: Vec<_> = world.workers.keys().copied().collect();
            match dice(if step < 300 { 20 } else { 15 }) {
                0 => world.pass(TICK * (1 + dice(20) as u32)),
                1..=3 if !alive.is_empty() => _ = world.pass_on(alive[dice(alive.len())]),
                4..=6 if !alive.is_empty() => world.order(alive[dice(alive.len())]),
                7 if alive.len() < 3 => _ = world.add_relay(),
                8 if workers.len() < 8 => {
                    let leaders: Vec<usize> = [0].into_iter().chain(alive.iter().map(|at| at + 1)).collect();
                    world.join(leaders[dice(leaders.len())]);
                }
                17 if !workers.is_empty() => {
                    let (leader, id) = workers[dice(workers.len())];
                    let now = world.now;
                    world.workers.remove(&(leader, id));
                    let actions = world.lead(leader).unwrap().on_lost(id, "gone", now);
                    world.act(leader, actions);
                }
                18 if !alive.is_empty() => {
                    let at = alive[dice(alive.len())];
                    let (id, now) = (world.relays[at].as_ref().unwrap().id, world.now);
                    world.vanish(at);
                    let actions = world.coordinator.on_lost(id, "gone", now);
                    world.act(0, actions);
                    relays_lost += 1;
                }
                19 if stops && step > 200 => {
                    let actions = world.coordinator.stop(Ending::Interrupted, world.now);
                    world.act(0, actions);
                }
                _ if !workers.is_empty() => {
                    let (leader, id) = workers[dice(workers.len())];
                    world.work_fast(leader, id);
                }
                _ => {}
            }
        }
        let ending = world.coordinator.ending().unwrap();
        assert!(ending == Ending::BudgetSpent || stops);
        world.ends(ending);
        reissued += world.coordinator.effort().streams_reissued;
    }
    assert!(relays_lost > 100 && reissued > 100, "{relays_lost} {reissued}");
}

/// Sixteen workers finish in about the time that they would need without any waiting, with many short walks and with
/// few long ones (chains), of which each thread has one at once.
#[test]
fn workers_behind_relays_are_as_busy_as_others() {
    for (plan_of, walks, ticks) in [
        ((|| plan(1_000_000, 10)) as fn() -> JobPlan, 80, 1),
        (|| JobPlan { leases_per_thread: 1, ..plan(72, 1) }, 1, 40),
    ] {
        let ran = |relays: usize| {
            let mut world = World::new(plan_of());
            let leaders: Vec<usize> = (0..relays).map(|_| world.add_relay()).collect();
            (0..16).for_each(|n| _ = world.join(leaders.get(n % relays.max(1)).copied().unwrap_or(0)));
            world.walk_all(walks, ticks);
            world.ends(Ending::BudgetSpent);
            assert_eq!(world.coordinator.effort().streams_reissued, 0);
            (world.now.as_secs_f64(), world.results)
        };
        let (without, results) = ran(0);
        let ideal = plan_of().paths as f64 / 16.0 * f64::from(ticks) / walks as f64 * TICK.as_secs_f64();
        assert!((1.0..1.12).contains(&(without / ideal)), "{without} s for {ideal} s");
        for relays in [1, 2, 4] {
            let (with, passed_on) = ran(relays);
            assert!(with < 1.02 * without, "{relays} relays: {with} s, without {without} s");
            // A relay's lease is for all of its workers.
            assert!(16 * passed_on < 2 * relays * results, "{relays} relays: {passed_on} of {results}");
        }
    }
}
