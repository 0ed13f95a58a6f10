//! Tests of the program's output: results that cannot be written fail a command, and with `--json` only JSON is on
//! stderr.

use std::fs::OpenOptions;
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{finish, path, radwalk, run, run_job};

const JOB: &str = "tests/data/cube54.toml";

/// Runs a command whose stdout is a full disk.
fn to_full_disk(args: &[&str]) -> (i32, String) {
    let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
    let child = radwalk().args(args).stdout(full).stderr(Stdio::piped()).spawn().unwrap();
    let (code, _, stderr) = finish(child);
    (code, stderr)
}

#[test]
fn results_that_cannot_be_written_fail_the_command() {
    let folder = tempdir().unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let [out, other] = ["out", "other"].map(|name| path(&folder, name));
    run_job(JOB, &out, &["--paths", "30000"]);
    run_job(JOB, &other, &["--paths", "30000", "--seed", "8"]);
    let fresh = |name: &str| text(&path(&folder, name));
    let (run_out, exact_out, merge_out, new_out) =
        (fresh("run"), fresh("exact"), fresh("merge"), fresh("new"));
    let (out, other) = (text(&out), text(&other));
    for args in [
        &["check", JOB][..],
        &["check", "configs/scenes/cube54.toml", "--fix-report"],
        &["plan", JOB, "--paths", "3000"],
        &["plan", JOB, "--paths", "3000", "--json"],
        &["exact", JOB, "--out", &exact_out],
        &["replay", JOB, "--walk", "7"],
        &["run", JOB, "--paths", "3000", "--out", &run_out],
        &["merge", &out, &other, "--out", &merge_out],
        &["audit", &out, "--share", "1"],
        &["diff", &out, &other],
        &["diff", &out, &other, "--json"],
        &["status", &out],
        &["status", &out, "--json"],
        &["new", "box", "--out", &new_out],
        &["--help"],
        &["--version"],
    ] {
        let (code, stderr) = to_full_disk(args);
        assert_eq!(code, 2, "{args:?}: {stderr}");
        assert!(stderr.contains("stdout cannot be written"), "{args:?}: {stderr}");
    }
}

