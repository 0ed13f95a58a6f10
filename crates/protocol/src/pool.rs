//! The workers of a coordinator or relay: their connections, their leases, and what becomes of their results. The
//! coordinator or relay itself decides what results amount to and when the job is over.

mod admission;
mod leasing;
mod peer;
mod results;

use std::collections::{BTreeSet, HashMap, HashSet};
use std::time::Duration;

use radiosity::boards::MergeError;

use self::peer::{Peer, PeerStage};
use crate::codec::SHORT_FRAME;
use crate::digest::Digester;
use crate::effort::Effort;
use crate::lead::{Action, Notice, Now, PeerId};
use crate::ledger::Ledger;
use crate::message::{LeaseId, PIECE, ToCoordinator, ToWorker};
use crate::provenance;
use crate::roster::{Contributor, Roster};
use crate::terms::Terms;
use crate::transfers::Transfers;

/// A worker that sends nothing for this long is lost. Workers send a heartbeat every second.
pub const SILENCE: Duration = Duration::from_secs(10);

/// A worker that holds leases and makes no progress for this long is lost.
pub const STALL: Duration = Duration::from_secs(60);

/// The most time between two ticks that counts as silence of peers. The leader itself may be held up (stopped, merging,
/// on a busy machine), and messages of peers are then still unread.
const BLINK: Duration = Duration::from_secs(1);

/// The heartbeats that a peer may save up, and those that it gains each second. Workers send one a second; many may
/// arrive at once after either end was held up. A peer that sends more is faulty.
const BEATS: f64 = 10_000.0;
const BEATS_PER_SECOND: f64 = 100.0;

/// The most names of workers that are refused for good.
const MOST_BANNED: usize = 1 << 16;

/// The most characters of a peer's reason that are shown.
const REASON_CHARS: usize = 400;

/// A worker that is connected now.
#[derive(Clone, Debug, PartialEq)]
pub struct Present {
    /// The name that the worker gave.
    pub name: String,
    /// The number of the worker's threads.
    pub threads: usize,
    /// The leases that the worker has.
    pub leases: usize,
    /// The worker's walks per second, learnt from its results; 0 before the first.
    pub walks_per_second: f64,
}

/// The outcome of an event for the pool.
pub(crate) enum PoolOutcome {
    /// There is no new work to give out and no new result to merge.
    Still(Vec<Action>),
    /// Results or walks came in or back, or a worker is free: the leader goes on from there.
    Moved(Vec<Action>),
    /// A sum overflowed, so that no result is of any use.
    Overflow,
}

/// The workers of a leader, their leases and the ledger.
#[derive(Debug)]
pub(crate) struct WorkerPool {
    terms: Terms,
    /// The ledger of all walks.
    pub ledger: Ledger,
    /// The number of walks that all workers share now, read from the ledger.
    in_hand: fn(&Ledger) -> u64,
    transfers: Transfers,
    peers: HashMap<PeerId, Peer>,
    /// The number of peers that shoot walks, or lead workers that do.
    workers_now: usize,
    /// All threads that shoot walks, as far as their claims are believed.
    threads: usize,
    /// The number of leases that are worked on at once.
    slots: usize,
    /// The peer that has each lease.
    holders: HashMap<LeaseId, PeerId>,
    /// The names of workers that sent an impossible result.
    banned: HashSet<String>,
    /// The peers that have room for another lease.
    hungry: BTreeSet<PeerId>,
    /// Whether walks are leased only to fill gaps below those that are in.
    fills_gaps: bool,
    /// Whether another job follows this one.
    goes_on: bool,
    /// The time of the last tick.
    ticked: Now,
    /// The time at which late leases were last looked for.
    sought: Now,
    /// The waking clock: the time so far, of which at most [`BLINK`] counts between two ticks. It measures silence and
    /// stalls.
    awake: Duration,
    /// A counter that grows whenever any peer makes progress.
    progress: u64,
    first_lease: Option<Now>,
    last_result: Now,
    digester: Digester,
    /// The workers that delivered something, by the numbers that deliveries use.
    roster: Roster,
    /// What earlier sessions and workers that have left took.
    spent: Effort,
}

