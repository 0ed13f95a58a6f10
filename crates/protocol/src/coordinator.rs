//! The coordinator as a pure state machine: events in, actions out, time as a number. The sockets are a thin shell
//! around it (the crate `cluster`), so that every fault can be tested without one. Its workers are its pool
//! ([`crate::pool`]); the coordinator decides what their results amount to and when the job is over.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use radiosity::{Layout, Tally};

use crate::checkpoint::{Look, Past};
use crate::digest::Digester;
use crate::effort::Effort;
use crate::lead::{Action, Notice, Now};
use crate::leader::Leader;
use crate::ledger::Ledger;
use crate::limits::Limits;
use crate::pace::LEASE_SECONDS_PER_SUM;
use crate::pool::{Present, WorkerPool};
use crate::roster::Contributor;
use crate::terms::Terms;
use crate::watch::{Watchdog, Watched};

/// The longest that a stopping job waits for results that workers keep or send, and for leases that fill a gap below
/// them; the time that the messages of two leases take is added.
const STOP_GRACE: Duration = Duration::from_secs(3);

/// The most bytes of out-of-order ranges in a checkpoint; the lowest out-of-order ranges are kept.
const MOST_OUT_OF_ORDER_BYTES: usize = 256 << 20;

/// A function that judges the tally of a prefix, given the looks before.
pub type Judge = Box<dyn FnMut(&Tally, &[Look]) -> Look>;

/// The job that the coordinator is to see done.
pub struct JobPlan {
    /// The job, encoded as workers read it.
    pub job: Arc<[u8]>,
    /// The digest that the scene of a worker's replica must have.
    pub scene_hash: [u8; 32],
    /// The digest that the job of a worker's replica must have.
    pub job_hash: [u8; 32],
    /// The build of the program; workers of another build are refused.
    pub build: String,
    /// The number of the job's first walk; all other walk numbers here count from it.
    pub first: u64,
    /// The total number of walks.
    pub paths: u64,
    /// The number of walks per stream.
    pub stream_paths: u64,
    /// The leases that each worker thread may have at once: 2, one under way and one waiting, so that no thread waits;
    /// 1 if a walk takes so long that a waiting one would be missed elsewhere.
    pub leases_per_thread: usize,
    /// The number of patches in the scene.
    pub patches: usize,
    /// The columns that a tally of the job keeps for each patch.
    pub layout: Layout,
    /// The most that the walks of the job can come to.
    pub limits: Limits,
    /// The time at which the job stops, whatever has been reached.
    pub wall: Option<Duration>,
    /// A secret random number: it decides which leases keep an entry of their own among the deliveries of a long run.
    pub lots: u64,
    /// The walk counts at which `judge` looks at the prefix, ascending.
    pub looks: Vec<u64>,
    /// The judge of a prefix's tally. It is called at looks only.
    pub judge: Judge,
}

/// The reason why a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Every walk is in.
    BudgetSpent,
    /// The target was met at a look.
    TargetReached,
    /// The wall-clock limit was reached.
    WallClock,
    /// The owner of the run asked for a stop.
    Interrupted,
    /// No worker is left, and none will come.
    NoWorkers,
    /// Workers are there and walks are left, but nothing happens: a fault of the program.
    Stuck,
    /// A sum overflowed, so that the prefix is of no use.
    Overflow,
}

/// A snapshot of the job for progress displays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The walks that are in, those beyond gaps included.
    pub walks: u64,
    /// The workers that shoot walks now.
    pub workers: usize,
}

/// The state of one job and its pool.
pub struct Coordinator {
    pool: WorkerPool,
    wall: Option<Duration>,
    judge: Judge,
    looks: Vec<Look>,
    stopping: Option<(Ending, Now)>,
    ending: Option<Ending>,
    watch: Watchdog,
    /// The bytes that workers have sent.
    received: u64,
}

/// The whole state but for the judge, so that tests can tell states apart.
impl fmt::Debug for Coordinator {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Coordinator { pool, wall, judge: _, looks, stopping, ending, watch, received } = self;
        let state = (pool, wall, looks, stopping, ending, watch, received);
        f.debug_tuple("Coordinator").field(&state).finish()
    }
}

