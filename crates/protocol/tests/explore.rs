//! The coordinator's state machine explored: every state that a few events reach, for two workers and three leases. A worker connects, says hello, is ready and
//! brings results one by one. Results come out of order, twice, late, on connections that are closed, or are impossible. Connections are cut, and workers fall
//! silent. Checkpoints are taken and written. The coordinator dies, and another one goes on from the latest checkpoint that was written. The owner stops the run.
//!
//! The search goes level by level, and no state is searched twice. A state is all that the coordinator holds, all that the workers and the disk hold, and the time. In
//! each state the prefix is that of its walks, none lost and none twice, and leases that are out do not overlap those that are in. From each state the
//! world is fair: workers come, and walk what they are given. Then the job ends, and unless the owner stopped it, every walk is in.

mod toy;

use std::collections::{HashSet, VecDeque};
use std::hash::{DefaultHasher, Hasher};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use protocol::message::{LeaseResult, SMALL_TALLY, ToCoordinator, ToWorker};
use protocol::{Action, Coordinator, Ending, JobPlan, Lead, Past, PeerId, SILENCE};
use radiosity::Tally;
use toy::{LAYOUT, MOMENTS, PATCHES, READY, coordinator, hello, judge, plan, result_of, straight};

const WALKS: u64 = 6;
const STREAM: u64 = 2;
const WORKERS: usize = 2;

/// The walks at which a target is met, in jobs that have one.
const TARGET: u64 = 4;

/// The most rounds in which a fair world ends a job: each brings every result that is out, and a second passes.
const ROUNDS: u32 = 100;

/// A job whose coordinator is explored.
struct Job {
    name: &'static str,
    patches: usize,
    /// Whether there is a look at the first stream, and at a target that is met before all walks are in.
    has_target: bool,
    /// The tallies of the first walks, by the number of streams.
    prefixes: Vec<Tally>,
}

impl Job {
    fn new(name: &'static str, patches: usize, has_target: bool) -> Self {
        let prefixes = (0..=WALKS / STREAM).map(|streams| padded(0..streams * STREAM, patches)).collect();
        Job { name, patches, has_target, prefixes }
    }

    /// Results of a job of few patches come unasked. Those of many are offered, kept by their workers and asked for, and a checkpoint that is being
    /// written holds up the prefix.
    fn all() -> [Self; 3] {
        let many = SMALL_TALLY / MOMENTS + 1;
        [
            Job::new("few patches", PATCHES, false),
            Job::new("a target", PATCHES, true),
            Job::new("many patches", many, false),
        ]
    }

    fn is_large(&self) -> bool {
        self.patches > PATCHES
    }

    fn plan(&self) -> JobPlan {
        let looks = if self.has_target { vec![STREAM, TARGET] } else { vec![] };
        let judge = judge(|tally| tally.counts.walks == TARGET);
        JobPlan { patches: self.patches, looks, judge, ..plan(WALKS, STREAM) }
    }

    fn result(&self, lease: u64, walks: Range<u64>) -> LeaseResult {
        result_of(lease, &padded(walks, self.patches))
    }
}

/// The tally of some walks, with patches beyond those that they hit.
fn padded(walks: Range<u64>, patches: usize) -> Tally {
    let tally = straight(walks);
    let mut sums = tally.sums().to_vec();
    sums.resize(patches * MOMENTS, 0);
    Tally::from_parts(tally.counts, patches, LAYOUT, sums).unwrap()
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// A worker does what is next: it connects, says hello, is ready, or brings or offers the oldest result that it owes.
    Next(usize),
    /// A worker brings or offers the newest result that it owes before others.
    Newest(usize),
    /// A worker sends the oldest result that it was asked for.
    Send(usize),
    /// A worker sends its last result once more.
    Again(usize),
    /// A worker sends a result with a walk too many. The coordinator does not look at it where another worker has brought these walks.
    Lie(usize),
    /// A worker's connection is cut.
    Cut(usize),
    /// A worker brings the result of a lease that it had over an earlier connection.
    Late(usize),
    /// What a worker sent over an earlier connection is read now.
    Stale(usize),
    /// A second passes, in which all workers give signs of life.
    Second,
    /// No worker gives a sign of life for long.
    Silence,
    /// A checkpoint is taken.
    Take,
    /// The checkpoint that was taken is on the disk.
    Keep,
    /// The coordinator dies, and another one goes on from the checkpoint on the disk.
    Death,
    /// The owner stops the run.
    Stop,
}