impl WorkerPool {
    /// A pool without workers for the walks of a ledger. `in_hand` returns the walks that all workers share now; leases
    /// shrink as it does.
    pub(crate) fn new(
        terms: Terms,
        ledger: Ledger,
        in_hand: fn(&Ledger) -> u64,
        workers: Vec<Contributor>,
        spent: Effort,
    ) -> Self {
        WorkerPool {
            digester: Digester::new(&terms.scene_hash),
            terms,
            ledger,
            in_hand,
            transfers: Transfers::default(),
            peers: HashMap::new(),
            workers_now: 0,
            threads: 0,
            slots: 0,
            holders: HashMap::new(),
            banned: HashSet::new(),
            hungry: BTreeSet::new(),
            fills_gaps: false,
            goes_on: false,
            ticked: Duration::ZERO,
            sought: Duration::ZERO,
            awake: Duration::ZERO,
            progress: 0,
            first_lease: None,
            last_result: Duration::ZERO,
            roster: Roster::new(workers),
            spent,
        }
    }

    /// What workers must know and be to join.
    pub(crate) fn terms(&self) -> &Terms {
        &self.terms
    }

    /// All workers that delivered, by the numbers that deliveries use.
    pub(crate) fn workers(&self) -> &[Contributor] {
        self.roster.workers()
    }

    /// The ledger and all workers that delivered.
    pub(crate) fn into_books(self) -> (Ledger, Vec<Contributor>) {
        (self.ledger, self.roster.into_workers())
    }

    /// Moves the prefix on ([`Ledger::advance`]) and credits its walks to the workers that delivered them.
    ///
    /// # Errors
    /// Where a sum overflows; the job cannot go on.
    pub(crate) fn advance(&mut self) -> Result<bool, MergeError> {
        let WorkerPool { ledger, roster, .. } = self;
        ledger.advance(|delivery| roster.credit(delivery))
    }

    /// The number of peers that shoot walks now, or lead workers that do.
    pub(crate) fn workers_now(&self) -> usize {
        self.workers_now
    }

    /// The peers that shoot walks now, or lead workers that do, sorted by name.
    pub(crate) fn present(&self) -> Vec<Present> {
        let working = self.peers.values().filter(|peer| peer.is_working());
        let mut present: Vec<Present> = working
            .map(|peer| Present {
                name: peer.name.clone(),
                threads: peer.threads,
                leases: peer.leases.len(),
                walks_per_second: peer.rate * peer.threads as f64,
            })
            .collect();
        present.sort_by(|a, b| a.name.cmp(&b.name));
        present
    }

    /// The number of threads that shoot walks now.
    pub(crate) fn threads(&self) -> usize {
        self.threads
    }

    /// Whether no peer is connected that was let in.
    pub(crate) fn is_empty(&self) -> bool {
        self.peers.values().all(|peer| matches!(peer.stage, PeerStage::Admitted))
    }

    /// A counter that grows whenever any peer makes progress.
    pub(crate) fn progress(&self) -> u64 {
        self.progress
    }

    /// The time on the waking clock.
    pub(crate) fn awake(&self) -> Duration {
        self.awake
    }

    /// What the workers are doing, for a message that nothing comes in.
    pub(crate) fn standstill(&self) -> String {
        let leases = self.peers.values().map(|peer| peer.leases.len()).sum::<usize>();
        match (self.workers_now, self.ledger.walks_in() == self.ledger.total()) {
            (_, true) => "all are in, and the last checkpoint is still being written".into(),
            (0, _) if self.is_empty() => "no worker is there".into(),
            (0, _) => "all workers are still building the scene".into(),
            _ if self.threads == 0 => "all relays wait for workers".into(),
            (workers, _) => {
                let disk = if self.ledger.is_held() { ", while a checkpoint is being written" } else { "" };
                format!(
                    "{workers} workers hold {leases} leases, and keep {} results that wait for those before them{disk}",
                    self.transfers.kept()
                )
            }
        }
    }

    /// The time of the last tick.
    pub(crate) fn ticked(&self) -> Now {
        self.ticked
    }

    /// The walks per second of all workers, learnt from their results.
    pub(crate) fn rate(&self) -> f64 {
        self.peers.values().map(|peer| peer.rate * peer.threads as f64).sum()
    }

