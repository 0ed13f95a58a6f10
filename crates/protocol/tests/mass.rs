//! Tests of a coordinator's memory and time when workers are many, or claim to be; bytes are counted by the allocator.

#![expect(clippy::disallowed_methods, reason = "it says how long losing many workers takes")]

#[path = "toy/counting.rs"]
mod counting;
mod toy;

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use counting::{HELD, MOST, megabytes};
use protocol::message::{ToCoordinator, ToWorker};
use protocol::{Action, Coordinator, Lead, PeerId};
use toy::{READY, coordinator, hello, plan, result};

/// Lets workers join. Returns the number of leases that they get.
fn join(coordinator: &mut Coordinator, ids: Range<PeerId>, threads: u32, now: Duration) -> usize {
    ids.map(|id| {
        coordinator.on_connect(id);
        coordinator.on_message(id, ToCoordinator::Hello(hello(&format!("w{id}"), threads)), now);
        let actions = coordinator.on_message(id, READY, now);
        actions.iter().filter(|action| matches!(action, Action::Send(..))).count()
    })
    .sum()
}

/// All in one test, so that no other test's memory is counted.
///
/// First, 1,600 workers of 64 threads die at once and others come, ten times over: a lease takes the same time and
/// memory however many were lost before. Then 170 workers claim a billion threads each and deliver results, so that
/// ever more of their threads are believed.
#[test]
fn a_hundred_thousand_slots_come_and_go_and_claims_are_bounded() {
    let (peers, threads) = (1600, 64);
    let slots = peers as usize * threads as usize;
    let mut coordinator = coordinator(plan(1 << 50, 1000));
    let bare = HELD.load(Ordering::Relaxed);
    MOST.store(bare, Ordering::Relaxed);
    let mut held = Vec::new();
    for round in 0..10 {
        let now = Duration::from_secs(round);
        let began = Instant::now();
        let ids = round * peers..(round + 1) * peers;
        assert_eq!(join(&mut coordinator, ids.clone(), threads, now), 2 * slots);
        let leased = began.elapsed().as_secs_f64();
        held.push(HELD.load(Ordering::Relaxed) - bare);
        let began = Instant::now();
        ids.for_each(|id| _ = coordinator.on_lost(id, "the power went", now));
        println!("{} leases in {leased:.2} s, all lost in {:.2} s", 2 * slots, began.elapsed().as_secs_f64());
    }
    let most = MOST.load(Ordering::Relaxed) - bare;
    println!("{:.1} MiB held after the first, at most {:.1} MiB", megabytes(held[0]), megabytes(most));
    assert!(most < 2 * slots * 600, "{} bytes a lease", most / (2 * slots));
    assert!(held[9] < held[1] + held[1] / 4, "what is lost is forgotten: {held:?}");

    let (bare, boasters) = (HELD.load(Ordering::Relaxed), 1_000_000..1_000_170);
    MOST.store(bare, Ordering::Relaxed);
    let now = Duration::from_secs(20);
    let mut todo: VecDeque<(PeerId, u64, Range<u64>)> = VecDeque::new();
    let read = |todo: &mut VecDeque<_>, actions: Vec<Action>| {
        for action in actions {
            if let Action::Send(peer, ToWorker::Lease { id, first_walk, walks }) = action {
                todo.push_back((peer, id, first_walk..first_walk + walks));
            }
        }
    };
    let began = Instant::now();
    for id in boasters.clone() {
        coordinator.on_connect(id);
        coordinator.on_message(id, ToCoordinator::Hello(hello(&format!("b{id}"), 1_000_000_000)), now);
        let actions = coordinator.on_message(id, READY, now);
        read(&mut todo, actions);
    }
    assert_eq!(todo.len(), 170 * 128, "64 threads each are believed");
    // After 63 results of each worker, its whole claim of 4,096 threads would be believed.
    let mut brought = vec![0; 170];
    let mut out = todo.len();
    for _ in 0..170 * 128 {
        let (peer, lease, walks) = todo.pop_front().expect("leases");
        let place = (peer - boasters.start) as usize;
        if brought[place] < 63 {
            brought[place] += 1;
            // Walks of streams that begin alike would take long to score; only the counts matter here.
            let actions = coordinator.on_message(peer, ToCoordinator::Result(result(lease, walks)), now);
            out -= 1;
            let before = todo.len();
            read(&mut todo, actions);
            out += todo.len() - before;
        }
    }
    let most = MOST.load(Ordering::Relaxed) - bare;
    let claimed = 170 * 4096;
    println!(
        "{claimed} threads are claimed: {out} leases are out after {:.2} s, {:.1} MiB",
        began.elapsed().as_secs_f64(),
        megabytes(most)
    );
    assert!(brought.iter().all(|&results| results == 63));
    assert!(out <= 2 * ((1 << 18) + 170) && out > 1 << 18, "{out} leases are out");
}
