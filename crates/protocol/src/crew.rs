//! The workers of whoever leads: who is there, what each was given, and what becomes of it. What results amount to, and
//! when it is over, is for the coordinator or the relay to say.

mod admission;
mod leasing;
mod peer;
mod results;

use std::collections::{BTreeSet, HashMap, HashSet};
use std::time::Duration;

use radiosity::MergeError;

use self::peer::{Peer, Stage};
use crate::codec::SHORT_FRAME;
use crate::digest::Digester;
pub use crate::effort::Effort;
use crate::lead::{Action, Notice, Now, PeerId};
use crate::ledger::{LeaseId, Ledger};
use crate::message::{PIECE, ToCoordinator, ToWorker};
use crate::provenance;
use crate::roster::{Contributor, Roster};
pub use crate::terms::Terms;
use crate::transfers::Transfers;

/// A worker that says nothing for so long is lost. Workers speak every second.
pub const SILENCE: Duration = Duration::from_secs(10);

/// A worker that holds leases and makes no progress for so long is lost.
pub const STALL: Duration = Duration::from_secs(60);

/// At most so much time between two ticks is held against peers. Whoever leads may be held up itself (it
/// was stopped, it merged, the machine was busy), and what peers said meanwhile is still unread then.
const BLINK: Duration = Duration::from_secs(1);

/// Heartbeats come once a second. So many more may come at once, when either end was held up, and so many a second;
/// who sends more is faulty.
const BEATS: f64 = 10_000.0;
const BEATS_PER_SECOND: f64 = 100.0;

/// The most names of workers that are not let in again.
const MOST_BANNED: usize = 1 << 16;

/// Reasons are shown to this length.
const REASON_CHARS: usize = 400;

/// A worker that is there now.
#[derive(Clone, Debug, PartialEq)]
pub struct Present {
    /// As it called itself.
    pub name: String,
    /// Its threads.
    pub threads: usize,
    /// Leases that it has.
    pub leases: usize,
    /// Walks a second, as far as it has shown; 0 before its first result.
    pub walks_per_second: f64,
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
    /// All threads that shoot, as far as they are believed.
    threads: usize,
    /// All leases that are worked on at once.
    slots: usize,
    /// Who has which lease.
    holders: HashMap<LeaseId, PeerId>,
    /// Names of workers that sent a result that cannot be.
    banned: HashSet<String>,
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
    /// The workers that brought something, as deliveries name them.
    roster: Roster,
    /// What earlier sessions and workers that have gone took.
    spent: Effort,
}

impl Crew {
    /// Nobody yet, for the walks of a ledger. `in_hand` says how many walks all share now: leases grow smaller with it.
    pub fn new(
        terms: Terms,
        ledger: Ledger,
        in_hand: fn(&Ledger) -> u64,
        workers: Vec<Contributor>,
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
            holders: HashMap::new(),
            banned: HashSet::new(),
            hungry: BTreeSet::new(),
            fills_gaps: false,
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

    /// What workers have to know.
    pub fn terms(&self) -> &Terms {
        &self.terms
    }

    /// Whoever worked, as deliveries name them.
    pub fn workers(&self) -> &[Contributor] {
        self.roster.workers()
    }

    /// The books, and whoever worked.
    pub fn into_books(self) -> (Ledger, Vec<Contributor>) {
        (self.ledger, self.roster.into_workers())
    }

    /// Moves the prefix on ([`Ledger::advance`]), to the credit of those that brought its walks.
    ///
    /// # Errors
    /// Where a sum overflows; the job cannot go on.
    pub fn advance(&mut self) -> Result<bool, MergeError> {
        let Crew { ledger, roster, .. } = self;
        ledger.advance(|delivery| roster.credit(delivery))
    }

    /// How many shoot now, or have others shoot.
    pub fn workers_now(&self) -> usize {
        self.workers_now
    }

    /// Those that shoot now, or have others shoot, by name.
    pub fn present(&self) -> Vec<Present> {
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

    /// The waking clock.
    pub fn awake(&self) -> Duration {
        self.awake
    }

    /// What all are at, in words.
    pub fn standstill(&self) -> String {
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

    /// The largest frame that a peer may send: what a piece of a tally of this job can hold, what stands around it, and what a
    /// relay tells of its workers.
    pub fn frame_cap(&self, id: PeerId) -> usize {
        let relays = self.peers.get(&id).is_some_and(|peer| peer.relays);
        let provenance = if relays { provenance::MOST_BYTES } else { 0 };
        SHORT_FRAME + self.terms.most_bytes().min(PIECE) + provenance
    }

    /// Somebody who knows the key has connected.
    pub fn on_connect(&mut self, id: PeerId) {
        let peer = Peer::new(id, self.awake, BEATS);
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
                if sums.len() == PIECE && self.transfers.stage(id, lease, &sums, self.awake) {
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
            (Stage::Welcomed | Stage::Working, ToCoordinator::Leave) => self.see_off(id),
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

    /// A connection is gone.
    pub fn on_lost(&mut self, id: PeerId, reason: &str) -> Step {
        if self.peers.contains_key(&id) { self.drop_peer(id, reason) } else { Step::Still(vec![]) }
    }

    /// Closes a connection, so that its leases go to others.
    fn drop_peer(&mut self, id: PeerId, reason: &str) -> Step {
        Step::Moved(self.forget(id, reason))
    }

    /// Lets a worker go that leaves by itself.
    fn see_off(&mut self, id: PeerId) -> Step {
        let Some(peer) = self.take_out(id) else { return Step::Still(vec![]) };
        self.spent.workers_lost += 1;
        Step::Moved(vec![Action::Close(id), Action::Tell(Notice::Left { name: peer.name })])
    }

    /// Gives up a worker that sent what cannot be. What it brought that waits beyond gaps is walked again; what is in the prefix
    /// cannot be told from the rest.
    fn ban(&mut self, id: PeerId, reason: &str) -> Step {
        let Some(peer) = self.peers.get(&id) else { return Step::Still(vec![]) };
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
            _ => format!("; {walks} walks of it are in the result already, which `radwalk audit` can check"),
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

    /// Closes a connection and tells why.
    fn forget(&mut self, id: PeerId, reason: &str) -> Vec<Action> {
        let Some(peer) = self.take_out(id) else { return vec![] };
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

/// What a peer says as it may be shown on a terminal.
fn printable(words: &str, chars: usize) -> String {
    words.chars().filter(|c| !c.is_control()).take(chars).collect()
}
