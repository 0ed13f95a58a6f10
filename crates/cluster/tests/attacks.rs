//! Tests with strangers, attackers between the two ends, and unsound workers: whatever they do, the honest run comes to
//! the same tally. Deadlines here only end a test that hangs.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use crate::net::{
    BULK, Bulky, Raw, SINGLE, assert_done, bulky, honest, identity, knock, never, run, toy_of, until_dropped,
};
use crate::toy::{BUILD, READY, SCENE_HASH, hash, plan, result_of};
use cluster::noise::{Greeting, HANDSHAKE_RECORD};
use cluster::{Access, Inbound, work};
use protocol::message::{LeaseResult, PIECE, ToCoordinator, ToWorker};
use protocol::{Coordinator, Ending, JobPlan, Limits};

/// What an attacker in between does to a record.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Attack {
    /// Flips a bit of the record's n-th byte from the end.
    Flip(usize),
    /// Sends the record twice.
    Replay,
    /// Leaves the record out.
    Drop,
    /// Sends the record after the next.
    Swap,
    /// Sends half of the record and hangs up.
    Cut,
}

#[derive(Clone, Copy, Debug)]
struct Plot {
    /// Whether it is done to what the worker sends.
    to_coordinator: bool,
    /// The number of the record, in the order in which they pass.
    record: usize,
    attack: Attack,
}

/// An attacker between a worker and the coordinator.
struct Relay {
    access: Access,
    /// The attack on the next connection.
    plot: Arc<Mutex<Option<Plot>>>,
}

impl Relay {
    fn to(coordinator: &Access) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let mut access = coordinator.clone();
        access.address = address;
        let plot = Arc::new(Mutex::new(None));
        let (coordinator, next) = (coordinator.address.clone(), plot.clone());
        thread::spawn(move || {
            for worker in listener.incoming().flatten() {
                let Ok(coordinator) = TcpStream::connect(&coordinator) else { return };
                let plot: Option<Plot> = next.lock().unwrap().take();
                let [there, back] = [true, false]
                    .map(|to_coordinator| plot.filter(|plot| plot.to_coordinator == to_coordinator));
                let (from, to) = (worker.try_clone().unwrap(), coordinator.try_clone().unwrap());
                thread::spawn(move || pass(&from, &to, there));
                thread::spawn(move || pass(&coordinator, &worker, back));
            }
        });
        Relay { access, plot }
    }
}

/// Passes records on until either end hangs up.
fn pass(from: &TcpStream, to: &TcpStream, plot: Option<Plot>) {
    let mut held = Vec::new();
    for number in 0.. {
        let Some(mut record) = read_record(from) else { break };
        let attack = plot.filter(|plot| plot.record == number).map(|plot| plot.attack);
        match attack {
            Some(Attack::Flip(byte)) => {
                let place = record.len() - 1 - byte;
                record[place] ^= 0x10;
            }
            Some(Attack::Replay) => record.extend(record.clone()),
            Some(Attack::Drop) => record.clear(),
            Some(Attack::Swap) => std::mem::swap(&mut held, &mut record),
            Some(Attack::Cut) => record.truncate(record.len() / 2),
            None => record.append(&mut held),
        }
        if (&mut &*to).write_all(&record).is_err() || attack == Some(Attack::Cut) {
            break;
        }
    }
    let _ = (to.shutdown(Shutdown::Both), from.shutdown(Shutdown::Both));
}

fn read_record(mut stream: &TcpStream) -> Option<Vec<u8>> {
    let mut record = vec![0; 2];
    stream.read_exact(&mut record).ok()?;
    record.resize(2 + usize::from(u16::from_le_bytes([record[0], record[1]])), 0);
    stream.read_exact(&mut record[2..]).ok()?;
    Some(record)
}

