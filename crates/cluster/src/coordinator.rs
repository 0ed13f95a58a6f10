//! The coordinator as a pure state machine: events in, actions out, time as a number. Sockets are a thin
//! shell around it ([`crate::server`]), so that every fault can be tested without one.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use bincode::{Decode, Encode};
use radiosity::{Counts, Layout, MergeError, Tally};

use crate::checkpoint::{Look, Past};
use crate::codec::{LONGEST_SUM, SHORT_FRAME};
use crate::digest::Digester;
use crate::ledger::{LeaseId, Ledger, Rejected};
use crate::message::{Hello, LeaseResult, PIECE, PROTOCOL, SMALL_TALLY, ToCoordinator, ToWorker};
use crate::parcel::Parcel;
use crate::transfers::{Offer, Room, Transfers};

/// A connection, named by the shell; never used twice.
pub type PeerId = u64;

/// Time since the coordinator began.
pub type Now = Duration;

/// A worker that says nothing for so long is lost. Workers speak every second.
pub const SILENCE: Duration = Duration::from_secs(10);

/// A worker that holds leases and makes no progress for so long is lost.
pub const STALL: Duration = Duration::from_secs(60);

/// How long a lease should take: long enough that messages cost nothing, short enough that a stop is prompt.
const LEASE_SECONDS: f64 = 0.25;

/// A lease may take this part of the time that the job has run: the ledger of a week stays a matter of megabytes.
const LEASE_SHARE: f64 = 1e-4;

/// Added per sum of the tally, so that packing and sending large ones stays a small part of a lease.
const LEASE_SECONDS_PER_SUM: f64 = 1e-6;

/// What the coordinator needs to open, check and merge a result, and per sum of it (docs/scale.md).
const TAKING_SECONDS: f64 = 1e-4;
const TAKING_SECONDS_PER_SUM: f64 = 4e-8;

/// It takes the results of all threads, and is to be idle for most of the time that a lease takes.
const IDLENESS: f64 = 3.0;

/// A lease is late after so many times the time in which its worker should have been done with it.
const LATE: f64 = 2.0;

/// So many workers may be at the same walks: the more, the sooner the end where several are silent.
const MOST_COPIES: usize = 3;

/// How often late leases are looked for.
const LATE_LOOK: Duration = Duration::from_millis(100);

/// How long the coordinator needs for a result of each of so many threads, whose tallies have so many sums [s].
pub fn taking_seconds(sums: usize, threads: usize) -> f64 {
    (TAKING_SECONDS + TAKING_SECONDS_PER_SUM * sums as f64) * threads as f64
}

/// How long a lease should take where so many threads work on tallies of so many sums, `age` seconds after the job
/// began [s].
pub fn lease_seconds(sums: usize, threads: usize, age: f64) -> f64 {
    let sending = LEASE_SECONDS_PER_SUM * sums as f64;
    LEASE_SECONDS + sending + IDLENESS * taking_seconds(sums, threads) + LEASE_SHARE * age
}

/// A new lease is at most so many times as long as the last: rates are learnt from short leases.
const LEASE_GROWTH: f64 = 4.0;

/// After a stop, results that are under way are waited for, as long as they fill a gap; no longer than this
/// and the time that the messages of two leases take.
const STOP_GRACE: Duration = Duration::from_secs(3);

/// At most so much time between two ticks is held against peers. The coordinator itself may be held up (it
/// was stopped, it merged, the machine was busy), and what peers said meanwhile is still unread then.
const BLINK: Duration = Duration::from_secs(1);

/// Heartbeats come once a second. So many more may come at once, when either end was held up, and so many a second;
/// who sends more is faulty.
const BEATS: f64 = 10_000.0;
const BEATS_PER_SECOND: f64 = 100.0;

/// Bytes that a worker may cost here beside what all share: for islands, and for results under way.
const ISLAND_SHARE: usize = 32 << 10;
const STAGING_SHARE: usize = 8 << 10;

/// A worker is leased work for at most so many threads, whatever it claims to have.
const MAX_THREADS: usize = 4096;

/// Names and builds are shown to this length, reasons to the next.
const NAME_CHARS: usize = 80;
const REASON_CHARS: usize = 400;

