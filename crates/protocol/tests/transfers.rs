//! Tests of large results and the state machine without sockets: which worker is asked when, and what becomes of
//! results that never come.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::time::Duration;

use crate::toy::{LAYOUT, READY, coordinator, hash, plan, result_of};
use protocol::message::{LeaseResult, PIECE, SMALL_TALLY, ToCoordinator, ToWorker};
use protocol::{Action, Coordinator, Ending, JobPlan, Lead, Limits, PeerId, STALL};
use radiosity::{Counts, Layout, Tally};

const PATCHES: usize = 4 * SMALL_TALLY;

/// The tally of some walks of a large scene: three bytes per sum.
fn large(walks: u64) -> Tally {
    let counts = Counts { walks, rays: walks, absorbed: walks, ..Counts::default() };
    let sums = vec![u128::from(walks) << 8; PATCHES * LAYOUT.columns()];
    Tally::from_parts(counts, PATCHES, LAYOUT, sums).unwrap()
}

fn large_plan(paths: u64) -> JobPlan {
    JobPlan { patches: PATCHES, layout: Layout { ..LAYOUT }, limits: Limits::NONE, ..plan(paths, 10) }
}

/// The leases of the workers, and the results that they were asked for.
#[derive(Default)]
struct Workers {
    leases: BTreeMap<PeerId, VecDeque<(u64, u64)>>,
    /// The offers: (peer, lease, walks).
    offered: Vec<(PeerId, u64, u64)>,
    asked: Vec<(PeerId, u64)>,
    closed: Vec<PeerId>,
}

impl Workers {
    fn read(&mut self, actions: Vec<Action>) {
        for action in actions {
            match action {
                Action::Send(id, ToWorker::Lease { id: lease, walks, .. }) => {
                    self.leases.entry(id).or_default().push_back((lease, walks));
                }
                Action::Send(id, ToWorker::Send { lease }) => self.asked.push((id, lease)),
                Action::Send(_, ToWorker::Drop { lease }) => {
                    self.offered.retain(|&(_, offered, _)| offered != lease);
                }
                Action::Close(id) => self.closed.push(id),
                Action::Send(..) | Action::Tell(_) => {}
            }
        }
    }

    fn join(&mut self, coordinator: &mut Coordinator, id: PeerId) {
        self.read(coordinator.on_connect(id));
        for message in [ToCoordinator::Hello(crate::toy::hello("large", 1)), READY] {
            self.read(coordinator.on_message(id, message, Duration::ZERO));
        }
    }

    /// Lets a worker finish its first lease and offer the result.
    fn offer(&mut self, coordinator: &mut Coordinator, id: PeerId, now: Duration) {
        let (lease, walks) = self.leases.get_mut(&id).unwrap().pop_front().unwrap();
        self.offered.push((id, lease, walks));
        let bytes = result_of(lease, &large(walks)).sums.len() as u64;
        self.read(coordinator.on_message(id, ToCoordinator::Offer { lease, bytes }, now));
    }

    /// Lets a worker send a result that it was asked for.
    fn send(&mut self, coordinator: &mut Coordinator, at: usize, now: Duration) {
        let (id, lease) = self.asked.swap_remove(at);
        let offer = self.offered.iter().position(|&(_, offered, _)| offered == lease).expect("an offer");
        let (_, _, walks) = self.offered.swap_remove(offer);
        let mut result = result_of(lease, &large(walks));
        while result.sums.len() > PIECE {
            let sums = result.sums.drain(..PIECE).collect();
            self.read(coordinator.on_message(id, ToCoordinator::Piece { lease, sums }, now));
        }
        self.read(coordinator.on_message(id, ToCoordinator::Result(result), now));
    }
}

#[test]
fn results_of_many_workers_come_in_whatever_order_they_are_ready_and_sent() {
    for seed in 0..5 {
        let mut coordinator = coordinator(large_plan(5000));
        let mut workers = Workers::default();
        (0..20).for_each(|id| workers.join(&mut coordinator, id));
        let (mut most_asked, mut most_offered) = (0, 0);
        for step in 0.. {
            assert!(step < 100_000, "no worker is asked any more");
            let now = Duration::from_millis(step);
            if coordinator.ending().is_some() {
                break;
            }
            let dice = hash(1_000_000 * seed + step);
            let ready: Vec<PeerId> =
                workers.leases.iter().filter(|(_, leases)| !leases.is_empty()).map(|(&id, _)| id).collect();
            if !dice.is_multiple_of(3) && !ready.is_empty() {
                workers.offer(&mut coordinator, ready[dice as usize / 3 % ready.len()], now);
            } else if !workers.asked.is_empty() {
                let at = dice as usize / 3 % workers.asked.len();
                workers.send(&mut coordinator, at, now);
            }
            most_asked = most_asked.max(workers.asked.len());
            most_offered = most_offered.max(workers.offered.len());
        }
        assert_eq!(coordinator.ending(), Some(Ending::BudgetSpent));
        assert_eq!(coordinator.prefix(), &large(5000));
        // Each worker has two offers, not all of which are asked for at once.
        assert!(most_offered > 20 && most_asked <= 16, "{most_offered} {most_asked}");
    }
}

