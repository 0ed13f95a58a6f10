//! Tests with peers that know the key and lie, over sockets: each lies while an honest worker works. The tally is that
//! of the honest worker, and the owner is told of the liar by its name. A peer that sent an impossible result is not
//! let in again.

use std::ops::Range;
use std::thread;

use crate::net::{BULK, Bulky, Raw, Run, SINGLE, assert_done, bulky, honest, identity, never, run};
use crate::toy::{JOB_HASH, READY, SCENE_HASH, hello, plan, result, result_of, sealed};
use cluster::{Access, work};
use protocol::message::{Hello, LeaseResult, PIECE, ToCoordinator, ToWorker};
use protocol::{Deliveries, Delivery, JobPlan, LeaseProvenance, Limits};

const PATHS: u64 = 20_000;

/// A liar that has introduced itself.
fn enter(access: &Access, hello: Hello) -> Raw {
    let mut raw = Raw::connect(access);
    raw.say(&ToCoordinator::Hello(hello));
    assert!(matches!(raw.message(), ToWorker::Welcome { .. }));
    raw
}

/// A liar with its first lease.
fn join(access: &Access, hello: Hello) -> (Raw, u64, Range<u64>) {
    let relays = hello.relays;
    let mut raw = enter(access, hello);
    raw.say(&READY);
    if relays {
        raw.say(&ToCoordinator::Capacity { threads: 1 << 20, lease_seconds: 1e300 });
    }
    let ToWorker::Lease { id, first_walk, walks } = raw.message() else { panic!("no lease") };
    (raw, id, first_walk..first_walk + walks)
}

/// The fate of a liar.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    /// The liar is found out, named, and not let in again.
    Banned,
    /// The liar is dropped and named.
    Dropped,
    /// The liar does no harm.
    Harmless,
}
use Fate::{Banned, Dropped, Harmless};

/// Runs a job of an honest worker and a liar. `lie` returns once it has lied; the honest worker comes then.
fn against(name: &str, fate: Fate, relays: bool, lie: impl FnOnce(&Access, Hello) -> Option<Raw> + Send) {
    let hello = Hello { relays, ..hello(name, u32::from(!relays)) };
    let run = run(plan(PATHS, 10), never, |access| {
        let raw = lie(access, hello.clone());
        match raw {
            Some(raw) if fate != Harmless => raw.until_dropped(),
            // The liar stays to the end, and sends nothing more.
            Some(raw) => {
                thread::scope(|scope| {
                    scope.spawn(|| honest(access, 1));
                    raw.until_dropped();
                });
                return;
            }
            None => {}
        }
        if fate == Banned {
            let mut again = Raw::connect(access);
            again.say(&ToCoordinator::Hello(hello));
            let message = again.message();
            assert!(
                matches!(&message, ToWorker::Refused { reason } if reason.contains("impossible result")),
                "{message:?}"
            );
        }
        honest(access, 1);
    });
    assert_done(&run, PATHS);
    let named = notices(&run, name);
    let wanted = match fate {
        Banned => 2,
        Dropped => 1,
        Harmless => 0,
    };
    assert_eq!(named, wanted, "{name}: {:?}", run.notices);
    let faults = |name: &str| {
        let workers = run.coordinator.past().workers;
        workers.iter().find(|worker| worker.name == name).map_or(0, |worker| worker.faults)
    };
    assert_eq!(faults(name), u64::from(fate == Banned), "{name}");
    assert_eq!(faults("a worker"), 0);
}

/// The number of notices about a worker.
fn notices(run: &Run, name: &str) -> usize {
    run.notices.iter().filter(|notice| notice.contains(name)).count()
}

/// Checks a liar that changes the result of its first lease.
fn changed(name: &str, change: impl FnOnce(LeaseResult) -> LeaseResult + Send) {
    against(name, Banned, false, |access, hello| {
        let (mut raw, lease, walks) = join(access, hello);
        raw.say(&ToCoordinator::Result(change(result(lease, walks))));
        Some(raw)
    });
}

