//! Tests of one job to which everything happens at random that can go wrong with processes, threads, connections,
//! disks, clocks and peers: the answer is that of a run to which nothing happened.
//!
//! All the while two in ten of the coordinator's fsyncs fail. Workers reach the coordinator through a relay that cuts, delays, repeats and alters what they send. A short version belongs to
//! the everyday suite; `scripts/chaos.sh` runs a long one and keeps its log.
#![cfg(target_os = "linux")]

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use cluster::{Access, Work, WorkerIntroduction, work};
use protocol::Checkpoint;
use radiosity::{Counts, Hands, Overflow, Tally};

use crate::support::shim::{Shim, Wrong, busiest_threads};
use crate::support::{answer, path, radwalk, signal, summary, wait_for};
use tempfile::tempdir;

const JOB: &str = "tests/data/cube54.toml";
const WORKERS: usize = 3;
/// The number of kinds of faults.
const KINDS: u64 = 16;
/// The faults of the everyday suite: each kind once.
const SHORT: usize = KINDS as usize;

/// xorshift64*: the kinds of faults are the same in every run, their moments are not.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) % n
    }
}

/// A relay of bytes between the workers and the coordinator: passes records on to the coordinator's present address.
struct Relay {
    address: String,
    state: Arc<RelayState>,
}

#[derive(Default)]
struct RelayState {
    coordinator: Mutex<String>,
    streams: Mutex<Vec<TcpStream>>,
    /// The milliseconds by which the next record is held up.
    delay: AtomicU64,
    /// The number of records that are still to be sent twice.
    repeat: AtomicU64,
    repeated: AtomicU64,
    /// The number of records of which a bit is still to be flipped.
    alter: AtomicU64,
}

impl Relay {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let state = Arc::new(RelayState::default());
        thread::spawn({
            let state = state.clone();
            move || listener.incoming().flatten().for_each(|worker| connect(worker, &state))
        });
        Relay { address, state }
    }

    /// Cuts every connection through the relay.
    fn cut(&self) {
        for stream in self.state.streams.lock().unwrap().drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

fn connect(worker: TcpStream, state: &Arc<RelayState>) {
    let address = state.coordinator.lock().unwrap().clone();
    // If no coordinator listens, the worker's connection is closed.
    let Ok(coordinator) = TcpStream::connect(address) else { return };
    let copy = |stream: &TcpStream| stream.try_clone().unwrap();
    state.streams.lock().unwrap().push(copy(&worker));
    let (to_worker, from_coordinator) = (copy(&worker), copy(&coordinator));
    thread::spawn(move || {
        let _ = std::io::copy(&mut &from_coordinator, &mut &to_worker);
        let _ = to_worker.shutdown(Shutdown::Both);
    });
    let state = state.clone();
    thread::spawn(move || {
        while let Ok(mut record) = read_record(&worker) {
            thread::sleep(Duration::from_millis(state.delay.swap(0, Ordering::Relaxed)));
            // Results are the long records.
            let long = record.len() > 100;
            if long && due(&state.alter) {
                let middle = record.len() / 2;
                record[middle] ^= 1;
            }
            let again = long && due(&state.repeat);
            state.repeated.fetch_add(u64::from(again), Ordering::Relaxed);
            let times = if again { 2 } else { 1 };
            if (0..times).any(|_| (&coordinator).write_all(&record).is_err()) {
                break;
            }
        }
        let _ = coordinator.shutdown(Shutdown::Both);
    });
}

/// Whether one more is to be done; counts it if so.
fn due(left: &AtomicU64) -> bool {
    left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1)).is_ok()
}

fn read_record(mut stream: &TcpStream) -> std::io::Result<Vec<u8>> {
    let mut length = [0; 2];
    stream.read_exact(&mut length)?;
    let mut record = length.to_vec();
    record.resize(2 + usize::from(u16::from_le_bytes(length)), 0);
    stream.read_exact(&mut record[2..])?;
    Ok(record)
}

/// A worker with the key that lies.
struct Liar {
    hashes: ([u8; 32], [u8; 32]),
    empty: Tally,
    lie: Lie,
}

#[derive(Clone, Copy, Debug)]
enum Lie {
    /// Lies that a walk ended twice.
    Counts,
    /// Sends a sum that no walks have.
    Sums,
    /// Sends more rays than walks can have.
    Rays,
    /// Reports progress for ever and brings nothing.
    Progress,
}

impl Work for Liar {
    type Board = u64;