impl Coordinator {
    /// A coordinator for a plan that goes on from the `past`, which is empty for a new job.
    pub fn new(plan: JobPlan, past: Past) -> Self {
        let JobPlan { job, scene_hash, job_hash, build, patches, layout, limits, leases_per_thread, .. } =
            plan;
        let stream_walks = plan.stream_paths;
        let terms = Terms {
            job,
            scene_hash,
            job_hash,
            build,
            stream_walks,
            leases_per_thread,
            patches,
            layout,
            limits,
        };
        let Past { tally, deliveries, out_of_order, workers, looks, effort } = past;
        let ledger = Ledger::new(plan.paths, stream_walks, plan.looks, tally, deliveries)
            .drawn_by(plan.lots)
            .with_out_of_order(&out_of_order, &Digester::new(&scene_hash));
        let reached = looks.last().is_some_and(|look| look.reached && look.walks == ledger.prefix_walks());
        let ending = match () {
            () if reached => Some(Ending::TargetReached),
            () if ledger.is_complete() => Some(Ending::BudgetSpent),
            () => None,
        };
        let pool =
            WorkerPool::new(terms, ledger.numbered_from(plan.first), Ledger::unleased, workers, effort);
        Coordinator {
            pool,
            wall: plan.wall,
            judge: plan.judge,
            looks,
            stopping: None,
            ending,
            watch: Watchdog::default(),
            received: 0,
        }
    }

    /// The coordinator of a job that another job follows: at its end the workers are not told that they are done, and look for
    /// the other job's coordinator.
    pub fn followed_by_another(mut self) -> Self {
        self.pool.expect_another_job();
        self
    }

    /// The books of the prefix: all that another coordinator needs to go on from here. A large tally is shared, not
    /// copied; the prefix then moves on only after the reader has dropped it.
    pub fn past(&self) -> Past {
        let ledger = &self.pool.ledger;
        Past {
            tally: ledger.prefix().clone(),
            deliveries: ledger.deliveries().clone(),
            out_of_order: ledger.kept_out_of_order(MOST_OUT_OF_ORDER_BYTES),
            workers: self.pool.workers().to_vec(),
            looks: self.looks.clone(),
            effort: self.effort(),
        }
    }

    /// The books without out-of-order ranges, and with a copy of the tally, so that a slow reader holds up nothing here.
    pub fn snapshot(&self) -> Past {
        let ledger = &self.pool.ledger;
        Past {
            tally: Tally::clone(ledger.prefix()).into(),
            deliveries: ledger.deliveries().clone(),
            out_of_order: Vec::new(),
            workers: self.pool.workers().to_vec(),
            looks: self.looks.clone(),
            effort: self.effort(),
        }
    }

    /// The books themselves, after the job is over.
    pub fn into_past(self) -> Past {
        let effort = self.effort();
        let (ledger, workers) = self.pool.into_books();
        let out_of_order = ledger.kept_out_of_order(MOST_OUT_OF_ORDER_BYTES);
        let (tally, deliveries) = ledger.into_prefix();
        Past { tally, deliveries, out_of_order, workers, looks: self.looks, effort }
    }

    /// The reason why the job ended, once it has.
    pub fn ending(&self) -> Option<Ending> {
        self.ending
    }

    /// The tally of the prefix 0 … N − 1.
    pub fn prefix(&self) -> &Tally {
        self.pool.ledger.prefix()
    }

    /// A snapshot for progress displays.
    pub fn progress(&self) -> Progress {
        Progress { walks: self.pool.ledger.walks_in(), workers: self.pool.workers_now() }
    }

    /// The workers that are connected now.
    pub fn present(&self) -> Vec<Present> {
        self.pool.present()
    }

    /// The workers that ever brought a result, in earlier sessions too.
    pub fn contributors(&self) -> &[Contributor] {
        self.pool.workers()
    }

    /// All looks so far.
    pub fn looks(&self) -> &[Look] {
        &self.looks
    }

    /// The bytes that workers have sent since they were let in.
    pub fn received(&self) -> u64 {
        self.received
    }

    /// What the run has taken so far, its earlier sessions included.
    pub fn effort(&self) -> Effort {
        self.pool.effort()
    }

