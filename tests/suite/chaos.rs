//! Everything that can go wrong with processes and connections, at random, over one job: the answer is that of a run
//! that nothing happened to.
//!
//! Workers reach the coordinator through a relay that cuts, delays, repeats and alters what they send. A short version belongs to
//! the everyday suite; `scripts/chaos.sh` runs a long one and keeps its log.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use crate::support::{answer, finish, path, radwalk, run_job, signal, summary, wait_for};
use tempfile::tempdir;

const JOB: &str = "configs/cube54.toml";
const WORKERS: usize = 3;
/// Kinds of faults.
const KINDS: u64 = 9;
/// Faults of the everyday suite: each kind twice.
const SHORT: usize = 2 * KINDS as usize;

/// xorshift64*: the faults, not their moments, are the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) % n
    }
}

/// Where workers go: passes records on to wherever the coordinator listens now.
struct Relay {
    address: String,
    state: Arc<RelayState>,
}

#[derive(Default)]
struct RelayState {
    coordinator: Mutex<String>,
    streams: Mutex<Vec<TcpStream>>,
    /// Milliseconds that the next record is held up.
    delay: AtomicU64,
    /// Records that are still to be sent twice.
    repeat: AtomicU64,
    repeated: AtomicU64,
    /// Records of which a bit is still to be flipped.
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

    /// Cuts every connection.
    fn cut(&self) {
        for stream in self.state.streams.lock().unwrap().drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

fn connect(worker: TcpStream, state: &Arc<RelayState>) {
    let address = state.coordinator.lock().unwrap().clone();
    // Where nobody listens, the worker is hung up on.
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

/// Whether one more is to be done, which is then counted.
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

/// One job, its coordinator and its workers.
struct Cluster {
    out: PathBuf,
    access: PathBuf,
    relayed: PathBuf,
    relay: Relay,
    coordinator: Child,
    workers: Vec<Child>,
}

impl Cluster {
    fn start(folder: &tempfile::TempDir) -> Self {
        let [out, access, relayed] = ["out", "access.json", "relayed.json"].map(|name| path(folder, name));
        let coordinator = coordinate(&out, &access);
        let mut cluster =
            Cluster { out, access, relayed, relay: Relay::start(), coordinator, workers: vec![] };
        cluster.follow();
        cluster.tend();
        cluster
    }

    /// Waits for the coordinator's access file and makes of it one that leads through the relay.
    fn follow(&mut self) {
        let text = wait_for("the access file", || std::fs::read(&self.access).ok());
        let mut access: serde_json::Value = serde_json::from_slice(&text).unwrap();
        *self.relay.state.coordinator.lock().unwrap() = access["address"].as_str().unwrap().to_owned();
        access["address"] = self.relay.address.clone().into();
        let draft = self.relayed.with_extension("tmp");
        std::fs::write(&draft, access.to_string()).unwrap();
        std::fs::rename(draft, &self.relayed).unwrap();
    }

    /// Starts workers in place of those that have gone.
    fn tend(&mut self) {
        self.workers.retain_mut(|worker| worker.try_wait().unwrap().is_none());
        while self.workers.len() < WORKERS {
            let mut command = radwalk();
            command.args(["work", "--quiet", "--access"]).arg(&self.relayed).stderr(Stdio::null());
            self.workers.push(command.spawn().unwrap());
        }
    }

    fn restart(&mut self) {
        self.coordinator.kill().unwrap();
        self.coordinator.wait().unwrap();
        std::fs::remove_file(&self.access).unwrap();
        self.coordinator = coordinate(&self.out, &self.access);
        self.follow();
    }

    /// One fault; returns its name.
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
            _ => {
                self.relay.state.repeat.fetch_add(1, Ordering::Relaxed);
                "a result sent twice"
            }
        }
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

fn coordinate(out: &Path, access: &Path) -> Child {
    let mut command = radwalk();
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

/// `RADWALK_CHAOS_FAULTS` says how many.
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
        // In rounds of all kinds, each round in another order.
        if kinds.is_empty() {
            kinds.extend(0..KINDS);
        }
        let kind = kinds.swap_remove(dice.below(kinds.len() as u64) as usize);
        let fault = cluster.strike(kind, &mut dice);
        println!("{number}: {fault}");
        thread::sleep(Duration::from_millis(50 + dice.below(350)));
        cluster.tend();
    }
    // Each that was asked for is sent twice or altered before the end, so that none is forgotten.
    wait_for("the last spoilt result", || {
        cluster.tend();
        let RelayState { repeat, alter, .. } = &*cluster.relay.state;
        (repeat.load(Ordering::Relaxed) + alter.load(Ordering::Relaxed) == 0).then_some(())
    });
    signal("INT", cluster.coordinator.id());
    wait_for("the end", || cluster.coordinator.try_wait().unwrap());
    let out = cluster.out.clone();
    let repeated = cluster.relay.state.repeated.load(Ordering::Relaxed);
    drop(cluster);

    let stormy = summary(&out);
    let paths = stormy["paths"].as_u64().unwrap();
    let sessions = stormy["provenance"]["sessions"].as_array().unwrap().len();
    println!(
        "{paths} paths, {sessions} coordinators, {} workers lost, {} streams leased again, {repeated} results sent twice",
        stormy["workers_lost"], stormy["streams_reissued"]
    );
    assert!(sessions > 1, "no coordinator died");
    let audit = radwalk().args(["audit", "--share", "0.01"]).arg(&out).stdout(Stdio::null()).spawn().unwrap();
    assert_eq!(finish(audit).0, 0, "an audit agrees");
    let calm = path(&folder, "calm");
    run_job(JOB, &calm, &["--paths", &paths.to_string()]);
    assert!(answer(&out) == answer(&calm), "the faults changed the answer");
    println!("tally {} and patches.csv are those of the undisturbed run", stormy["tally_hash"]);
}