/// A lease: its number and its walks.
type Lease = (u64, Range<u64>);

#[derive(Debug, Default)]
struct Worker {
    peer: Option<PeerId>,
    /// Messages of its introduction that it has sent.
    introduced: u32,
    owes: VecDeque<Lease>,
    /// Results that it has offered and keeps, and those that it was asked for.
    offered: VecDeque<Lease>,
    asked: VecDeque<Lease>,
    last: Option<LeaseResult>,
    /// The latest connection that has ended, and a result that was not brought over it.
    before: Option<(PeerId, Option<Lease>)>,
}

impl Worker {
    /// The worker without its connection.
    fn alone(&mut self) -> Self {
        let earlier = self.before.take().and_then(|(_, lease)| lease);
        let undone =
            self.owes.pop_front().or_else(|| self.asked.pop_front()).or_else(|| self.offered.pop_front());
        Worker { before: self.peer.map(|peer| (peer, undone.or(earlier))), ..Worker::default() }
    }

    fn has(&self, lease: u64) -> bool {
        [&self.owes, &self.offered, &self.asked].into_iter().flatten().any(|&(number, _)| number == lease)
    }

    /// The lease of an earlier connection, where its number means nothing on this one.
    fn late(&self) -> Option<Lease> {
        let (_, lease) = self.before.as_ref()?;
        lease.clone().filter(|&(number, _)| self.introduced == 2 && !self.has(number))
    }
}

struct World<'a> {
    job: &'a Job,
    coordinator: Coordinator,
    workers: [Worker; WORKERS],
    /// The number of connections that each worker has had, for numbers of its own.
    connections: [u64; WORKERS],
    now: Duration,
    stopped: bool,
    /// Whether a worker has lied: what it brought beyond gaps is walked again, also by those who owe walks that it had brought before them.
    lied: bool,
    /// The checkpoint that is being written.
    taken: Option<Past>,
    /// The checkpoint on the disk.
    kept: Option<Past>,
}

impl<'a> World<'a> {
    fn new(job: &'a Job) -> Self {
        World {
            job,
            coordinator: coordinator(job.plan()),
            workers: Default::default(),
            connections: [0; WORKERS],
            now: Duration::ZERO,
            stopped: false,
            lied: false,
            taken: None,
            kept: None,
        }
    }

    /// The world after some events.
    fn after(job: &'a Job, events: &[Event]) -> Self {
        let mut world = World::new(job);
        events.iter().for_each(|&event| world.happen(event));
        world
    }

    /// The digest of the whole state. Equal states have equal digests.
    fn state(&self) -> u64 {
        let World { job: _, coordinator, workers, connections, now, stopped, lied, taken, kept } = self;
        let state = (coordinator, workers, connections, now, stopped, lied, taken, kept);
        digest(format!("{state:?}").as_bytes(), &mut 0)
    }

    /// The events that may come now.
    fn events(&self) -> Vec<Event> {
        let mut events = vec![Event::Second, Event::Silence, Event::Death];
        events.push(if self.taken.is_some() { Event::Keep } else { Event::Take });
        for (i, worker) in self.workers.iter().enumerate() {
            let is_idle = worker.introduced == 2 && worker.owes.is_empty();
            events.extend((!is_idle).then_some(Event::Next(i)));
            events.extend((worker.owes.len() > 1).then_some(Event::Newest(i)));
            events.extend((!worker.asked.is_empty()).then_some(Event::Send(i)));
            events.extend(worker.last.is_some().then_some(Event::Again(i)));
            events.extend((!worker.owes.is_empty() || !worker.asked.is_empty()).then_some(Event::Lie(i)));
            events.extend(worker.peer.is_some().then_some(Event::Cut(i)));
            events.extend(worker.late().is_some().then_some(Event::Late(i)));
            events.extend(
                worker.before.as_ref().is_some_and(|(_, lease)| lease.is_some()).then_some(Event::Stale(i)),
            );
        }
        events.extend((!self.stopped).then_some(Event::Stop));
        events
    }

