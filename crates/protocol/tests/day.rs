//! A day of a coordinator in simulated time: thousands of workers bring the walks of a large job, checkpoints are written, workers die and others come, the
//! coordinator dies and goes on from its checkpoint. What it holds is counted by the allocator. No walk is lost or counted twice, and memory and
//! checkpoint do not grow with the time.

#[path = "toy/counting.rs"]
mod counting;
mod toy;

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use counting::{HELD, megabytes};
use protocol::message::{LeaseResult, ToCoordinator, ToWorker};
use protocol::{
    Action, Book, Checkpoint, Coordinator, Ending, JobPlan, Lead, Limits, Notice, Past, PeerId, WalkRange,
};
use radiosity::{Counts, Tally};
use toy::{Dice, JOB, JOB_HASH, LAYOUT, PATCHES, READY, SCENE_HASH, hello, plan, result_of};

/// The time between two ticks.
const TICK: Duration = Duration::from_millis(500);

/// The ticks between two heartbeats of a worker, and between two checkpoints.
const BEAT: u64 = 10;
const CHECKPOINT: u64 = 120;

/// The checkpoints between two lines that say how far it is.
const HOUR: usize = 60;

/// The ticks in which all workers find another coordinator.
const RETURN: u64 = 20;

const STREAM: u64 = 1024;

/// The most deliveries in a checkpoint, and the bytes of one of them or of the name of a worker, at the most.
const ENTRIES: usize = 1 << 15;
const ENTRY: usize = 32;

/// Why a worker is lost.
const DIED: &str = "it died";

/// What is simulated.
struct Day {
    workers: usize,
    walks: u64,
    /// The walks per second of the fastest worker; the slowest has half of that.
    rate: f64,
    /// The workers that die each minute, and are replaced.
    deaths: usize,
    /// The ticks between two deaths of the coordinator.
    life: u64,
}

/// The tally of some walks: sums of the numbers of walks and of their squares, which have closed forms.
fn tally(walks: &Range<u64>) -> Tally {
    let count = walks.end - walks.start;
    let counts = Counts { walks: count, rays: count, absorbed: count, ..Counts::default() };
    // Σ n = m(m − 1)/2 and Σ n² = (m − 1)m(2m − 1)/6 of the numbers n below m.
    let upto = |m: u64| {
        let m = u128::from(m);
        let below = m.saturating_sub(1);
        [below * m / 2, below * m * (2 * m).saturating_sub(1) / 6]
    };
    let (from, to) = (upto(walks.start), upto(walks.end));
    let mut sums = vec![0; PATCHES * LAYOUT.columns()];
    sums[0] = to[0] - from[0];
    sums[1] = to[1] - from[1];
    (sums[2], sums[3]) = (count.into(), count.into());
    Tally::from_parts(counts, PATCHES, LAYOUT, sums).unwrap()
}

#[derive(Default)]
struct Worker {
    peer: Option<PeerId>,
    name: u64,
    rate: f64,
    leases: VecDeque<(u64, Range<u64>)>,
    /// The tick at which the worker connects, where it has no connection.
    joins: u64,
}

/// The end of a lease: the time [µs], the worker and its connection.
type End = Reverse<(u64, usize, PeerId)>;

/// What a row of the chart says.
struct Row {
    seconds: f64,
    held: usize,
    checkpoint: u64,
    files: usize,
    walks: u64,
}

struct Simulation<'a> {
    day: &'a Day,
    folder: &'a Path,
    coordinator: Coordinator,
    workers: Vec<Worker>,
    /// The ends of leases, the earliest first.
    ends: BinaryHeap<End>,
    /// The worker of each connection.
    of: Vec<usize>,
    tick: u64,
    /// The tick at which the present coordinator began.
    began: u64,
    names: u64,
    dice: Dice,
    deaths: [u64; 2],
}

