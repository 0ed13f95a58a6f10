//! Tests of what operators see of a running job: status, metrics, logs, addresses.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{TABLES, finish, path, radwalk, run, signal, wait_for};

const JOB: &str = "tests/data/cube54.toml";

/// A coordinator of a job that does not end by itself, whose log goes to a file.
fn coordinate(out: &Path, access: &Path, log: &Path, args: &[&str]) -> Child {
    radwalk()
        .args(["coordinate", JOB, "--paths", "1e15", "--set", "budget.checkpoint_seconds=0.5"])
        .args(TABLES)
        .arg("--out")
        .arg(out)
        .arg("--access")
        .arg(access)
        .args(args)
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(log).unwrap())
        .spawn()
        .unwrap()
}

fn work(access: &Path) -> Child {
    radwalk().args(["work", "--quiet", "--access"]).arg(access).stdout(Stdio::null()).spawn().unwrap()
}

fn status(of: &Path) -> Option<Value> {
    let (code, stdout, _) = run(&["status", of.to_str().unwrap(), "--json"]);
    (code == 0).then(|| serde_json::from_str(&stdout).unwrap())
}

fn get(address: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut page = String::new();
    stream.read_to_string(&mut page).unwrap();
    page
}

#[test]
fn a_running_job_is_seen_in_status_metrics_and_log() {
    let folder = tempdir().unwrap();
    let [out, access, log] = ["out", "shared.json", "log"].map(|name| path(&folder, name));
    let target = ["--json", "--metrics", "0", "--set", "target.relative_error=1e-4"];
    let coordinator = coordinate(&out, &access, &log, &target);
    let events = || -> Vec<Value> {
        let text = std::fs::read_to_string(&log).unwrap();
        // The last line may still be incomplete.
        text.split_inclusive('\n')
            .filter(|line| line.ends_with('\n'))
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    };
    // No worker is there yet: no time is predicted, and the job is listed.
    let idle = wait_for("the first status", || status(&out));
    assert_eq!(
        (&idle["workers"], &idle["seconds_left"], &idle["state"]),
        (&0.into(), &Value::Null, &"running".into())
    );
    let (_, words, _) = run(&["status", access.to_str().unwrap()]);
    assert!(words.contains("no worker is there") && !words.contains("left"), "{words}");

    let workers = [work(&access), work(&access)];
    let name = |worker: &Child| format!(":{}", worker.id());
    // Both workers have delivered, a checkpoint is written, and the end is predicted.
    let busy = wait_for("a busy status", || {
        status(&access).filter(|status| {
            let crew = status["crew"].as_array().unwrap();
            let all_rated =
                crew.len() == 2 && crew.iter().all(|hand| hand["paths_per_second"].as_f64() > Some(0.0));
            all_rated
                && status["checkpoint"]["paths"].as_u64() > Some(0)
                && status["target"]["paths_expected"].is_u64()
        })
    });
    for worker in &workers {
        let crew = busy["crew"].as_array().unwrap();
        assert!(crew.iter().any(|hand| hand["name"].as_str().unwrap().ends_with(&name(worker))), "{busy}");
    }
    assert!(busy["paths"].as_u64() > Some(0) && busy["paths_per_second"].as_f64() > Some(0.0), "{busy}");
    // The time left is that to the target, far before the end of the budget.
    let left = busy["seconds_left"].as_f64().unwrap();
    let to_budget = 1e15 / busy["paths_per_second"].as_f64().unwrap();
    assert!(left < 0.01 * to_budget, "{left} s to the target, {to_budget} s to the budget");
    let (_, words, _) = run(&["status", out.to_str().unwrap()]);
    for word in ["2 workers", "target:", "last checkpoint:", "no faults seen", " left"] {
        assert!(words.contains(word), "{word} is not in: {words}");
    }

    let published =
        events().into_iter().find(|event| event["event"] == "metrics").expect("the address is told");
    let address = published["text"]
        .as_str()
        .unwrap()
        .split("http://")
        .nth(1)
        .unwrap()
        .trim_end_matches("/metrics")
        .to_owned();
    assert!(address.starts_with("127.0.0.1:"), "a port alone is for this machine: {address}");
    let page = wait_for("metrics of two workers", || {
        Some(get(&address)).filter(|page| page.contains("\nradwalk_workers 2\n"))
    });
    assert!(page.contains("# TYPE radwalk_paths gauge\nradwalk_paths "), "{page}");
    assert!(page.contains("radwalk_worker_paths_per_second{worker=\""), "{page}");

    // A worker dies, and one message says so.
    let [victim, other] = workers;
    let dead = name(&victim);
    signal("KILL", victim.id());
    finish(victim);
    wait_for("a fault", || status(&out).filter(|status| status["faults"]["workers_lost"] == 1));
    signal("INT", coordinator.id());
    assert_eq!(finish(coordinator).0, 130);
    assert_eq!(finish(other).0, 0);
    let of = |event: &str| -> Vec<String> {
        let events = events().into_iter().filter(|line| line["event"] == event);
        events.map(|line| line["worker"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!((of("joined").len(), of("lost").len()), (2, 1));
    assert!(of("lost")[0].ends_with(&dead));
    // A run that ended says so, and leaves no status behind.
    assert!(!out.join("status.json").exists() && !path(&folder, "shared.status.json").exists());
    let (code, words, _) = run(&["status", out.to_str().unwrap()]);
    assert!(code == 0 && words.contains("target not reached"), "{words}");
    let (code, _, text) = run(&["status", access.to_str().unwrap()]);
    assert!(code == 2 && text.contains("removed when a job ends"), "{text}");
}

/// A coordinator that was killed cannot remove its status file.
#[test]
fn a_coordinator_that_is_gone_is_told_from_one_that_works() {
    let folder = tempdir().unwrap();
    let [out, access, log] = ["out", "access.json", "log"].map(|name| path(&folder, name));
    let coordinator = coordinate(&out, &access, &log, &[]);
    wait_for("the first status", || status(&out));
    signal("KILL", coordinator.id());
    finish(coordinator);
    let file = out.join("status.json");
    let mut report: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    report["time"] = 1.into();
    std::fs::write(&file, report.to_string()).unwrap();
    let (code, _, text) = run(&["status", out.to_str().unwrap()]);
    assert_eq!(code, 3, "{text}");
    assert!(text.contains("has not reported") && text.contains("--resume"), "{text}");
}

#[test]
fn access_files_hold_addresses_that_others_can_use() {
    let folder = tempdir().unwrap();
    let begin = |name: &str, args: &[&str]| {
        let [out, access, log] =
            ["out", "access.json", "log"].map(|part| path(&folder, &format!("{name}-{part}")));
        let coordinator = coordinate(&out, &access, &log, args);
        let address = wait_for("the access file", || {
            let access: Value = serde_json::from_slice(&std::fs::read(&access).ok()?).ok()?;
            Some(access["address"].as_str().unwrap().to_owned())
        });
        signal("INT", coordinator.id());
        finish(coordinator);
        address
    };
    let address = begin("named", &["--listen", "0.0.0.0:0", "--advertise", "node7.cluster"]);
    let port = address.strip_prefix("node7.cluster:").unwrap_or_else(|| panic!("{address}"));
    assert!(port.parse::<u16>().unwrap() > 0);
    assert_eq!(begin("gate", &["--listen", "127.0.0.1:0", "--advertise", "gate:7601"]), "gate:7601");
    assert!(begin("v6", &["--listen", "127.0.0.1:0", "--advertise", "fe80::1"]).starts_with("[fe80::1]:"));

    // Without a name this machine's own is used, or the address is refused: 0.0.0.0 leads nowhere.
    let [out, access, log] = ["out", "access.json", "log"].map(|name| path(&folder, name));
    let mut coordinator = coordinate(&out, &access, &log, &["--listen", "0.0.0.0:0"]);
    let known = wait_for("an access file, or the end", || match coordinator.try_wait().unwrap() {
        Some(_) => Some(false),
        None => access.exists().then_some(true),
    });
    if known {
        let address = std::fs::read_to_string(&access).unwrap();
        assert!(!address.contains("0.0.0.0"), "{address}");
        signal("INT", coordinator.id());
        finish(coordinator);
    } else {
        assert_eq!(finish(coordinator).0, 2);
        let text = std::fs::read_to_string(&log).unwrap();
        assert!(text.contains("0.0.0.0") && text.contains("--advertise HOST"), "{text}");
    }
}