    fn happen(&mut self, event: Event) {
        match event {
            Event::Next(i) => self.next(i),
            Event::Newest(i) => {
                let lease = self.workers[i].owes.pop_back();
                self.bring(i, lease);
            }
            Event::Send(i) => {
                let (number, walks) = self.workers[i].asked.pop_front().expect("it was asked for a result");
                self.send(i, number, walks);
            }
            Event::Again(i) => {
                let last = self.workers[i].last.clone().expect("there was a result");
                self.say(i, ToCoordinator::Result(last));
            }
            Event::Lie(i) => self.lie(i),
            Event::Cut(i) => {
                let peer = self.workers[i].peer.expect("it is connected");
                self.workers[i] = self.workers[i].alone();
                let actions = self.coordinator.on_lost(peer, "the connection was cut", self.now);
                self.act(actions);
            }
            Event::Late(i) => {
                let (number, walks) = self.workers[i].late().expect("it had a lease before");
                let result = self.job.result(number, walks);
                self.say(i, ToCoordinator::Result(result));
            }
            Event::Stale(i) => {
                let before = self.workers[i].before.take().expect("it was connected before");
                let (peer, (number, walks)) = (before.0, before.1.expect("it had a lease then"));
                let result = ToCoordinator::Result(self.job.result(number, walks));
                let actions = self.coordinator.on_message(peer, result, self.now);
                self.act(actions);
            }
            Event::Second => {
                self.now += Duration::from_secs(1);
                let progress = self.now.as_secs();
                let introduced = (0..WORKERS).filter(|&i| self.workers[i].introduced > 0);
                for i in introduced.collect::<Vec<_>>() {
                    self.say(i, ToCoordinator::Alive { progress });
                }
                self.tick();
            }
            Event::Silence => {
                self.now += SILENCE + Duration::from_secs(1);
                self.tick();
                self.now += Duration::from_secs(1);
                self.tick();
            }
            Event::Take => self.taken = Some(self.coordinator.past()),
            Event::Keep => {
                let taken = self.taken.take().expect("a checkpoint is being written");
                let is_older = |kept: &Past| kept.tally.counts.walks <= taken.tally.counts.walks;
                assert!(self.kept.as_ref().is_none_or(is_older), "a checkpoint goes back");
                self.kept = Some(read(&taken));
            }
            Event::Death => {
                let empty = || Past::none(padded(0..0, self.job.patches));
                let past = self.kept.as_ref().map_or_else(empty, read);
                self.taken = None;
                self.coordinator = Coordinator::new(self.job.plan(), past);
                // Numbers of connections begin again.
                self.workers.iter_mut().for_each(|worker| *worker = worker.alone());
                self.workers
                    .iter_mut()
                    .for_each(|worker| _ = worker.before.as_mut().map(|before| before.0 = PeerId::MAX));
                self.connections = [0; WORKERS];
                self.stopped = false;
                self.now = Duration::ZERO;
            }
            Event::Stop => {
                self.stopped = true;
                let actions = self.coordinator.stop(Ending::Interrupted, self.now);
                self.act(actions);
            }
        }
        self.check();
    }

    fn next(&mut self, i: usize) {
        let worker = &mut self.workers[i];
        match (worker.peer, worker.introduced) {
            (None, _) => {
                let peer = self.connections[i] * WORKERS as u64 + i as u64;
                self.connections[i] += 1;
                worker.peer = Some(peer);
                let actions = self.coordinator.on_connect(peer);
                self.act(actions);
            }
            (Some(peer), 0) => {
                worker.introduced = 1;
                // A name of its own each time: that of a liar is refused for good.
                self.say(i, ToCoordinator::Hello(hello(&format!("worker {peer}"), 1)));
            }
            (Some(_), 1) => {
                worker.introduced = 2;
                self.say(i, READY);
            }
            _ => {
                let lease = worker.owes.pop_front();
                self.bring(i, lease);
            }
        }
    }

    /// Brings a small result, or offers a large one.
    fn bring(&mut self, i: usize, lease: Option<Lease>) {
        let (number, walks) = lease.expect("it owes a result");
        if !self.job.is_large() {
            return self.send(i, number, walks);
        }
        let bytes = self.job.result(number, walks.clone()).sums.len() as u64;
        self.workers[i].offered.push_back((number, walks));
        self.say(i, ToCoordinator::Offer { lease: number, bytes });
    }

    fn send(&mut self, i: usize, number: u64, walks: Range<u64>) {
        let result = self.job.result(number, walks);
        self.workers[i].last = Some(result.clone());
        self.say(i, ToCoordinator::Result(result));
    }

