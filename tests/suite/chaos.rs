//! Tests of one job to which everything happens at random that can go wrong with processes, threads, connections,
//! disks, clocks and peers: the answer is that of a run to which nothing happened.
//!
//! All the while two in ten of the coordinator's fsyncs fail. Workers reach the coordinator through a relay that cuts, delays, repeats and alters what they send. A short version belongs to
//! the everyday suite; `scripts/chaos.sh` runs a long one and keeps its log.
#![cfg(target_os = "linux")]

use std::ops::Range;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use cluster::{Access, JobHashes, Work, WorkerIntroduction, work};
use protocol::Checkpoint;
use radiosity::{Counts, Overflow, Tally, parallel::ThreadPool};

use crate::support::shim::Wrong;
use crate::support::storm::{Cluster, Dice, Fault, draw, faults};
use crate::support::{TABLES, answer, path, radwalk, signal, summary, wait_for};
use tempfile::tempdir;

const JOB: &str = "tests/data/cube54.toml";
/// The faults of the everyday suite: each kind once, and a liar.
const SHORT: usize = Fault::ALL.len() + 1;

/// A worker with the key that lies.
struct Liar {
    hashes: JobHashes,
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

    fn hashes(&self) -> JobHashes {
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
    fn shoot_while(&self, walks: Range<u64>, board: &mut u64, pool: &dyn ThreadPool) {
        while matches!(self.lie, Lie::Progress) && pool.go_on() {
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

/// Lets a liar join; it stays until it is found out or its connection is cut.
fn lie(cluster: &Cluster, liars: &mut u64, dice: &mut Dice) {
    // Another coordinator may have replaced the one that wrote this access file.
    let (Ok(access), Ok(Checkpoint { scene_hash, tally, book })) =
        (Access::read(&cluster.relayed), Checkpoint::read(&cluster.out.join("tally.bin")))
    else {
        return;
    };
    let lie = [Lie::Counts, Lie::Sums, Lie::Rays, Lie::Progress][dice.below(4) as usize];
    *liars += 1;
    let name = format!("liar {liars} of {lie:?}");
    let identity = WorkerIntroduction { build: access.build.clone(), name, threads: 1, leave: || false };
    let empty = Tally::new(tally.patches(), tally.layout());
    let liar = Liar { hashes: JobHashes { scene: scene_hash, job: book.parts[0].job_hash }, empty, lie };
    thread::spawn(move || work(&access, &identity, |_| Ok(liar), || 0.0));
}

fn coordinate(out: &Path, access: &Path) -> Command {
    let mut command = radwalk();
    command.args(["coordinate", JOB, "--resume", "--quiet", "--listen", "127.0.0.1:0"]);
    command.args(["--paths", "1000000000000", "--set", "budget.checkpoint_seconds=0.1"]).args(TABLES);
    command.arg("--out").arg(out).arg("--access").arg(access);
    command
}

#[test]
fn no_fault_leaves_a_trace_in_the_answer() {
    let folder = tempdir().unwrap();
    let mut cluster = Cluster::start(&folder, 2, Box::new(coordinate));
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15);
    wait_for("a checkpoint", || {
        cluster.tend();
        cluster.out.join("tally.bin").exists().then_some(())
    });
    let (mut left, mut liars) = (Vec::new(), 0);
    for number in 1..=faults(SHORT) {
        // A liar comes after each round of all faults.
        match number % SHORT == 0 {
            true => {
                lie(&cluster, &mut liars, &mut dice);
                println!("{number}: a liar with the key");
            }
            false => {
                let fault = draw(&mut left, &Fault::ALL, &mut dice);
                cluster.strike(fault, &mut dice);
                println!("{number}: {}", fault.name());
            }
        }
        thread::sleep(Duration::from_millis(50 + dice.below(350)));
        cluster.tend();
    }
    // Each of these records is sent twice or altered before the end, so that none is left out.
    wait_for("the last spoilt result", || {
        cluster.tend();
        let state = &cluster.relay.state;
        (state.repeat.load(Ordering::Relaxed) + state.alter.load(Ordering::Relaxed) == 0).then_some(())
    });
    cluster.shims[0].set(Wrong::SyncFails, 0);
    signal("INT", cluster.coordinator.id());
    wait_for("the end", || cluster.ended());
    let out = cluster.out.clone();
    let repeated = cluster.relay.state.repeated.load(Ordering::Relaxed);
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
    run.args(["run", JOB, "--quiet", "--paths", &paths.to_string(), "--out"]).arg(&calm).args(TABLES);
    assert!(run.status().unwrap().success());
    assert!(answer(&out) == answer(&calm), "the faults changed the answer");
    println!("tally {} and patches.csv are those of the undisturbed run", stormy["tally_hash"]);
}