    /// What the run has taken so far.
    pub(crate) fn effort(&self) -> Effort {
        let began = self.first_lease.unwrap_or(self.last_result);
        Effort {
            seconds: self.spent.seconds + self.last_result.saturating_sub(began).as_secs_f64(),
            cpu_seconds: self.spent.cpu_seconds
                + self.peers.values().map(|peer| peer.cpu_seconds).sum::<f64>(),
            streams_reissued: self.spent.streams_reissued + self.ledger.streams_reissued,
            ..self.spent
        }
    }

    /// The largest frame that a peer may send [bytes]: a piece of a tally of this job, the message around it, and a
    /// relay's provenance.
    pub(crate) fn frame_cap(&self, id: PeerId) -> usize {
        let relays = self.peers.get(&id).is_some_and(|peer| peer.relays);
        let provenance = if relays { provenance::MOST_BYTES } else { 0 };
        SHORT_FRAME + self.terms.most_bytes().min(PIECE) + provenance
    }

    /// Takes up a connection whose other end has proved that it knows the key.
    pub(crate) fn on_connect(&mut self, id: PeerId) {
        let peer = Peer::new(id, self.awake, BEATS);
        self.peers.insert(id, peer);
    }

    /// Handles a message of a peer.
    pub(crate) fn on_message(&mut self, id: PeerId, message: ToCoordinator, now: Now) -> PoolOutcome {
        let Some(peer) = self.peers.get_mut(&id) else { return PoolOutcome::Still(vec![]) };
        let quiet = (self.awake - peer.heard).as_secs_f64();
        peer.beats = BEATS.min(peer.beats + quiet * BEATS_PER_SECOND);
        peer.heard = self.awake;
        if matches!(message, ToCoordinator::Alive { .. } | ToCoordinator::Capacity { .. }) {
            peer.beats -= 1.0;
            if peer.beats < 0.0 {
                return self.drop_peer(id, "sent heartbeats too often (a faulty program)");
            }
        }
        match (&peer.stage, message) {
            (PeerStage::Admitted, ToCoordinator::Hello(hello)) => {
                PoolOutcome::Still(self.on_hello(id, hello))
            }
            (PeerStage::Welcomed, ToCoordinator::Ready { scene_hash, job_hash }) => {
                self.on_ready(id, scene_hash, job_hash)
            }
            (PeerStage::Working, ToCoordinator::Result(result)) => self.on_result(id, result, now),
            (PeerStage::Working, ToCoordinator::Offer { lease, bytes }) => self.on_offer(id, lease, bytes),
            (PeerStage::Working, ToCoordinator::Piece { lease, sums }) => {
                self.gets_on(id);
                if sums.len() == PIECE && self.transfers.stage(id, lease, &sums, self.awake) {
                    return PoolOutcome::Still(vec![]);
                }
                self.drop_peer(id, "sent a piece of a result that it was not asked for")
            }
            (PeerStage::Working, ToCoordinator::Capacity { threads, lease_seconds }) if peer.relays => {
                self.on_capacity(id, threads, lease_seconds)
            }
            (PeerStage::Working, ToCoordinator::Return { lease }) if peer.relays => self.on_return(id, lease),
            (PeerStage::Welcomed | PeerStage::Working, ToCoordinator::Alive { progress }) => {
                if progress > peer.progress {
                    peer.progress = progress;
                    self.gets_on(id);
                }
                PoolOutcome::Still(vec![])
            }
            (PeerStage::Welcomed | PeerStage::Working, ToCoordinator::Leave) => self.see_off(id),
            (_, ToCoordinator::Failed { reason }) => self.drop_peer(id, &format!("gave up: {reason}")),
            _ => self.drop_peer(id, "sent an unexpected message (a foreign or faulty program)"),
        }
    }