fn with_sum(mut result: LeaseResult, sum: u128) -> LeaseResult {
    let mut sums: Vec<u128> = protocol::codec::unpack(&result.sums).map(Result::unwrap).collect();
    sums[2] = sum;
    result.sums = protocol::codec::pack(&sums);
    sealed(result)
}

#[test]
fn results_that_cannot_be_are_refused_and_their_senders_banned() {
    let with_count = |place: usize, change: fn(u128) -> u128| {
        move |mut result: LeaseResult| {
            result.counts[place] = change(result.counts[place]);
            sealed(result)
        }
    };
    changed("one more walk than asked for", with_count(0, |walks| walks + 1));
    changed("one walk ended twice", with_count(2, |absorbed| absorbed + 1));
    changed("one walk did not end", with_count(2, |absorbed| absorbed - 1));
    changed("all the rays there are", with_count(1, |_| u64::MAX.into()));
    changed("more rays than there are", |mut result| {
        result.counts[1] = 1 << 64;
        result
    });
    changed("a sum of 2^90", |result| with_sum(result, 1 << 90));
    changed("a sum of 2^128 - 1", |result| with_sum(result, u128::MAX));
    changed("another digest", |result| LeaseResult { digest: result.digest ^ 1, ..result });
    changed("too few patches", |mut result| {
        result.sums = protocol::codec::pack(&[1, 1]);
        result
    });
    changed("too many patches", |mut result| {
        result.sums.extend(protocol::codec::pack(&[1, 1]));
        result
    });
}

/// Checks a relay that reports an impossible provenance of its first lease.
fn provenance(name: &str, change: impl FnOnce(&mut LeaseProvenance) + Send) {
    against(name, Banned, true, |access, hello| {
        let (mut raw, lease, walks) = join(access, hello);
        let mut result = result(lease, walks.clone());
        let part = Delivery::lease(walks.end - walks.start, 0, result.digest);
        result.provenance = LeaseProvenance { names: vec!["w".into()], parts: vec![part] };
        change(&mut result.provenance);
        raw.say(&ToCoordinator::Result(result));
        Some(raw)
    });
}

#[test]
fn relays_that_tell_what_cannot_be_of_their_workers_are_banned() {
    provenance("of no parts", |provenance| *provenance = LeaseProvenance::default());
    provenance("of other walks", |provenance| provenance.parts[0].walks += 1);
    provenance("of walks without end", |provenance| {
        provenance.parts = vec![Delivery { walks: u64::MAX, ..provenance.parts[0] }; 2]
    });
    provenance("of another digest", |provenance| provenance.parts[0].digest ^= 1);
    provenance("of a digest that is none", |provenance| provenance.parts[0].digest = u64::MAX);
    provenance("of a worker that it does not name", |provenance| provenance.parts[0].worker = 1);
    provenance("of one lease as many", |provenance| provenance.parts[0].leases = u64::MAX);
    provenance("of too many parts", |provenance| {
        let rest = Delivery { walks: 0, digest: 0, ..provenance.parts[0] };
        provenance.parts.extend([rest; Deliveries::MOST_PARTS]);
    });
    provenance("of names in colour", |provenance| provenance.names[0] = "\u{1b}[31mred".into());
    provenance("of a worker behind too many", |provenance| provenance.names[0] = ["w"; 9].join(" > "));
    changed("a worker with parts", |result| {
        let parts = vec![Delivery::lease(u64::from(result.counts[0] as u32), 0, result.digest)];
        LeaseResult { provenance: LeaseProvenance { names: vec!["w".into()], parts }, ..result }
    });
    // No frame may be that long.
    against("of a name without end", Dropped, true, |access, hello| {
        let (mut raw, lease, walks) = join(access, hello);
        let names = vec!["w".repeat(1 << 20)];
        let result = result(lease, walks);
        let result = LeaseResult { provenance: LeaseProvenance { names, parts: vec![] }, ..result };
        let said = raw.sealed(&ToCoordinator::Result(result));
        // The coordinator may hang up in the middle of it.
        let _ = std::io::Write::write_all(&mut raw.stream, &said);
        Some(raw)
    });
}