    fn lie(&mut self, i: usize) {
        let Worker { asked, owes, .. } = &mut self.workers[i];
        let (number, walks) = asked.pop_front().or_else(|| owes.pop_front()).expect("it owes a result");
        self.lied = true;
        let lie = self.job.result(number, walks.start..walks.end + 1);
        self.say(i, ToCoordinator::Result(lie));
    }

    fn say(&mut self, i: usize, message: ToCoordinator) {
        let Some(peer) = self.workers[i].peer else { return };
        let actions = self.coordinator.on_message(peer, message, self.now);
        self.act(actions);
    }

    fn tick(&mut self) {
        let actions = self.coordinator.on_tick(self.now);
        self.act(actions);
    }

    fn act(&mut self, actions: Vec<Action>) {
        for action in actions {
            match action {
                Action::Send(peer, ToWorker::Lease { id, first_walk, walks }) => {
                    assert!(self.coordinator.ending().is_none(), "no lease after the end");
                    let walks = first_walk..first_walk + walks;
                    let prefix = self.coordinator.prefix().counts.walks;
                    assert!(
                        walks.start >= prefix && walks.start < walks.end && walks.end <= WALKS,
                        "{walks:?} of {prefix}"
                    );
                    let lied = self.lied;
                    let worker = self.of(peer).expect("leases go to workers that are there");
                    assert!(worker.introduced == 2, "leases go to workers that are ready");
                    assert!(!worker.has(id), "lease {id} is given out twice");
                    let overlaps =
                        worker.owes.iter().any(|(_, out)| out.start < walks.end && walks.start < out.end);
                    assert!(!overlaps || lied, "{walks:?} twice with one worker");
                    worker.owes.push_back((id, walks));
                }
                Action::Send(peer, ToWorker::Send { lease }) => {
                    let worker = self.of(peer).expect("workers that are there are asked");
                    let place = worker.offered.iter().position(|&(number, _)| number == lease);
                    let offer = worker.offered.remove(place.expect("it was offered")).expect("it was found");
                    worker.asked.push_back(offer);
                }
                Action::Send(peer, ToWorker::Drop { lease }) => {
                    if let Some(worker) = self.of(peer) {
                        worker.offered.retain(|&(number, _)| number != lease);
                    }
                }
                Action::Close(peer) => {
                    if let Some(worker) = self.of(peer) {
                        *worker = worker.alone();
                    }
                }
                Action::Send(..) | Action::Tell(_) => {}
            }
        }
    }

    fn of(&mut self, peer: PeerId) -> Option<&mut Worker> {
        self.workers.iter_mut().find(|worker| worker.peer == Some(peer))
    }

    /// What no order of events may break.
    fn check(&self) {
        let prefix = self.coordinator.prefix();
        let walks = prefix.counts.walks;
        assert!(walks <= WALKS && walks.is_multiple_of(STREAM), "{walks} walks");
        assert_eq!(prefix, &self.job.prefixes[(walks / STREAM) as usize], "a walk is lost or counted twice");
        assert!(self.coordinator.progress().walks <= WALKS);
        assert!(!self.job.has_target || walks <= TARGET, "{walks} walks, beyond the target");
    }

    /// Workers come and do what they are given, and checkpoints are written; the job must end.
    fn be_fair(mut self) {
        for _ in 0..ROUNDS {
            if let Some(ending) = self.coordinator.ending() {
                return self.check_ending(ending);
            }
            if self.taken.is_some() {
                self.happen(Event::Keep);
            }
            for i in 0..WORKERS {
                let Worker { owes, offered, asked, .. } = &self.workers[i];
                for _ in 0..3 + 2 * owes.len() + offered.len() + asked.len() {
                    let worker = &self.workers[i];
                    if self.coordinator.ending().is_some() {
                    } else if !worker.asked.is_empty() {
                        self.happen(Event::Send(i));
                    } else if worker.introduced < 2 || !worker.owes.is_empty() {
                        self.happen(Event::Next(i));
                    }
                }
            }
            if self.coordinator.ending().is_none() {
                self.happen(Event::Second);
            }
        }
        panic!("the job does not end");
    }