    /// Notes that a peer has read more of a long message. A peer may send nothing until it has the whole message, so
    /// this counts as a sign of life and of progress.
    pub(crate) fn on_stir(&mut self, id: PeerId) {
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.heard = self.awake;
            self.gets_on(id);
        }
    }

    /// Notes that a peer makes progress.
    fn gets_on(&mut self, id: PeerId) {
        self.progress += 1;
        if let Some(peer) = self.peers.get_mut(&id) {
            peer.progressed = self.awake;
        }
    }

    /// Takes a connection that has ended out of the books.
    pub(crate) fn on_lost(&mut self, id: PeerId, reason: &str) -> PoolOutcome {
        if self.peers.contains_key(&id) { self.drop_peer(id, reason) } else { PoolOutcome::Still(vec![]) }
    }

    /// Closes a connection; its leases go to other workers.
    fn drop_peer(&mut self, id: PeerId, reason: &str) -> PoolOutcome {
        PoolOutcome::Moved(self.forget(id, reason))
    }

    /// Lets a worker leave that announced it.
    fn see_off(&mut self, id: PeerId) -> PoolOutcome {
        let Some(peer) = self.take_out(id) else { return PoolOutcome::Still(vec![]) };
        self.spent.workers_lost += 1;
        PoolOutcome::Moved(vec![Action::Close(id), Action::Tell(Notice::Left { name: peer.name })])
    }

    /// Gives up a worker that sent an impossible result, and refuses its name from now on. What it delivered beyond
    /// gaps is walked again; its share of the prefix cannot be separated from the rest.
    fn ban(&mut self, id: PeerId, reason: &str) -> PoolOutcome {
        let Some(peer) = self.peers.get(&id) else { return PoolOutcome::Still(vec![]) };
        if self.banned.len() < MOST_BANNED {
            self.banned.insert(peer.name.clone());
        }
        let number = self.roster.number(&peer.name);
        self.roster.blame(number);
        let workers = self.roster.workers();
        self.ledger.lose_waiting_of(|worker| workers[worker as usize].peer() == peer.name);
        let walks = self.roster.walks_over(&peer.name);
        let rest = match walks {
            0 => String::new(),
            _ => format!(
                "; {walks} of its walks are already in the result, where `radwalk audit` can check them"
            ),
        };
        self.drop_peer(
            id,
            &format!("sent a result that does not fit ({reason}), and is not let in again{rest}"),
        )
    }

    /// Takes a connection out of the books, and its leases back.
    fn take_out(&mut self, id: PeerId) -> Option<Peer> {
        let mut peer = self.peers.remove(&id)?;
        self.transfers.forget(id);
        if peer.is_working() {
            self.workers_now -= 1;
            self.threads -= peer.trusted_threads();
            self.slots -= peer.slots;
            self.hungry.remove(&id);
        }
        self.spent.cpu_seconds += peer.cpu_seconds;
        for lease in std::mem::take(&mut peer.leases).into_keys() {
            self.holders.remove(&lease);
            self.ledger.lose(lease);
        }
        Some(peer)
    }

    /// Closes a connection and tells the owner why.
    fn forget(&mut self, id: PeerId, reason: &str) -> Vec<Action> {
        let Some(peer) = self.take_out(id) else { return vec![] };
        let reason = printable(reason, REASON_CHARS);
        let notice = if matches!(peer.stage, PeerStage::Admitted) {
            Notice::Failed(reason)
        } else {
            self.spent.workers_lost += 1;
            Notice::Lost { name: peer.name, reason }
        };
        vec![Action::Close(id), Action::Tell(notice)]
    }

    /// Advances the clocks and gives up peers that are silent, stalled or too slow to send a result. All of them are
    /// removed before any lease is given out again, so that none of them gets one.
    pub(crate) fn tick(&mut self, now: Now) -> Vec<Action> {
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

    /// Notes that another job follows this one.
    pub(crate) fn expect_another_job(&mut self) {
        self.goes_on = true;
    }

    /// Parts with every peer.
    pub(crate) fn dismiss(&mut self) -> Vec<Action> {
        let mut ids: Vec<PeerId> = self.peers.keys().copied().collect();
        ids.sort_unstable();
        ids.into_iter().flat_map(|id| self.farewell(id)).collect()
    }

    /// The last actions for a peer. It is told that the job is done, and its connection closes. Where another job follows, its
    /// connection closes without a word, so that the peer looks for its leader again and finds that job.
    pub(crate) fn farewell(&self, id: PeerId) -> Vec<Action> {
        let done = (!self.goes_on).then_some(Action::Send(id, ToWorker::Done));
        done.into_iter().chain([Action::Close(id)]).collect()
    }
}

fn refuse(id: PeerId, name: String, reason: String) -> Vec<Action> {
    let message = ToWorker::Refused { reason: reason.clone() };
    vec![Action::Send(id, message), Action::Close(id), Action::Tell(Notice::Refused { name, reason })]
}

/// A peer's words without control characters and cut to `chars`, to be shown on a terminal.
fn printable(words: &str, chars: usize) -> String {
    words.chars().filter(|c| !c.is_control()).take(chars).collect()
}
