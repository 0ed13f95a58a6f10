//! Tests of liveness without sockets: a coordinator, relays and workers as state machines, whose checkpoints, threads,
//! processes and machines fail at random. While walks are left and a worker could walk, something moves.
//!
//! Workers behave as real ones do: a thread that keeps two large results begins no third lease; results are sent piece
//! by piece beside the walking; and a worker reads messages whatever its threads are doing.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::time::Duration;

use crate::toy::{
    BUILD, Dice, JOB, JOB_HASH, LAYOUT, READY, SCENE_HASH, coordinator, hello, plan, result_of,
};
use protocol::message::{Hello, LeaseResult, PIECE, SMALL_TALLY, ToCoordinator, ToWorker};
use protocol::{
    Action, Coordinator, Ending, JobPlan, Lead, Limits, Notice, Past, PeerId, Relay, RelayEnd, Terms,
};
use radiosity::{Counts, Tally};

const TICK: Duration = Duration::from_millis(50);
const TICKS_PER_SECOND: u64 = 20;

/// The walks of one thread in one tick.
const PACE: u64 = 2;

/// The results that a thread of a worker keeps, as in `worker.rs`.
const MOST_KEPT: usize = 2;

/// The patches of a scene with large tallies. A few of their out-of-order ranges find room beside the prefix.
const LARGE: usize = 4 * SMALL_TALLY;

/// The longest that nothing may move, in ticks: if all workers are sound, and if some worker was stuck recently (a
/// worker that was asked for a result has a minute, and one that makes no progress another).
const SOUND: u64 = 15 * TICKS_PER_SECOND;
const STUCK: u64 = 100 * TICKS_PER_SECOND;

/// A random number of ticks within a range of seconds.
fn seconds(dice: &mut Dice, range: Range<u64>) -> u64 {
    TICKS_PER_SECOND * range.start + dice.below(TICKS_PER_SECOND * (range.end - range.start))
}

/// The tally of a number of walks: three bytes per sum.
fn tally(patches: usize, walks: u64) -> Tally {
    let counts = Counts { walks, rays: walks, absorbed: walks, ..Counts::default() };
    let sums = vec![u128::from(walks) << 8; patches * LAYOUT.columns()];
    Tally::from_parts(counts, patches, LAYOUT, sums).unwrap()
}

fn terms(plan: &JobPlan) -> Terms {
    Terms {
        job: JOB.into(),
        scene_hash: SCENE_HASH,
        job_hash: JOB_HASH,
        build: BUILD.into(),
        stream_walks: plan.stream_paths,
        leases_per_thread: plan.leases_per_thread,
        patches: plan.patches,
        layout: LAYOUT,
        limits: Limits::NONE,
    }
}

#[derive(Clone)]
struct Lease {
    id: u64,
    walks: u64,
}

/// A thread of a worker.
#[derive(Default)]
struct Thread {
    /// The lease that the thread walks, and the ticks that are left of it.
    at: Option<(Lease, u64)>,
    kept: Vec<u64>,
    /// The tick until which the thread is stuck; it may report progress meanwhile.
    stuck: u64,
    claims: bool,
}

/// A worker, or a relay as its leader sees it: the results that it keeps and sends.
#[derive(Default)]
struct Sender {
    kept: BTreeMap<u64, LeaseResult>,
    asked: VecDeque<u64>,
    /// The result that is being sent.
    sending: Option<LeaseResult>,
}

impl Sender {
    /// The worker's message of one tick: the next piece of a result that was asked for.
    fn turn(&mut self) -> Option<ToCoordinator> {
        if self.sending.is_none() {
            self.sending = self.asked.pop_front().and_then(|lease| self.kept.remove(&lease));
        }
        let result = self.sending.as_mut()?;
        if result.sums.len() > PIECE {
            let sums = result.sums.drain(..PIECE).collect();
            return Some(ToCoordinator::Piece { lease: result.lease, sums });
        }
        self.sending.take().map(ToCoordinator::Result)
    }

    /// Keeps a large result and offers it.
    fn offer(&mut self, result: LeaseResult) -> ToCoordinator {
        let (lease, bytes) = (result.lease, result.sums.len() as u64);
        self.kept.insert(lease, result);
        ToCoordinator::Offer { lease, bytes }
    }
}

struct Worker {
    leader: usize,
    queue: VecDeque<Lease>,
    threads: Vec<Thread>,
    sender: Sender,
    progress: u64,
    /// The tick until which the worker's process is stopped.
    stopped: u64,
    /// Whether the worker offers results and sends none.
    mute: bool,
}

