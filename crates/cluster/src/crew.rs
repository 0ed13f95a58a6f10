//! The workers of whoever leads: who is there, what each was given, and what becomes of it. What results amount to, and
//! when it is over, is for the coordinator ([`crate::coordinator`]) or the relay ([`crate::relay`]) to say.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use bincode::{Decode, Encode};
use radiosity::{Counts, Layout, MergeError};

use crate::codec::{LONGEST_SUM, SHORT_FRAME};
use crate::digest::Digester;
use crate::lead::{Action, Notice, Now, PeerId};
use crate::ledger::{LeaseId, Ledger, Rejected};
use crate::message::{Hello, LeaseResult, PIECE, PROTOCOL, SMALL_TALLY, ToCoordinator, ToWorker};
use crate::pace::{LATE, LEASE_GROWTH, lease_seconds, taking_seconds};
use crate::parcel::Parcel;
use crate::transfers::{Offer, Room, Transfers};

/// A worker that says nothing for so long is lost. Workers speak every second.
pub const SILENCE: Duration = Duration::from_secs(10);

/// A worker that holds leases and makes no progress for so long is lost.
pub const STALL: Duration = Duration::from_secs(60);

/// So many workers may be at the same walks: the more, the sooner the end where several are silent.
const MOST_COPIES: usize = 3;

/// How often late leases are looked for.
const LATE_LOOK: Duration = Duration::from_millis(100);

/// At most so much time between two ticks is held against peers. Whoever leads may be held up itself (it
/// was stopped, it merged, the machine was busy), and what peers said meanwhile is still unread then.
const BLINK: Duration = Duration::from_secs(1);

/// Heartbeats come once a second. So many more may come at once, when either end was held up, and so many a second;
/// who sends more is faulty.
const BEATS: f64 = 10_000.0;
const BEATS_PER_SECOND: f64 = 100.0;

/// Bytes that a worker may cost here beside what all share: for islands, and for results under way.
const ISLAND_SHARE: usize = 32 << 10;
const STAGING_SHARE: usize = 8 << 10;

/// A worker is leased work for at most so many threads, whatever it claims to have; a relay for so many.
const MAX_THREADS: usize = 4096;
const MAX_RELAYED_THREADS: usize = 1 << 20;

/// A relay's lease takes at most so long, whatever it asks for [s].
const LONGEST_RELAYED: f64 = 86_400.0;

/// Names and builds are shown to this length, reasons to the next.
const NAME_CHARS: usize = 80;
const REASON_CHARS: usize = 400;

/// What workers have to know and to be.
#[derive(Clone)]
pub struct Terms {
    /// The job as workers read it.
    pub job: Arc<[u8]>,
    /// What a worker's replica must hash to.
    pub scene_hash: [u8; 32],
    /// Likewise.
    pub job_hash: [u8; 32],
    /// The only build that may join.
    pub build: String,
    /// Walks per stream.
    pub stream_walks: u64,
    /// Leases per worker thread that are out at once.
    pub leases_per_thread: usize,
    /// Patches of the scene.
    pub patches: usize,
    /// What a tally of the job keeps of each.
    pub layout: Layout,
}

impl Terms {
    /// Numbers in a tally of the job.
    pub fn sums(&self) -> usize {
        self.patches * self.layout.columns()
    }

    /// What the packed sums of a result can take.
    fn most_bytes(&self) -> usize {
        LONGEST_SUM * self.sums()
    }
}

/// What a run took, its earlier sessions included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Encode, Decode)]
pub struct Effort {
    /// From the first lease to the last result that was merged.
    pub seconds: f64,
    /// Processor time that all workers walked.
    pub cpu_seconds: f64,
    /// Workers that ever shot.
    pub workers_seen: u64,
    /// Workers that were lost while the job ran.
    pub workers_lost: u64,
    /// Streams of lost leases.
    pub streams_reissued: u64,
}

