//! Tests of one thread of a worker that is stuck for ever, while everything else works. A preloaded library stops it
//! (`support/shim.rs`); its worker sends heartbeats, and makes progress with its other threads.
#![cfg(target_os = "linux")]

use std::process::Stdio;
use std::thread;
use std::time::Duration;

use protocol::Checkpoint;
use tempfile::tempdir;

use crate::support::shim::{Shim, Wrong, busiest_threads};
use crate::support::{TABLES, answer, finish, path, radwalk, run_job, signal, summary, wait_for};

const JOB: &str = "tests/data/cube54.toml";
const FOR_EVER: i32 = i32::MAX;

fn sleeps(process: u32, thread: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/task/{thread}/status")).unwrap();
    status.lines().any(|line| line.starts_with("State:\tS"))
}

#[test]
fn a_thread_that_is_stuck_holds_up_neither_checkpoints_nor_the_end() {
    let folder = tempdir().unwrap();
    let shim = Shim::new(folder.path());
    shim.set(Wrong::StuckMs, FOR_EVER);
    let [out, access, calm] = ["out", "access.json", "calm"].map(|name| path(&folder, name));
    let mut command = radwalk();
    command.args(["coordinate", JOB, "--quiet", "--listen", "127.0.0.1:0", "--paths", "1000000000000"]);
    command.args(["--set", "budget.checkpoint_seconds=0.1"]).args(TABLES);
    command.arg("--out").arg(&out).arg("--access").arg(&access);
    let coordinator = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for("the access file", || access.exists().then_some(()));
    let mut command = radwalk();
    command.args(["work", "--quiet", "--threads", "3", "--access"]).arg(&access).stderr(Stdio::null());
    let mut worker = shim.stand_before(&mut command).spawn().unwrap();
    // (walks of the prefix, the end of all that is in)
    let kept = || {
        let Checkpoint { tally, book, .. } = Checkpoint::read(&out.join("tally.bin")).ok()?;
        let prefix = tally.counts.walks;
        let out_of_order = book.out_of_order.iter().map(|range| range.first + range.counts[0] as u64).max();
        Some((prefix, out_of_order.unwrap_or(0).max(prefix)))
    };
    wait_for("a checkpoint", kept);
    // Three threads walk; the others of the process have taken hardly any time.
    let threads = wait_for("three threads that walk", || {
        let threads = busiest_threads(worker.id());
        threads.get(2).is_some_and(|&(_, time)| time > 20).then_some(threads)
    });
    let stuck = threads[0].0;
    shim.stick(worker.id(), stuck);
    let time = || busiest_threads(worker.id()).into_iter().find(|thread| thread.0 == stuck).unwrap().1;
    // A walking thread runs or waits to run: a thread that sleeps whenever it is looked at is stuck.
    let mut asleep = 0;
    wait_for("the thread to be stuck", || {
        asleep = if sleeps(worker.id(), stuck) { asleep + 1 } else { 0 };
        (asleep == 100).then_some(())
    });
    let before = time();

    // The results after two seconds lie beyond the walks that the stuck thread had. The prefix reaches them, too.
    thread::sleep(Duration::from_secs(2));
    let (_, reached) = kept().expect("a checkpoint");
    wait_for("a prefix beyond the stuck thread's walks", || kept().filter(|&(prefix, _)| prefix > reached));
    assert_eq!(time(), before, "it is stuck");

    signal("INT", coordinator.id());
    let (code, _, said) = finish(coordinator);
    assert_eq!((code, said.as_str()), (130, ""));
    worker.kill().unwrap();
    worker.wait().unwrap();
    let stopped = summary(&out);
    assert_eq!(stopped["workers_lost"], 0, "its worker was not given up");
    assert!(stopped["streams_reissued"].as_u64().unwrap() > 0, "its walks were given out once more");
    run_job(JOB, &calm, &["--paths", &stopped["paths"].to_string()]);
    assert!(answer(&out) == answer(&calm));
}