/// A gap that no worker is free to fill. Three workers have two leases each, 0 … 5, and the next one for each that they
/// bring. When the first dies, with 1 and 6, the others keep 7 … 10, so that neither can take 1 or 6.
#[test]
fn workers_that_are_full_of_results_beyond_a_gap_make_room_for_it() {
    let mut coordinator = coordinator(large_plan(5000));
    let mut workers = Workers::default();
    (0..3).for_each(|id| workers.join(&mut coordinator, id));
    let now = Duration::from_millis(1);
    for id in [0, 1, 1, 2, 2] {
        workers.offer(&mut coordinator, id, now);
        workers.send(&mut coordinator, 0, now);
    }
    for id in [1, 1, 2, 2] {
        workers.offer(&mut coordinator, id, now);
    }
    assert!(workers.asked.is_empty(), "they are beyond the gap");
    workers.leases.remove(&0);
    workers.read(coordinator.on_lost(0, "it died", now));
    let mut now = now;
    while coordinator.ending().is_none() {
        now += Duration::from_millis(50);
        assert!(now < Duration::from_secs(60), "no worker fills the gap");
        workers.read(coordinator.on_tick(now));
        while !workers.asked.is_empty() {
            workers.send(&mut coordinator, 0, now);
        }
        for id in [1, 2] {
            if !workers.leases[&id].is_empty() {
                workers.offer(&mut coordinator, id, now);
            }
        }
    }
    assert_eq!(coordinator.ending(), Some(Ending::BudgetSpent));
    assert_eq!(coordinator.prefix(), &large(5000));
}

#[test]
fn a_worker_that_waits_to_be_asked_is_kept_and_one_that_was_asked_and_sends_nothing_is_given_up() {
    let mut coordinator = coordinator(large_plan(1 << 40));
    let mut workers = Workers::default();
    (0..5).for_each(|id| workers.join(&mut coordinator, id));
    // All results are beyond the walks of the first worker: one is asked for, the others wait.
    (1..5).for_each(|id| workers.offer(&mut coordinator, id, Duration::ZERO));
    assert_eq!(workers.asked.len(), 1);
    let mut now = Duration::ZERO;
    let mut progress = 0;
    while now < STALL + Duration::from_secs(5) {
        now += Duration::from_secs(1);
        for id in 0..5 {
            // All workers send heartbeats; only the first makes progress.
            progress += u64::from(id == 0);
            let message = ToCoordinator::Alive { progress: if id == 0 { progress } else { 0 } };
            workers.read(coordinator.on_message(id, message, now));
        }
        workers.read(coordinator.on_tick(now));
    }
    // Each worker that is asked and sends nothing has 20 s; the last has waited for longer than a stall.
    let asked: Vec<PeerId> = workers.asked.iter().map(|asked| asked.0).collect();
    assert_eq!(asked.len(), 4);
    assert_eq!(workers.closed, asked[..3]);
}

/// A checkpoint of a large tally is no copy: until it is written the prefix stays, and results wait beside it.
#[test]
fn the_prefix_does_not_move_while_a_checkpoint_reads_it_but_at_a_stop() {
    let mut coordinator = coordinator(large_plan(1000));
    let mut workers = Workers::default();
    workers.join(&mut coordinator, 0);
    let mut deliver = |coordinator: &mut Coordinator| {
        workers.offer(coordinator, 0, Duration::ZERO);
        workers.send(coordinator, 0, Duration::ZERO);
    };
    deliver(&mut coordinator);
    let walks = coordinator.prefix().counts.walks;
    let past = coordinator.past();
    deliver(&mut coordinator);
    deliver(&mut coordinator);
    assert_eq!(coordinator.prefix().counts.walks, walks);
    let all = coordinator.progress().walks;
    assert!(all > walks && *past.tally == large(walks));
    drop(past);
    coordinator.on_tick(Duration::from_secs(1));
    assert_eq!(coordinator.prefix().counts.walks, all);

    let past = coordinator.past();
    deliver(&mut coordinator);
    coordinator.stop(Ending::Interrupted, Duration::from_secs(2));
    let more = coordinator.prefix().counts.walks;
    assert!(more > all && coordinator.prefix() == &large(more));
    assert!(*past.tally == large(all));
}

