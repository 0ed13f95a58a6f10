//! Real processes for end-to-end tests: each test has its own folder.
#![allow(dead_code, reason = "each test file uses its own part")]

#[cfg(target_os = "linux")]
pub mod shim;
#[cfg(target_os = "linux")]
pub mod storm;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A process that hangs fails its test after this; nothing else depends on it.
const HANG: Duration = Duration::from_secs(900);

/// The program under test.
pub fn radwalk() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_radwalk"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null()).env_remove("COLUMNS");
    command
}

/// A picture of the usual size takes more than all else in a short run, and few tests look at one.
pub const SMALL_PICTURE: [&str; 2] = ["--set", "view.size=[64, 48]"];

/// No picture and no page: what takes longest in a short run is to find where a camera sees most.
pub const TABLES: [&str; 2] = ["--set", "output.files=[\"csv\", \"summary\"]"];

/// Runs to the end and returns exit code, stdout, stderr. Pictures of jobs are small unless they are given a size.
pub fn run(args: &[&str]) -> (i32, String, String) {
    let mut command = radwalk();
    command.args(args);
    if args.len() > 1 && args[0] == "run" && !args.iter().any(|arg| arg.starts_with("view.size")) {
        command.args(SMALL_PICTURE);
    }
    finish(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
}

/// Waits for a process, not for ever.
pub fn finish(mut child: Child) -> (i32, String, String) {
    let began = Instant::now();
    // Small outputs fit the pipes, so waiting before reading cannot block.
    while child.try_wait().unwrap().is_none() {
        if began.elapsed() > HANG {
            child.kill().unwrap();
            panic!("the process hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let Output { status, stdout, stderr } = child.wait_with_output().unwrap();
    (
        status.code().unwrap_or(-1),
        String::from_utf8_lossy(&stdout).into_owned(),
        String::from_utf8_lossy(&stderr).into_owned(),
    )
}

/// Runs a job that must succeed, and writes its tables alone; returns its summary.
pub fn run_job(job: &str, out: &Path, args: &[&str]) -> Value {
    draw_job(job, out, &[&TABLES[..], args].concat())
}

/// Runs a job that must succeed, with its picture and its page; returns its summary.
pub fn draw_job(job: &str, out: &Path, args: &[&str]) -> Value {
    let mut all = vec!["run", job, "--quiet", "--out", out.to_str().unwrap()];
    all.extend(args);
    let (code, stdout, stderr) = run(&all);
    assert_eq!(code, 0, "{stdout}{stderr}");
    summary(out)
}

/// The summary in an output folder.
pub fn summary(out: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap()
}

/// What must not depend on how a job was run: the digest of its tally and the bytes of its table.
pub fn answer(out: &Path) -> (String, Vec<u8>) {
    let hash = summary(out)["tally_hash"].as_str().unwrap().to_owned();
    (hash, std::fs::read(out.join("patches.csv")).unwrap())
}

/// A table as columns by name.
pub fn columns(path: &Path) -> HashMap<String, Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: HashMap<String, Vec<String>> = names.iter().map(|n| ((*n).to_owned(), vec![])).collect();
    for line in lines {
        for (name, value) in names.iter().zip(line.split(',')) {
            columns.get_mut(*name).unwrap().push(value.to_owned());
        }
    }
    columns
}

/// Numbers of a column.
pub fn numbers(column: &[String]) -> Vec<f64> {
    column.iter().map(|value| value.parse().unwrap()).collect()
}

/// The processes whose parent is `pid`.
pub fn children(pid: u32) -> Vec<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{pid}/task"));
    let Ok(tasks) = tasks else { return vec![] };
    tasks
        .filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("children")).ok())
        .flat_map(|list| list.split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<u32>>())
        .collect()
}

/// Sends a signal by name. The process may be gone already.
pub fn signal(name: &str, pid: u32) {
    let _ = Command::new("kill").args([format!("-{name}"), pid.to_string()]).stderr(Stdio::null()).status();
}

/// Waits until something is so.
pub fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(began.elapsed() < HANG, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A path below a test's folder.
pub fn path(folder: &tempfile::TempDir, name: &str) -> PathBuf {
    folder.path().join(name)
}

/// Runs a job on workers that are killed at random, and again undisturbed: the answers have the same bytes.
pub fn storms_leave_no_trace(job: &str, set: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let [calm, stormy] = ["calm", "stormy"].map(|name| path(&folder, name));
    let workers = [set, &["--workers", "3"]].concat();
    run_job(job, &calm, &workers);
    let mut command = radwalk();
    command.args(["run", job, "--quiet", "--out"]).arg(&stormy).args(&workers).args(TABLES);
    let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let coordinator = child.id();
    let mut state = 54_321_u64;
    for _ in 0..8 {
        let workers = children(coordinator);
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if let Some(&victim) = workers.get((state >> 33) as usize % workers.len().max(1)) {
            signal("KILL", victim);
        }
        std::thread::sleep(Duration::from_millis(100 + (state >> 57)));
    }
    let (code, ..) = finish(child);
    assert_eq!(code, 0);
    let summary = summary(&stormy);
    assert!(summary["workers_lost"].as_u64().unwrap() > 0, "the storm must have hit a worker: {summary}");
    assert!(answer(&stormy) == answer(&calm), "deaths changed the answer");
}

/// Starts a process again and again and kills it, `pause(n)` after its n-th start, until one comes to its end well. How
/// many were killed: at least one.
pub fn kill_until_done(mut start: impl FnMut() -> Child, pause: impl Fn(u64) -> Duration, most: u64) -> u64 {
    let mut killed = 0;
    loop {
        let mut child = start();
        // On a busy machine little gets done between two kills: they become rarer, so that the job ends.
        std::thread::sleep(pause(killed).mul_f64((killed as f64 / 16.0).exp2()));
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success());
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        killed += 1;
        assert!(killed < most, "it gets nowhere");
    }
    assert!(killed > 0, "no process was killed");
    killed
}