impl<'a> Simulation<'a> {
    fn new(day: &'a Day, folder: &'a Path) -> Self {
        let worker = |n: usize| Worker {
            name: n as u64,
            rate: day.rate * (1.0 - 0.5 * n as f64 / day.workers as f64),
            joins: n as u64 % RETURN,
            ..Worker::default()
        };
        Simulation {
            day,
            folder,
            coordinator: Coordinator::new(day.plan(), Past::none(tally(&(0..0)))),
            workers: (0..day.workers).map(worker).collect(),
            ends: BinaryHeap::new(),
            of: Vec::new(),
            tick: 0,
            began: 0,
            names: day.workers as u64,
            dice: Dice(7),
            deaths: [0; 2],
        }
    }

    /// The time of the present coordinator at a number of microseconds.
    fn now(&self, micros: u64) -> Duration {
        Duration::from_micros(micros) - TICK * u32::try_from(self.began).expect("a few days")
    }

    fn micros(&self) -> u64 {
        self.tick * TICK.as_micros() as u64
    }

    /// The part of the walks that is in [%].
    fn share(&self) -> f64 {
        100.0 * self.coordinator.progress().walks as f64 / self.day.walks as f64
    }

    /// Lives through the ticks to the end of the job, or to some tick.
    fn live(&mut self, most: u64) -> Vec<Row> {
        let mut rows: Vec<Row> = Vec::new();
        let bare = HELD.load(Ordering::Relaxed);
        while self.coordinator.ending().is_none() {
            assert!(self.tick < most, "the job does not end");
            self.tick += 1;
            while let Some(&Reverse((at, worker, peer))) = self.ends.peek()
                && at <= self.micros()
            {
                self.ends.pop();
                if self.workers[worker].peer == Some(peer) {
                    self.bring(worker, at);
                }
            }
            self.join();
            if self.tick.is_multiple_of(BEAT) {
                let progress = self.tick;
                for worker in 0..self.workers.len() {
                    self.say(worker, ToCoordinator::Alive { progress }, self.micros());
                }
            }
            let actions = self.coordinator.on_tick(self.now(self.micros()));
            self.act(actions, self.micros());
            if self.tick.is_multiple_of(CHECKPOINT) {
                rows.push(self.row(bare));
                if rows.len().is_multiple_of(HOUR) {
                    println!("{} h: {:.1} % of the walks", rows.len() / HOUR, self.share());
                }
                (0..self.day.deaths).for_each(|_| self.kill());
            }
            if self.tick.is_multiple_of(self.day.life) && self.coordinator.ending().is_none() {
                self.restart();
            }
        }
        rows
    }

    fn join(&mut self) {
        for n in 0..self.workers.len() {
            if self.workers[n].peer.is_none() && self.tick >= self.workers[n].joins {
                let peer = self.of.len() as PeerId;
                self.of.push(n);
                self.workers[n].peer = Some(peer);
                let actions = self.coordinator.on_connect(peer);
                self.act(actions, self.micros());
                self.say(
                    n,
                    ToCoordinator::Hello(hello(&format!("worker {}", self.workers[n].name), 1)),
                    self.micros(),
                );
                self.say(n, READY, self.micros());
            }
        }
    }

    fn say(&mut self, n: usize, message: ToCoordinator, micros: u64) {
        let Some(peer) = self.workers[n].peer else { return };
        let actions = self.coordinator.on_message(peer, message, self.now(micros));
        self.act(actions, micros);
    }

    fn bring(&mut self, n: usize, micros: u64) {
        let worker = &mut self.workers[n];
        let (lease, walks) = worker.leases.pop_front().expect("it walked one");
        let seconds = (walks.end - walks.start) as f64 / worker.rate;
        let result = LeaseResult { seconds, cpu_seconds: 0.0, ..result_of(lease, &tally(&walks)) };
        self.begin(n, micros);
        self.say(n, ToCoordinator::Result(result), micros);
    }

