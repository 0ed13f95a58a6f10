//! Tests of chosen patches: targets on them alone, and methods that gather on them.

use crate::support::{answer, columns, numbers, path, run, run_job, storms_leave_no_trace};
use serde_json::Value;
use tempfile::tempdir;

const CUBE: &str = "tests/data/cube54.toml";

/// The half-width over the estimate for every patch in a table.
fn relative_errors(out: &std::path::Path) -> Vec<f64> {
    let table = columns(&out.join("patches.csv"));
    let [low, high, h] =
        ["irradiance_low", "irradiance_high", "irradiance"].map(|name| numbers(&table[name]));
    (0..h.len()).map(|i| 0.5 * (high[i] - low[i]) / h[i]).collect()
}

#[test]
fn a_target_of_chosen_patches_is_judged_and_planned_on_them_alone() {
    let folder = tempdir().unwrap();
    let [all, chosen, straight] = ["all", "chosen", "straight"].map(|name| path(&folder, name));
    let target = ["--paths", "2000000", "--set", "target.relative_error=0.05", "--set", "target.fraction=1"];
    let whole = run_job(CUBE, &all, &target);
    // The two patches with the smallest relative errors.
    let errors = relative_errors(&all);
    let mut order: Vec<usize> = (0..errors.len()).collect();
    order.sort_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let best: Vec<usize> = order.into_iter().filter(|&i| errors[i] > 0.0).take(2).collect();
    let patches = format!("target.patches=[{}, {}]", best[1], best[0]);
    let job = [&target[..], &["--set", &patches]].concat();
    let summary = run_job(CUBE, &chosen, &job);
    let paths = summary["paths"].as_u64().unwrap();
    assert!(paths < whole["paths"].as_u64().unwrap(), "{summary}");
    assert_eq!(summary["target"]["reached"], true);
    assert_eq!(summary["target"]["patches"], serde_json::json!([best[1], best[0]]));
    assert_eq!(whole["target"].get("patches"), None);
    let errors = relative_errors(&chosen);
    assert!(best.iter().all(|&i| errors[i] <= 0.05), "{errors:?}");
    assert!(errors.iter().any(|&error| error > 0.05), "the other patches are not waited for: {errors:?}");
    // The target sets when to stop, not the walks.
    assert_eq!(summary["job_hash"], whole["job_hash"]);
    run_job(CUBE, &straight, &["--paths", &paths.to_string()]);
    assert!(answer(&straight) == answer(&chosen));

    let (code, stdout, stderr) = run(&[&["plan", CUBE, "--json"][..], &job].concat());
    assert_eq!(code, 0, "{stderr}");
    let plan: Value = serde_json::from_str(&stdout).unwrap();
    let [least, most] = ["least_paths", "most_paths"].map(|key| plan["ending"][key].as_u64().unwrap());
    assert!((least..=most).contains(&paths), "{least} … {most}, took {paths}");
}

#[test]
fn a_target_of_patches_that_no_walk_is_born_on_is_refused() {
    let gathering = ["--set", "method.walk=gathering", "--set", "method.birth={patches=[7, 12]}"];
    let target = ["--set", "target.relative_error=0.1", "--set", "target.patches=[12, 8]"];
    let (code, _, stderr) = run(&[&["check", CUBE][..], &gathering, &target].concat());
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("target.patches: no walk is born on patch 8"), "{stderr}");
}

const GATHER: [&str; 2] = ["--set", "method.final_gather=[53, 0]"];

/// Tests walks in batches, and chains.
#[test]
fn workers_leave_no_trace_in_a_final_gather() {
    let folder = tempdir().unwrap();
    for walk in ["shooting", "jacobi"] {
        let walk = format!("method.walk={walk}");
        let job = [&GATHER[..], &["--set", &walk, "--paths", "300000"]].concat();
        let [base, plain, part] =
            ["base", "plain", "part"].map(|name| path(&folder, &format!("{name}-{walk}")));
        let batch = ["--set", "method.batch_paths=10000"];
        let summary = run_job(CUBE, &base, &[&job[..], &batch, &["--workers", "1"]].concat());
        assert_eq!((&summary["paths"], &summary["streams"]), (&300_000.into(), &30.into()));
        assert_eq!(summary["model"]["final_gather"], serde_json::json!([0, 53]));
        assert!(summary["checks"].as_array().unwrap().iter().all(|check| check["ok"] != false), "{summary}");
        for workers in ["2", "5"] {
            let out = path(&folder, &format!("{workers}-{walk}"));
            run_job(CUBE, &out, &[&job[..], &batch, &["--workers", workers]].concat());
            assert!(answer(&out) == answer(&base), "{workers} workers");
        }
        run_job(CUBE, &part, &[&GATHER[..], &["--set", &walk, "--paths", "120000"], &batch].concat());
        run_job(CUBE, &part, &[&job[..], &batch, &["--resume"]].concat());
        assert!(answer(&part) == answer(&base), "resumed");
        let text = part.to_str().unwrap();
        let (code, _, stderr) = run(&["audit", text, "--share", "1", "--quiet"]);
        assert_eq!(code, 0, "{stderr}");
        let sobol = ["--set", "method.sampler=sobol", "--set", &walk, "--paths", "300000"];
        run_job(CUBE, &plain, &[&sobol[..], &batch].concat());
        let [with, without] = [&base, &plain].map(|out| relative_errors(out));
        for patch in [0, 53] {
            assert!(with[patch] < 0.6 * without[patch], "patch {patch}: {} {}", with[patch], without[patch]);
        }
    }
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_a_final_gather() {
    let set = [&GATHER[..], &["--set", "method.batch_paths=8192", "--paths", "5000000"]].concat();
    storms_leave_no_trace(CUBE, &set);
}