/// Looks at the tally of a prefix, knowing the looks before.
pub type Judge = Box<dyn FnMut(&Tally, &[Look]) -> Look>;

/// What the coordinator has to see done.
pub struct Plan {
    /// The job as workers read it.
    pub job: Arc<[u8]>,
    /// What a worker's replica must hash to.
    pub scene_hash: [u8; 32],
    /// Likewise.
    pub job_hash: [u8; 32],
    /// The only build that may join.
    pub build: String,
    /// The first walk of the job; all other numbers of walks here count from it.
    pub first: u64,
    /// Total walks.
    pub paths: u64,
    /// Walks per stream.
    pub stream_paths: u64,
    /// Leases per worker thread that are out at once: 2, one under way and one waiting, so that no worker waits; 1
    /// where a walk is so long that one waiting here would be missed elsewhere.
    pub leases_per_thread: usize,
    /// Patches of the scene.
    pub patches: usize,
    /// What a tally of the job keeps of each.
    pub layout: Layout,
    /// When to stop, whatever has been reached.
    pub wall: Option<Duration>,
    /// Numbers of walks at which `judge` is asked, ascending.
    pub looks: Vec<u64>,
    /// What the tally of a prefix amounts to. Asked at looks only.
    pub judge: Judge,
}

impl Plan {
    /// Numbers in a tally of the job.
    fn sums(&self) -> usize {
        self.patches * self.layout.columns()
    }
}

/// What the shell has to do.
#[derive(Debug, PartialEq)]
pub enum Action {
    /// Send a message.
    Send(PeerId, ToWorker),
    /// Close a connection, after what was sent has gone out.
    Close(PeerId),
    /// Tell the owner of the run.
    Tell(Notice),
}

/// What the owner of a run should know about its workers.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// A worker is gone, or was given up.
    Lost {
        /// As it called itself.
        name: String,
        /// Why.
        reason: String,
    },
    /// Somebody was not let in.
    Refused {
        /// As it called itself.
        name: String,
        /// Why.
        reason: String,
    },
    /// A connection ended before anybody was introduced.
    Failed(String),
    /// So many connections were refused or ended of which nothing was told.
    Hushed(usize),
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Notice::Lost { name, reason } => {
                write!(f, "lost worker {name}: {reason}; its walks go to others")
            }
            Notice::Refused { name, reason } => write!(f, "refused worker {name}: {reason}"),
            Notice::Failed(reason) => write!(f, "a connection came to nothing: {reason}"),
            Notice::Hushed(connections) => write!(f, "{connections} more connections came to nothing"),
        }
    }
}

/// Why a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Every walk is in.
    BudgetSpent,
    /// The target was met at a look.
    TargetReached,
    /// The wall-clock limit came first.
    WallClock,
    /// Somebody asked for a stop.
    Interrupted,
    /// No worker is left and none will come.
    NoWorkers,
    /// A sum overflowed; the prefix is of no use.
    Overflow,
}

/// A snapshot for progress displays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Walks that are in.
    pub walks: u64,
    /// Workers at work now.
    pub workers: usize,
}

/// What a run took, its earlier sessions included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Encode, Decode)]
pub struct Effort {
    /// From the first lease to the last result that was merged.
    pub seconds: f64,
    /// CPU time of all workers.
    pub cpu_seconds: f64,
    /// Workers that ever shot.
    pub workers_seen: u64,
    /// Workers that were lost while the job ran.
    pub workers_lost: u64,
    /// Streams of lost leases.
    pub streams_reissued: u64,
}

/// Where a connection stands.
#[derive(Debug)]
enum Stage {
    /// Knows the key.
    Admitted,
    /// Is building its replica.
    Welcomed,
    /// Shoots.
    Working,
}

#[derive(Debug)]
struct Peer {
    stage: Stage,
    name: String,
    threads: usize,
    /// What it was given and has not answered for, and when, by the waking clock. Some of it others may have done since.
    leases: HashMap<LeaseId, Duration>,
    /// When it last spoke, by the waking clock.
    heard: Duration,
    progress: u64,
    /// When it last made progress, by the waking clock.
    progressed: Duration,
    /// Its place among the names in the ledger.
    number: u32,
    /// Walks per second of one thread; 0 before the first result.
    rate: f64,
    longest_lease: u64,
    cpu_seconds: f64,
    /// Heartbeats that it may send now.
    beats: f64,
}

