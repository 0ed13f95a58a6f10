//! Chosen patches: targets that are about them alone.

mod support;

use serde_json::Value;
use support::{answer, columns, numbers, path, run, run_job};
use tempfile::tempdir;

const CUBE: &str = "configs/cube54.toml";

/// Half-width over estimate of every patch in a table.
fn relative_errors(out: &std::path::Path) -> Vec<f64> {
    let table = columns(&out.join("patches.csv"));
    let [low, high, b] = ["ci_low", "ci_high", "radiosity"].map(|name| numbers(&table[name]));
    (0..b.len()).map(|i| 0.5 * (high[i] - low[i]) / b[i]).collect()
}

#[test]
fn a_target_of_chosen_patches_is_judged_and_planned_on_them_alone() {
    let folder = tempdir().unwrap();
    let [all, chosen, straight] = ["all", "chosen", "straight"].map(|name| path(&folder, name));
    let target = ["--paths", "2000000", "--set", "target.relative_error=0.05", "--set", "target.fraction=1"];
    let whole = run_job(CUBE, &all, &target);
    // The two patches that are known best.
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
    // The target says when to stop, not what to find.
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
