//! Tests of pilots that workers walk: who walks, and how often all is killed, has no part in what is chosen.

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use crate::support::{SMALL_PICTURE, answer, children, finish, path, radwalk, run_job, signal, wait_for};
use tempfile::tempdir;

const SCENE: &str = "configs/scenes/lamps.toml";

/// A tenth of these paths is enough for workers to join.
const JOB: [&str; 4] = ["--set", "scene.patches=auto", "--paths", "3000000"];

fn spawn(out: &Path, args: &[&str]) -> Child {
    let mut command = radwalk();
    command.args(["run", SCENE, "--out"]).arg(out).args(args).args(SMALL_PICTURE);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

#[test]
fn workers_have_no_part_in_what_a_pilot_chooses() {
    let folder = tempdir().unwrap();
    let [one, two, sixteen] = ["1", "2", "16"].map(|workers| {
        let out = path(&folder, workers);
        run_job(SCENE, &out, &[&JOB[..], &["--workers", workers]].concat());
        (answer(&out), std::fs::read(out.join("partition.toml")).unwrap())
    });
    assert!(one == two && one == sixteen);
    let out = path(&folder, "killed");
    let child = spawn(&out, &[&JOB[..], &["--workers", "2"]].concat());
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
    let set = ["scene.patches=auto", "budget.paths=12000000"];
    let job = job::load(&PathBuf::from(SCENE), &set.map(String::from)).unwrap();
    let args = ["--set", set[0], "--set", set[1], "--workers", "2", "--resume"];
    let mut walked = Vec::new();
    let checkpoint = || std::fs::read(out.join("pilot.bin")).ok();
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
    assert_eq!(results::stored_partition(&out).unwrap(), chosen);
}

/// Kept walks of a pilot for other paths have no part in a run: it comes to the bytes of an undisturbed one, or goes on with what both share.
#[test]
fn a_pilot_that_is_resumed_with_other_paths_comes_to_what_an_undisturbed_one_does() {
    let folder = tempdir().unwrap();
    let undisturbed = ["1500000", "6000000"].map(|paths| {
        let out = path(&folder, paths);
        run_job(SCENE, &out, &["--set", JOB[1], "--paths", paths, "--workers", "2"]);
        (paths, answer(&out), std::fs::read(out.join("partition.toml")).unwrap())
    });
    // Walks of a stage, then also those of the control that follows it.
    for begun in ["pilot.bin", "pilot.arrivals.bin"] {
        for (paths, answered, partition) in &undisturbed {
            let out = path(&folder, &format!("{begun} {paths}"));
            let mut child = spawn(&out, &[&JOB[..], &["--workers", "2"]].concat());
            wait_for(begun, || out.join(begun).exists().then_some(()));
            child.kill().unwrap();
            finish(child);
            assert!(!out.join("tally.bin").exists(), "the pilot was over");
            let args = ["--set", JOB[1], "--paths", paths, "--workers", "2", "--resume"];
            run_job(SCENE, &out, &args);
            assert!(answer(&out) == *answered, "{begun}, then {paths} paths");
            assert!(std::fs::read(out.join("partition.toml")).unwrap() == *partition);
            for left in ["pilot.bin", "pilot.arrivals.bin"] {
                assert!(!out.join(left).exists(), "{left} is left");
            }
        }
    }
}
