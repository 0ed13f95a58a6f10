//! Tests of audits, merges and replays of real runs.

use crate::support::{answer, path, radwalk, run, run_job, summary};
use std::path::Path;
use tempfile::tempdir;

const JOB: &str = "tests/data/cube54.toml";

fn audit(out: &Path, args: &[&str]) -> (i32, String, String) {
    run(&[&["audit", out.to_str().unwrap()], args].concat())
}

fn merge(runs: &[&Path], out: &Path) -> (i32, String, String) {
    let runs: Vec<&str> = runs.iter().map(|run| run.to_str().unwrap()).collect();
    run(&[&["merge"], &runs[..], &["--quiet", "--out", out.to_str().unwrap()]].concat())
}

#[test]
fn an_audit_finds_every_lease_as_it_was_delivered() {
    let folder = tempdir().unwrap();
    for (i, method) in
        ["method.walk=shooting", "method.walk=gathering", "method.estimator=infinite"].iter().enumerate()
    {
        let out = path(&folder, &format!("out{i}"));
        run_job(JOB, &out, &["--paths", "300000", "--workers", "2", "--set", method]);
        let (code, stdout, stderr) = audit(&out, &["--share", "1"]);
        assert_eq!(code, 0, "{stdout}{stderr}");
        assert!(stdout.contains("300000 of 300000 paths"), "{stdout}");
    }
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "release builds have no hook that spoils sums")]
fn a_worker_that_delivers_wrong_sums_is_named() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let status = radwalk()
        .args(["run", JOB, "--paths", "300000", "--workers", "1", "--quiet", "--out"])
        .arg(&out)
        .env("RADWALK_TEST_WRONG_WORKER", "3")
        .status()
        .unwrap();
    assert!(status.success(), "nothing gives the worker away while it works");
    let worker = summary(&out)["provenance"]["workers"][0]["name"].as_str().unwrap().to_owned();
    let (code, stdout, stderr) = audit(&out, &["--share", "1"]);
    assert_eq!(code, 3, "{stdout}{stderr}");
    assert!(stderr.contains(&worker), "{stderr} names {worker}");
}

#[test]
fn an_audit_of_no_share_is_refused() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    run_job(JOB, &out, &["--paths", "1000"]);
    for share in ["0", "1.5", "NaN"] {
        assert_eq!(audit(&out, &["--share", share]).0, 2, "{share}");
    }
    assert_eq!(audit(folder.path(), &[]).0, 2, "no run there");
}

/// Ranges of one job, in any order, merge to the job; the merged result can be audited and resumed.
#[test]
fn ranges_of_walks_merge_to_the_whole_run() {
    let folder = tempdir().unwrap();
    let [straight, a, b, c, merged] = ["straight", "a", "b", "c", "merged"].map(|name| path(&folder, name));
    run_job(JOB, &straight, &["--paths", "300000"]);
    run_job(JOB, &a, &["--paths", "100001"]);
    run_job(JOB, &b, &["--paths", "49999", "--set", "budget.first_path=100001"]);
    run_job(JOB, &c, &["--paths", "150000", "--set", "budget.first_path=150000", "--workers", "3"]);
    let (code, _, stderr) = merge(&[&c, &a, &b], &merged);
    assert_eq!(code, 0, "{stderr}");
    assert!(answer(&merged) == answer(&straight));
    assert_eq!(summary(&merged)["provenance"]["parts"].as_array().unwrap().len(), 1);
    assert_eq!(audit(&merged, &["--share", "1"]).0, 0);
    let longer = ["run", JOB, "--resume", "--quiet", "--paths", "400000", "--out", merged.to_str().unwrap()];
    assert_eq!(run(&longer).0, 0);
    run_job(JOB, &straight, &["--paths", "400000", "--force"]);
    assert!(answer(&merged) == answer(&straight));
}

#[test]
fn other_seeds_merge_to_all_their_walks_and_others_are_refused() {
    let folder = tempdir().unwrap();
    let [one, two, other, merged] = ["one", "two", "other", "merged"].map(|name| path(&folder, name));
    let first = run_job(JOB, &one, &["--paths", "100000", "--seed", "1"]);
    let second = run_job(JOB, &two, &["--paths", "200000", "--seed", "2"]);
    assert_eq!(merge(&[&one, &two], &merged).0, 0);
    let both = summary(&merged);
    for count in ["paths", "rays", "escaped", "absorbed_back"] {
        let sum = first[count].as_u64().unwrap() + second[count].as_u64().unwrap();
        assert_eq!(both[count].as_u64().unwrap(), sum, "{count}");
    }
    assert_eq!(audit(&merged, &["--share", "1"]).0, 0);
    let refused = |runs: &[&Path], reason: &str| {
        let (code, _, stderr) = merge(runs, &path(&folder, "refused"));
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains(reason), "{stderr}");
    };
    refused(&[&one, &one], "walks 0 to 99999 of seed 1");
    refused(&[&merged, &two], "walks 0 to 199999 of seed 2");
    run_job("configs/furnace.toml", &other, &["--paths", "1000"]);
    refused(&[&one, &other], "another scene");
    run_job(JOB, &other, &["--paths", "1000", "--set", "method.estimator=absorption", "--force"]);
    refused(&[&one, &other], "scored differently");
    let code = merge(&[&one, &two], &merged).0;
    assert_eq!(code, 2, "an output folder is not replaced without --force");
}

/// The hits of replayed walks are those of the tally.
#[test]
fn replayed_walks_are_the_walks_of_the_run() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    run_job(JOB, &out, &["--paths", "20"]);
    let hits: Vec<u64> = crate::support::columns(&out.join("patches.csv"))["hits"]
        .iter()
        .map(|hits| hits.parse().unwrap())
        .collect();
    let mut counted = vec![0; hits.len()];
    for walk in 0..20 {
        let (code, stdout, _) = run(&["replay", JOB, "--walk", &walk.to_string()]);
        assert_eq!(code, 0);
        assert!(stdout.contains("is born on patch 4,"), "the only emitter: {stdout}");
        for arrival in stdout.lines().filter_map(|line| line.strip_prefix("arrives at patch ")) {
            counted[arrival.split(',').next().unwrap().parse::<usize>().unwrap()] += 1;
        }
    }
    assert_eq!(counted, hits);
}