/// What an event came to.
pub enum Step {
    /// There is nothing new to give out, or to do with results.
    Still(Vec<Action>),
    /// Results or walks came in or back, or somebody is free: see what can be done now.
    Moved(Vec<Action>),
    /// A sum overflowed; no result is of any use.
    Overflow,
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
    /// Whether it has others work for it.
    relays: bool,
    /// Threads that shoot there.
    threads: usize,
    /// Leases that it works on at once: one a thread; of a relay one in all, none while it has no workers.
    slots: usize,
    /// How long its leases take at least [s].
    lease_seconds: f64,
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

impl Peer {
    fn is_working(&self) -> bool {
        matches!(self.stage, Stage::Working)
    }

    /// Threads that share a lease.
    fn lease_threads(&self) -> usize {
        if self.relays { self.threads } else { 1 }
    }

    /// Walks per second of those that share a lease.
    fn lease_rate(&self) -> f64 {
        self.rate * self.lease_threads() as f64
    }
}

/// A lease that is late.
struct Late {
    /// When its walks were last leased, by the waking clock.
    since: Duration,
    /// How long that may take.
    patience: f64,
    lease: LeaseId,
    /// Who is at them.
    holders: Vec<PeerId>,
}

/// Workers and their leases.
pub struct Crew {
    terms: Terms,
    /// The walks.
    pub ledger: Ledger,
    /// The walks that all share now, by the books.
    in_hand: fn(&Ledger) -> u64,
    transfers: Transfers,
    peers: HashMap<PeerId, Peer>,
    /// How many of the peers shoot, or have others shoot.
    workers_now: usize,
    /// All threads that shoot.
    threads: usize,
    /// All leases that are worked on at once.
    slots: usize,
    /// Those that have room for a lease.
    hungry: BTreeSet<PeerId>,
    /// Whether no walk is leased any more that does not fill a gap below what is walked.
    fills_gaps: bool,
    /// The last tick.
    ticked: Now,
    /// When late leases were last looked for.
    sought: Now,
    /// The waking clock: time without what went by unnoticed between ticks. Silence and stalls go by it.
    awake: Duration,
    /// Grows while anybody makes progress.
    progress: u64,
    first_lease: Option<Now>,
    last_result: Now,
    digester: Digester,
    /// Whoever worked, as deliveries name them.
    workers: Vec<String>,
    /// What earlier sessions and workers that have gone took.
    spent: Effort,
}

impl Crew {
    /// Nobody yet, for the walks of a ledger. `in_hand` says how many walks all share now: leases grow smaller with it.
    pub fn new(
        terms: Terms,
        ledger: Ledger,
        in_hand: fn(&Ledger) -> u64,
        workers: Vec<String>,
        spent: Effort,
    ) -> Self {
        Crew {
            digester: Digester::new(&terms.scene_hash),
            terms,
            ledger,
            in_hand,
            transfers: Transfers::default(),
            peers: HashMap::new(),
            workers_now: 0,
            threads: 0,
            slots: 0,
            hungry: BTreeSet::new(),
            fills_gaps: false,
            ticked: Duration::ZERO,
            sought: Duration::ZERO,
            awake: Duration::ZERO,
            progress: 0,
            first_lease: None,
            last_result: Duration::ZERO,
            workers,
            spent,
        }
    }

    /// What workers have to know.
    pub fn terms(&self) -> &Terms {
        &self.terms
    }

    /// Whoever worked, as deliveries name them.
    pub fn workers(&self) -> &[String] {
        &self.workers
    }

    /// The books, and whoever worked.
    pub fn into_books(self) -> (Ledger, Vec<String>) {
        (self.ledger, self.workers)
    }

    /// How many shoot now, or have others shoot.
    pub fn workers_now(&self) -> usize {
        self.workers_now
    }

    /// All threads that shoot now.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Whether nobody is here who was let in.
    pub fn is_empty(&self) -> bool {
        self.peers.values().all(|peer| matches!(peer.stage, Stage::Admitted))
    }

    /// Grows while anybody makes progress.
    pub fn progress(&self) -> u64 {
        self.progress
    }

    /// The last tick.
    pub fn ticked(&self) -> Now {
        self.ticked
    }

    /// Walks per second of all workers, as far as they have shown.
    pub fn rate(&self) -> f64 {
        self.peers.values().map(|peer| peer.rate * peer.threads as f64).sum()
    }

    /// What all took so far.
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
        SHORT_FRAME + self.terms.most_bytes().min(PIECE)
    }