    /// Lets a worker walk the first of its leases.
    fn begin(&mut self, n: usize, micros: u64) {
        let Worker { peer, leases, rate, .. } = &self.workers[n];
        if let (Some(peer), Some((_, walks))) = (peer, leases.front()) {
            let took = 1e6 * (walks.end - walks.start) as f64 / rate;
            self.ends.push(Reverse((micros + took as u64, n, *peer)));
        }
    }

    fn act(&mut self, actions: Vec<Action>, micros: u64) {
        for action in actions {
            match action {
                Action::Send(peer, ToWorker::Lease { id, first_walk, walks }) => {
                    let n = self.of[peer as usize];
                    assert_eq!(self.workers[n].peer, Some(peer), "leases go to workers that are there");
                    self.workers[n].leases.push_back((id, first_walk..first_walk + walks));
                    if self.workers[n].leases.len() == 1 {
                        self.begin(n, micros);
                    }
                }
                Action::Close(peer) => {
                    self.workers[self.of[peer as usize]].peer = None;
                }
                Action::Tell(Notice::Joined { .. }) | Action::Send(..) => {}
                Action::Tell(Notice::Lost { reason, .. }) if reason == DIED => {}
                Action::Tell(notice) => panic!("{notice}"),
            }
        }
    }

    /// A worker dies; another one, under a name of its own, comes in its place.
    fn kill(&mut self) {
        let n = self.dice.below(self.workers.len() as u64) as usize;
        let Some(peer) = self.workers[n].peer.take() else { return };
        self.deaths[0] += 1;
        self.names += 1;
        let rate = self.workers[n].rate;
        self.workers[n] = Worker { name: self.names, rate, joins: self.tick + RETURN, ..Worker::default() };
        let actions = self.coordinator.on_lost(peer, DIED, self.now(self.micros()));
        self.act(actions, self.micros());
    }

    /// The coordinator dies, and another one goes on from the last checkpoint.
    fn restart(&mut self) {
        self.deaths[1] += 1;
        let Checkpoint { tally, book, .. } = Checkpoint::read(&self.folder.join("tally.bin")).unwrap();
        let Book { parts, out_of_order, workers, looks, effort, .. } = book;
        let deliveries = parts.into_iter().next().unwrap().deliveries;
        self.coordinator = Coordinator::new(
            self.day.plan(),
            Past { tally, deliveries, out_of_order, workers, looks, effort },
        );
        self.began = self.tick;
        self.ends.clear();
        self.of.clear();
        for (n, worker) in self.workers.iter_mut().enumerate() {
            (worker.peer, worker.joins) = (None, self.tick + 1 + n as u64 % RETURN);
            worker.leases.clear();
        }
    }

    /// Writes a checkpoint, and says what the coordinator takes.
    fn row(&mut self, bare: usize) -> Row {
        // What the simulation itself holds is not the coordinator's.
        self.ends.shrink_to_fit();
        let queues = self.ends.capacity() * size_of::<End>() + self.of.capacity() * size_of::<usize>();
        let held = (HELD.load(Ordering::Relaxed) - bare).saturating_sub(queues);
        let Past { tally, deliveries, out_of_order, workers, looks, effort } = self.coordinator.past();
        let walks = tally.counts.walks;
        let part = WalkRange { job_hash: JOB_HASH, seed: 1, first: 0, deliveries };
        let (goal, job, sessions) = ([0; 32], JOB.into(), vec![]);
        let book = Book { parts: vec![part], out_of_order, workers, looks, goal, effort, sessions, job };
        let checkpoint = Checkpoint { scene_hash: SCENE_HASH, tally, book };
        let path = self.folder.join("tally.bin");
        let mut file = BufWriter::new(File::create(&path).unwrap());
        checkpoint.write(&mut file).unwrap();
        file.flush().unwrap();
        let files = fs::read_dir(self.folder).unwrap().count();
        let seconds = self.micros() as f64 / 1e6;
        Row { seconds, held, checkpoint: fs::metadata(path).unwrap().len(), files, walks }
    }
}