/// A lease that is late.
struct Late {
    /// When its walks were last leased, by the waking clock.
    since: Duration,
    lease: LeaseId,
    /// Who is at them.
    holders: Vec<PeerId>,
}

/// The state of one job.
pub struct Coordinator {
    plan: Plan,
    ledger: Ledger,
    transfers: Transfers,
    peers: HashMap<PeerId, Peer>,
    /// How many of the peers shoot.
    workers_now: usize,
    /// Their threads.
    threads: usize,
    /// Those that have room for a lease.
    hungry: BTreeSet<PeerId>,
    stopping: Option<(Ending, Now)>,
    ending: Option<Ending>,
    /// The last tick.
    ticked: Now,
    /// When late leases were last looked for.
    sought: Now,
    /// The waking clock: time without what went by unnoticed between ticks. Silence and stalls go by it.
    awake: Duration,
    first_lease: Option<Now>,
    last_result: Now,
    digester: Digester,
    /// Whoever worked, as deliveries name them.
    workers: Vec<String>,
    looks: Vec<Look>,
    /// What earlier sessions and workers that have gone took.
    spent: Effort,
}

impl Coordinator {
    /// A coordinator for a plan that goes on from the `past`, an empty one for a new job.
    pub fn new(plan: Plan, past: Past) -> Self {
        let Past { tally, deliveries, workers, looks, effort } = past;
        let ledger = Ledger::new(plan.paths, plan.stream_paths, plan.looks.clone(), tally, deliveries);
        let reached = looks.last().is_some_and(|look| look.reached && look.walks == ledger.prefix_walks());
        let ending = match () {
            () if reached => Some(Ending::TargetReached),
            () if ledger.is_complete() => Some(Ending::BudgetSpent),
            () => None,
        };
        Coordinator {
            digester: Digester::new(&plan.scene_hash),
            plan,
            ledger,
            transfers: Transfers::default(),
            peers: HashMap::new(),
            workers_now: 0,
            threads: 0,
            hungry: BTreeSet::new(),
            stopping: None,
            ending,
            ticked: Duration::ZERO,
            sought: Duration::ZERO,
            awake: Duration::ZERO,
            first_lease: None,
            last_result: Duration::ZERO,
            workers,
            looks,
            spent: effort,
        }
    }

    /// The books of the prefix: what another coordinator needs to go on from here. A large tally is not copied; the
    /// prefix moves on when whoever has it is done with it.
    pub fn past(&self) -> Past {
        Past {
            tally: self.ledger.prefix().clone(),
            deliveries: self.ledger.deliveries().to_vec(),
            workers: self.workers.clone(),
            looks: self.looks.clone(),
            effort: self.effort(),
        }
    }

    /// The books themselves, where the job is over.
    pub fn into_past(self) -> Past {
        let effort = self.effort();
        let (tally, deliveries) = self.ledger.into_prefix();
        Past { tally, deliveries, workers: self.workers, looks: self.looks, effort }
    }

    /// Why the job ended, once it has.
    pub fn ending(&self) -> Option<Ending> {
        self.ending
    }

    /// The tally of the prefix 0 … N − 1.
    pub fn prefix(&self) -> &Tally {
        self.ledger.prefix()
    }

    /// For progress displays.
    pub fn progress(&self) -> Progress {
        Progress { walks: self.ledger.walks_in(), workers: self.workers_now }
    }

    /// What the run has taken so far.
    pub fn effort(&self) -> Effort {
        let began = self.first_lease.unwrap_or(self.last_result);
        Effort {
            seconds: self.spent.seconds + self.last_result.saturating_sub(began).as_secs_f64(),
            cpu_seconds: self.spent.cpu_seconds
                + self.peers.values().map(|peer| peer.cpu_seconds).sum::<f64>(),
            streams_reissued: self.spent.streams_reissued + self.ledger.streams_reissued,
            ..self.spent
        }
    }

    /// The largest frame that a worker may send: what a piece of a tally of this job can hold, and what stands around
    /// it.
    pub fn frame_cap(&self) -> usize {
        SHORT_FRAME + self.most_bytes().min(PIECE)
    }

    /// What the packed sums of a result can take.
    fn most_bytes(&self) -> usize {
        LONGEST_SUM * self.plan.sums()
    }

