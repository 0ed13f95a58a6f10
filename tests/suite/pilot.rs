//! Tests of pilots that workers walk: who walks, and how often all is killed, has no part in what is chosen.

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use crate::support::{TABLES, answer, children, finish, path, radwalk, run_job, signal, wait_for};
use tempfile::tempdir;

const SCENE: &str = "configs/scenes/lamps.toml";

/// A tenth of these paths is enough for workers to join.
const JOB: [&str; 4] = ["--set", "scene.patches=auto", "--paths", "3000000"];

/// The pilot is that of the budget, and the run after it ends at its first looks: other tests hold the bytes of long runs.
const SOON_OVER: [&str; 2] = ["--set", "target.relative_error=0.5"];

fn spawn(out: &Path, args: &[&str]) -> Child {
    let mut command = radwalk();
    command.args(["run", SCENE, "--out"]).arg(out).args(args).args(TABLES);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

#[test]
fn workers_have_no_part_in_what_a_pilot_chooses() {
    let folder = tempdir().unwrap();
    let job = [&JOB[..], &SOON_OVER, &["--workers"]].concat();
    let [one, sixteen] = ["1", "16"].map(|workers| {
        let out = path(&folder, workers);
        run_job(SCENE, &out, &[&job[..], &[workers]].concat());
        (answer(&out), std::fs::read(out.join("partition.toml")).unwrap())
    });
    assert!(one == sixteen);
    let out = path(&folder, "killed");
    let child = spawn(&out, &[&job[..], &["2"]].concat());
    // The first worker that is seen is one of the pilot.
    let victim = wait_for("a worker", || children(child.id()).first().copied());
    signal("KILL", victim);
    let (code, ..) = finish(child);
    assert_eq!(code, 0);
    assert!((answer(&out), std::fs::read(out.join("partition.toml")).unwrap()) == one);
    assert!(!out.join("pilot.bin").exists(), "a pilot that is over is not kept");
}

/// The walks that a pilot goes on after, by what a run says.
fn goes_on_after(text: &str) -> Option<u64> {
    let (_, rest) = text.split_once("the pilot goes on after ")?;
    rest.split_whitespace().next()?.parse().ok()
}

#[test]
fn a_pilot_that_is_killed_again_and_again_makes_progress() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    // One worker takes long enough for several checkpoints.
    let set = ["scene.patches=auto", "budget.paths=6000000"];
    let job = job::load(&PathBuf::from(SCENE), &set.map(String::from)).unwrap();
    let args = ["--set", set[0], "--set", set[1], "--workers", "1", "--resume"];
    let mut walked = Vec::new();
    let checkpoint = || std::fs::metadata(out.join("pilot.bin")).and_then(|file| file.modified()).ok();
    let is_over = || out.join("tally.bin").exists();
    for killed in 0..80 {
        let before = checkpoint();
        let mut child = spawn(&out, &args);
        // As soon as something new is kept.
        wait_for("a checkpoint", || (checkpoint() != before || is_over()).then_some(()));
        child.kill().unwrap();
        let (_, _, text) = finish(child);
        walked.extend(goes_on_after(&text));
        if is_over() {
            break;
        }
        assert!(killed < 79, "it gets nowhere: {walked:?}");
    }
    assert!(walked.len() > 1 && walked.is_sorted(), "{walked:?}");
    let chosen = results::choose(&job, 2).unwrap().unwrap().partition;
    assert_eq!(results::stored_partition(&out).unwrap(), Some(chosen));
}

/// Begins a pilot in a folder, and kills it once it has kept this file.
fn begin(out: &Path, until: &str) {
    let mut child = spawn(out, &[&JOB[..], &SOON_OVER, &["--workers", "2"]].concat());
    wait_for(until, || out.join(until).exists().then_some(()));
    child.kill().unwrap();
    finish(child);
    assert!(!out.join("tally.bin").exists(), "the pilot was over");
}

/// The files of a folder, in a new one.
fn copied(from: &Path, to: &Path) {
    std::fs::create_dir(to).unwrap();
    for file in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        std::fs::copy(file.path(), to.join(file.file_name())).unwrap();
    }
}

/// Kept walks of a pilot for other paths have no part in a run: it comes to the bytes of an undisturbed one, or goes on with what both share.
#[test]
fn a_pilot_that_is_resumed_with_other_paths_comes_to_what_an_undisturbed_one_does() {
    let folder = tempdir().unwrap();
    let run = |out: &Path, paths: &str, more: &[&str]| {
        run_job(SCENE, out, &[&JOB[..2], &SOON_OVER, &["--workers", "2", "--paths", paths], more].concat());
        (answer(out), std::fs::read(out.join("partition.toml")).unwrap())
    };
    let undisturbed = ["500000", "4000000"].map(|paths| (paths, run(&path(&folder, paths), paths, &[])));
    // Walks of a stage, then also those of the control that follows it.
    for kept in ["pilot.bin", "pilot.arrivals.bin"] {
        let begun = path(&folder, kept);
        begin(&begun, kept);
        for (paths, answered) in &undisturbed {
            let out = path(&folder, &format!("{kept} {paths}"));
            copied(&begun, &out);
            assert!(run(&out, paths, &["--resume"]) == *answered, "{kept}, then {paths} paths");
            for left in ["pilot.bin", "pilot.arrivals.bin"] {
                assert!(!out.join(left).exists(), "{left} is left");
            }
        }
    }
}
