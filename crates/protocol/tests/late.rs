//! Tests of a job's end: walks that are late are leased again to workers that have nothing else to do, and come in
//! once.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::time::Duration;

use crate::toy::{LAYOUT, READY, coordinator, hello, plan, result, result_of, straight};
use protocol::message::{LeaseResult, PIECE, ToCoordinator, ToWorker};
use protocol::{Action, Coordinator, Ending, JobPlan, Lead, Notice, PeerId, SILENCE};
use radiosity::{Counts, Tally};

const TICK: Duration = Duration::from_millis(50);

/// The leases that a worker was given and has not walked.
type Todo = VecDeque<(u64, Range<u64>)>;

/// A coordinator and its workers, some of which are slow.
struct Farm {
    coordinator: Coordinator,
    now: Duration,
    todo: BTreeMap<PeerId, Todo>,
    /// The messages that workers were sent beside leases.
    sent: BTreeMap<PeerId, Vec<ToWorker>>,
    lost: usize,
}

impl Farm {
    fn new(plan: JobPlan, workers: u64) -> Self {
        let (todo, sent) = (BTreeMap::new(), BTreeMap::new());
        let mut farm = Farm { coordinator: coordinator(plan), now: Duration::ZERO, todo, sent, lost: 0 };
        (0..workers).for_each(|id| farm.join(id));
        farm
    }

    fn join(&mut self, id: PeerId) {
        self.todo.insert(id, Todo::new());
        let actions = self.coordinator.on_connect(id);
        self.act(actions);
        self.say(id, ToCoordinator::Hello(hello(&format!("worker {id}"), 1)));
        self.say(id, READY);
    }

    fn act(&mut self, actions: Vec<Action>) {
        for action in actions {
            match action {
                Action::Send(id, ToWorker::Lease { id: lease, first_walk, walks }) => {
                    assert_eq!(self.coordinator.ending(), None);
                    self.todo.get_mut(&id).unwrap().push_back((lease, first_walk..first_walk + walks));
                }
                Action::Send(id, message) => self.sent.entry(id).or_default().push(message),
                Action::Close(id) => {
                    self.todo.remove(&id);
                }
                Action::Tell(Notice::Joined { .. }) => {}
                Action::Tell(_) => self.lost += 1,
            }
        }
    }

    fn say(&mut self, id: PeerId, message: ToCoordinator) {
        let actions = self.coordinator.on_message(id, message, self.now);
        self.act(actions);
    }

    /// Lets a worker walk its first lease, if it has any, at a pace of 0.1 s per hundred walks.
    fn work(&mut self, id: PeerId) -> Option<Range<u64>> {
        let (lease, walks) = self.todo.get_mut(&id)?.pop_front()?;
        let seconds = 1e-3 * (walks.end - walks.start) as f64;
        self.say(id, ToCoordinator::Result(LeaseResult { seconds, ..result(lease, walks.clone()) }));
        Some(walks)
    }

    /// Lets workers walk until they have no leases.
    fn work_off(&mut self, workers: Range<PeerId>) {
        while workers.clone().any(|id| self.work(id).is_some()) {}
    }

    /// Lets time pass; all workers but the `silent` send heartbeats.
    fn pass(&mut self, time: Duration, silent: &[PeerId]) {
        let until = self.now + time;
        while self.now < until {
            self.now += TICK;
            let speaking: Vec<PeerId> = self.todo.keys().copied().filter(|id| !silent.contains(id)).collect();
            for id in speaking {
                self.say(id, ToCoordinator::Alive { progress: self.now.as_millis() as u64 });
            }
            let actions = self.coordinator.on_tick(self.now);
            self.act(actions);
        }
    }

    #[track_caller]
    fn ends(&self, walks: u64) {
        assert_eq!(self.coordinator.ending(), Some(Ending::BudgetSpent));
        assert_eq!(self.coordinator.prefix(), &straight(0..walks));
        assert_eq!(self.lost, 0, "no worker was given up");
    }
}

#[test]
fn a_silent_worker_does_not_hold_the_end() {
    let mut farm = Farm::new(plan(10_000, 100), 3);
    // Worker 0 falls silent at once; the others walk all the rest.
    farm.work_off(1..3);
    assert!(farm.coordinator.progress().walks < 10_000, "it holds leases");
    let held = farm.todo[&0].clone();
    // The coordinator waits for it until it is late: two leases of 0.25 s each, twice.
    farm.pass(Duration::from_millis(900), &[0]);
    assert!(farm.todo[&1].is_empty() && farm.todo[&2].is_empty(), "nothing is late yet");
    farm.pass(Duration::from_millis(300), &[0]);
    let again: Vec<_> = farm.todo[&1].iter().chain(&farm.todo[&2]).map(|(_, walks)| walks.clone()).collect();
    let held: Vec<_> = held.into_iter().map(|(_, walks)| walks).collect();
    assert_eq!(again, held, "each of its leases, the first to the first");
    farm.work_off(1..3);
    farm.ends(10_000);
    assert!(farm.now < SILENCE);
    // A stream has 100 walks; a lease of the silent worker is one or more streams.
    let streams: u64 = held.iter().map(|walks| (walks.end - walks.start).div_ceil(100)).sum();
    assert_eq!(farm.coordinator.effort().streams_reissued, streams);
}