    fn check_ending(&self, ending: Ending) {
        let walks = self.coordinator.prefix().counts.walks;
        let expected = match walks {
            WALKS => Ending::BudgetSpent,
            TARGET if self.job.has_target => Ending::TargetReached,
            _ => Ending::Interrupted,
        };
        assert_eq!(ending, expected, "after {walks} walks");
        assert!(self.stopped || ending != Ending::Interrupted, "{walks} walks");
    }
}

/// A past as it is read from a disk. No other part of the program shares its tally.
fn read(past: &Past) -> Past {
    Past { tally: Tally::clone(&past.tally).into(), ..past.clone() }
}

/// A number for what `Debug` writes, from a place on to the end of the group that begins there. The entries of `{}` have no order: these are maps and sets, whose
/// order differs from one to the next, and fields, which have names.
fn digest(text: &[u8], at: &mut usize) -> u64 {
    let mut entries = Vec::new();
    let mut entry = DefaultHasher::new();
    let opening = text[*at];
    loop {
        *at += 1;
        match text[*at] {
            b'{' | b'[' | b'(' => entry.write_u64(digest(text, at)),
            b'}' | b']' | b')' => break,
            b',' => entries.push(std::mem::replace(&mut entry, DefaultHasher::new()).finish()),
            b' ' => {}
            byte => entry.write_u8(byte),
        }
    }
    entries.push(entry.finish());
    if opening == b'{' {
        entries.sort_unstable();
    }
    let mut all = DefaultHasher::new();
    all.write_u8(opening);
    entries.iter().for_each(|&entry| all.write_u64(entry));
    all.finish()
}

/// What a search has seen.
struct Explored {
    /// The states, each once.
    states: usize,
    /// The steps between them that were tried.
    steps: u64,
}

/// Every state of a job that is reached by at most `depth` events from one of several beginnings. Says the events that led to a failure.
fn explore(job: &Job, depth: usize) -> Explored {
    let join = |i: usize| [Event::Next(i); 3];
    let mut level: Vec<Vec<Event>> = vec![
        vec![],
        join(0).to_vec(),
        [join(0), join(1)].concat(),
        [&join(0)[..], &[Event::Newest(0)], &join(1), &[Event::Cut(0), Event::Next(0)]].concat(),
        [&join(0)[..], &[Event::Next(0), Event::Take, Event::Keep, Event::Death], &join(1)].concat(),
    ];
    let mut search = Search { job, seen: HashSet::new() };
    level.retain(|events| search.is_new(events));
    let mut steps = level.len() as u64;
    for _ in 0..depth {
        let mut next = Vec::new();
        for events in level {
            let world = World::after(job, &events);
            // Nothing comes after the end.
            let further = if world.coordinator.ending().is_none() { world.events() } else { vec![] };
            steps += further.len() as u64;
            let orders = further.into_iter().map(|event| [&events[..], &[event]].concat());
            next.extend(orders.filter(|events| search.is_new(events)));
        }
        level = next;
    }
    Explored { states: search.seen.len(), steps }
}

/// A search under way.
struct Search<'a> {
    job: &'a Job,
    seen: HashSet<u64>,
}

impl Search<'_> {
    /// Whether events lead to a state that was not seen before. A fair world then ends the job from there.
    fn is_new(&mut self, events: &[Event]) -> bool {
        let Search { job, seen } = self;
        let looked = catch_unwind(AssertUnwindSafe(|| {
            let world = World::after(job, events);
            let is_new = seen.insert(world.state());
            if is_new {
                world.be_fair();
            }
            is_new
        }));
        looked.unwrap_or_else(|_| panic!("{}: after {events:?}", job.name))
    }
}

/// Explores every job, and says what was seen.
fn explore_all(depth: usize) -> usize {
    let explored = Job::all().map(|job| (explore(&job, depth), job.name));
    for (Explored { states, steps }, name) in &explored {
        println!("{name}: {states} states within {depth} events, {steps} steps");
    }
    explored.iter().map(|(explored, _)| explored.states).sum()
}

#[test]
fn every_state_within_three_events_keeps_the_walks_and_comes_to_an_end() {
    let states = explore_all(3);
    assert!(states > 1_000, "{states}");
}

/// By hand, after changes of the coordinator.
#[test]
#[ignore = "takes minutes: every state within six events"]
fn every_state_within_six_events_keeps_the_walks_and_comes_to_an_end() {
    let depth = std::env::var("RADWALK_DEPTH").map_or(6, |depth| depth.parse().unwrap());
    println!("{} states", explore_all(depth));
}