    /// Somebody who knows the key has connected.
    pub fn on_connect(&mut self, id: PeerId) -> Vec<Action> {
        if self.ending.is_some() {
            return vec![Action::Send(id, ToWorker::Done), Action::Close(id)];
        }
        let peer = Peer {
            stage: Stage::Admitted,
            name: format!("peer {id}"),
            threads: 0,
            leases: HashMap::new(),
            heard: self.awake,
            progress: 0,
            progressed: self.awake,
            number: 0,
            rate: 0.0,
            longest_lease: self.plan.stream_paths,
            cpu_seconds: 0.0,
            beats: BEATS,
        };
        self.peers.insert(id, peer);
        vec![]
    }

    /// A peer said something.
    pub fn on_message(&mut self, id: PeerId, message: ToCoordinator, now: Now) -> Vec<Action> {
        // The prefix stays what it was when the job ended.
        if self.ending.is_some() {
            return vec![];
        }
        let Some(peer) = self.peers.get_mut(&id) else { return vec![] };
        let quiet = (self.awake - peer.heard).as_secs_f64();
        peer.beats = BEATS.min(peer.beats + quiet * BEATS_PER_SECOND);
        peer.heard = self.awake;
        match (&peer.stage, message) {
            (Stage::Admitted, ToCoordinator::Hello(hello)) => self.on_hello(id, hello),
            (Stage::Welcomed, ToCoordinator::Ready { scene_hash, job_hash }) => {
                self.on_ready(id, scene_hash, job_hash, now)
            }
            (Stage::Working, ToCoordinator::Result(result)) => self.on_result(id, result, now),
            (Stage::Working, ToCoordinator::Offer { lease, bytes }) => self.on_offer(id, lease, bytes, now),
            (Stage::Working, ToCoordinator::Piece { lease, sums }) => {
                peer.progressed = self.awake;
                if sums.len() == PIECE && self.transfers.stage(id, lease, &sums) {
                    return vec![];
                }
                self.drop_peer(id, "sent a piece of a result that it was not asked for", now)
            }
            (Stage::Welcomed | Stage::Working, ToCoordinator::Alive { progress }) => {
                peer.beats -= 1.0;
                if peer.beats < 0.0 {
                    return self.drop_peer(id, "says too often that it is alive (a faulty program)", now);
                }
                if progress > peer.progress {
                    (peer.progress, peer.progressed) = (progress, self.awake);
                }
                vec![]
            }
            (_, ToCoordinator::Failed { reason }) => self.drop_peer(id, &format!("gave up: {reason}"), now),
            _ => self.drop_peer(id, "spoke out of turn (a foreign or faulty program)", now),
        }
    }

    /// A long message to a peer gets on. It may say nothing until it has all of it, so this is a sign of life and of
    /// progress.
    pub fn on_stir(&mut self, id: PeerId) {
        if let Some(peer) = self.peers.get_mut(&id) {
            (peer.heard, peer.progressed) = (self.awake, self.awake);
        }
    }

    /// A peer introduces itself: can it walk as we do?
    fn on_hello(&mut self, id: PeerId, hello: Hello) -> Vec<Action> {
        let refusal = if hello.protocol != PROTOCOL {
            Some(format!(
                "it speaks protocol {}, this coordinator {PROTOCOL}; use the same radwalk",
                hello.protocol
            ))
        } else if hello.build != self.plan.build {
            Some(format!(
                "it is radwalk {}, this coordinator {} (other builds may walk otherwise); use the same build",
                printable(&hello.build, NAME_CHARS),
                self.plan.build
            ))
        } else if hello.threads == 0 {
            Some("it has no threads".into())
        } else {
            None
        };
        if let Some(reason) = refusal {
            self.peers.remove(&id);
            return refuse(id, printable(&hello.name, NAME_CHARS), reason);
        }
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        peer.stage = Stage::Welcomed;
        peer.name = printable(&hello.name, NAME_CHARS);
        peer.threads = (hello.threads as usize).min(MAX_THREADS);
        vec![Action::Send(id, ToWorker::Welcome { job: self.plan.job.clone() })]
    }