struct Node {
    relay: Relay,
    /// The relay's number at the coordinator.
    id: PeerId,
    sender: Sender,
    /// The messages that it was sent, and those of its workers, that it has not read.
    orders: VecDeque<ToWorker>,
    mail: VecDeque<(PeerId, ToCoordinator)>,
    stopped: u64,
}

/// All leaders and workers. The coordinator is leader 0; relays, those that are gone included, are leaders 1 ….
struct World {
    patches: usize,
    coordinator: Coordinator,
    terms: Terms,
    relays: Vec<Option<Node>>,
    workers: BTreeMap<PeerId, Worker>,
    /// The checkpoints that are being written, and the tick at which each is done.
    held: Vec<(Past, u64)>,
    next: PeerId,
    tick: u64,
    /// The tick at which something last moved, and the one at which some worker was last not sound.
    moved: u64,
    unsound: u64,
    /// The longest time without any move although a worker could have moved.
    stillest: u64,
    quiet: Vec<String>,
    /// The events so far, for messages of failures and to prove that faults happened.
    dropped: u64,
    faults: u64,
}

impl World {
    fn new(plan: JobPlan) -> Self {
        World {
            patches: plan.patches,
            terms: terms(&plan),
            coordinator: coordinator(plan),
            relays: vec![],
            workers: BTreeMap::new(),
            held: vec![],
            next: 0,
            tick: 0,
            moved: 0,
            unsound: 0,
            stillest: 0,
            quiet: vec![],
            dropped: 0,
            faults: 0,
        }
    }

    fn now(&self) -> Duration {
        TICK * self.tick as u32
    }

    fn is_large(&self) -> bool {
        self.patches * LAYOUT.columns() > SMALL_TALLY
    }

    fn lead(&mut self, leader: usize) -> Option<&mut dyn Lead> {
        match leader {
            0 => Some(&mut self.coordinator),
            _ => self.relays[leader - 1].as_mut().map(|node| &mut node.relay as &mut dyn Lead),
        }
    }

    fn act(&mut self, leader: usize, actions: Vec<Action>) {
        for action in actions {
            match action {
                Action::Send(id, message) => self.deliver(id, message),
                Action::Close(id) if leader == 0 => {
                    self.workers.remove(&id);
                    if let Some(at) = self.relays.iter().position(|n| n.as_ref().is_some_and(|n| n.id == id))
                    {
                        self.vanish(at);
                    }
                }
                Action::Close(id) => _ = self.workers.remove(&id),
                Action::Tell(Notice::Quiet { why, .. }) => self.quiet.push(why),
                Action::Tell(_) => {}
            }
        }
    }

    fn deliver(&mut self, id: PeerId, message: ToWorker) {
        if let Some(node) = self.relays.iter_mut().flatten().find(|node| node.id == id) {
            node.orders.push_back(message);
            return;
        }
        let Some(worker) = self.workers.get_mut(&id) else { return };
        match message {
            ToWorker::Lease { id, walks, .. } => worker.queue.push_back(Lease { id, walks }),
            ToWorker::Send { lease } => worker.sender.asked.push_back(lease),
            ToWorker::Drop { lease } => {
                worker.sender.kept.remove(&lease);
                self.dropped += 1;
            }
            _ => {}
        }
    }

    fn say(&mut self, leader: usize, id: PeerId, message: ToCoordinator) {
        let (now, tick) = (self.now(), self.tick);
        if let Some(node) = leader.checked_sub(1).and_then(|at| self.relays[at].as_mut())
            && node.stopped > tick
        {
            node.mail.push_back((id, message));
            return;
        }
        if let Some(lead) = self.lead(leader) {
            let actions = lead.on_message(id, message, now);
            self.act(leader, actions);
        }
    }

    fn join(&mut self, leader: usize, threads: u64) {
        let id = self.next;
        self.next += 1;
        let threads = (0..threads).map(|_| Thread::default()).collect::<Vec<_>>();
        let hello = hello(&format!("worker {id}"), threads.len() as u32);
        let (queue, sender) = (VecDeque::new(), Sender::default());
        self.workers
            .insert(id, Worker { leader, queue, threads, sender, progress: 0, stopped: 0, mute: false });
        let Some(lead) = self.lead(leader) else { return };
        let actions = lead.on_connect(id);
        self.act(leader, actions);
        self.say(leader, id, ToCoordinator::Hello(hello));
        self.say(leader, id, READY);
    }

