//! The fuzz targets, run by libFuzzer (`scripts/fuzz.sh`) and, briefly and with fixed bytes, by the test suite
//! (`tests/fuzz.rs`). Each target takes any bytes and panics if it finds a fault.
#![allow(dead_code, reason = "each target is a program of its own")]

use std::time::Duration;

use cluster::noise::{self, Greeting, HANDSHAKE_RECORD};
use cluster::{Access, Inbound};
use protocol::codec::{LONG_FRAME, SHORT_FRAME};
use protocol::digest::Digester;
use protocol::message::{LeaseResult, ToCoordinator, ToWorker};
use protocol::{Action, Coordinator, JobPlan, Lead, Limits, Look, Parcel, Past, Relay, Terms, codec};
use radiosity::{Counts, Layout, Tally};

/// Reads bytes as messages, frames and packed sums.
pub fn decoder(bytes: &[u8]) {
    // A decoded message means the same when it is sent on. (Encodings are not unique, and not every number equals
    // itself.)
    if let Ok(message) = codec::decode::<ToCoordinator>(bytes) {
        let once = codec::encode(&message).expect("what was decoded is short");
        let again = codec::decode::<ToCoordinator>(&once).expect("what was encoded is a message");
        assert_eq!(codec::encode(&again).expect("what was decoded is short"), once);
    }
    if let Ok(message) = codec::decode::<ToWorker>(bytes) {
        let once = codec::encode(&message).expect("what was decoded is short");
        assert_eq!(codec::decode::<ToWorker>(&once).expect("what was encoded is a message"), message);
    }
    for cap in [0, 1, SHORT_FRAME, LONG_FRAME] {
        if let Ok(Some((_, used))) = codec::first_message::<ToCoordinator>(bytes, cap) {
            assert!(used <= bytes.len() && used <= cap + 4);
        }
    }
    if let Ok(numbers) = codec::unpack(bytes).collect::<Result<Vec<u128>, _>>() {
        assert!(numbers.len() <= bytes.len());
        let packed = codec::pack(&numbers);
        assert!(packed.len() <= bytes.len(), "packing is as short as can be");
        assert!(codec::unpack(&packed).map(Result::unwrap).eq(numbers));
    }
    let digester = Digester::new(&[7; 32]);
    if let Ok(parcel) = Parcel::new(Counts::default(), bytes.into(), 0, &digester) {
        let layout = Layout { scores: 1, moments: 1, slopes: 0, events: false };
        parcel.add_to(&mut Tally::new(parcel.sums(), layout)).expect("each sum is there once");
    }
}

/// Reads bytes as a stranger's messages, as a coordinator's answer, as records, and as the content of records.
pub fn handshake(bytes: &[u8]) {
    let access: Access = serde_json::from_str(
        r#"{ "address": "nowhere:1", "run": "fuzz", "build": "fuzz", "scene": "",
             "key": "0707070707070707070707070707070707070707070707070707070707070707" }"#,
    )
    .expect("an access file");
    let mut first = [0; HANDSHAKE_RECORD];
    let length = bytes.len().min(HANDSHAKE_RECORD);
    first[..length].copy_from_slice(&bytes[..length]);
    assert!(noise::answer(&access, &first).is_err(), "no greeting is made without the key");

    assert!(Greeting::new(&access).0.finish(bytes).is_err(), "nor an answer");

    let (greeting, first) = Greeting::new(&access);
    let (mut coordinator, answer) = noise::answer(&access, &first).expect("the key is right");
    let mut worker = greeting.finish(&answer[2..]).expect("the key is right");
    // The first byte cuts the others in two: the content of records, and the bytes that follow them on the wire.
    let (&cut, rest) = bytes.split_first().unwrap_or((&0, &[]));
    let (inside, outside) = rest.split_at(rest.len() * usize::from(cut) / 255);
    let mut wire = Vec::new();
    inside.chunks(1 + usize::from(cut)).for_each(|content| {
        worker.sealer.seal(content, &mut wire);
    });
    let sealed = wire.len();
    wire.extend(outside);
    let mut inbound = Inbound::new(coordinator.opener);
    let mut content = inside;
    'wire: for (at, part) in wire.chunks(777).enumerate() {
        inbound.arrived(part);
        loop {
            match inbound.next::<ToCoordinator>(LONG_FRAME) {
                Ok(Some(message)) => {
                    // What opens is what was sealed, and nothing that stands outside.
                    let (expected, used) = codec::first_message::<ToCoordinator>(content, LONG_FRAME)
                        .expect("a message")
                        .expect("all of it");
                    let encoded = |message| codec::encode(message).expect("it was decoded");
                    assert_eq!(encoded(&message), encoded(&expected));
                    content = &content[used..];
                }
                Ok(None) => break,
                Err(_) => {
                    let spoilt = codec::first_message::<ToCoordinator>(content, LONG_FRAME).is_err();
                    assert!(spoilt || 777 * (at + 1) > sealed, "what was sealed opens");
                    break 'wire;
                }
            }
        }
    }
    // In the other direction, a record of the coordinator opens once.
    let (mut record, mut opened) = (Vec::new(), Vec::new());
    coordinator.sealer.seal(b"done", &mut record);
    assert_eq!(worker.opener.open(&record, &mut opened), Ok(Some(record.len())));
    assert!(worker.opener.open(&record, &mut opened).is_err());
}

