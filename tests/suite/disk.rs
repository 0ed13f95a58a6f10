//! Tests with disks that are slow or fail, and clocks that jump (`support/shim.rs`): the bytes do not change, or the
//! run ends and says why.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::Stdio;

use crate::support::shim::{Shim, Wrong};
use crate::support::{TABLES, answer, finish, path, radwalk, run, run_job, wait_for};
use protocol::Checkpoint;
use tempfile::tempdir;

/// A job whose tallies are large enough to be offered before they are sent: the coloured Cornell box.
const LARGE: &str = "configs/cornell.toml";

/// Runs the job with a shim before it. Returns its exit code and its words.
fn run_with(shim: &Shim, wrong: &[(Wrong, i32)], out: &Path, args: &[&str]) -> (i32, String) {
    for fault in [Wrong::SyncMs, Wrong::SyncFails, Wrong::Clock, Wrong::Full] {
        shim.set(fault, wrong.iter().find(|(other, _)| *other as usize == fault as usize).map_or(0, |w| w.1));
    }
    let mut command = radwalk();
    command.args(["run", LARGE, "--workers", "2", "--set", "budget.checkpoint_seconds=0.1", "--out"]);
    command.arg(out).args(args).args(TABLES);
    shim.stand_before(&mut command);
    let (code, _, stderr) = finish(command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap());
    (code, stderr)
}

#[test]
fn slow_and_failing_disks_and_jumping_clocks_change_nothing() {
    let folder = tempdir().unwrap();
    let shim = Shim::new(folder.path());
    let straight = path(&folder, "straight");
    let paths = ["--paths", "600000", "--set", "budget.stream_paths=4096"];
    run_job(LARGE, &straight, &paths);
    for (n, what) in [
        &[(Wrong::SyncMs, 300)][..],
        &[(Wrong::SyncMs, 30), (Wrong::SyncFails, 1)],
        &[(Wrong::Clock, 1), (Wrong::SyncMs, 50)],
    ]
    .into_iter()
    .enumerate()
    {
        let out = path(&folder, &format!("out{n}"));
        let (code, said) = run_with(&shim, what, &out, &paths);
        assert_eq!(code, 0, "{what:?}: {said}");
        assert!(answer(&out) == answer(&straight), "{what:?}");
    }
}

#[test]
fn a_disk_that_never_syncs_is_reported_and_leaves_what_was_there() {
    let folder = tempdir().unwrap();
    let shim = Shim::new(folder.path());
    let out = path(&folder, "out");
    run_job(LARGE, &out, &["--paths", "20000"]);
    let before = answer(&out);
    let (code, said) = run_with(&shim, &[(Wrong::SyncFails, 10)], &out, &["--paths", "6000000", "--resume"]);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("no checkpoint: cannot write") && said.contains("tried again in 8 s"), "{said}");
    assert!(answer(&out) == before);
}

/// Where the tally has room and other files have none, no walk is lost: the run says so, and `report` makes the files once there is room.
#[test]
fn a_disk_with_room_for_the_tally_keeps_the_walks() {
    let folder = tempdir().unwrap();
    let shim = Shim::new(folder.path());
    let [out, straight] = ["out", "straight"].map(|name| path(&folder, name));
    let paths = ["--paths", "200000"];
    run_job(LARGE, &straight, &paths);
    let bytes = |name: &str| std::fs::metadata(straight.join(name)).unwrap().len();
    let room = bytes("tally.bin") + 10_000;
    assert!(room < bytes("patches.csv"), "{room}");
    let (code, said) = run_with(&shim, &[(Wrong::Full, room as i32)], &out, &paths);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("The walks are kept in") && said.contains("radwalk report"), "{said}");
    let (code, _, stderr) = run(&["report", out.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    assert!(answer(&out) == answer(&straight));
}

/// The tally is there before anything is drawn: a run that is killed over its pictures has lost no walk, and `report` makes the files.
#[test]
fn a_run_that_is_killed_while_it_draws_has_kept_its_walks() {
    let folder = tempdir().unwrap();
    let [out, straight] = ["out", "straight"].map(|name| path(&folder, name));
    let job = ["--paths", "200000", "--set", "view.size=[500, 400]"];
    run_job(LARGE, &straight, &job);
    let mut command = radwalk();
    command.args(["run", LARGE, "--quiet", "--out"]).arg(&out).args(job);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let walks = || Checkpoint::read(&out.join("tally.bin")).ok().map(|kept| kept.tally.counts.walks);
    wait_for("the tally", || walks().filter(|&walks| walks == 200_000));
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!out.join("patches.csv").exists(), "it was killed too late");
    let (code, _, stderr) = run(&["report", out.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    assert!(answer(&out) == answer(&straight));
}