#[test]
fn no_change_by_an_attacker_in_between_is_taken_for_a_message() {
    use Attack::{Cut, Drop, Flip, Replay, Swap};
    // The records are the handshake, the introduction and the job; then heartbeats and hashes, results, and leases.
    let to_coordinator: [(usize, &[Attack]); 4] = [
        (0, &[Flip(0), Flip(40), Replay]),
        (1, &[Flip(0), Flip(20), Replay, Cut]),
        (2, &[Flip(3), Replay, Drop, Swap, Cut]),
        (4, &[Flip(0), Flip(16), Flip(30), Replay, Drop, Swap, Cut]),
    ];
    let to_worker: [(usize, &[Attack]); 3] = [
        (0, &[Flip(0), Flip(40)]),
        (1, &[Flip(0), Replay, Cut]),
        (2, &[Flip(0), Flip(16), Replay, Drop, Swap, Cut]),
    ];
    let run = run(plan(2_000_000, 1000), never, |access| {
        let relay = Relay::to(access);
        for (to_coordinator, plots) in [(true, &to_coordinator[..]), (false, &to_worker[..])] {
            for &(record, attacks) in plots {
                for &attack in attacks {
                    let plot = Plot { to_coordinator, record, attack };
                    *relay.plot.lock().unwrap() = Some(plot);
                    let ended = work(&relay.access, &identity(1), toy_of, || 1.0);
                    assert!(ended.is_err(), "{plot:?} was not noticed");
                    assert!(relay.plot.lock().unwrap().is_none());
                }
            }
        }
        // One worker connects directly, and one through an attacker that only listens.
        thread::scope(|scope| {
            scope.spawn(|| honest(access, 1));
            scope.spawn(|| honest(&relay.access, 1));
        });
    });
    assert_done(&run, 2_000_000);
    assert!(run.coordinator.effort().workers_lost > 10);
}

#[test]
fn what_was_recorded_is_of_no_use() {
    let run = run(plan(100_000, 1000), never, |access| {
        // An attacker has recorded this session, whose worker died at its first lease.
        let mut stream = knock(access);
        let (greeting, mut recorded) = Greeting::new(access);
        stream.write_all(&recorded).unwrap();
        let mut answer = [0; HANDSHAKE_RECORD];
        stream.read_exact(&mut answer).unwrap();
        let session = greeting.finish(&answer[2..]).unwrap();
        let inbound = Inbound::new(session.opener);
        let mut raw = Raw { stream, sealer: session.sealer, inbound };
        let mut rest = raw.sealed(&ToCoordinator::Hello(crate::toy::hello("recorded", 1)));
        rest.extend(raw.sealed(&READY));
        raw.stream.write_all(&rest).unwrap();
        assert!(matches!(raw.message(), ToWorker::Welcome { .. }));
        assert!(matches!(raw.message(), ToWorker::Lease { .. }));
        drop(raw);

        let replay = |first: &[u8]| {
            let mut stream = knock(access);
            stream.write_all(first).unwrap();
            // The coordinator may have hung up already.
            let _ = stream.write_all(&rest);
            until_dropped(stream);
        };
        replay(&recorded);
        // The recording is passed off as another worker's.
        recorded[2] ^= 1;
        replay(&recorded);
        // The recording is sent without its beginning.
        replay(&[]);
        honest(access, 2);
    });
    assert_done(&run, 100_000);
    let noticed = |words: &str| run.notices.iter().any(|notice| notice.contains(words));
    assert!(noticed("repeats a worker's first message"), "{:?}", run.notices);
    assert!(noticed("does not know the key"), "{:?}", run.notices);
    assert_eq!(run.coordinator.effort().workers_seen, 2);
}

/// Hundreds of connections send nothing, a part of the handshake, or a handshake without an introduction; all stay to
/// the end.
#[test]
fn silent_and_slow_connections_hold_up_no_worker() {
    let run = run(plan(200_000, 1000), never, |access| {
        let silent: Vec<TcpStream> = (0..200).map(|_| knock(access)).collect();
        let begun: Vec<TcpStream> = (0..100)
            .map(|n| {
                let mut stream = knock(access);
                let (_, record) = Greeting::new(access);
                stream.write_all(&record[..1 + n % 49]).unwrap();
                stream
            })
            .collect();
        let answered: Vec<Raw> = (0..50).map(|_| Raw::connect(access)).collect();
        for n in 0..100 {
            let mut noise = knock(access);
            let bytes: Vec<u8> = (0..n).map(|at| hash(1000 * n + at) as u8).collect();
            let _ = noise.write_all(&bytes);
        }
        let keyless = Access::new(access.address.clone(), BUILD, SCENE_HASH).unwrap();
        for _ in 0..50 {
            assert!(work(&keyless, &identity(1), toy_of, || 0.0).is_err());
        }
        honest(access, 2);
        drop((silent, begun, answered));
    });
    assert_done(&run, 200_000);
    assert_eq!((run.coordinator.effort().workers_seen, run.coordinator.effort().workers_lost), (1, 0));
    // Many strangers do not fill the terminal.
    assert!(run.notices.len() < 40 && run.notices.last().unwrap().contains("more connections"));
}