#[test]
fn the_first_result_counts_and_the_slow_worker_is_not_punished() {
    for slow_is_first in [false, true] {
        let mut farm = Farm::new(plan(1000, 100), 2);
        farm.work_off(1..2);
        farm.pass(Duration::from_millis(1200), &[]);
        assert_eq!((farm.todo[&0].len(), farm.todo[&1].len()), (2, 1), "one at a time");
        let (_, walks) = farm.todo[&0][0].clone();
        let order = if slow_is_first { [0, 1] } else { [1, 0] };
        for id in order {
            assert_eq!(farm.work(id), Some(walks.clone()));
        }
        assert!(farm.coordinator.ending().is_none() && farm.lost == 0, "the second of the same is dropped");
        assert_eq!(farm.coordinator.progress().walks, 1000 - (walks.end - walks.start));
        // Worker 1 may have another copy by now; either worker's result ends the job.
        farm.pass(Duration::from_millis(1200), &[]);
        farm.work(if slow_is_first { 1 } else { 0 }).unwrap();
        farm.ends(1000);
        let by: Vec<u32> =
            farm.coordinator.past().deliveries.entries().iter().map(|delivery| delivery.worker).collect();
        assert!(by.contains(&0) && by.contains(&1));
    }
}

#[test]
fn a_late_lease_is_given_ever_more_rarely_and_never_twice_to_one_thread() {
    let mut farm = Farm::new(plan(700, 100), 6);
    // Six workers have one lease each, and one has a second; five of them wait for leases and fall silent with what
    // they get.
    farm.work_off(1..6);
    farm.pass(Duration::from_secs(8), &[]);
    let held = farm.todo[&0].clone();
    for (_, walks) in &held {
        let copies = farm.todo.values().filter(|todo| todo.iter().any(|(_, other)| other == walks)).count();
        // Two more copies are given out after one second, and four more after that.
        assert!((3..=4).contains(&copies), "{walks:?}: {copies}");
    }
    for todo in farm.todo.values() {
        let mut walks: Vec<_> = todo.iter().map(|(_, walks)| walks.start).collect();
        walks.dedup();
        assert_eq!(walks.len(), todo.len());
    }
    // A copy whose worker is lost makes room for another; its walks stay out with the other copies.
    let holder = *farm.todo.iter().find(|(id, todo)| **id != 0 && !todo.is_empty()).unwrap().0;
    let walks = farm.todo[&holder][0].1.clone();
    let actions = farm.coordinator.on_lost(holder, "gone", farm.now);
    farm.act(actions);
    farm.lost = 0;
    farm.pass(Duration::from_secs(5), &[]);
    let copies = farm.todo.values().filter(|todo| todo.iter().any(|(_, other)| *other == walks)).count();
    assert!((3..=4).contains(&copies), "{copies}");
    farm.work_off(0..6);
    farm.ends(700);
}

#[test]
fn while_there_is_something_new_to_do_only_what_holds_up_the_prefix_for_long_is_shot_twice() {
    let mut farm = Farm::new(plan(1_000_000, 100), 2);
    let mut reissued = Vec::new();
    for _ in 0..40 {
        farm.work(1);
        farm.pass(Duration::from_millis(250), &[]);
        reissued.push(farm.coordinator.effort().streams_reissued);
    }
    // Four seconds are four times the patience with late leases at the end.
    assert_eq!(reissued[14], 0);
    assert!(reissued[39] > 0 && farm.coordinator.prefix().counts.walks > 0);
}

#[test]
fn a_large_result_that_others_have_brought_is_not_asked_for() {
    const PATCHES: usize = 4096;
    const SCORE: u128 = 1 << 20;
    let big = |walks: &Range<u64>| {
        let walked = walks.end - walks.start;
        let counts = Counts { walks: walked, rays: walked, absorbed: walked, ..Counts::default() };
        result_of(0, &Tally::from_parts(counts, PATCHES, LAYOUT, vec![SCORE; PATCHES * 2]).unwrap())
    };
    let bytes = big(&(0..1)).sums.len() as u64;
    let offer = |farm: &mut Farm, id: PeerId, walks: Range<u64>| {
        let (lease, mine) = farm.todo.get_mut(&id).unwrap().pop_front().unwrap();
        assert_eq!(mine, walks);
        farm.say(id, ToCoordinator::Offer { lease, bytes });
        (lease, walks)
    };
    let bring = |farm: &mut Farm, id: PeerId, (lease, walks): (u64, Range<u64>)| {
        assert_eq!(farm.sent.get_mut(&id).unwrap().pop(), Some(ToWorker::Send { lease }));
        let mut result = LeaseResult { lease, ..big(&walks) };
        let rest = result.sums.split_off(PIECE);
        farm.say(id, ToCoordinator::Piece { lease, sums: std::mem::replace(&mut result.sums, rest) });
        farm.say(id, ToCoordinator::Result(result));
    };
    for offered_before in [true, false] {
        let mut farm = Farm::new(JobPlan { patches: PATCHES, ..plan(300, 100) }, 2);
        let first = offer(&mut farm, 1, 200..300);
        bring(&mut farm, 1, first);
        farm.pass(Duration::from_secs(3), &[]);
        // Worker 1 has nothing else to do, and also walks the first lease of worker 0.
        let copy = offer(&mut farm, 1, 0..100);
        let lease = if offered_before {
            // There is no room for both results.
            let (lease, _) = offer(&mut farm, 0, 0..100);
            bring(&mut farm, 1, copy);
            lease
        } else {
            bring(&mut farm, 1, copy);
            offer(&mut farm, 0, 0..100).0
        };
        assert_eq!(farm.sent.get_mut(&0).unwrap().pop(), Some(ToWorker::Drop { lease }));
        let last = offer(&mut farm, 0, 100..200);
        bring(&mut farm, 0, last);
        assert_eq!(farm.coordinator.ending(), Some(Ending::BudgetSpent));
        assert_eq!(farm.coordinator.prefix().counts.walks, 300);
        assert!(farm.coordinator.prefix().sums().iter().all(|&sum| sum == 3 * SCORE), "each came in once");
        assert_eq!(farm.lost, 0);
    }
}