    fn hashes(&self) -> ([u8; 32], [u8; 32]) {
        self.hashes
    }
    fn empty(&self) -> Tally {
        self.empty.clone()
    }
    fn board(&self) -> u64 {
        0
    }
    fn shoot(&self, walks: Range<u64>, board: &mut u64) {
        *board += walks.end - walks.start;
    }
    fn shoot_while(&self, walks: Range<u64>, board: &mut u64, hands: &dyn Hands) {
        while matches!(self.lie, Lie::Progress) && hands.go_on() {
            thread::sleep(Duration::from_millis(10));
        }
        self.shoot(walks, board);
    }
    fn hand_over(&self, board: &mut u64, tally: &mut Tally) -> Result<(), Overflow> {
        let walks = std::mem::take(board);
        let mut counts = Counts { walks, rays: 2 * walks, absorbed: walks, ..Counts::default() };
        let mut sums = vec![u128::from(walks); self.empty.sums().len()];
        match self.lie {
            Lie::Counts => counts.absorbed += 1,
            Lie::Sums => sums[0] = 1 << 90,
            Lie::Rays => counts.rays = u64::MAX,
            Lie::Progress => {}
        }
        let lie = Tally::from_parts(counts, self.empty.patches(), self.empty.layout(), sums);
        tally.merge(&lie.expect("the shape of the job's")).map_err(|_| Overflow)
    }
}

/// One job, its coordinator and its workers.
struct Cluster {
    out: PathBuf,
    access: PathBuf,
    relayed: PathBuf,
    relay: Relay,
    /// The shims before the coordinator and before workers.
    shims: [Shim; 2],
    coordinator: Child,
    workers: Vec<Child>,
    liars: u64,
}

impl Cluster {
    fn start(folder: &tempfile::TempDir) -> Self {
        let [out, access, relayed] = ["out", "access.json", "relayed.json"].map(|name| path(folder, name));
        let shims = ["coordinators", "workers"].map(|name| {
            let folder = path(folder, name);
            std::fs::create_dir(&folder).unwrap();
            Shim::new(&folder)
        });
        shims[0].set(Wrong::SyncFails, 2);
        let coordinator = coordinate(&out, &access, &shims[0]);
        let (relay, workers) = (Relay::start(), vec![]);
        let mut cluster = Cluster { out, access, relayed, relay, shims, coordinator, workers, liars: 0 };
        cluster.follow();
        cluster.tend();
        cluster
    }

    /// Waits for the coordinator's access file, and makes one of it that leads through the relay.
    fn follow(&mut self) {
        let text = wait_for("the access file", || std::fs::read(&self.access).ok());
        let mut access: serde_json::Value = serde_json::from_slice(&text).unwrap();
        *self.relay.state.coordinator.lock().unwrap() = access["address"].as_str().unwrap().to_owned();
        access["address"] = self.relay.address.clone().into();
        let draft = self.relayed.with_extension("tmp");
        std::fs::write(&draft, access.to_string()).unwrap();
        std::fs::rename(draft, &self.relayed).unwrap();
    }

    /// Starts workers in place of those that have ended.
    fn tend(&mut self) {
        self.workers.retain_mut(|worker| worker.try_wait().unwrap().is_none());
        while self.workers.len() < WORKERS {
            let mut command = radwalk();
            command.args(["work", "--quiet", "--threads", "2", "--access"]).arg(&self.relayed);
            self.shims[1].stand_before(command.stderr(Stdio::null()));
            self.workers.push(command.spawn().unwrap());
        }
    }

    fn restart(&mut self) {
        self.coordinator.kill().unwrap();
        self.coordinator.wait().unwrap();
        std::fs::remove_file(&self.access).unwrap();
        self.coordinator = coordinate(&self.out, &self.access, &self.shims[0]);
        self.follow();
    }