/// Three workers have two leases each, 0 … 5. When the job is stopped, 2 is under way, 0 and 4 are kept.
fn stopped() -> (Coordinator, Workers) {
    let mut coordinator = coordinator(large_plan(5000));
    let mut workers = Workers::default();
    (0..3).for_each(|id| workers.join(&mut coordinator, id));
    for id in [1, 2, 0] {
        workers.offer(&mut coordinator, id, Duration::ZERO);
    }
    assert_eq!(workers.asked, [(1, 2)], "there is room for one on its way");
    workers.read(coordinator.stop(Ending::Interrupted, Duration::ZERO));
    (coordinator, workers)
}

#[test]
fn a_stop_takes_what_workers_keep_and_send_and_what_fills_gaps_below() {
    let (mut coordinator, mut workers) = stopped();
    let now = Duration::from_secs(1);
    let walks: u64 = workers.offered.iter().map(|&(_, _, walks)| walks).sum();
    let below: u64 = [0, 1].iter().map(|id| workers.leases[id][0].1).sum();
    for id in [0, 1] {
        while !workers.asked.is_empty() {
            workers.send(&mut coordinator, 0, now);
        }
        assert_eq!(coordinator.ending(), None, "a gap below 4 is being walked");
        workers.offer(&mut coordinator, id, now);
    }
    while !workers.asked.is_empty() {
        workers.send(&mut coordinator, 0, now);
    }
    assert_eq!(
        coordinator.ending(),
        Some(Ending::Interrupted),
        "the job does not wait for 5, beyond all others"
    );
    assert_eq!(coordinator.prefix(), &large(walks + below));
    assert_eq!(workers.leases.values().map(VecDeque::len).sum::<usize>(), 1);
}

#[test]
fn a_stop_waits_for_large_results_no_longer_than_is_said() {
    let (mut coordinator, mut workers) = stopped();
    // The results of 1 and 3 never come.
    while !workers.asked.is_empty() {
        workers.send(&mut coordinator, 0, Duration::ZERO);
    }
    workers.read(coordinator.on_tick(Duration::from_secs(3)));
    assert_eq!(coordinator.ending(), None);
    let walks = coordinator.prefix().counts.walks;
    workers.read(coordinator.on_tick(Duration::from_millis(3100)));
    assert_eq!(coordinator.ending(), Some(Ending::Interrupted));
    assert!(walks > 0 && coordinator.prefix() == &large(walks));
}

/// A standstill of all workers. Two workers have two leases each, of ten walks, 0 … 3; looks are at 20 and 40 walks,
/// across which nothing is merged. While a checkpoint of 0 is written, 2 and 3 come in, and 1 continues the prefix that
/// is being read. With 4, 5 and 6 both workers keep all results that they can keep. When the checkpoint is written, no
/// worker sends anything any more.
#[test]
fn what_continues_the_prefix_is_asked_for_though_a_checkpoint_reads_it() {
    let mut coordinator = coordinator(JobPlan { looks: vec![20, 40], ..large_plan(5000) });
    let mut workers = Workers::default();
    (0..2).for_each(|id| workers.join(&mut coordinator, id));
    let now = Duration::from_millis(1);
    workers.offer(&mut coordinator, 0, now);
    workers.send(&mut coordinator, 0, now);
    let held = coordinator.past();
    for _ in 0..2 {
        workers.offer(&mut coordinator, 1, now);
        workers.send(&mut coordinator, 0, now);
    }
    for id in [0, 0, 1, 1] {
        workers.offer(&mut coordinator, id, now);
    }
    drop(held);
    workers.read(coordinator.on_tick(Duration::from_secs(1)));
    assert!(workers.asked.contains(&(0, 1)), "{:?}", workers.asked);
    let mut now = Duration::from_secs(1);
    while coordinator.prefix().counts.walks < 50 {
        now += Duration::from_millis(50);
        assert!(now < Duration::from_secs(3), "no worker is asked any more");
        workers.read(coordinator.on_tick(now));
        while !workers.asked.is_empty() {
            workers.send(&mut coordinator, 0, now);
        }
    }
}

/// The tally of walks of a large scene, by what each of them scores: any mix-up of walks shows.
fn distinct(walks: Range<u64>) -> Tally {
    let number = walks.end - walks.start;
    let counts = Counts { walks: number, rays: number, absorbed: number, ..Counts::default() };
    let score = walks.map(|n| u128::from(crate::toy::hash(n) >> 40)).sum();
    let sums = vec![score; PATCHES * LAYOUT.columns()];
    Tally::from_parts(counts, PATCHES, LAYOUT, sums).unwrap()
}

/// How a worker dies that has offered a result.
#[derive(Clone, Copy, Debug)]
enum Death {
    /// The connection of the worker closes.
    Closed,
    /// The worker's connection closes when a part of the result has come.
    HalfSent,
    /// Nothing is heard from it.
    Silent,
}