    /// Somebody who knows the key has connected.
    pub fn on_connect(&mut self, id: PeerId) {
        let peer = Peer {
            stage: Stage::Admitted,
            name: format!("peer {id}"),
            relays: false,
            threads: 0,
            slots: 0,
            lease_seconds: 0.0,
            leases: HashMap::new(),
            heard: self.awake,
            progress: 0,
            progressed: self.awake,
            number: 0,
            rate: 0.0,
            longest_lease: 0,
            cpu_seconds: 0.0,
            beats: BEATS,
        };
        self.peers.insert(id, peer);
    }

    /// A peer said something.
    pub fn on_message(&mut self, id: PeerId, message: ToCoordinator, now: Now) -> Step {
        let Some(peer) = self.peers.get_mut(&id) else { return Step::Still(vec![]) };
        let quiet = (self.awake - peer.heard).as_secs_f64();
        peer.beats = BEATS.min(peer.beats + quiet * BEATS_PER_SECOND);
        peer.heard = self.awake;
        if matches!(message, ToCoordinator::Alive { .. } | ToCoordinator::Capacity { .. }) {
            peer.beats -= 1.0;
            if peer.beats < 0.0 {
                return self.drop_peer(id, "says too often that it is alive (a faulty program)");
            }
        }
        match (&peer.stage, message) {
            (Stage::Admitted, ToCoordinator::Hello(hello)) => Step::Still(self.on_hello(id, hello)),
            (Stage::Welcomed, ToCoordinator::Ready { scene_hash, job_hash }) => {
                self.on_ready(id, scene_hash, job_hash)
            }
            (Stage::Working, ToCoordinator::Result(result)) => self.on_result(id, result, now),
            (Stage::Working, ToCoordinator::Offer { lease, bytes }) => self.on_offer(id, lease, bytes),
            (Stage::Working, ToCoordinator::Piece { lease, sums }) => {
                self.gets_on(id);
                if sums.len() == PIECE && self.transfers.stage(id, lease, &sums) {
                    return Step::Still(vec![]);
                }
                self.drop_peer(id, "sent a piece of a result that it was not asked for")
            }
            (Stage::Working, ToCoordinator::Capacity { threads, lease_seconds }) if peer.relays => {
                self.on_capacity(id, threads, lease_seconds)
            }
            (Stage::Working, ToCoordinator::Return { lease }) if peer.relays => self.on_return(id, lease),
            (Stage::Welcomed | Stage::Working, ToCoordinator::Alive { progress }) => {
                if progress > peer.progress {
                    peer.progress = progress;
                    self.gets_on(id);
                }
                Step::Still(vec![])
            }
            (_, ToCoordinator::Failed { reason }) => self.drop_peer(id, &format!("gave up: {reason}")),
            _ => self.drop_peer(id, "spoke out of turn (a foreign or faulty program)"),
        }
    }