/// The numbers of patches of the jobs below: one whose results are sent at once, one whose results are offered.
const PATCHES: [usize; 2] = [3, 2000];

/// Reads bytes as messages of peers that know the key, to a coordinator or to a relay, in any order.
pub fn coordinator(bytes: &[u8]) {
    let (&kind, rest) = bytes.split_first().unwrap_or((&0, &[]));
    let layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };
    let patches = PATCHES[usize::from(kind) % 2];
    if kind & 64 == 0 {
        let past = Past::none(Tally::new(patches, layout));
        play(rest, &mut Coordinator::new(plan(patches, layout), past), |coordinator, _| {
            assert!(coordinator.prefix().counts.walks <= 1000);
            vec![]
        });
    } else {
        let mut given = 0;
        play(rest, &mut Relay::new(terms(patches, layout), 1), |relay, now| {
            for said in relay.take_outbox() {
                match said {
                    ToCoordinator::Result(LeaseResult { lease, counts, provenance, digest, .. }) => {
                        assert!(lease < given && counts[0] == 100, "whole leases are passed on");
                        assert_eq!(provenance.breach(100, digest), None);
                    }
                    ToCoordinator::Return { lease } => assert!(lease < given),
                    ToCoordinator::Capacity { .. } => {}
                    other => panic!("{other:?}"),
                }
            }
            given += 1;
            relay.on_lease(given - 1, 10 * given, 100, now)
        });
    }
}

/// Feeds bytes to a leader as events, and runs `then` after each event.
fn play<L: Lead>(mut rest: &[u8], lead: &mut L, mut then: impl FnMut(&mut L, Duration) -> Vec<Action>) {
    let mut open = std::collections::BTreeSet::new();
    let (mut now, mut next) = (Duration::ZERO, 0);
    while let [event, peer, length, ..] = *rest {
        rest = &rest[3..];
        let peer = u64::from(peer) % (next + 1);
        let mut actions = match event % 8 {
            0 => {
                open.insert(next);
                next += 1;
                lead.on_connect(next - 1)
            }
            1 => lead.on_lost(peer, "it was lost", now),
            2 => {
                now += Duration::from_millis(u64::from(length) * 50);
                lead.on_tick(now)
            }
            // A worker or relay that introduces itself properly.
            3 => {
                open.insert(next);
                let id = next;
                next += 1;
                let mut actions = lead.on_connect(id);
                for message in [hello(length % 2 == 1), ready()] {
                    actions.extend(lead.on_message(id, message, now));
                }
                actions
            }
            // A message about a lease that may be out, or about capacity.
            4 => {
                let bytes = 4000 + u64::from(length % 4);
                let lease_seconds = f64::from_bits(u64::from(length) << 56);
                let message = match event / 8 {
                    0..=15 => ToCoordinator::Offer { lease: length.into(), bytes },
                    16..=23 => ToCoordinator::Capacity { threads: length.into(), lease_seconds },
                    _ => ToCoordinator::Return { lease: length.into() },
                };
                lead.on_message(peer, message, now)
            }
            5 => {
                let sums = vec![0; protocol::message::PIECE - usize::from(length == 255)];
                lead.on_message(peer, ToCoordinator::Piece { lease: length.into(), sums }, now)
            }
            _ => {
                let (said, after) = rest.split_at(usize::from(length).min(rest.len()));
                rest = after;
                match codec::decode(said) {
                    Ok(message) => lead.on_message(peer, message, now),
                    Err(_) => vec![],
                }
            }
        };
        actions.extend(then(lead, now));
        for action in actions {
            match action {
                Action::Send(id, _) => assert!(open.contains(&id), "messages go to open connections"),
                Action::Close(id) => assert!(open.remove(&id), "open connections are closed"),
                Action::Tell(_) => {}
            }
        }
        assert!(open.iter().all(|&id| lead.frame_cap(id) <= LONG_FRAME));
    }
}

fn hello(relays: bool) -> ToCoordinator {
    let (protocol, threads) = (protocol::message::PROTOCOL, 2);
    ToCoordinator::Hello(protocol::message::Hello {
        protocol,
        build: "fuzz".into(),
        name: "fuzz".into(),
        threads,
        relays,
    })
}

fn ready() -> ToCoordinator {
    ToCoordinator::Ready { scene_hash: [1; 32], job_hash: [2; 32] }
}

fn terms(patches: usize, layout: Layout) -> Terms {
    let (job, build) = ([][..].into(), "fuzz".into());
    let (scene_hash, job_hash) = ([1; 32], [2; 32]);
    Terms {
        job,
        scene_hash,
        job_hash,
        build,
        stream_walks: 10,
        leases_per_thread: 2,
        patches,
        layout,
        limits: Limits::NONE,
    }
}

fn plan(patches: usize, layout: Layout) -> JobPlan {
    JobPlan {
        job: [][..].into(),
        scene_hash: [1; 32],
        job_hash: [2; 32],
        build: "fuzz".into(),
        first: 0,
        lots: 0,
        paths: 1000,
        stream_paths: 10,
        leases_per_thread: 2,
        patches,
        layout,
        limits: Limits::NONE,
        wall: None,
        looks: vec![300],
        judge: Box::new(|tally, _| Look { walks: tally.counts.walks, ..Look::default() }),
    }
}