    fn stop_grace(&self) -> Duration {
        STOP_GRACE + Duration::from_secs_f64(2.0 * LEASE_SECONDS_PER_SUM * self.pool.terms().sums() as f64)
    }

    /// Ends the job early, in good order: only lost gaps are leased from now on. For a while the coordinator waits for
    /// results that are walked already and for leases that fill gaps below them.
    pub fn stop(&mut self, ending: Ending, now: Now) -> Vec<Action> {
        if self.stopping.is_some() || self.ending.is_some() {
            return vec![];
        }
        self.stopping = Some((ending, now));
        self.pool.fill_gaps();
        self.advance(now)
    }

    /// Notes that no worker will come any more. Ends the job once none is left: messages of the last workers may still
    /// be unread, and workers may have joined that the owner does not know of.
    pub fn on_no_workers(&mut self) -> Vec<Action> {
        if !self.pool.is_empty() || self.ending.is_some() {
            return vec![];
        }
        self.pool.ledger.hurry();
        let mut actions = self.advance(self.pool.ticked());
        actions.extend(self.finish(Ending::NoWorkers));
        actions
    }

    /// Tells the owner when nothing comes in for long, and ends the job when nothing can come in any more. A relay
    /// without workers waits for them, and workers may have to wait for a slow disk.
    fn keep_watch(&mut self) -> Vec<Action> {
        let WorkerPool { ledger, .. } = &self.pool;
        let walks = ledger.walks_in();
        let could = walks < ledger.total() && self.pool.threads() > 0 && !ledger.is_held();
        match self.watch.look(self.pool.awake(), walks, self.pool.progress()) {
            Watched::Well => vec![],
            Watched::Still if could => self.finish(Ending::Stuck),
            Watched::Still | Watched::Quiet => {
                let seconds = self.watch.quiet(self.pool.awake()).as_secs();
                vec![Action::Tell(Notice::Quiet { seconds, why: self.pool.standstill() })]
            }
        }
    }

    fn finish(&mut self, ending: Ending) -> Vec<Action> {
        if self.ending.is_some() {
            return vec![];
        }
        self.ending = Some(ending);
        self.pool.dismiss()
    }
}

impl Leader for Coordinator {
    fn pool_mut(&mut self) -> &mut WorkerPool {
        &mut self.pool
    }

    fn pool(&self) -> &WorkerPool {
        &self.pool
    }

    fn is_over(&self) -> bool {
        self.ending.is_some()
    }

    /// Moves the prefix on, judges it at each look, and gives out more work.
    fn advance(&mut self, now: Now) -> Vec<Action> {
        loop {
            match self.pool.advance() {
                Ok(true) => {}
                Ok(false) => break,
                Err(_) => return self.finish(Ending::Overflow),
            }
            if self.pool.ledger.at_look() {
                let look = (self.judge)(self.pool.ledger.prefix(), &self.looks);
                self.looks.push(look);
                if look.reached {
                    return self.finish(Ending::TargetReached);
                }
            }
        }
        if self.pool.ledger.is_complete() {
            return self.finish(Ending::BudgetSpent);
        }
        let mut actions = self.pool.go_on(now);
        // A stopping job ends once nothing more can be saved.
        if let Some((ending, _)) = self.stopping
            && !self.pool.gap_may_close()
        {
            actions.extend(self.finish(ending));
        }
        actions
    }

    fn overflow(&mut self) -> Vec<Action> {
        self.finish(Ending::Overflow)
    }

    /// Notices silence, stalls, the wall clock and the end of a stop's grace.
    fn tick(&mut self, now: Now) -> Vec<Action> {
        let mut actions = self.pool.tick(now);
        let wall_is_over = self.wall.is_some_and(|wall| now >= wall);
        actions.extend(match self.stopping {
            Some((ending, since)) if now.saturating_sub(since) > self.stop_grace() => self.finish(ending),
            None if wall_is_over => self.stop(Ending::WallClock, now),
            _ if !actions.is_empty() || self.pool.ledger.may_advance() => self.advance(now),
            _ => vec![],
        });
        if self.ending.is_none() {
            actions.extend(self.pool.keep_going(now));
            actions.extend(self.keep_watch());
        }
        actions
    }

    fn count(&mut self, bytes: usize) {
        self.received += bytes as u64;
    }
}
