//! A job that threads of this process walk by themselves. They are the one worker of a coordinator that needs no socket to lead them, so
//! the answer is that of the cluster.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use job::Job;
use judge::target::looks;
use protocol::codec::pack;
use protocol::digest::Digester;
use protocol::message::{Hello, LeaseResult, PROTOCOL, SMALL_TALLY, ToCoordinator, ToWorker};
use protocol::pace::{BOARD_WALKS, FIRST_CHUNK, next_chunk};
use protocol::{Action, Coordinator, Ending, Lead, LeaseId, LeaseProvenance, Look, Past, PeerId};
use radiosity::{Board, Experiment, Overflow, Tally};
use rustix::time::{ClockId, clock_gettime};

use crate::checkpoints::Identity;
use crate::error::Error;
use crate::replica::Replica;
use crate::settings::Settings;
use crate::stored_run::StoredRun;

/// Between two calls of the watcher.
const WATCH: Duration = Duration::from_millis(100);

/// For how long the coordinator waits for a result before it is told the time.
const TICK: Duration = Duration::from_millis(20);

/// The number of the only worker.
const WORKER: PeerId = 0;

/// The progress of a job whose walks this process traces itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoloProgress {
    /// Paths that are in.
    pub paths: u64,
    /// Paths of the whole job.
    pub paths_total: u64,
    /// Since the first walk [s].
    pub seconds: f64,
    /// What half of the area is known within, at the latest look; `None` before the first.
    pub median_relative_error: Option<f64>,
}

/// Walks a job on some threads of this process, a build of the program. `watch` hears ten times a second where the job stands, on the
/// calling thread; where it says no, walks are given up and there is no result.
///
/// # Errors
/// Where a sum overflows, and where the system refuses a thread.
pub fn walk_here(
    job: &Job,
    experiment: Experiment,
    threads: usize,
    build: &str,
    watch: &mut dyn FnMut(SoloProgress) -> bool,
) -> Result<Option<(StoredRun, Ending)>, Error> {
    let settings = Settings::of(job);
    let identity = Identity::new(job, &settings, &experiment, build)?;
    let mut observer = settings.observer(&experiment);
    let judge = Box::new(move |tally: &Tally, seen: &[Look]| observer.look(tally, seen));
    let looks = looks(&experiment, job.budget.paths / experiment.unit().paths());
    let walks = looks.last().copied().unwrap_or(0);
    let plan = identity.plan(build, &job.budget, &experiment, (looks, judge), 0);
    let coordinator = Coordinator::new(plan, Past::none(experiment.tally()));
    let replica = Replica::new(experiment, &settings, settings.seed);
    let shooters = Shooters { replica: &replica, over: AtomicBool::new(false), progress: AtomicU64::new(0) };
    let (ending, past) = thread::scope(|scope| {
        let (queue, leases) = unbounded();
        let (found, results) = unbounded();
        // However this ends, threads are waited for.
        let _over = Over(&shooters.over);
        for _ in 0..threads.max(1) {
            let (leases, found, shooters) = (leases.clone(), found.clone(), &shooters);
            thread::Builder::new()
                .spawn_scoped(scope, move || shooters.shoot(&leases, &found))
                .map_err(|source| Error::System { doing: "starting a thread", source })?;
        }
        drop(found);
        let offered = HashMap::new();
        let mut led = Led { shooters: &shooters, coordinator, queue, offered, cpu_seconds: 0.0, walks };
        led.introduce(build, threads.max(1));
        let ending = led.lead(&results, watch)?;
        Ok::<_, Error>((ending, led.coordinator.into_past()))
    })?;
    let checkpoint = identity.checkpoint(past);
    Ok(ending
        .map(|ending| (StoredRun { checkpoint, settings, experiment: replica.into_experiment() }, ending)))
}

/// A range of walks under a number.
struct ThreadLease {
    id: LeaseId,
    walks: Range<u64>,
}

/// What the threads share.
struct Shooters<'a> {
    replica: &'a Replica,
    /// Whether walks under way are of no use any more.
    over: AtomicBool,
    /// How often any thread has gone on: that it grows shows that they do.
    progress: AtomicU64,
}

/// Ends the walks when it is dropped, also by a panic: they would be waited for.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Shooters<'_> {
    fn go_on(&self) -> bool {
        self.progress.fetch_add(1, Ordering::Relaxed);
        !self.over.load(Ordering::Relaxed)
    }

    /// One thread's work: lease after lease, until there are no more.
    fn shoot(&self, leases: &Receiver<ThreadLease>, found: &Sender<Result<LeaseResult, Overflow>>) {
        let _panicking = Panicking(&self.over);
        let experiment = self.replica.experiment();
        let digester = Digester::new(&experiment.scene().hash());
        let (mut board, mut chunk) = (experiment.board(), FIRST_CHUNK);
        for ThreadLease { id, walks } in leases {
            let (began, cpu_began) = (Instant::now(), thread_seconds());
            let tally = match self.trace(walks, &mut board, &mut chunk) {
                Ok(Some(tally)) => tally,
                Ok(None) => return,
                Err(overflow) => return drop(found.send(Err(overflow))),
            };
            let result = LeaseResult {
                lease: id,
                seconds: began.elapsed().as_secs_f64(),
                cpu_seconds: thread_seconds() - cpu_began,
                digest: digester.digest(&tally),
                counts: Box::new(tally.counts.to_array()),
                sums: pack(tally.sums()),
                provenance: LeaseProvenance::default(),
            };
            if found.send(Ok(result)).is_err() {
                return;
            }
        }
    }

    /// The tally of some walks; `None` where they are given up.
    fn trace(
        &self,
        walks: Range<u64>,
        board: &mut Board,
        chunk: &mut u64,
    ) -> Result<Option<Tally>, Overflow> {
        let experiment = self.replica.experiment();
        let (mut tally, mut next) = (experiment.tally(), walks.start);
        while next < walks.end {
            let end = walks.end.min(next.saturating_add(BOARD_WALKS));
            while next < end {
                let part = next..end.min(next + *chunk);
                next = part.end;
                let began = Instant::now();
                experiment.walk_while(self.replica.sequence(), part, board, &|| self.go_on());
                *chunk = next_chunk(*chunk, began.elapsed());
                if !self.go_on() {
                    return Ok(None);
                }
            }
            board.add_to(&mut tally)?;
        }
        Ok(Some(tally))
    }
}