    /// A peer has built its replica: is it the same scene and job?
    fn on_ready(&mut self, id: PeerId, scene_hash: [u8; 32], job_hash: [u8; 32], now: Now) -> Vec<Action> {
        if (scene_hash, job_hash) != (self.plan.scene_hash, self.plan.job_hash) {
            self.spent.workers_lost += 1;
            let peer = self.peers.remove(&id).expect("the caller found it");
            let reason = "its replica of the scene differs (its build or memory is faulty)";
            return refuse(id, peer.name, reason.into());
        }
        self.spent.workers_seen += 1;
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        peer.stage = Stage::Working;
        peer.number = number_of(&peer.name, &mut self.workers);
        self.workers_now += 1;
        self.threads += peer.threads;
        self.hungry.insert(id);
        peer.progressed = self.awake;
        self.hand_out(now)
    }

    /// A worker has a large result.
    fn on_offer(&mut self, id: PeerId, lease: LeaseId, bytes: u64, now: Now) -> Vec<Action> {
        let sums = self.plan.sums();
        let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
        let peer = &self.peers[&id];
        let offered = match self.ledger.range(lease) {
            // Others were faster.
            None if peer.leases.contains_key(&lease) => {
                let mut actions = vec![self.spare(id, lease)];
                actions.extend(self.go_on(now));
                return actions;
            }
            Some(walks)
                if peer.leases.contains_key(&lease) && (sums..=self.most_bytes()).contains(&bytes) =>
            {
                self.transfers.offer(Offer { peer: id, lease, walks, bytes })
            }
            _ => false,
        };
        if offered {
            self.ask()
        } else {
            self.drop_peer(id, "offered a result that it was not asked for", now)
        }
    }

