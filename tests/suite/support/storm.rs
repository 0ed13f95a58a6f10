//! A job to which everything happens at random that can go wrong with processes, threads, connections, disks and clocks.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use super::shim::{Shim, Wrong, busiest_threads};
use super::{path, radwalk, signal};

const WORKERS: usize = 3;

/// xorshift64*: the kinds of faults are the same in every run, their moments are not.
pub struct Dice(pub u64);

impl Dice {
    /// A number below n.
    pub fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) % n
    }
}

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    WorkerKilled,
    WorkerStopped,
    CoordinatorKilled,
    CoordinatorStopped,
    Cut,
    Delayed,
    Altered,
    Repeated,
    StuckBriefly,
    StuckForLong,
    SlowDisk,
    FailingDisk,
    FullDisk,
    ReadOnly,
    Clock,
}

impl Fault {
    /// All of them; the coordinator is killed twice as often as anything else happens.
    pub const ALL: [Fault; 16] = [
        Fault::WorkerKilled,
        Fault::WorkerStopped,
        Fault::CoordinatorKilled,
        Fault::CoordinatorKilled,
        Fault::CoordinatorStopped,
        Fault::Cut,
        Fault::Delayed,
        Fault::Altered,
        Fault::Repeated,
        Fault::StuckBriefly,
        Fault::StuckForLong,
        Fault::SlowDisk,
        Fault::FailingDisk,
        Fault::FullDisk,
        Fault::ReadOnly,
        Fault::Clock,
    ];

    /// Those that happen to a process which walks by itself.
    pub const ALONE: [Fault; 8] = [
        Fault::CoordinatorKilled,
        Fault::CoordinatorKilled,
        Fault::CoordinatorStopped,
        Fault::SlowDisk,
        Fault::FailingDisk,
        Fault::FullDisk,
        Fault::ReadOnly,
        Fault::Clock,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Fault::WorkerKilled => "kill -9 of a worker",
            Fault::WorkerStopped => "SIGSTOP of a worker",
            Fault::CoordinatorKilled => "kill -9 of the coordinator",
            Fault::CoordinatorStopped => "SIGSTOP of the coordinator",
            Fault::Cut => "all connections cut",
            Fault::Delayed => "a message delayed",
            Fault::Altered => "a bit of a result flipped",
            Fault::Repeated => "a result sent twice",
            Fault::StuckBriefly => "a thread of a worker stuck for a moment",
            Fault::StuckForLong => "a thread of a worker stuck for 20 s",
            Fault::SlowDisk => "a disk that takes 0.4 s for each fsync",
            Fault::FailingDisk => "a disk of which every fsync fails",
            Fault::FullDisk => "a full disk",
            Fault::ReadOnly => "a folder that cannot be written to",
            Fault::Clock => "a clock that jumps by a day, to and fro",
        }
    }
}

/// A relay of bytes between the workers and the coordinator: passes records on to the coordinator's present address.
pub struct Relay {
    address: String,
    pub state: Arc<RelayState>,
}

#[derive(Default)]
pub struct RelayState {
    coordinator: Mutex<String>,
    streams: Mutex<Vec<TcpStream>>,
    /// The milliseconds by which the next record is held up.
    delay: AtomicU64,
    /// The number of records that are still to be sent twice.
    pub repeat: AtomicU64,
    pub repeated: AtomicU64,
    /// The number of records of which a bit is still to be flipped.
    pub alter: AtomicU64,
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

/// How a coordinator is started that writes to a folder, and says in a file how workers join; on a process that walks by itself the file is lost.
pub type Start = Box<dyn Fn(&Path, &Path) -> Command>;

/// One job, its coordinator and its workers.
pub struct Cluster {
    pub out: PathBuf,
    access: PathBuf,
    /// The access file that leads through the relay.
    pub relayed: PathBuf,
    pub relay: Relay,
    /// The shims before the coordinator and before workers.
    pub shims: [Shim; 2],
    start: Start,
    pub coordinator: Child,
    workers: Vec<Child>,
    /// The access file that the relay follows.
    followed: Vec<u8>,
    /// The number of fsyncs in ten that fail all the while.
    sync_fails: i32,
}

impl Cluster {
    pub fn start(folder: &tempfile::TempDir, sync_fails: i32, start: Start) -> Self {
        let [out, access, relayed] = ["out", "access.json", "relayed.json"].map(|name| path(folder, name));
        let shims = ["coordinators", "workers"].map(|name| {
            let folder = path(folder, name);
            std::fs::create_dir_all(&folder).unwrap();
            Shim::new(&folder)
        });
        shims[0].set(Wrong::SyncFails, sync_fails);
        let coordinator = coordinate(&start, (&out, &access), &shims[0]);
        let (relay, workers, followed) = (Relay::start(), vec![], vec![]);
        Cluster { out, access, relayed, relay, shims, start, coordinator, workers, followed, sync_fails }
    }