/// A coordinator and honest workers, whose results tell their walks apart.
struct Stage {
    coordinator: Coordinator,
    /// By peer and number.
    leases: BTreeMap<(PeerId, u64), Range<u64>>,
    /// Leases that are not offered yet.
    given: VecDeque<(PeerId, u64)>,
    /// Offers that the coordinator has room for.
    asked: VecDeque<(PeerId, u64)>,
}

impl Stage {
    fn new(paths: u64, workers: u64) -> Self {
        let coordinator = coordinator(large_plan(paths));
        let mut stage =
            Stage { coordinator, leases: BTreeMap::new(), given: VecDeque::new(), asked: VecDeque::new() };
        for id in 0..workers {
            let actions = stage.coordinator.on_connect(id);
            stage.read(actions);
            stage.hear(id, ToCoordinator::Hello(crate::toy::hello("large", 1)), Duration::ZERO);
            stage.hear(id, READY, Duration::ZERO);
        }
        stage
    }

    fn read(&mut self, actions: Vec<Action>) {
        for action in actions {
            match action {
                Action::Send(id, ToWorker::Lease { id: lease, first_walk, walks }) => {
                    self.leases.insert((id, lease), first_walk..first_walk + walks);
                    self.given.push_back((id, lease));
                }
                Action::Send(id, ToWorker::Send { lease }) => self.asked.push_back((id, lease)),
                _ => {}
            }
        }
    }

    fn hear(&mut self, id: PeerId, message: ToCoordinator, now: Duration) {
        let actions = self.coordinator.on_message(id, message, now);
        self.read(actions);
    }

    fn result(&self, (id, lease): (PeerId, u64)) -> LeaseResult {
        result_of(lease, &distinct(self.leases[&(id, lease)].clone()))
    }

    fn offer(&mut self, (id, lease): (PeerId, u64), now: Duration) {
        let bytes = self.result((id, lease)).sums.len() as u64;
        self.hear(id, ToCoordinator::Offer { lease, bytes }, now);
    }

    fn deliver(&mut self, (id, lease): (PeerId, u64), now: Duration) {
        let mut result = self.result((id, lease));
        while result.sums.len() > PIECE {
            let sums = result.sums.drain(..PIECE).collect();
            self.hear(id, ToCoordinator::Piece { lease, sums }, now);
        }
        self.hear(id, ToCoordinator::Result(result), now);
    }
}

/// Two workers, of which the first dies between the offer of its first result and the delivery. The other one does the rest: it walks
/// the dead worker's walks, too, and the tally is that of walks 0 … N − 1, each once.
#[test]
fn a_worker_that_dies_between_offer_and_delivery_leaves_no_trace() {
    const PATHS: u64 = 400;
    for death in [Death::Closed, Death::HalfSent, Death::Silent] {
        let mut stage = Stage::new(PATHS, 2);
        let at = stage.given.iter().position(|&(id, _)| id == 0).expect("a lease of the first worker");
        let first = stage.given.remove(at).unwrap();
        let lost = stage.leases[&first].clone();
        stage.offer(first, Duration::ZERO);
        assert_eq!(stage.asked.pop_front(), Some(first), "the prefix waits for it: it is asked for");
        let mut now = Duration::from_secs(1);
        if let Death::HalfSent = death {
            let sums = stage.result(first).sums[..PIECE].to_vec();
            stage.hear(0, ToCoordinator::Piece { lease: first.1, sums }, now);
        }
        let actions = match death {
            Death::Closed | Death::HalfSent => stage.coordinator.on_lost(0, "its connection closed", now),
            Death::Silent => {
                now = Duration::from_secs(30);
                stage.hear(1, ToCoordinator::Alive { progress: 1 }, now);
                stage.coordinator.on_tick(now)
            }
        };
        stage.read(actions);
        stage.given.retain(|&(id, _)| id == 1);
        let mut walked_again = false;
        while stage.coordinator.ending().is_none() {
            now += Duration::from_millis(1);
            if let Some(asked) = stage.asked.pop_front() {
                stage.deliver(asked, now);
            } else if let Some(lease) = stage.given.pop_front() {
                walked_again |= stage.leases[&lease].contains(&lost.start);
                stage.offer(lease, now);
            } else {
                now += Duration::from_secs(1);
                assert!(
                    now < Duration::from_secs(300),
                    "{death:?}: no lease comes, and the job does not end"
                );
                stage.hear(1, ToCoordinator::Alive { progress: now.as_secs() }, now);
                let actions = stage.coordinator.on_tick(now);
                stage.read(actions);
            }
        }
        assert_eq!(stage.coordinator.ending(), Some(Ending::BudgetSpent), "{death:?}");
        assert!(walked_again, "{death:?}");
        assert_eq!(stage.coordinator.prefix(), &distinct(0..PATHS), "{death:?}");
    }
}
