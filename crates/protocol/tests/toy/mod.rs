//! A job without physics: the score of a walk is a hash of its number, so that any mix-up of walks shows.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::ops::Range;

use protocol::codec::{pack, unpack};
use protocol::digest::Digester;
use protocol::message::{Hello, LeaseResult, PROTOCOL, ToCoordinator, ToWorker};
use protocol::{Coordinator, JobPlan, LeaseProvenance, Limits, Look, Past};
use radiosity::{Counts, Layout, Tally};

pub const PATCHES: usize = 3;
pub const MOMENTS: usize = 2;
pub const LAYOUT: Layout = Layout { scores: 1, moments: MOMENTS, slopes: 0, events: false };
/// The limits of the walks of [`Board::shoot`].
pub const LIMITS: Limits =
    Limits { ends: 1, rays: 7, ray_score: 1 << 24, walk_score: 1 << 24, sensors: None, materials: None };
pub const BUILD: &str = "0.1.0 (toy)";
pub const JOB: &[u8] = b"a toy job";
pub const SCENE_HASH: [u8; 32] = [1; 32];
pub const JOB_HASH: [u8; 32] = [2; 32];

/// The finaliser of splitmix64, as a hash of a number.
pub fn hash(n: u64) -> u64 {
    let z = n.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The random numbers of one simulation.
pub struct Dice(pub u64);

impl Dice {
    pub fn below(&mut self, n: u64) -> u64 {
        self.0 += 1;
        hash(self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)) % n
    }

    pub fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }

    pub fn pick<'a, T>(&mut self, of: &'a [T]) -> Option<&'a T> {
        if of.is_empty() { None } else { Some(&of[self.below(of.len() as u64) as usize]) }
    }
}

/// The board on which walks score.
#[derive(Clone, Default)]
pub struct Board {
    counts: Counts,
    sums: [u128; PATCHES * MOMENTS],
}

impl Board {
    pub fn shoot(&mut self, walks: Range<u64>) {
        for n in walks {
            let luck = hash(n);
            let counts = Counts {
                walks: 1,
                rays: 1 + luck % 7,
                absorbed: luck % 2,
                escaped: 1 - luck % 2,
                ..Counts::default()
            };
            self.counts.add(&counts).unwrap();
            let patch = luck as usize % PATCHES;
            for (power, sum) in (1..).zip(&mut self.sums[patch * MOMENTS..][..MOMENTS]) {
                *sum += u128::from(luck >> 40).pow(power);
            }
        }
    }

    pub fn take(&mut self) -> Tally {
        let Board { counts, sums } = std::mem::take(self);
        Tally::from_parts(counts, PATCHES, LAYOUT, sums.to_vec()).unwrap()
    }
}

/// The tally of some walks, shot in one go.
pub fn straight(walks: Range<u64>) -> Tally {
    let mut board = Board::default();
    board.shoot(walks);
    board.take()
}

/// A plan without target or clock.
pub fn plan(paths: u64, stream_paths: u64) -> JobPlan {
    JobPlan {
        job: JOB.into(),
        scene_hash: SCENE_HASH,
        job_hash: JOB_HASH,
        build: BUILD.into(),
        paths,
        stream_paths,
        leases_per_thread: 2,
        patches: PATCHES,
        layout: LAYOUT,
        limits: LIMITS,
        wall: None,
        first: 0,
        lots: 0,
        looks: Vec::new(),
        judge: judge(|_| false),
    }
}

/// A judge that only says whether the target is met.
pub fn judge(mut met: impl FnMut(&Tally) -> bool + 'static) -> protocol::Judge {
    Box::new(move |tally, _| Look { walks: tally.counts.walks, reached: met(tally), ..Look::default() })
}

/// A coordinator of a new job.
pub fn coordinator(plan: JobPlan) -> Coordinator {
    let past = Past::none(Tally::new(plan.patches, plan.layout));
    Coordinator::new(plan, past)
}

/// The introduction of a worker of the right build.
pub fn hello(name: &str, threads: u32) -> Hello {
    Hello { protocol: PROTOCOL, build: BUILD.into(), name: name.into(), threads, relays: false }
}

/// The answer of a coordinator of [`plan`] to a worker of the right build.
pub fn welcome(stream_walks: u64) -> ToWorker {
    ToWorker::Welcome { job: JOB.into(), stream_walks, leases_per_thread: 2 }
}

/// The message of a worker that has built the right replica.
pub const READY: ToCoordinator = ToCoordinator::Ready { scene_hash: SCENE_HASH, job_hash: JOB_HASH };

/// The result of a lease as an honest worker sends it.
pub fn result(lease: u64, walks: Range<u64>) -> LeaseResult {
    result_of(lease, &straight(walks))
}

/// The result of a lease with a given tally, as an honest worker sends it.
pub fn result_of(lease: u64, tally: &Tally) -> LeaseResult {
    LeaseResult {
        lease,
        seconds: 0.25,
        cpu_seconds: 0.25,
        digest: Digester::new(&SCENE_HASH).digest(tally),
        counts: Box::new(tally.counts.to_array()),
        sums: pack(tally.sums()),
        provenance: LeaseProvenance::default(),
    }
}

/// A result that was changed before it was sent, with the digest that it then has.
pub fn sealed(result: LeaseResult) -> LeaseResult {
    let counts = Counts::from_array(*result.counts).unwrap();
    let sums = unpack(&result.sums).collect::<Result<_, _>>().unwrap();
    let tally = Tally::from_parts(counts, PATCHES, LAYOUT, sums).unwrap();
    LeaseResult { digest: Digester::new(&SCENE_HASH).digest(&tally), ..result }
}