#[test]
fn results_that_were_not_asked_for_are_not_taken() {
    against("of a lease that is another's", Dropped, false, |access, hello| {
        let (_other, lease, walks) = join(access, crate::toy::hello("the other", 1));
        let (mut raw, ..) = join(access, hello);
        raw.say(&ToCoordinator::Result(result(lease, walks)));
        Some(raw)
    });
    against("of a lease that never was", Dropped, false, |access, hello| {
        let (mut raw, lease, walks) = join(access, hello);
        raw.say(&ToCoordinator::Result(result(lease + 1_000_000, walks)));
        Some(raw)
    });
    against("twice", Dropped, false, |access, hello| {
        let (mut raw, lease, walks) = join(access, hello);
        raw.say(&ToCoordinator::Result(result(lease, walks.clone())));
        raw.say(&ToCoordinator::Result(result(lease, walks)));
        Some(raw)
    });
    // A lease of a connection that has ended belongs to another worker, or to none.
    against("stale", Dropped, false, |access, hello| {
        let (first, lease, walks) = join(access, Hello { name: "before".into(), ..hello.clone() });
        drop(first);
        let (mut raw, ..) = join(access, hello);
        raw.say(&ToCoordinator::Result(result(lease, walks)));
        Some(raw)
    });
    // A small result need not be offered, and the offer does not fit.
    against("offers a small result", Dropped, false, |access, hello| {
        let (mut raw, lease, _) = join(access, hello);
        raw.say(&ToCoordinator::Offer { lease, bytes: 1 << 40 });
        Some(raw)
    });
}

#[test]
fn floods_are_cut_off() {
    against("a flood of heartbeats", Dropped, false, |access, hello| {
        let (mut raw, ..) = join(access, hello);
        flood(&mut raw, |n| ToCoordinator::Alive { progress: n });
        Some(raw)
    });
    against("a flood of capacities", Dropped, true, |access, hello| {
        let (mut raw, ..) = join(access, hello);
        flood(&mut raw, |n| ToCoordinator::Capacity { threads: n as u32 % 2, lease_seconds: 0.0 });
        Some(raw)
    });
    against("a flood of returned leases", Dropped, true, |access, hello| {
        let (mut raw, mut lease, _) = join(access, hello);
        loop {
            let said = raw.sealed(&ToCoordinator::Return { lease });
            if std::io::Write::write_all(&mut raw.stream, &said).is_err() {
                break;
            }
            // Each is answered with another lease, as long as the relay is believed.
            match next_lease(&mut raw) {
                Some(next) => lease = next,
                None => break,
            }
        }
        Some(raw)
    });
}

/// Sends more messages than any peer may; the coordinator may hang up in the middle of it.
fn flood(raw: &mut Raw, message: impl Fn(u64) -> ToCoordinator) {
    for n in 0..50_000 {
        let said = raw.sealed(&message(n));
        if std::io::Write::write_all(&mut raw.stream, &said).is_err() {
            return;
        }
    }
}

/// The number of the next lease; `None` if the coordinator has hung up.
fn next_lease(raw: &mut Raw) -> Option<u64> {
    loop {
        if let Some(message) = raw.inbound.next::<ToWorker>(1 << 20).unwrap() {
            match message {
                ToWorker::Lease { id, .. } => return Some(id),
                _ => continue,
            }
        }
        let mut bytes = [0; 1000];
        match std::io::Read::read(&mut raw.stream, &mut bytes) {
            Ok(read @ 1..) => raw.inbound.arrived(&bytes[..read]),
            _ => return None,
        }
    }
}

#[test]
fn claims_and_promises_do_no_harm() {
    against("a billion threads", Harmless, false, |access, hello| {
        let (raw, ..) = join(access, Hello { threads: 1_000_000_000, ..hello });
        Some(raw)
    });
    against("a relay of leases of 1e300 s", Harmless, true, |access, hello| {
        let (raw, ..) = join(access, hello);
        Some(raw)
    });
    against("seconds that are no number", Harmless, false, |access, hello| {
        let (mut raw, lease, walks) = join(access, hello);
        let result = LeaseResult { seconds: f64::NAN, cpu_seconds: f64::INFINITY, ..result(lease, walks) };
        raw.say(&ToCoordinator::Result(result));
        Some(raw)
    });
    // The worker reports progress for ever and brings nothing.
    against("heartbeats alone", Harmless, false, |access, hello| {
        let (mut raw, ..) = join(access, hello);
        for progress in 0..100 {
            raw.say(&ToCoordinator::Alive { progress });
        }
        Some(raw)
    });
}