/// A stranger sends one byte every half second: it never falls silent, and is turned away after ten seconds.
#[test]
fn a_stranger_that_introduces_itself_too_slowly_is_turned_away() {
    let turned_away = AtomicBool::new(false);
    let run = run(
        plan(1 << 60, 1000),
        |_| turned_away.load(Ordering::Relaxed),
        |access| {
            thread::scope(|scope| {
                scope.spawn(|| {
                    let mut slow = knock(access);
                    let (_, record) = Greeting::new(access);
                    for byte in record {
                        if slow.write_all(&[byte]).is_err() {
                            break;
                        }
                        thread::sleep(Duration::from_millis(500));
                    }
                    turned_away.store(true, Ordering::Relaxed);
                });
                until_dropped_by_patience(access);
            });
        },
    );
    assert_eq!(run.ending, Ending::Interrupted);
    assert!(run.notices.iter().any(|notice| notice.contains("within 10 s")), "{:?}", run.notices);
}

/// Connects, sends nothing, and waits to be turned away.
fn until_dropped_by_patience(access: &Access) {
    let began = Instant::now();
    until_dropped(knock(access));
    // The stranger is not turned away at once.
    assert!(began.elapsed() > Duration::from_secs(5));
}

#[test]
fn workers_that_are_not_sound_are_dropped_with_what_they_sent() {
    let bulky_plan = JobPlan { patches: BULK, layout: SINGLE, limits: Limits::NONE, ..plan(400, 10) };
    let run = run(bulky_plan, never, |access| {
        let whole = |lease, walks: u64| result_of(lease, &bulky(walks));
        let join = || {
            let (raw, lease, walks) = Raw::join(access);
            (raw, lease, whole(lease, walks.end - walks.start))
        };
        let offer = |raw: &mut Raw, lease: u64, bytes: u64| {
            raw.say(&ToCoordinator::Offer { lease, bytes });
            loop {
                match raw.message() {
                    ToWorker::Lease { .. } => {}
                    other => break assert_eq!(other, ToWorker::Send { lease }),
                }
            }
        };
        let piece = |lease, sums: &[u8]| ToCoordinator::Piece { lease, sums: sums.into() };

        // The coordinator asked for no piece.
        let (mut raw, lease, result) = join();
        raw.say(&piece(lease, &result.sums[..PIECE]));
        raw.until_dropped();
        let (mut raw, lease, result) = join();
        let sums = result.sums[..PIECE].into();
        raw.say(&ToCoordinator::Result(LeaseResult { lease, sums, ..result }));
        raw.until_dropped();
        // A frame of four billion bytes, and an offer of more.
        let (mut raw, _, _) = join();
        raw.say_bytes(&u32::MAX.to_le_bytes());
        raw.until_dropped();
        let (mut raw, lease, _) = join();
        raw.say(&ToCoordinator::Offer { lease, bytes: u64::MAX });
        raw.until_dropped();
        // An offer comes twice; another one is of a lease that this worker does not have.
        let (mut raw, lease, result) = join();
        let bytes = result.sums.len() as u64;
        offer(&mut raw, lease, bytes);
        raw.say(&ToCoordinator::Offer { lease, bytes });
        raw.until_dropped();
        let (mut raw, lease, _) = join();
        raw.say(&ToCoordinator::Offer { lease: lease + 1000, bytes });
        raw.until_dropped();
        // Pieces are too short, or too many.
        let (mut raw, lease, result) = join();
        offer(&mut raw, lease, bytes);
        raw.say(&piece(lease, &result.sums[..PIECE - 1]));
        raw.until_dropped();
        let (mut raw, lease, result) = join();
        offer(&mut raw, lease, bytes);
        (0..=bytes as usize / PIECE).for_each(|_| raw.say(&piece(lease, &result.sums[..PIECE])));
        raw.until_dropped();
        // The result comes without its end, by half, and whole with a byte changed.
        for (sent, changed) in [(bytes as usize / PIECE, 0), (bytes as usize / PIECE / 2, 0), (usize::MAX, 1)]
        {
            let (mut raw, lease, mut result) = join();
            offer(&mut raw, lease, bytes);
            result.sums[1] ^= changed;
            let last = result.sums.len() / PIECE * PIECE;
            result.sums[..last].chunks(PIECE).take(sent).for_each(|sums| raw.say(&piece(lease, sums)));
            if changed != 0 {
                result.sums.drain(..last);
                raw.say(&ToCoordinator::Result(result));
                raw.until_dropped();
            }
        }
        work(access, &identity(2), |_| Ok(Bulky), || 1.0).unwrap();
    });
    assert_eq!(run.ending, Ending::BudgetSpent, "{:?}", run.notices);
    assert!(run.coordinator.prefix() == &bulky(400));
    let effort = run.coordinator.effort();
    assert_eq!((effort.workers_seen, effort.workers_lost), (12, 11));
}