    /// A long message to a peer gets on. It may say nothing until it has all of it, so this is a sign of life and of
    /// progress.
    pub fn on_stir(&mut self, id: PeerId) {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.heard = self.awake;
            self.gets_on(id);
        }
    }

    /// A peer makes progress.
    fn gets_on(&mut self, id: PeerId) {
        self.progress += 1;
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.progressed = self.awake;
        }
    }

    /// A peer introduces itself: can it walk as we do?
    fn on_hello(&mut self, id: PeerId, hello: Hello) -> Vec<Action> {
        let refusal = if hello.protocol != PROTOCOL {
            Some(format!(
                "it speaks protocol {}, this coordinator {PROTOCOL}; use the same radwalk",
                hello.protocol
            ))
        } else if hello.build != self.terms.build {
            Some(format!(
                "it is radwalk {}, this coordinator {} (other builds may walk otherwise); use the same build",
                printable(&hello.build, NAME_CHARS),
                self.terms.build
            ))
        } else if hello.threads == 0 && !hello.relays {
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
        peer.relays = hello.relays;
        // A relay says later how many its workers have.
        peer.threads = if hello.relays { 0 } else { (hello.threads as usize).min(MAX_THREADS) };
        peer.slots = peer.threads;
        let Terms { job, stream_walks, leases_per_thread, .. } = &self.terms;
        let (stream_walks, leases_per_thread) = (*stream_walks, *leases_per_thread as u32);
        vec![Action::Send(id, ToWorker::Welcome { job: job.clone(), stream_walks, leases_per_thread })]
    }

    /// A peer has built its replica: is it the same scene and job?
    fn on_ready(&mut self, id: PeerId, scene_hash: [u8; 32], job_hash: [u8; 32]) -> Step {
        if (scene_hash, job_hash) != (self.terms.scene_hash, self.terms.job_hash) {
            self.spent.workers_lost += 1;
            let peer = self.peers.remove(&id).expect("the caller found it");
            let reason = "its replica of the scene differs (its build or memory is faulty)";
            return Step::Still(refuse(id, peer.name, reason.into()));
        }
        self.spent.workers_seen += 1;
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        peer.stage = Stage::Working;
        peer.number = number_of(&peer.name, &mut self.workers);
        self.workers_now += 1;
        self.threads += peer.threads;
        self.slots += peer.slots;
        self.gets_on(id);
        self.consider(id);
        Step::Moved(vec![])
    }

    /// Notes whether a peer has room for a lease.
    fn consider(&mut self, id: PeerId) {
        let Some(peer) = self.peers.get(&id) else { return };
        if peer.is_working() && peer.leases.len() < self.terms.leases_per_thread * peer.slots {
            self.hungry.insert(id);
        } else {
            self.hungry.remove(&id);
        }
    }

    /// A relay's workers have come or gone.
    fn on_capacity(&mut self, id: PeerId, threads: u32, lease_seconds: f64) -> Step {
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        self.threads -= peer.threads;
        self.slots -= peer.slots;
        peer.threads = (threads as usize).min(MAX_RELAYED_THREADS);
        peer.slots = peer.threads.min(1);
        let wanted = if lease_seconds.is_nan() { 0.0 } else { lease_seconds };
        peer.lease_seconds = wanted.clamp(0.0, LONGEST_RELAYED);
        self.threads += peer.threads;
        self.slots += peer.slots;
        self.consider(id);
        Step::Moved(vec![])
    }

    /// A relay that has lost its workers gives a lease back.
    fn on_return(&mut self, id: PeerId, lease: LeaseId) -> Step {
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        if peer.leases.remove(&lease).is_none() {
            return self.drop_peer(id, "returned a lease that it did not have");
        }
        self.ledger.lose(lease);
        self.consider(id);
        Step::Moved(vec![])
    }

    /// A worker has a large result.
    fn on_offer(&mut self, id: PeerId, lease: LeaseId, bytes: u64) -> Step {
        let sums = self.terms.sums();
        let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
        let peer = &self.peers[&id];
        let offered = match self.ledger.range(lease) {
            // Others were faster.
            None if peer.leases.contains_key(&lease) => return Step::Moved(vec![self.spare(id, lease)]),
            Some(walks)
                if peer.leases.contains_key(&lease) && (sums..=self.terms.most_bytes()).contains(&bytes) =>
            {
                self.transfers.offer(Offer { peer: id, lease, walks, bytes })
            }
            _ => false,
        };
        if offered {
            Step::Still(self.ask())
        } else {
            self.drop_peer(id, "offered a result that it was not asked for")
        }
    }

    /// Lets a worker drop a large result that others have brought.
    fn spare(&mut self, id: PeerId, lease: LeaseId) -> Action {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.leases.remove(&lease);
        }
        self.gets_on(id);
        self.consider(id);
        Action::Send(id, ToWorker::Drop { lease })
    }

    /// Asks for large results where there is room.
    fn ask(&mut self) -> Vec<Action> {
        let void = self.transfers.take_void(&self.ledger);
        let mut actions: Vec<Action> = void.into_iter().map(|(id, lease)| self.spare(id, lease)).collect();
        let (workers, tally) = (self.workers_now, (size_of::<u128>() * self.terms.sums()).max(1));
        let room =
            Room { islands: 1 + workers * ISLAND_SHARE / tally, bytes: tally / 4 + workers * STAGING_SHARE };
        let asked = self.transfers.grant(&self.ledger, room, self.awake);
        for &(id, _) in &asked {
            self.gets_on(id);
        }
        actions.extend(asked.into_iter().map(|(id, lease)| Action::Send(id, ToWorker::Send { lease })));
        actions
    }

    /// Where every lease that is out is a result that is kept beyond a gap, nobody is free to fill the gap: whoever keeps
    /// the furthest drops its own, which are leased again.
    pub fn make_room(&mut self, now: Now) -> Vec<Action> {
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
    fn on_result(&mut self, id: PeerId, mut result: LeaseResult, now: Now) -> Step {
        let peer = self.peers.get_mut(&id).expect("the caller found it");
        let lease = result.lease;
        let asked = match self.terms.sums() {
            ..=SMALL_TALLY => true,
            _ => self.transfers.finish(id, lease, &result.sums).map(|sums| result.sums = sums).is_some(),
        };
        if !asked || peer.leases.remove(&lease).is_none() {
            return self.drop_peer(id, "sent a result that it was not asked for");
        }
        if result.cpu_seconds.is_finite() {
            peer.cpu_seconds = peer.cpu_seconds.max(result.cpu_seconds);
        }
        let (number, seconds) = (peer.number, result.seconds);
        self.gets_on(id);
        self.consider(id);
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
                let rate = walks as f64 / seconds.max(1e-6) / peer.lease_threads().max(1) as f64;
                peer.rate = if peer.rate == 0.0 { rate } else { 0.5 * (peer.rate + rate) };
                self.last_result = now;
                Step::Moved(vec![])
            }
            // Others were faster, or it was given up and is back.
            Err(Rejected::NotLeased(_)) => Step::Moved(vec![]),
            Err(Rejected::Tally(MergeError::Overflow(_))) => Step::Overflow,
            Err(rejected) => {
                self.ledger.lose(lease);
                self.drop_peer(id, &format!("sent a result that does not fit ({rejected})"))
            }
        }
    }

    /// Asks for what is kept and gives out what there is to do.
    pub fn go_on(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.ask();
        actions.extend(self.hand_out(now));
        actions
    }

    /// From now on no walk is leased that does not fill a gap below others.
    pub fn fill_gaps(&mut self) {
        self.fills_gaps = true;
        self.ledger.hurry();
    }

    /// Where what is walked ends: what is in, and what workers keep or are sending.
    fn walked(&self) -> u64 {
        self.ledger.last_waiting().max(self.transfers.end()).unwrap_or(0)
    }

    /// Whether a gap below what is walked may still be filled.
    pub fn gap_may_close(&self) -> bool {
        let walked = self.walked();
        self.ledger.gap_is_out(walked) || (self.ledger.gap_is_lost(walked) && self.workers_now > 0)
    }

    /// Fills every working peer up with leases, the idlest first. While stopping, with those alone that fill
    /// gaps below what is walked.
    fn hand_out(&mut self, now: Now) -> Vec<Action> {
        let mut actions = Vec::new();
        if self.ledger.unleased() == 0 {
            return actions;
        }
        for depth in 0..self.terms.leases_per_thread {
            let fed = |peer: &Peer| peer.leases.len() >= (depth + 1) * peer.slots;
            let hungry: Vec<PeerId> =
                self.hungry.iter().copied().filter(|id| !fed(&self.peers[id])).collect();
            for id in hungry {
                while !fed(&self.peers[&id]) {
                    let walks = self.lease_walks(id, now);
                    let leased = match self.fills_gaps {
                        false => self.ledger.lease(walks),
                        true => self.ledger.lease_gap(walks, self.walked()),
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
        let by_rate = peer.lease_rate() * self.lease_seconds(now).max(peer.lease_seconds);
        let streams = (peer.lease_threads() as u64).saturating_mul(self.terms.stream_walks);
        let by_growth = peer.longest_lease.max(streams) as f64 * LEASE_GROWTH;
        let parts = (self.terms.leases_per_thread * self.threads) as u128;
        let share = u128::from((self.in_hand)(&self.ledger)) * peer.lease_threads() as u128 / parts;
        // Results must not come faster than they are taken, towards the end either.
        let least = (peer.lease_rate() * taking_seconds(self.terms.sums(), self.slots)) as u64;
        // Rounded up to whole streams, that is one for every thread.
        let one_each = streams.saturating_sub(self.terms.stream_walks - 1);
        (by_rate.min(by_growth) as u64).min((share as u64).max(least)).max(one_each)
    }

    /// How long a lease should take.
    pub fn lease_seconds(&self, now: Now) -> f64 {
        let age = self.spent.seconds + now.as_secs_f64();
        lease_seconds(self.terms.sums(), self.slots, age)
    }

    /// How long leases take that are out now, at most [s].
    pub fn longest_lease_seconds(&self, now: Now) -> f64 {
        self.peers.values().map(|peer| peer.lease_seconds).fold(self.lease_seconds(now), f64::max)
    }

    /// Gives walks that are late once more, to workers that have nothing to do when all walks are out. Whoever is first
    /// counts, so that the end waits for nobody who is slow or silent.
    pub fn lease_late(&mut self, now: Now) -> Vec<Action> {
        let nothing_else = !self.fills_gaps && self.ledger.unleased() == 0;
        if !nothing_else || now.saturating_sub(self.sought) < LATE_LOOK {
            return vec![];
        }
        self.sought = now;
        let is_idle = |peer: &Peer| peer.leases.len() < peer.slots;
        let idle: Vec<PeerId> = self.hungry.iter().copied().filter(|id| is_idle(&self.peers[id])).collect();
        let mut late = if idle.is_empty() { vec![] } else { self.late(now) };
        let mut actions = Vec::new();
        for id in idle {
            while is_idle(&self.peers[&id])
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
        let mut out: BTreeMap<u64, Late> = BTreeMap::new();
        for (&id, peer) in &self.peers {
            for (&lease, &since) in &peer.leases {
                // Others have done what is not out any more.
                let Some(range) = self.ledger.range(lease) else { continue };
                let walking = (range.end - range.start) as f64 / (fastest * peer.lease_threads() as f64);
                let seconds = self.lease_seconds(now).max(peer.lease_seconds).max(walking);
                let patience = LATE * self.terms.leases_per_thread as f64 * seconds;
                let fresh = || Late { since, patience, lease, holders: vec![] };
                let late = out.entry(range.start).or_insert_with(fresh);
                if since > late.since {
                    (late.since, late.patience) = (since, patience);
                }
                late.holders.push(id);
            }
        }
        let mut late: Vec<Late> = out
            .into_values()
            .filter(|late| {
                late.holders.len() < MOST_COPIES && (self.awake - late.since).as_secs_f64() > late.patience
            })
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
        peer.longest_lease = peer.longest_lease.max(walks);
        self.consider(id);
        Action::Send(id, ToWorker::Lease { id: lease, first_walk: self.ledger.number(range.start), walks })
    }

    /// A connection is gone.
    pub fn on_lost(&mut self, id: PeerId, reason: &str) -> Step {
        if self.peers.contains_key(&id) { self.drop_peer(id, reason) } else { Step::Still(vec![]) }
    }

    /// Closes a connection, so that its leases go to others.
    fn drop_peer(&mut self, id: PeerId, reason: &str) -> Step {
        Step::Moved(self.forget(id, reason))
    }

    /// Closes a connection and takes its leases back.
    fn forget(&mut self, id: PeerId, reason: &str) -> Vec<Action> {
        let Some(peer) = self.peers.remove(&id) else { return vec![] };
        self.transfers.forget(id);
        if peer.is_working() {
            self.workers_now -= 1;
            self.threads -= peer.threads;
            self.slots -= peer.slots;
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

    /// Time goes by: gives up those that are silent, stall or take too long. All are gone before any lease is given to
    /// others, lest one of them gets it.
    pub fn tick(&mut self, now: Now) -> Vec<Action> {
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
        given_up.iter().flat_map(|&(id, reason)| self.forget(id, reason)).collect()
    }

    /// Sends everybody home.
    pub fn dismiss(&mut self) -> Vec<Action> {
        let mut ids: Vec<PeerId> = self.peers.keys().copied().collect();
        ids.sort_unstable();
        ids.into_iter().flat_map(farewell).collect()
    }
}

/// It is over.
pub fn farewell(id: PeerId) -> [Action; 2] {
    [Action::Send(id, ToWorker::Done), Action::Close(id)]
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