    /// Lets a worker drop a large result that others have brought.
    fn spare(&mut self, id: PeerId, lease: LeaseId) -> Action {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.leases.remove(&lease);
            peer.progressed = self.awake;
            self.hungry.insert(id);
        }
        Action::Send(id, ToWorker::Drop { lease })
    }

    /// Asks for large results where there is room.
    fn ask(&mut self) -> Vec<Action> {
        let void = self.transfers.take_void(&self.ledger);
        let mut actions: Vec<Action> = void.into_iter().map(|(id, lease)| self.spare(id, lease)).collect();
        let (workers, tally) = (self.workers_now, (size_of::<u128>() * self.plan.sums()).max(1));
        let room =
            Room { islands: 1 + workers * ISLAND_SHARE / tally, bytes: tally / 4 + workers * STAGING_SHARE };
        let asked = self.transfers.grant(&self.ledger, room, self.awake);
        for (id, _) in &asked {
            if let Some(peer) = self.peers.get_mut(id) {
                peer.progressed = self.awake;
            }
        }
        actions.extend(asked.into_iter().map(|(id, lease)| Action::Send(id, ToWorker::Send { lease })));
        actions
    }

    /// Where every lease that is out is a result that is kept beyond a gap, nobody is free to fill the gap: whoever keeps
    /// the furthest drops its own, which are leased again.
    fn make_room(&mut self, now: Now) -> Vec<Action> {
        let out: usize = self.peers.values().map(|peer| peer.leases.len()).sum();
        if !self.ledger.has_lost() || !self.hungry.is_empty() || self.transfers.kept() < out {
            return vec![];
        }
        let dropped = self.transfers.take_furthest();
        for &(_, lease) in &dropped {
            self.ledger.lose(lease);
        }
        let mut actions: Vec<Action> = dropped.into_iter().map(|(id, lease)| self.spare(id, lease)).collect();
        actions.extend(self.hand_out(now));
        actions
    }

    /// The result of a lease: taken whole or not at all.
    fn on_result(&mut self, id: PeerId, mut result: LeaseResult, now: Now) -> Vec<Action> {
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        let lease = result.lease;
        let asked = match self.plan.sums() {
            ..=SMALL_TALLY => true,
            _ => self.transfers.finish(id, lease, &result.sums).map(|sums| result.sums = sums).is_some(),
        };
        if !asked || peer.leases.remove(&lease).is_none() {
            return self.drop_peer(id, "sent a result that it was not asked for", now);
        }
        self.hungry.insert(id);
        if result.cpu_seconds.is_finite() {
            peer.cpu_seconds = peer.cpu_seconds.max(result.cpu_seconds);
        }
        peer.progressed = self.awake;
        let (number, seconds) = (peer.number, result.seconds);
        let accepted = Counts::from_array(*result.counts)
            .ok_or(Rejected::Counts)
            .and_then(|counts| Parcel::new(counts, result.sums, result.digest, &self.digester))
            .and_then(|parcel| {
                let walks = parcel.counts().walks;
                self.ledger.accept(lease, parcel, number).map(|()| walks)
            });
        match accepted {
            Ok(walks) => {
                let peer = self.peers.get_mut(&id).expect("the caller found it");
                // Not a number is no less than any, and so becomes the least time, too.
                let rate = walks as f64 / seconds.max(1e-6);
                peer.rate = if peer.rate == 0.0 { rate } else { 0.5 * (peer.rate + rate) };
                self.last_result = now;
                self.advance(now)
            }
            // Others were faster, or it was given up and is back.
            Err(Rejected::NotLeased(_)) => self.go_on(now),
            Err(Rejected::Tally(MergeError::Overflow(_))) => self.finish(Ending::Overflow),
            Err(rejected) => {
                self.ledger.lose(lease);
                self.drop_peer(id, &format!("sent a result that does not fit ({rejected})"), now)
            }
        }
    }

    /// Moves the prefix on, looks at the target where the job says so, and gives out more work.
    fn advance(&mut self, now: Now) -> Vec<Action> {
        loop {
            match self.ledger.advance() {
                Ok(true) => {}
                Ok(false) => break,
                Err(_) => return self.finish(Ending::Overflow),
            }
            if self.ledger.at_look() {
                let look = (self.plan.judge)(self.ledger.prefix(), &self.looks);
                self.looks.push(look);
                if look.reached {
                    return self.finish(Ending::TargetReached);
                }
            }
        }
        if self.ledger.is_complete() {
            return self.finish(Ending::BudgetSpent);
        }
        self.go_on(now)
    }

    /// Gives out what there is to do, and ends a job that is stopping once nothing more can be saved.
    fn go_on(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.ask();
        actions.extend(self.hand_out(now));
        if let Some((ending, _)) = self.stopping {
            let gap_may_close =
                self.ledger.gap_is_out() || (self.ledger.gap_is_lost() && self.workers_now > 0);
            if !gap_may_close {
                actions.extend(self.finish(ending));
            }
        }
        actions
    }

    /// Fills every working peer up with leases, the idlest first. While stopping, with those alone that fill
    /// gaps below results that are in.
    fn hand_out(&mut self, now: Now) -> Vec<Action> {
        let mut actions = Vec::new();
        if self.ledger.unleased() == 0 {
            return actions;
        }
        for depth in 0..self.plan.leases_per_thread {
            let fed = |peer: &Peer| peer.leases.len() >= (depth + 1) * peer.threads;
            let hungry: Vec<PeerId> =
                self.hungry.iter().copied().filter(|id| !fed(&self.peers[id])).collect();
            for id in hungry {
                while !fed(&self.peers[&id]) {
                    let walks = self.lease_walks(id, now);
                    let leased = match self.stopping {
                        None => self.ledger.lease(walks),
                        Some(_) => self.ledger.lease_gap(walks),
                    };
                    let Some((lease, range)) = leased else { return actions };
                    actions.push(self.send_lease(id, lease, range, now));
                }
            }
        }
        actions
    }

    /// How many walks to lease to a peer: by its rate, but ever fewer towards the end so that all finish
    /// together. Only the pace depends on it, never the answer.
    fn lease_walks(&self, id: PeerId, now: Now) -> u64 {
        let peer = &self.peers[&id];
        let by_rate = peer.rate * self.lease_seconds(now);
        let by_growth = peer.longest_lease as f64 * LEASE_GROWTH;
        let share = self.ledger.unleased() / (self.plan.leases_per_thread * self.threads) as u64;
        // Results must not come faster than they are taken, towards the end either.
        let least = (peer.rate * taking_seconds(self.plan.sums(), self.threads)) as u64;
        (by_rate.min(by_growth) as u64).min(share.max(least))
    }

    /// How long a lease should take.
    fn lease_seconds(&self, now: Now) -> f64 {
        let age = self.spent.seconds + now.as_secs_f64();
        lease_seconds(self.plan.sums(), self.threads, age)
    }

    /// Gives walks that are late once more, to workers that have nothing to do when all walks are out. Whoever is first
    /// counts, so that the end waits for nobody who is slow or silent.
    fn lease_late(&mut self, now: Now) -> Vec<Action> {
        let nothing_else = self.stopping.is_none() && self.ledger.unleased() == 0;
        if !nothing_else || now.saturating_sub(self.sought) < LATE_LOOK {
            return vec![];
        }
        self.sought = now;
        let is_idle = |peer: &Peer| peer.leases.len() < peer.threads;
        let idle: Vec<PeerId> = self.hungry.iter().copied().filter(|id| is_idle(&self.peers[id])).collect();
        let mut late = if idle.is_empty() { vec![] } else { self.late(now) };
        let mut actions = Vec::new();
        for id in idle {
            while self.peers[&id].leases.len() < self.peers[&id].threads
                && let Some(at) = late.iter().position(|late| !late.holders.contains(&id))
                && let Some((lease, range)) = self.ledger.lease_again(late.remove(at).lease)
            {
                actions.push(self.send_lease(id, lease, range, now));
            }
        }
        actions
    }

    /// Leases that should have been in long ago, those first that have been out for longest. Of walks that are out more
    /// than once, the last lease counts.
    fn late(&self, now: Now) -> Vec<Late> {
        let fastest = self.peers.values().map(|peer| peer.rate).fold(0.0, f64::max);
        let mut out: BTreeMap<u64, (u64, Late)> = BTreeMap::new();
        for (&id, peer) in &self.peers {
            for (&lease, &since) in &peer.leases {
                // Others have done what is not out any more.
                let Some(range) = self.ledger.range(lease) else { continue };
                let fresh = || (range.end - range.start, Late { since, lease, holders: vec![] });
                let (_, late) = out.entry(range.start).or_insert_with(fresh);
                late.since = late.since.max(since);
                late.holders.push(id);
            }
        }
        let mut late: Vec<Late> = out
            .into_values()
            .filter(|(walks, late)| {
                let seconds = self.lease_seconds(now).max(*walks as f64 / fastest);
                let patience = LATE * self.plan.leases_per_thread as f64 * seconds;
                late.holders.len() < MOST_COPIES && (self.awake - late.since).as_secs_f64() > patience
            })
            .map(|(_, late)| late)
            .collect();
        late.sort_unstable_by_key(|late| late.since);
        late
    }

    fn send_lease(&mut self, id: PeerId, lease: LeaseId, range: Range<u64>, now: Now) -> Action {
        self.first_lease.get_or_insert(now);
        let walks = range.end - range.start;
        let peer = self.peers.get_mut(&id).expect("a working peer");
        if peer.leases.is_empty() {
            peer.progressed = self.awake;
        }
        peer.leases.insert(lease, self.awake);
        if peer.leases.len() >= self.plan.leases_per_thread * peer.threads {
            self.hungry.remove(&id);
        }
        peer.longest_lease = peer.longest_lease.max(walks);
        let first_walk = self.plan.first.saturating_add(range.start);
        Action::Send(id, ToWorker::Lease { id: lease, first_walk, walks })
    }

    /// A connection is gone.
    pub fn on_lost(&mut self, id: PeerId, reason: &str, now: Now) -> Vec<Action> {
        // After the end everybody leaves.
        if self.ending.is_some() || !self.peers.contains_key(&id) {
            return vec![];
        }
        self.drop_peer(id, reason, now)
    }

    /// Closes a connection and gives its leases to others.
    fn drop_peer(&mut self, id: PeerId, reason: &str, now: Now) -> Vec<Action> {
        let mut actions = self.forget(id, reason);
        actions.extend(self.go_on(now));
        actions
    }

    /// Closes a connection and takes its leases back.
    fn forget(&mut self, id: PeerId, reason: &str) -> Vec<Action> {
        let Some(peer) = self.peers.remove(&id) else { return vec![] };
        self.transfers.forget(id);
        if matches!(peer.stage, Stage::Working) {
            self.workers_now -= 1;
            self.threads -= peer.threads;
            self.hungry.remove(&id);
        }
        self.spent.cpu_seconds += peer.cpu_seconds;
        for lease in peer.leases.into_keys() {
            self.ledger.lose(lease);
        }
        let reason = printable(reason, REASON_CHARS);
        let notice = if matches!(peer.stage, Stage::Admitted) {
            Notice::Failed(reason)
        } else {
            self.spent.workers_lost += 1;
            Notice::Lost { name: peer.name, reason }
        };
        vec![Action::Close(id), Action::Tell(notice)]
    }

    /// Time goes by: notices silence, stalls, the wall clock and the end of a stop's grace.
    pub fn on_tick(&mut self, now: Now) -> Vec<Action> {
        if self.ending.is_some() {
            return vec![];
        }
        self.awake += now.saturating_sub(self.ticked).min(BLINK);
        self.ticked = now;
        let mut given_up: Vec<(PeerId, &str)> = self
            .peers
            .iter()
            .filter_map(|(&id, peer)| {
                let stalled = !peer.leases.is_empty()
                    && self.awake - peer.progressed > STALL
                    && !self.transfers.keeps_waiting(id);
                match () {
                    () if self.awake - peer.heard > SILENCE => Some((id, "it went silent")),
                    () if stalled => Some((id, "it makes no progress")),
                    () if self.transfers.is_overdue(id, self.awake) => {
                        Some((id, "it takes too long to send a result"))
                    }
                    () => None,
                }
            })
            .collect();
        given_up.sort_unstable();
        // All are gone before any lease is given to others, lest one of them gets it.
        let mut actions: Vec<Action> =
            given_up.iter().flat_map(|&(id, reason)| self.forget(id, reason)).collect();
        let wall_is_over = self.plan.wall.is_some_and(|wall| now >= wall);
        actions.extend(match self.stopping {
            Some((ending, since)) if now.saturating_sub(since) > self.stop_grace() => self.finish(ending),
            None if wall_is_over => self.stop(Ending::WallClock, now),
            _ if !given_up.is_empty() || self.ledger.may_advance() => self.advance(now),
            _ => self.lease_late(now),
        });
        actions.extend(self.make_room(now));
        actions
    }

    fn stop_grace(&self) -> Duration {
        STOP_GRACE + Duration::from_secs_f64(2.0 * LEASE_SECONDS_PER_SUM * self.plan.sums() as f64)
    }

    /// Ends the job early, in good order: no new leases but of lost gaps; results under way are waited for
    /// where they fill a gap below others.
    pub fn stop(&mut self, ending: Ending, now: Now) -> Vec<Action> {
        if self.stopping.is_some() || self.ending.is_some() {
            return vec![];
        }
        self.stopping = Some((ending, now));
        self.ledger.hurry();
        self.advance(now)
    }

    /// No worker will come any more. Ends the job once none is left: what the last ones sent may still be
    /// unread, and others may have joined that the owner does not know.
    pub fn on_no_workers(&mut self) -> Vec<Action> {
        let left = self.peers.values().any(|peer| !matches!(peer.stage, Stage::Admitted));
        if left || self.ending.is_some() {
            return vec![];
        }
        self.ledger.hurry();
        let mut actions = self.advance(self.ticked);
        actions.extend(self.finish(Ending::NoWorkers));
        actions
    }

    fn finish(&mut self, ending: Ending) -> Vec<Action> {
        if self.ending.is_some() {
            return vec![];
        }
        self.ending = Some(ending);
        let mut ids: Vec<PeerId> = self.peers.keys().copied().collect();
        ids.sort_unstable();
        ids.into_iter().flat_map(|id| [Action::Send(id, ToWorker::Done), Action::Close(id)]).collect()
    }
}

fn refuse(id: PeerId, name: String, reason: String) -> Vec<Action> {
    let message = ToWorker::Refused { reason: reason.clone() };
    vec![Action::Send(id, message), Action::Close(id), Action::Tell(Notice::Refused { name, reason })]
}

/// The place of a name among the names, added where it is new.
fn number_of(name: &str, names: &mut Vec<String>) -> u32 {
    let place = names.iter().position(|known| known == name).unwrap_or_else(|| {
        names.push(name.into());
        names.len() - 1
    });
    u32::try_from(place).expect("each name took a connection")
}

/// What a peer says as it may be shown on a terminal.
fn printable(words: &str, chars: usize) -> String {
    words.chars().filter(|c| !c.is_control()).take(chars).collect()
}
