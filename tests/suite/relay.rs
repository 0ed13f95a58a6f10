//! Tests of relays as processes: workers and relays are killed and stopped, and the answer is that of a run without
//! any.

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::thread;
use std::time::Duration;

use crate::support::{TABLES, answer, finish, path, radwalk, run, run_job, signal, summary, wait_for};
use protocol::Checkpoint;
use tempfile::{TempDir, tempdir};

const JOB: &str = "tests/data/cube54.toml";

/// A time that is long enough for some leases.
const WHILE: Duration = Duration::from_millis(300);

fn coordinate(out: &Path, access: &Path) -> Child {
    let mut command = radwalk();
    command.args(["coordinate", JOB, "--quiet", "--paths", "1000000000000"]);
    command.args(["--set", "budget.checkpoint_seconds=0.1"]).args(TABLES);
    command.arg("--out").arg(out).arg("--access").arg(access);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn work(access: &Path) -> Child {
    radwalk().args(["work", "--quiet", "--wait", "60", "--access"]).arg(access).spawn().unwrap()
}

/// A relay and its two workers.
struct Branch {
    access: PathBuf,
    relay: Child,
    workers: [Child; 2],
}

impl Branch {
    fn start(folder: &TempDir, name: &str, upstream: &Path) -> Self {
        let access = path(folder, name);
        let mut command = radwalk();
        command.args(["relay", "--quiet", "--wait", "60", "--access"]).arg(upstream);
        let relay = command.arg("--out-access").arg(&access).spawn().unwrap();
        let workers = [(); 2].map(|()| work(&access));
        Branch { access, relay, workers }
    }
}

fn kill(mut child: Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn relays_that_come_and_go_leave_no_trace_in_the_answer() {
    let folder = tempdir().unwrap();
    let (out, access) = (path(&folder, "out"), path(&folder, "access.json"));
    let coordinator = coordinate(&out, &access);
    wait_for("the access file", || access.exists().then_some(()));
    let [one, two] = ["one.json", "two.json"].map(|name| Branch::start(&folder, name, &access));
    let direct = work(&access);
    wait_for("a checkpoint", || out.join("tally.bin").exists().then_some(()));
    thread::sleep(WHILE);

    // A worker behind a relay dies.
    let [victim, rest] = one.workers;
    kill(victim);
    thread::sleep(WHILE);
    // A relay dies. Its workers would look for another.
    kill(two.relay);
    two.workers.into_iter().for_each(kill);
    assert!(two.access.exists());
    let three = Branch::start(&folder, "three.json", &access);
    thread::sleep(WHILE);
    // A relay is stopped: its walks go to others, and its workers end.
    signal("INT", one.relay.id());
    assert_eq!(finish(one.relay).0, 130);
    assert_eq!(finish(rest).0, 0);
    assert!(!one.access.exists());
    wait_for("the third relay", || three.access.exists().then_some(()));
    thread::sleep(WHILE);

    signal("INT", coordinator.id());
    assert_eq!(finish(coordinator).0, 130);
    for process in [direct, three.relay].into_iter().chain(three.workers) {
        assert_eq!(finish(process).0, 0);
    }
    assert!(!three.access.exists());

    let seen = summary(&out);
    assert_eq!((seen["workers_seen"].as_u64(), seen["workers_lost"].as_u64()), (Some(4), Some(2)));
    let calm = path(&folder, "calm");
    run_job(JOB, &calm, &["--paths", &seen["paths"].to_string()]);
    assert!(answer(&out) == answer(&calm), "relays changed the answer");
    let (code, _, text) = run(&["audit", out.to_str().unwrap(), "--share", "0.1", "--quiet"]);
    assert_eq!(code, 0, "every lease behind a relay is as it was delivered: {text}");
}

/// Starts a worker whose memory fails with every lease.
fn lie(access: &Path) -> Child {
    let mut command = radwalk();
    command.args(["work", "--quiet", "--wait", "60", "--access"]).arg(access);
    command.env("RADWALK_TEST_WRONG_WORKER", "1").spawn().unwrap()
}

/// Whether a lease in the latest checkpoint is by a worker whose name has this ending.
fn has_brought(out: &Path, name: &str) -> bool {
    let Ok(checkpoint) = Checkpoint::read(&out.join("tally.bin")) else { return false };
    checkpoint.book.workers.iter().any(|worker| worker.name.ends_with(name) && worker.leases > 0)
}

/// The coordinator leads a worker and a relay. That relay leads two workers and a relay, which leads two workers. One
/// worker behind each relay delivers wrong sums.
#[test]
#[cfg_attr(not(debug_assertions), ignore = "release builds have no hook that spoils sums")]
fn audits_name_liars_behind_relays_and_behind_relays_of_relays() {
    let folder = tempdir().unwrap();
    let (out, access) = (path(&folder, "out"), path(&folder, "access.json"));
    let coordinator = coordinate(&out, &access);
    wait_for("the access file", || access.exists().then_some(()));
    let start = |name: &str, upstream: &Path| {
        let access = path(&folder, name);
        let mut relay = radwalk();
        relay.args(["relay", "--quiet", "--wait", "60", "--access"]).arg(upstream);
        let relay = relay.arg("--out-access").arg(&access).spawn().unwrap();
        let workers = [work(&access), lie(&access)];
        (access, relay, workers)
    };
    let (outer_access, outer, outer_workers) = start("outer.json", &access);
    let (_, inner, inner_workers) = start("inner.json", &outer_access);
    let direct = work(&access);
    let ends = |child: &Child| format!(":{}", child.id());
    let [honest, liar] = outer_workers.each_ref().map(ends);
    let [inner_honest, inner_liar] = inner_workers.each_ref().map(ends);
    let (relay, inner_relay) = (ends(&outer), ends(&inner));
    for name in [&honest, &liar, &inner_honest, &inner_liar, &ends(&direct)] {
        wait_for("leases of all workers", || has_brought(&out, name).then_some(()));
    }
    signal("INT", coordinator.id());
    assert_eq!(finish(coordinator).0, 130);
    for process in [direct, outer, inner].into_iter().chain(outer_workers).chain(inner_workers) {
        assert_eq!(finish(process).0, 0);
    }

    let (code, _, text) = run(&["audit", out.to_str().unwrap(), "--share", "1", "--quiet"]);
    assert_eq!(code, 3, "{text}");
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let behind = format!("relay {host}{relay} > {host}{liar}: ");
    let behind_two = format!("relay {host}{relay} > relay {host}{inner_relay} > {host}{inner_liar}: ");
    assert!(text.contains(&behind) && text.contains(&behind_two), "{text} names {behind} and {behind_two}");
    let named = text.matches(&format!("{host}{relay}")).count();
    assert_eq!(named, 2, "no other worker is named: {text}");
    assert!(text.contains("the word of the relay"), "{text}");
}

#[test]
fn a_relay_that_cannot_begin_says_why() {
    let folder = tempdir().unwrap();
    let file = path(&folder, "access.json");
    let file = file.to_str().unwrap();
    let (code, _, text) = run(&["relay", "--access", file, "--out-access", file]);
    assert_eq!(code, 2, "{text}");
    assert!(text.contains("--out-access"), "{text}");
    let (code, _, text) = run(&["relay", "--access", file, "--out-access", &format!("{file}.2")]);
    assert_eq!(code, 2, "{text}");
    let (code, _, text) =
        run(&["relay", "--access", file, "--out-access", &format!("{file}.2"), "--listen", "nowhere"]);
    assert_eq!(code, 2, "{text}");
}