    /// Causes one fault. Returns its name.
    fn strike(&mut self, kind: u64, dice: &mut Dice) -> &'static str {
        let worker = self.workers[dice.below(self.workers.len() as u64) as usize].id();
        let pause = Duration::from_millis(100 + dice.below(900));
        match kind {
            0 => {
                signal("KILL", worker);
                "kill -9 of a worker"
            }
            1 => {
                stop_for(worker, pause);
                "SIGSTOP of a worker"
            }
            2 | 3 => {
                self.restart();
                "kill -9 of the coordinator"
            }
            4 => {
                stop_for(self.coordinator.id(), pause);
                "SIGSTOP of the coordinator"
            }
            5 => {
                self.relay.cut();
                "all connections cut"
            }
            6 => {
                self.relay.state.delay.store(pause.as_millis() as u64, Ordering::Relaxed);
                "a message delayed"
            }
            7 => {
                self.relay.state.alter.fetch_add(1, Ordering::Relaxed);
                "a bit of a result flipped"
            }
            8 => {
                self.relay.state.repeat.fetch_add(1, Ordering::Relaxed);
                "a result sent twice"
            }
            9 => {
                self.stick(worker, pause);
                "a thread of a worker stuck for a moment"
            }
            10 => {
                self.stick(worker, Duration::from_secs(20));
                "a thread of a worker stuck for 20 s"
            }
            11 => self.spell(Wrong::SyncMs, 400, 2 * pause, "a disk that takes 0.4 s for each fsync"),
            12 => self.spell(Wrong::SyncFails, 10, 2 * pause, "a disk of which every fsync fails"),
            13 => self.spell(Wrong::Full, 1, 2 * pause, "a full disk"),
            14 => self.spell(Wrong::Clock, 1, pause, "a clock that jumps by a day, to and fro"),
            _ => {
                let lies = [Lie::Counts, Lie::Sums, Lie::Rays, Lie::Progress];
                self.lie(lies[dice.below(4) as usize]);
                "a liar with the key"
            }
        }
    }

    /// Stops the busiest thread of a worker for a while.
    fn stick(&self, worker: u32, time: Duration) {
        self.shims[1].set(Wrong::StuckMs, time.as_millis() as i32);
        if let Some(&(thread, _)) = busiest_threads(worker).first() {
            self.shims[1].stick(worker, thread);
            // The thread reads the duration before the next fault sets another.
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Lets the coordinator's system fail in one way for a while.
    fn spell(&self, wrong: Wrong, degree: i32, time: Duration, name: &'static str) -> &'static str {
        self.shims[0].set(wrong, degree);
        thread::sleep(time);
        self.shims[0].set(wrong, if matches!(wrong, Wrong::SyncFails) { 2 } else { 0 });
        name
    }

    /// Lets a liar join; it stays until it is found out or its connection is cut.
    fn lie(&mut self, lie: Lie) {
        // Another coordinator may have replaced the one that wrote this access file.
        let (Ok(access), Ok(Checkpoint { scene_hash, tally, book })) =
            (Access::read(&self.relayed), Checkpoint::read(&self.out.join("tally.bin")))
        else {
            return;
        };
        self.liars += 1;
        let name = format!("liar {} of {lie:?}", self.liars);
        let identity = WorkerIntroduction { build: access.build.clone(), name, threads: 1, leave: || false };
        let empty = Tally::new(tally.patches(), tally.layout());
        let liar = Liar { hashes: (scene_hash, book.parts[0].job_hash), empty, lie };
        thread::spawn(move || work(&access, &identity, |_| Ok(liar), || 0.0));
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        for process in self.workers.iter_mut().chain([&mut self.coordinator]) {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

fn coordinate(out: &Path, access: &Path, shim: &Shim) -> Child {
    let mut command = radwalk();
    shim.stand_before(&mut command);
    command.args(["coordinate", JOB, "--resume", "--quiet", "--listen", "127.0.0.1:0"]);
    command.args(["--paths", "1000000000000", "--set", "budget.checkpoint_seconds=0.1"]);
    command.arg("--out").arg(out).arg("--access").arg(access);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn stop_for(pid: u32, pause: Duration) {
    signal("STOP", pid);
    thread::sleep(pause);
    signal("CONT", pid);
}

/// The number of faults, from `RADWALK_CHAOS_FAULTS`.
fn faults() -> usize {
    std::env::var("RADWALK_CHAOS_FAULTS").map_or(SHORT, |faults| faults.parse().expect("a number of faults"))
}

#[test]
fn no_fault_leaves_a_trace_in_the_answer() {
    let folder = tempdir().unwrap();
    let mut cluster = Cluster::start(&folder);
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15);
    wait_for("a checkpoint", || cluster.out.join("tally.bin").exists().then_some(()));
    let mut kinds: Vec<u64> = Vec::new();
    for number in 1..=faults() {
        // Faults come in rounds of all kinds, each round in another order.
        if kinds.is_empty() {
            kinds.extend(0..KINDS);
        }
        let kind = kinds.swap_remove(dice.below(kinds.len() as u64) as usize);
        let fault = cluster.strike(kind, &mut dice);
        println!("{number}: {fault}");
        thread::sleep(Duration::from_millis(50 + dice.below(350)));
        cluster.tend();
    }
    // Each of these records is sent twice or altered before the end, so that none is left out.
    wait_for("the last spoilt result", || {
        cluster.tend();
        let RelayState { repeat, alter, .. } = &*cluster.relay.state;
        (repeat.load(Ordering::Relaxed) + alter.load(Ordering::Relaxed) == 0).then_some(())
    });
    cluster.shims[0].set(Wrong::SyncFails, 0);
    signal("INT", cluster.coordinator.id());
    wait_for("the end", || cluster.coordinator.try_wait().unwrap());
    let out = cluster.out.clone();
    let (repeated, liars) = (cluster.relay.state.repeated.load(Ordering::Relaxed), cluster.liars);
    drop(cluster);

    let stormy = summary(&out);
    let paths = stormy["paths"].as_u64().unwrap();
    let sessions = stormy["provenance"]["sessions"].as_array().unwrap().len();
    println!(
        "{paths} paths, {sessions} coordinators, {} workers lost, {} streams leased again, {repeated} results sent twice, {liars} liars",
        stormy["workers_lost"], stormy["streams_reissued"]
    );
    assert!(sessions > 1, "no coordinator died");
    assert!(liars > 0, "no liar came");
    // Both take as long as the storm has walked.
    let mut audit = radwalk();
    audit.args(["audit", "--share", "0.01"]).arg(&out).stdout(Stdio::null());
    assert!(audit.status().unwrap().success(), "an audit agrees");
    let calm = path(&folder, "calm");
    let mut run = radwalk();
    run.args(["run", JOB, "--quiet", "--paths", &paths.to_string(), "--out"]).arg(&calm);
    assert!(run.status().unwrap().success());
    assert!(answer(&out) == answer(&calm), "the faults changed the answer");
    println!("tally {} and patches.csv are those of the undisturbed run", stormy["tally_hash"]);
}