/// Ends all walks where those of a thread panic.
struct Panicking<'a>(&'a AtomicBool);

impl Drop for Panicking<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

/// The coordinator with its only worker.
struct Led<'a> {
    shooters: &'a Shooters<'a>,
    coordinator: Coordinator,
    queue: Sender<ThreadLease>,
    /// Large results, until the coordinator asks for them.
    offered: HashMap<LeaseId, LeaseResult>,
    /// Processor time of all walks so far [s].
    cpu_seconds: f64,
    /// Walks of the whole job.
    walks: u64,
}

impl Led<'_> {
    fn introduce(&mut self, build: &str, threads: usize) {
        let name = format!("process {}", std::process::id());
        let (build, threads) = (build.to_owned(), threads as u32);
        let (scene_hash, job_hash) =
            (self.shooters.replica.experiment().scene().hash(), self.shooters.replica.job_hash());
        self.coordinator.on_connect(WORKER);
        self.tell(
            ToCoordinator::Hello(Hello { protocol: PROTOCOL, build, name, threads, relays: false }),
            Duration::ZERO,
        );
        self.tell(ToCoordinator::Ready { scene_hash, job_hash }, Duration::ZERO);
    }

    /// Leads the threads until the job has ended. Returns why; `None` where the watcher has given it up.
    fn lead(
        &mut self,
        results: &Receiver<Result<LeaseResult, Overflow>>,
        watch: &mut dyn FnMut(SoloProgress) -> bool,
    ) -> Result<Option<Ending>, Error> {
        let began = Instant::now();
        let mut watched = WATCH;
        while self.coordinator.ending().is_none() && !self.shooters.over.load(Ordering::Relaxed) {
            let heard = results.recv_timeout(TICK);
            let now = began.elapsed();
            match heard {
                Ok(result) => self.bring(result.map_err(|Overflow| Error::Overflow)?, now),
                Err(RecvTimeoutError::Timeout) => {
                    let progress = self.shooters.progress.load(Ordering::Relaxed);
                    self.tell(ToCoordinator::Alive { progress }, now);
                }
                // A thread has panicked, and the scope tells.
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
            }
            let actions = self.coordinator.on_tick(now);
            self.obey(actions, now);
            if now >= watched {
                watched = now + WATCH;
                if !watch(self.stage(now)) {
                    return Ok(None);
                }
            }
        }
        let goes_on = watch(self.stage(began.elapsed()));
        match self.coordinator.ending() {
            Some(Ending::Overflow) => Err(Error::Overflow),
            ending => Ok(ending.filter(|_| goes_on)),
        }
    }

    /// Brings the coordinator a result: a large one when it asks.
    fn bring(&mut self, mut result: LeaseResult, now: Duration) {
        self.cpu_seconds += result.cpu_seconds;
        result.cpu_seconds = self.cpu_seconds;
        if self.coordinator.prefix().sums().len() <= SMALL_TALLY {
            return self.tell(ToCoordinator::Result(result), now);
        }
        let (lease, bytes) = (result.lease, result.sums.len() as u64);
        self.offered.insert(lease, result);
        self.tell(ToCoordinator::Offer { lease, bytes }, now);
    }

    fn tell(&mut self, message: ToCoordinator, now: Duration) {
        let actions = self.coordinator.on_message(WORKER, message, now);
        self.obey(actions, now);
    }

    fn obey(&mut self, actions: Vec<Action>, now: Duration) {
        for action in actions {
            match action {
                Action::Send(_, ToWorker::Lease { id, first_walk, walks }) => {
                    // Where the threads are gone, they have panicked, and the scope tells.
                    let _ = self.queue.send(ThreadLease { id, walks: first_walk..first_walk + walks });
                }
                Action::Send(_, ToWorker::Send { lease }) => {
                    for message in self.offered.remove(&lease).into_iter().flat_map(LeaseResult::in_pieces) {
                        self.tell(message, now);
                    }
                }
                Action::Send(_, ToWorker::Drop { lease }) => drop(self.offered.remove(&lease)),
                Action::Send(..) | Action::Close(_) | Action::Tell(_) => {}
            }
        }
    }

    fn stage(&self, now: Duration) -> SoloProgress {
        let paths = self.shooters.replica.experiment().unit().paths();
        SoloProgress {
            paths: self.coordinator.progress().walks.saturating_mul(paths),
            paths_total: self.walks.saturating_mul(paths),
            seconds: now.as_secs_f64(),
            median_relative_error: self.coordinator.looks().last().map(|look| look.median_relative_error),
        }
    }
}

/// Processor time of this thread so far [s].
fn thread_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