    /// Leads the relay to the present coordinator, once that listens.
    fn follow(&mut self) {
        let Ok(text) = std::fs::read(&self.access) else { return };
        if text == self.followed {
            return;
        }
        let mut access: serde_json::Value = serde_json::from_slice(&text).unwrap();
        *self.relay.state.coordinator.lock().unwrap() = access["address"].as_str().unwrap().to_owned();
        access["address"] = self.relay.address.clone().into();
        let draft = self.relayed.with_extension("tmp");
        std::fs::write(&draft, access.to_string()).unwrap();
        std::fs::rename(draft, &self.relayed).unwrap();
        self.followed = text;
    }

    /// Starts workers in place of those that have ended, once there is a coordinator that they can join.
    pub fn tend(&mut self) {
        self.follow();
        self.workers.retain_mut(|worker| worker.try_wait().unwrap().is_none());
        while self.relayed.exists() && self.workers.len() < WORKERS {
            let mut command = radwalk();
            command.args(["work", "--quiet", "--threads", "2", "--access"]).arg(&self.relayed);
            self.shims[1].stand_before(command.stderr(Stdio::null()));
            self.workers.push(command.spawn().unwrap());
        }
    }

    /// How the coordinator has ended, if it has.
    pub fn ended(&mut self) -> Option<ExitStatus> {
        self.coordinator.try_wait().unwrap()
    }

    /// Kills the coordinator, if it has not ended, and starts another.
    pub fn restart(&mut self) {
        self.coordinator.kill().unwrap();
        self.coordinator.wait().unwrap();
        let _ = std::fs::remove_file(&self.access);
        self.coordinator = coordinate(&self.start, (&self.out, &self.access), &self.shims[0]);
    }

    /// Causes one fault. What happens to workers happens to none where none has joined yet.
    pub fn strike(&mut self, fault: Fault, dice: &mut Dice) {
        let pause = Duration::from_millis(100 + dice.below(900));
        let worker = dice.below(WORKERS as u64) as usize;
        let worker = self.workers.get(worker).map(Child::id);
        let state = &self.relay.state;
        match fault {
            Fault::WorkerKilled => worker.into_iter().for_each(|worker| signal("KILL", worker)),
            Fault::WorkerStopped => worker.into_iter().for_each(|worker| stop_for(worker, pause)),
            Fault::CoordinatorKilled => self.restart(),
            Fault::CoordinatorStopped => stop_for(self.coordinator.id(), pause),
            Fault::Cut => self.relay.cut(),
            Fault::Delayed => state.delay.store(pause.as_millis() as u64, Ordering::Relaxed),
            Fault::Altered => drop(state.alter.fetch_add(1, Ordering::Relaxed)),
            Fault::Repeated => drop(state.repeat.fetch_add(1, Ordering::Relaxed)),
            Fault::StuckBriefly => self.stick(worker, pause),
            Fault::StuckForLong => self.stick(worker, Duration::from_secs(20)),
            Fault::SlowDisk => self.spell(Wrong::SyncMs, 400, 2 * pause),
            Fault::FailingDisk => self.spell(Wrong::SyncFails, 10, 2 * pause),
            Fault::FullDisk => self.spell(Wrong::Full, 1, 2 * pause),
            Fault::ReadOnly => self.spell(Wrong::ReadOnly, 1, 2 * pause),
            Fault::Clock => self.spell(Wrong::Clock, 1, pause),
        }
    }

    /// Stops the busiest thread of a worker for a while.
    fn stick(&self, worker: Option<u32>, time: Duration) {
        let Some(worker) = worker else { return };
        self.shims[1].set(Wrong::StuckMs, time.as_millis() as i32);
        if let Some(&(thread, _)) = busiest_threads(worker).first() {
            self.shims[1].stick(worker, thread);
            // The thread reads the duration before the next fault sets another.
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Lets the coordinator's system fail in one way for a while.
    fn spell(&self, wrong: Wrong, degree: i32, time: Duration) {
        self.shims[0].set(wrong, degree);
        thread::sleep(time);
        self.shims[0].set(wrong, if matches!(wrong, Wrong::SyncFails) { self.sync_fails } else { 0 });
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

fn coordinate(start: &Start, (out, access): (&Path, &Path), shim: &Shim) -> Child {
    let mut command = start(out, access);
    shim.stand_before(&mut command);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn stop_for(pid: u32, pause: Duration) {
    signal("STOP", pid);
    thread::sleep(pause);
    signal("CONT", pid);
}

/// The number of faults of a long storm, from `RADWALK_CHAOS_FAULTS`; `short` in the everyday suite.
pub fn faults(short: usize) -> usize {
    std::env::var("RADWALK_CHAOS_FAULTS").map_or(short, |faults| faults.parse().expect("a number of faults"))
}

/// Takes one of some faults: they come in rounds of all, each round in another order.
pub fn draw(left: &mut Vec<Fault>, all: &[Fault], dice: &mut Dice) -> Fault {
    if left.is_empty() {
        left.extend(all);
    }
    left.swap_remove(dice.below(left.len() as u64) as usize)
}