/// A reader that goes away is no fault: `radwalk replay … | head -1`.
#[test]
fn a_reader_that_goes_away_is_no_fault() {
    let mut child = radwalk()
        .args(["replay", JOB, "--walk", "7"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let (code, _, stderr) = finish(child);
    assert_eq!((code, &stderr[..]), (0, ""));
}

#[test]
fn json_streams_hold_nothing_but_json() {
    let folder = tempdir().unwrap();
    let fresh = |name: &str| path(&folder, name).to_str().unwrap().to_owned();
    let [out, used, exact, compared] = ["out", "used", "exact", "compared"].map(fresh);
    run_job(JOB, Path::new(&used), &["--paths", "3000"]);
    // The scene has a gap, so that there is a note; and the target is missed.
    let scene = fresh("open.toml");
    let room = "[material.m]\nreflectance = 0.5\nemittance = 1\n[[surface]]\nmaterial = \"m\"\nquad = [[0,0,0],[1,0,0],[0,1,0]]\n";
    std::fs::write(&scene, room).unwrap();
    for (code, args) in [
        (0, &["run", JOB, "--paths", "300000", "--workers", "2", "--out", &out][..]),
        (0, &["run", &scene, "--paths", "3000", "--workers", "1", "--resume", "--out", &fresh("open")]),
        (
            1,
            &[
                "run",
                JOB,
                "--paths",
                "3000",
                "--set",
                "target.relative_error=1e-6",
                "--out",
                &fresh("missed"),
            ],
        ),
        (2, &["run", JOB, "--paths", "3000", "--out", &used]),
        (2, &["run", JOB, "--workers", "0"]),
        (2, &["run", "configs/no-such-job.toml"]),
        (2, &["run"]),
        (3, &["coordinate", JOB, "--listen", "256.1.1.1:0", "--out", &fresh("deaf")]),
        (0, &["exact", JOB, "--out", &exact]),
        (2, &["exact", JOB, "--out", &exact]),
        (2, &["plan", JOB, "--set", "budget.path=1"]),
        (2, &["status", &fresh("nothing")]),
        (2, &["diff", &used, &fresh("nothing")]),
        (0, &["new", "box", "--out", &fresh("new")]),
        (2, &["new", "box", "--out", &fresh("new")]),
        (0, &["new", "box", "--force", "--out", &fresh("new")]),
        (0, &["new", "schema", "--out", &fresh("new")]),
        (0, &["sky", "--cie", "1", "--out", &fresh("sky.mtx")]),
        (2, &["sky", "--cie", "1", "--out", &fresh("sky.mtx")]),
        (0, &["merge", &used, "--out", &fresh("merged")]),
        (0, &["report", &used]),
        (0, &["compare", JOB, "--rays", "4096", "--runs", "2", "--workers", "1", "--out", &compared]),
    ] {
        let (got, _, stderr) = run(&[args, &["--json"]].concat());
        assert_eq!(got, code, "{args:?}: {stderr}");
        for line in stderr.lines() {
            let event: Value =
                serde_json::from_str(line).unwrap_or_else(|error| panic!("{args:?}: {error}: {line}"));
            assert!(event["event"].is_string(), "{args:?}: {line}");
        }
        let last: Option<Value> = stderr.lines().last().map(|line| serde_json::from_str(line).unwrap());
        if code >= 2 {
            let last = last.expect("a failure is told");
            assert_eq!((&last["event"], &last["level"]), (&"error".into(), &"error".into()), "{args:?}");
        } else if ["new", "sky", "merge", "report"].contains(&args[0]) {
            assert_eq!(last.expect("what is written is told")["event"], "done", "{args:?}");
        }
    }
}

#[test]
fn levels_are_those_of_the_environment() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let output = |level: &str, quiet: bool| {
        let mut command = radwalk();
        command
            .args(["run", JOB, "--paths", "3000", "--resume", "--out"])
            .arg(&out)
            .env("RADWALK_LOG", level);
        let child = command.args(quiet.then_some("--quiet")).stdout(Stdio::null()).stderr(Stdio::piped());
        let (code, _, stderr) = finish(child.spawn().unwrap());
        (code, stderr)
    };
    let (code, stderr) = output("loud", false);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("RADWALK_LOG=loud") && stderr.contains("warn"), "{stderr}");
    // There is nothing to resume from yet, which is a warning.
    assert_eq!(output("error", false), (0, String::new()));
    std::fs::remove_dir_all(&out).unwrap();
    let (_, stderr) = output("info", true);
    let joined =
        stderr.lines().find(|line| line.contains(" joins with 1 thread")).expect("workers are told of");
    assert!(joined.starts_with("20") && joined.contains("Z info "), "lines of a log have a time: {stderr}");
    assert!(stderr.contains("Z warn  there is no checkpoint to resume from"), "{stderr}");
}

#[test]
fn help_tells_examples_exit_codes_and_environment() {
    let (code, stdout, _) = run(&["--help"]);
    assert_eq!(code, 0);
    for word in ["Examples:", "Exit codes:", "130", "Environment:", "RADWALK_LOG"] {
        assert!(stdout.contains(word), "{word} is not in: {stdout}");
    }
    for command in ["run", "coordinate", "work", "relay", "check", "merge", "diff"] {
        let (_, stdout, _) = run(&[command, "--help"]);
        assert!(stdout.contains(&format!("Examples:\n  radwalk {command} ")), "{stdout}");
    }
}

#[test]
fn numbers_of_paths_are_written_as_people_write_them() {
    let folder = tempdir().unwrap();
    let runs = [("a", "20_000"), ("b", "2e4")]
        .map(|(name, paths)| run_job(JOB, &path(&folder, name), &["--paths", paths]));
    assert!(runs.iter().all(|summary| summary["paths"] == 20_000));
    let (code, _, stderr) = run(&["run", JOB, "--paths", "99999999999999999999"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("largest number of a job file"), "{stderr}");
}
