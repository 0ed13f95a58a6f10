//! Tests of `sampler = "sobol"` for walks on a cluster: batches are leased whole, and any workers give the same bytes.

use crate::support::{answer, path, run, run_job, storms_leave_no_trace, summary};
use tempfile::tempdir;

const CUBE: &str = "tests/data/cube54.toml";
const SOBOL: [&str; 4] = ["--set", "method.sampler=sobol", "--paths", "300000"];

#[test]
fn workers_leave_no_trace_in_sobol_walks() {
    let folder = tempdir().unwrap();
    let base = path(&folder, "base");
    let first = run_job(CUBE, &base, &[&SOBOL[..], &["--workers", "1"]].concat());
    // Batches have 2¹⁴ paths, and 300,000 paths hold 18 of them.
    assert_eq!((&first["paths"], &first["streams"]), (&294_912.into(), &18.into()));
    assert_eq!((&first["walk"], &first["sampler"]), (&"shooting".into(), &"sobol".into()));
    let energy = &first["energy"];
    assert_eq!((&energy["emitted"], &energy["absorbed"]), (&294_912.into(), &294_912.into()));
    assert!(first["rays"].as_u64() > first["paths"].as_u64());
    assert!(first["checks"].as_array().unwrap().iter().all(|check| check["ok"] != false), "{first}");
    for workers in ["2", "5"] {
        let out = path(&folder, workers);
        run_job(
            CUBE,
            &out,
            &[&SOBOL[..], &["--workers", workers, "--set", "budget.stream_paths=7"]].concat(),
        );
        assert!(answer(&out) == answer(&base), "{workers} workers");
    }
    let out = path(&folder, "other");
    run_job(CUBE, &out, &[&SOBOL[..], &["--set", "method.batch_paths=8192"]].concat());
    assert!(answer(&out) != answer(&base), "other batches are another answer");
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_sobol_walks() {
    let set = ["--set", "method.sampler=sobol", "--set", "method.batch_paths=8192", "--paths", "5000000"];
    storms_leave_no_trace(CUBE, &set);
}

#[test]
fn batches_are_extended_merged_and_audited() {
    let folder = tempdir().unwrap();
    let [straight, head, tail, merged] =
        ["straight", "head", "tail", "merged"].map(|name| path(&folder, name));
    let job = ["--set", "method.sampler=sobol", "--set", "method.batch_paths=4096"];
    run_job(CUBE, &straight, &[&job[..], &["--paths", "131072"]].concat());
    run_job(CUBE, &head, &[&job[..], &["--paths", "65536"]].concat());
    run_job(CUBE, &tail, &[&job[..], &["--paths", "65536", "--set", "budget.first_path=65536"]].concat());
    let text = |path: &std::path::Path| path.to_str().unwrap().to_owned();
    let (code, _, stderr) = run(&["merge", &text(&tail), &text(&head), "--quiet", "--out", &text(&merged)]);
    assert_eq!(code, 0, "{stderr}");
    assert!(answer(&merged) == answer(&straight));
    assert_eq!(summary(&merged)["paths"], 131_072);
    let (code, stdout, stderr) = run(&["audit", &text(&merged), "--share", "1"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("131072 of 131072 paths"), "{stdout}");
    run_job(CUBE, &head, &[&job[..], &["--paths", "131072", "--resume"]].concat());
    assert!(answer(&head) == answer(&straight));
    let (code, _, stderr) = run(&["replay", CUBE, "--walk", "0", "--set", "method.sampler=sobol"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("no walks to replay"), "{stderr}");
}