impl Day {
    fn plan(&self) -> JobPlan {
        JobPlan { limits: Limits::NONE, ..plan(self.walks, STREAM) }
    }

    /// Lives through it. Returns the rows of its chart.
    fn live(&self, hours: f64) -> Vec<Row> {
        let folder = tempfile::tempdir().unwrap();
        let mut simulation = Simulation::new(self, folder.path());
        let rows = simulation.live((2.0 * hours * 3600.0 / TICK.as_secs_f64()) as u64);
        let Simulation { coordinator, deaths, tick, .. } = simulation;
        assert_eq!(coordinator.ending(), Some(Ending::BudgetSpent));
        assert_eq!(coordinator.prefix(), &tally(&(0..self.walks)), "a walk is lost or counted twice");
        let results: u64 = coordinator.contributors().iter().map(|worker| worker.leases).sum();
        println!(
            "{:.2} hours: {} workers at a time, {} walks in {results} results, {} of them died, {} coordinators; at most {:.1} MiB held, {:.2} MiB of checkpoint",
            tick as f64 * TICK.as_secs_f64() / 3600.0,
            self.workers,
            self.walks,
            deaths[0],
            1 + deaths[1],
            megabytes(rows.iter().map(|row| row.held).max().unwrap_or(0)),
            rows.iter().map(|row| row.checkpoint).max().unwrap_or(0) as f64 / f64::from(1 << 20),
        );
        rows
    }
}

/// The most of a column in a part of the rows.
fn most(rows: &[Row], part: Range<f64>, of: impl Fn(&Row) -> usize) -> usize {
    let place = |part: f64| (part * rows.len() as f64) as usize;
    rows[place(part.start)..place(part.end)].iter().map(of).max().unwrap()
}

#[test]
fn an_hour_of_many_workers_keeps_every_walk() {
    let rows = Day { workers: 128, walks: 1_000_000_000, rate: 3_900.0, deaths: 2, life: 1_511 }.live(1.0);
    assert!(rows.len() > 30, "{} minutes", rows.len());
    assert!(rows.iter().all(|row| row.files == 1));
    let [early, late] = [0.2..0.6, 0.6..1.0].map(|part| most(&rows, part, |row| row.held));
    assert!(late < early + early / 2, "{early} bytes, then {late}");
}

/// 24 hours of 4,096 workers and 10¹² walks. Writes the chart's figures to the file `RADWALK_CHART`.
#[test]
#[ignore = "takes minutes: scripts/day.sh"]
fn a_day_of_4096_workers_is_flat() {
    let rows =
        Day { workers: 4096, walks: 1_000_000_000_000, rate: 3_900.0, deaths: 8, life: 20_011 }.live(24.0);
    if let Ok(path) = std::env::var("RADWALK_CHART") {
        let mut text = String::from("seconds,bytes_held,checkpoint_bytes,files,walks\n");
        for Row { seconds, held, checkpoint, files, walks } in &rows {
            text += &format!("{seconds},{held},{checkpoint},{files},{walks}\n");
        }
        fs::write(path, text).unwrap();
    }
    assert!((20 * 60..28 * 60).contains(&rows.len()), "{} minutes", rows.len());
    assert!(rows.iter().all(|row| row.files == 1));
    let [early, late] = [0.25..0.5, 0.75..1.0].map(|part| most(&rows, part, |row| row.held));
    assert!(late < early + early / 4, "{early} bytes held, then {late}");
    // It grows until its deliveries are folded, ever more rarely, and by the names of those that died.
    let checkpoint = most(&rows, 0.0..1.0, |row| row.checkpoint as usize);
    assert!(checkpoint < ENTRY * (ENTRIES + 4096 + 8 * rows.len()), "{checkpoint} bytes of checkpoint");
}