#[test]
fn who_is_not_of_this_job_or_speaks_out_of_turn_is_sent_away() {
    for (name, ready) in [
        ("another scene", ToCoordinator::Ready { scene_hash: [9; 32], job_hash: JOB_HASH }),
        ("another job", ToCoordinator::Ready { scene_hash: SCENE_HASH, job_hash: [9; 32] }),
    ] {
        against(name, Dropped, false, |access, hello| {
            let mut raw = enter(access, hello);
            raw.say(&ready);
            assert!(matches!(raw.message(), ToWorker::Refused { reason } if reason.contains("differs")));
            Some(raw)
        });
    }
    against("ready twice", Dropped, false, |access, hello| {
        let (mut raw, ..) = join(access, hello);
        raw.say(&READY);
        Some(raw)
    });
    against("a relay that is none", Dropped, false, |access, hello| {
        let (mut raw, ..) = join(access, hello);
        raw.say(&ToCoordinator::Capacity { threads: 1 << 20, lease_seconds: 1.0 });
        Some(raw)
    });
}

/// Large results come in pieces. Pieces in another order do not match the digest; `liveness.rs` tests pieces that are
/// never sent.
#[test]
fn pieces_out_of_order_are_found_out() {
    let plan = JobPlan { patches: BULK, layout: SINGLE, limits: Limits::NONE, ..plan(400, 10) };
    let run = run(plan, never, |access| {
        let (mut raw, lease, walks) = join(access, hello("shuffles", 1));
        let mut result = result_of(lease, &bulky(walks.end - walks.start));
        raw.say(&ToCoordinator::Offer { lease, bytes: result.sums.len() as u64 });
        loop {
            match raw.message() {
                ToWorker::Lease { .. } => {}
                other => break assert_eq!(other, ToWorker::Send { lease }),
            }
        }
        let last = result.sums.split_off(result.sums.len() / PIECE * PIECE);
        for sums in result.sums.chunks(PIECE).rev() {
            raw.say(&ToCoordinator::Piece { lease, sums: sums.into() });
        }
        result.sums = last;
        raw.say(&ToCoordinator::Result(result));
        raw.until_dropped();
        let mut again = Raw::connect(access);
        again.say(&ToCoordinator::Hello(hello("shuffles", 1)));
        assert!(matches!(again.message(), ToWorker::Refused { .. }));
        work(access, &identity(1), |_| Ok(Bulky), || 1.0).unwrap();
    });
    assert!(run.coordinator.prefix() == &bulky(400), "{:?}", run.notices);
    assert_eq!(notices(&run, "shuffles"), 2, "{:?}", run.notices);
}

/// Ten liars come back under other names, while honest workers work.
#[test]
fn many_liars_at_once_do_not_change_the_tally() {
    let run = run(plan(10 * PATHS, 10), never, |access| {
        thread::scope(|scope| {
            for n in 0..10 {
                scope.spawn(move || {
                    for round in 0..10 {
                        let (mut raw, lease, walks) = join(access, hello(&format!("liar {n} of {round}"), 1));
                        let sum = (1 << 70) + u128::from(lease);
                        raw.say(&ToCoordinator::Result(with_sum(result(lease, walks), sum)));
                        raw.until_dropped();
                    }
                });
            }
        });
        honest(access, 2);
    });
    assert_done(&run, 10 * PATHS);
    let banned = run.coordinator.past().workers.iter().filter(|worker| worker.faults == 1).count();
    assert_eq!(banned, 100);
    assert!(run.notices.iter().any(|notice| notice.contains("lost worker liar")), "{:?}", run.notices);
}