    fn add_relay(&mut self) {
        let id = self.next;
        self.next += 1;
        let relay = Relay::new(self.terms.clone(), id);
        let (sender, orders, mail) = (Sender::default(), VecDeque::new(), VecDeque::new());
        self.relays.push(Some(Node { relay, id, sender, orders, mail, stopped: 0 }));
        let actions = self.coordinator.on_connect(id);
        self.act(0, actions);
        self.say(0, id, ToCoordinator::Hello(Hello { relays: true, ..hello(&format!("relay {id}"), 0) }));
        self.say(0, id, READY);
    }

    /// Lets a relay vanish, and its workers with it.
    fn vanish(&mut self, at: usize) {
        self.relays[at] = None;
        self.workers.retain(|_, worker| worker.leader != at + 1);
    }

    fn kill_worker(&mut self, id: PeerId) {
        let worker = self.workers.remove(&id).expect("a worker");
        let now = self.now();
        if let Some(lead) = self.lead(worker.leader) {
            let actions = lead.on_lost(id, "it died", now);
            self.act(worker.leader, actions);
        }
    }

    fn kill_relay(&mut self, at: usize) {
        let id = self.relays[at].as_ref().expect("a relay").id;
        self.vanish(at);
        let actions = self.coordinator.on_lost(id, "it died", self.now());
        self.act(0, actions);
    }

    fn alive_relays(&self) -> Vec<usize> {
        (0..self.relays.len()).filter(|&at| self.relays[at].is_some()).collect()
    }

    /// Lets a worker's threads work for one tick. Returns the worker's messages, and whether it moves.
    fn work(&mut self, id: PeerId) -> (Vec<ToCoordinator>, bool) {
        let (large, patches, tick) = (self.is_large(), self.patches, self.tick);
        let worker = self.workers.get_mut(&id).expect("a worker");
        if worker.stopped > tick {
            return (vec![], false);
        }
        let (mut said, mut moves) = (Vec::new(), false);
        let Worker { queue, threads, sender, progress, mute, .. } = worker;
        *progress += threads.iter().filter(|thread| thread.stuck > tick && thread.claims).count() as u64;
        for thread in threads.iter_mut().filter(|thread| thread.stuck <= tick) {
            let here = |lease: &u64| {
                sender.kept.contains_key(lease)
                    || sender.sending.as_ref().is_some_and(|sent| sent.lease == *lease)
            };
            thread.kept.retain(here);
            if thread.at.is_none() && thread.kept.len() < MOST_KEPT {
                thread.at = queue.pop_front().map(|lease| {
                    let ticks = lease.walks.div_ceil(PACE);
                    (lease, ticks)
                });
            }
            let Some((lease, left)) = &mut thread.at else { continue };
            (*left, *progress, moves) = (*left - 1, *progress + 1, true);
            if *left > 0 {
                continue;
            }
            let seconds = lease.walks.div_ceil(PACE) as f64 * TICK.as_secs_f64();
            let result = LeaseResult { seconds, ..result_of(lease.id, &tally(patches, lease.walks)) };
            if large {
                thread.kept.push(lease.id);
                said.push(sender.offer(result));
            } else {
                said.push(ToCoordinator::Result(result));
            }
            thread.at = None;
        }
        let sent = if *mute { None } else { sender.turn() };
        moves |= sent.is_some();
        said.extend(sent);
        if tick.is_multiple_of(TICKS_PER_SECOND) {
            said.push(ToCoordinator::Alive { progress: *progress });
        }
        (said, moves)
    }

    /// Lets a relay read its messages and send its own. Returns whether it moves.
    fn relay(&mut self, at: usize) -> bool {
        let (now, tick, large) = (self.now(), self.tick, self.is_large());
        while let Some((id, message)) = self.relays[at].as_mut().and_then(|node| node.mail.pop_front()) {
            self.say(at + 1, id, message);
        }
        while let Some(node) = &mut self.relays[at]
            && let Some(order) = node.orders.pop_front()
        {
            let actions = match order {
                ToWorker::Lease { id, first_walk, walks } => node.relay.on_lease(id, first_walk, walks, now),
                ToWorker::Send { lease } => {
                    node.sender.asked.push_back(lease);
                    vec![]
                }
                ToWorker::Drop { lease } => {
                    node.sender.kept.remove(&lease);
                    vec![]
                }
                ToWorker::Done => node.relay.finish(RelayEnd::Dismissed),
                _ => vec![],
            };
            self.act(at + 1, actions);
        }
        let Some(node) = &mut self.relays[at] else { return false };
        let actions = node.relay.on_tick(now);
        self.act(at + 1, actions);
        let Some(node) = &mut self.relays[at] else { return false };
        let mut said = Vec::new();
        for message in node.relay.take_outbox() {
            match message {
                ToCoordinator::Result(result) if large => said.push(node.sender.offer(result)),
                message => said.push(message),
            }
        }
        let sent = node.sender.turn();
        let moves = sent.is_some() || !said.is_empty();
        said.extend(sent);
        if tick.is_multiple_of(TICKS_PER_SECOND) {
            said.push(ToCoordinator::Alive { progress: node.relay.progress() });
        }
        let id = node.id;
        said.into_iter().for_each(|message| self.say(0, id, message));
        moves
    }

