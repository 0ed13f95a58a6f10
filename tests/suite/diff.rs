//! Tests of `radwalk diff`, which compares results.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{path, run, run_job};

const JOB: &str = "configs/cube54.toml";

fn diff(first: &Path, second: &Path, args: &[&str]) -> (i32, String, String) {
    run(&[&["diff", first.to_str().unwrap(), second.to_str().unwrap()], args].concat())
}

/// Walks, batches of few, and the exact solution: ten comparisons, each of which raises a false alarm at most once in
/// 1,000, once and for all for these seeds.
#[test]
fn honest_results_agree() {
    let folder = tempdir().unwrap();
    let out = |name: &str| path(&folder, name);
    for (i, set) in
        ["method.walk=shooting", "method.walk=gathering", "method.sampler=sobol", "method.walk=jacobi"]
            .iter()
            .enumerate()
    {
        for seed in ["1", "2"] {
            run_job(JOB, &out(&format!("{i}-{seed}")), &["--paths", "200000", "--seed", seed, "--set", set]);
        }
        let (code, stdout, stderr) = diff(&out(&format!("{i}-1")), &out(&format!("{i}-2")), &[]);
        assert_eq!(code, 0, "{set}: {stdout}{stderr}");
        assert!(stdout.contains("the results agree") && stdout.contains("1 of 1000 comparisons"), "{stdout}");
        // Results of different methods are compared, too.
        assert_eq!(diff(&out("0-1"), &out(&format!("{i}-2")), &[]).0, 0, "{set}");
    }
    let exact = out("exact");
    assert_eq!(run(&["exact", JOB, "--quiet", "--out", exact.to_str().unwrap()]).0, 0);
    for run in ["0-1", "3-1"] {
        let (code, stdout, _) = diff(&out(run), &exact, &["--json"]);
        let found: Value = serde_json::from_str(&stdout).unwrap();
        assert_eq!((code, &found["agree"], &found["compared"]), (0, &true.into(), &54.into()), "{found}");
    }
    let (code, stdout, _) = diff(&out("0-1"), &out("0-1"), &[]);
    assert!(code == 0 && stdout.contains("the same, to the last bit"), "{stdout}");
}

#[test]
fn wrong_results_are_named() {
    let folder = tempdir().unwrap();
    let [a, b, darker] = ["a", "b", "darker"].map(|name| path(&folder, name));
    run_job(JOB, &a, &["--paths", "200000", "--seed", "1"]);
    run_job(JOB, &b, &["--paths", "200000", "--seed", "2"]);
    // One patch of the table is off by a tenth.
    let table = std::fs::read_to_string(b.join("patches.csv")).unwrap();
    let lines = table.lines().enumerate().map(|(i, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if i == 41 {
            cells[10] = (1.1 * cells[10].parse::<f64>().unwrap()).to_string();
        }
        cells.join(",") + "\n"
    });
    let wrong = lines.collect::<String>();
    std::fs::write(b.join("patches.csv"), wrong).unwrap();
    let (code, stdout, stderr) = diff(&a, &b, &[]);
    assert_eq!(code, 3, "{stdout}{stderr}");
    assert!(stdout.contains("beyond the limit: patch 40"), "{stdout}");
    assert!(
        stderr.contains("1 of 54 radiosities by more than") && stderr.contains("1000 comparisons"),
        "{stderr}"
    );
    // A result with some of the same walks is no independent sample.
    run_job(JOB, &darker, &["--paths", "300000", "--seed", "1"]);
    let (code, _, stderr) = diff(&a, &darker, &[]);
    assert!(code == 2 && stderr.contains("the same walks") && stderr.contains("--seed"), "{stderr}");
    run_job("configs/cube6-r90.toml", &darker, &["--force", "--paths", "3000"]);
    let (code, _, stderr) = diff(&a, &darker, &[]);
    assert!(code == 2 && stderr.contains("one has 54 radiosities, the other 6"), "{stderr}");
    assert_eq!(diff(&a, &path(&folder, "none"), &[]).0, 2);
}