/// The number of connections that send nothing; only some of them may be pending at once.
const SILENT: usize = 10_000;

/// The processor time of this thread on Linux [s].
fn thread_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    stat.split(' ').next().and_then(|nanos| nanos.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}

/// One worker's walks per second, and the part of a core that the coordinator takes: undisturbed, or while ten thousand
/// connections send nothing and a thousand a second bring replays and noise.
fn walks_per_second(attacked: bool) -> (f64, f64) {
    const TIME: Duration = Duration::from_secs(5);
    let (ready, rate) = (AtomicBool::new(false), Mutex::new((0.0, 0.0)));
    let began = Mutex::new(None);
    let watch = |coordinator: &Coordinator| {
        let walks = coordinator.progress().walks;
        if !ready.load(Ordering::Relaxed) || walks == 0 {
            return false;
        }
        // The coordinator's own thread calls this.
        let (since, before, cpu) =
            *began.lock().unwrap().get_or_insert((Instant::now(), walks, thread_seconds()));
        if since.elapsed() < TIME {
            return false;
        }
        let seconds = since.elapsed().as_secs_f64();
        *rate.lock().unwrap() = ((walks - before) as f64 / seconds, (thread_seconds() - cpu) / seconds);
        true
    };
    let ended = AtomicBool::new(false);
    let done = run(plan(1 << 50, 65_536), watch, |access| {
        thread::scope(|scope| {
            scope.spawn(|| {
                honest(access, 1);
                ended.store(true, Ordering::Relaxed);
            });
            let silent: Vec<TcpStream> =
                (0..if attacked { SILENT } else { 0 }).map(|_| knock(access)).collect();
            ready.store(true, Ordering::Relaxed);
            let (_, replayed) = Greeting::new(access);
            for n in 0.. {
                if ended.load(Ordering::Relaxed) {
                    break;
                }
                thread::sleep(Duration::from_millis(1));
                if attacked && let Ok(mut stream) = TcpStream::connect(&access.address) {
                    let noise: &[u8] = if n % 2 == 0 { &replayed } else { &[b'0', 0, 7, 8, 9] };
                    let _ = stream.write_all(noise);
                }
            }
            drop(silent);
        });
    });
    assert_eq!(done.ending, Ending::Interrupted);
    assert_eq!(done.coordinator.effort().workers_lost, 0);
    rate.into_inner().unwrap()
}

/// A measurement, which `scripts/attack.sh` runs.
#[test]
#[ignore = "takes two minutes, 11,500 files, and a machine of its own"]
fn throughput_under_attack() {
    let ratios: Vec<f64> = (0..8)
        .map(|_| {
            let ((calm, idle), (attacked, busy)) = (walks_per_second(false), walks_per_second(true));
            println!(
                "{calm:.4e} walks/s undisturbed, {attacked:.4e} under attack: {:.3}; coordinator {:.2} and {:.2} % of a core",
                attacked / calm,
                100.0 * idle,
                100.0 * busy
            );
            attacked / calm
        })
        .collect();
    let n = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let variance = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / (n - 1.0);
    println!("ratio {mean:.3} (standard error {:.3})", (variance / n).sqrt());
}