    /// Lets a tick pass and checks liveness: while a worker could walk, and no checkpoint is being written, something
    /// moves.
    fn pass(&mut self) {
        self.tick += 1;
        let tick = self.tick;
        self.held.retain(|(_, until)| *until > tick);
        let walks = self.coordinator.progress().walks;
        let ids: Vec<PeerId> = self.workers.keys().copied().collect();
        let mut moves = false;
        for id in ids {
            let Some(leader) = self.workers.get(&id).map(|worker| worker.leader) else { continue };
            let (said, moved) = self.work(id);
            moves |= moved;
            said.into_iter().for_each(|message| self.say(leader, id, message));
        }
        for at in self.alive_relays() {
            if self.relays[at].as_ref().is_some_and(|node| node.stopped <= tick) {
                moves |= self.relay(at);
            }
        }
        let actions = self.coordinator.on_tick(self.now());
        moves |= actions.iter().any(|action| matches!(action, Action::Send(..)));
        self.act(0, actions);
        moves |= self.coordinator.progress().walks != walks;
        let stopped = |leader: usize| {
            leader > 0 && self.relays[leader - 1].as_ref().is_none_or(|node| node.stopped > tick)
        };
        let sound = |worker: &Worker| worker.stopped <= tick && !stopped(worker.leader);
        let able = self
            .workers
            .values()
            .any(|worker| sound(worker) && worker.threads.iter().any(|thread| thread.stuck <= tick));
        let all_sound = self.relays.iter().flatten().all(|node| node.stopped <= tick)
            && self.workers.values().all(|worker| {
                let sound = worker.stopped <= tick && !worker.mute;
                sound && worker.threads.iter().all(|thread| thread.stuck <= tick)
            });
        if !all_sound {
            self.unsound = tick;
        }
        if moves || !able || !self.held.is_empty() || self.coordinator.ending().is_some() {
            self.moved = tick;
        }
        let still = tick - self.moved;
        self.stillest = self.stillest.max(still);
        let patience = if tick - self.unsound > SOUND { SOUND } else { STUCK };
        assert!(
            still < patience,
            "nothing moves at {} s, with {} of {} walks: {:?}",
            tick / TICKS_PER_SECOND,
            self.coordinator.prefix().counts.walks,
            self.coordinator.progress().walks,
            self.quiet
        );
    }

    /// Lets something go wrong.
    fn fail(&mut self, dice: &mut Dice) {
        let ids: Vec<PeerId> = self.workers.keys().copied().collect();
        let relays = self.alive_relays();
        if ids.is_empty() {
            return;
        }
        let (id, tick) = (ids[dice.below(ids.len() as u64) as usize], self.tick);
        self.faults += 1;
        match dice.below(if relays.is_empty() { 9 } else { 11 }) {
            0 | 1 => self.kill_worker(id),
            2 | 3 => {
                let until = if dice.one_in(2) { u64::MAX } else { tick + seconds(dice, 1..40) };
                let threads = &mut self.workers.get_mut(&id).expect("a worker").threads;
                let at = dice.below(threads.len() as u64) as usize;
                (threads[at].stuck, threads[at].claims) = (until, dice.one_in(3));
            }
            4 => self.workers.get_mut(&id).expect("a worker").stopped = tick + seconds(dice, 0..30),
            // Disks are slow; the next checkpoint may begin before this one is written.
            5..=7 if self.held.len() < 3 => {
                let until = tick + seconds(dice, 0..20);
                self.held.push((self.coordinator.past(), until));
            }
            8 => self.workers.get_mut(&id).expect("a worker").mute = true,
            9 => self.kill_relay(relays[dice.below(relays.len() as u64) as usize]),
            10 => {
                let at = relays[dice.below(relays.len() as u64) as usize];
                self.relays[at].as_mut().expect("a relay").stopped = tick + seconds(dice, 0..30);
            }
            _ => {}
        }
    }

    /// Plays until the job ends: `worker_count` workers, some of them behind `relays`, with one fault every `faults` ticks on
    /// average during the first five minutes.
    fn play(mut self, dice: &mut Dice, worker_count: usize, relays: usize, faults: u64) -> Self {
        while self.coordinator.ending().is_none() {
            assert!(self.tick < 3600 * TICKS_PER_SECOND, "the job does not end: {:?}", self.quiet);
            while self.alive_relays().len() < relays {
                self.add_relay();
            }
            if self.workers.len() < worker_count && dice.one_in(20) {
                let leaders: Vec<usize> =
                    [0].into_iter().chain(self.alive_relays().into_iter().map(|at| at + 1)).collect();
                let leader = leaders[dice.below(leaders.len() as u64) as usize];
                let threads = 1 + dice.below(3);
                self.join(leader, threads);
            }
            if self.tick < 300 * TICKS_PER_SECOND && dice.one_in(faults) {
                self.fail(dice);
            }
            self.pass();
        }
        self
    }
}

/// Plays a schedule of faults for each seed, with tallies of `patches` patches. Returns the number of faults, and that
/// of results that were dropped.
fn play_all(seeds: Range<u64>, patches: usize, walks: u64, most_relays: u64) -> (u64, u64) {
    let (mut faults, mut dropped, mut stillest) = (0, 0, 0);
    for seed in seeds {
        let mut dice = Dice(seed << 32);
        let paths = walks + dice.below(walks);
        // Nothing is merged across looks, so that some results wait for others.
        let looks = (1..8).map(|k| k * paths / 8).collect();
        let world = World::new(JobPlan { patches, looks, limits: Limits::NONE, ..plan(paths, 10) });
        let worker_count = 1 + dice.below(5) as usize;
        let relays = dice.below(most_relays + 1) as usize;
        let faults_every = 20 + dice.below(200);
        println!(
            "seed {seed}: {paths} walks, {worker_count} workers, {relays} relays, a fault in {faults_every} ticks"
        );
        let world = world.play(&mut dice, worker_count, relays, faults_every);
        assert_eq!(world.coordinator.ending(), Some(Ending::BudgetSpent), "seed {seed}: {:?}", world.quiet);
        assert_eq!(world.coordinator.prefix(), &tally(patches, paths), "seed {seed}");
        (faults, dropped) = (faults + world.faults, dropped + world.dropped);
        stillest = stillest.max(world.stillest);
    }
    println!(
        "{faults} faults, {dropped} results dropped, nothing moved for {} s",
        stillest / TICKS_PER_SECOND
    );
    (faults, dropped)
}

#[test]
fn whatever_fails_the_job_moves_on_with_large_tallies() {
    let (faults, dropped) = play_all(0..25, LARGE, 4000, 0);
    assert!(faults > 1000 && dropped > 20, "{faults} {dropped}");
}

#[test]
fn whatever_fails_the_job_moves_on_behind_relays() {
    for (patches, walks) in [(crate::toy::PATCHES, 20_000), (LARGE, 2000)] {
        let (faults, _) = play_all(100..120, patches, walks, 2);
        assert!(faults > 300, "{faults}");
    }
}

/// A disk that takes ten minutes: workers keep results for which there is no room, and the job waits and says so.
#[test]
fn a_disk_that_hangs_is_waited_for_and_reported() {
    let looks = vec![500, 1000, 1500];
    let mut world = World::new(JobPlan { patches: LARGE, looks, limits: Limits::NONE, ..plan(2000, 10) });
    (0..3).for_each(|_| world.join(0, 2));
    for _ in 0..TICKS_PER_SECOND {
        world.pass();
    }
    world.held.push((world.coordinator.past(), 600 * TICKS_PER_SECOND));
    while !world.held.is_empty() {
        world.pass();
    }
    assert_eq!(world.coordinator.ending(), None);
    assert!(world.coordinator.progress().walks < 2000);
    assert_eq!(world.quiet.len(), 9, "{:?}", world.quiet);
    assert!(world.quiet[0].ends_with("while a checkpoint is being written"), "{:?}", world.quiet);
    while world.coordinator.ending().is_none() {
        world.pass();
    }
    assert_eq!(world.coordinator.prefix(), &tally(LARGE, 2000));
}
