//! Tests of `radwalk plan`, by running what it planned. They take some seconds of processor time.

use crate::support::{run, run_job};
use serde_json::Value;

/// The changes of a job so that its target ends it, not its budget.
struct Case {
    job: &'static str,
    set: &'static [&'static str],
}

const CASES: [Case; 6] = [
    Case { job: "configs/cube54.toml", set: &["target.relative_error=0.01"] },
    Case {
        job: "configs/cube54.toml",
        set: &["target.relative_error=0.02", "method.walk=gathering", "method.birth=uniform"],
    },
    Case {
        job: "configs/cube54.toml",
        set: &["target.relative_error=0.04", "method.space=continuous", "method.estimator=absorption"],
    },
    Case {
        job: "configs/cube54.toml",
        set: &["target.relative_error=0.03", "method.estimator=survival", "simultaneous=true"],
    },
    Case {
        job: "configs/cube54.toml",
        set: &["target.relative_error=0.05", "method.estimator=infinite", "seed=3"],
    },
    Case { job: "configs/cornell.toml", set: &["target.relative_error=0.5", "target.fraction=0.9"] },
];

impl Case {
    fn arguments(&self) -> Vec<&str> {
        let budget = ["budget.paths=100000000"];
        self.set.iter().chain(&budget).flat_map(|set| ["--set", set]).collect()
    }

    fn plan(&self) -> Value {
        let mut args = vec!["plan", self.job, "--json"];
        args.extend(self.arguments());
        let (code, stdout, stderr) = run(&args);
        assert_eq!(code, 0, "{stderr}");
        serde_json::from_str(&stdout).unwrap()
    }
}

/// The pilot predicts the walks within 20 % of what the run takes (rays within as much, and half a percent for the
/// pilot's mean length of walks); the bound is never below. Runs end at steps of 4/3 and 3/2: if a pilot cannot tell
/// two steps apart, the plan is between them, at most 20 % from both. A plan is wrong if errors are more than two
/// standard errors from the pilot's, at most once in 20 plans; these jobs and their seeds are fixed.
#[test]
fn runs_take_what_was_planned() {
    let dir = tempfile::tempdir().unwrap();
    for (number, case) in CASES.iter().enumerate() {
        let plan = case.plan();
        let summary = run_job(case.job, &dir.path().join(number.to_string()), &case.arguments());
        let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{plan}"));
        for what in ["paths", "rays"] {
            let ratio = number(&plan[what]) / number(&summary[what]);
            println!("{} {:?}: {what} {ratio:.3} of what was taken", case.job, case.set);
            assert!((ratio - 1.0).abs() <= 0.205, "{plan}\n{summary}");
        }
        assert_eq!(summary["target"]["reached"], true);
        assert!(number(&plan["pilot"]["paths"]) <= number(&summary["paths"]), "a pilot is a part of its run");
        if plan["bound"].is_null() {
            assert_eq!(case.job, "configs/cornell.toml", "bounds are for grey scenes");
        } else {
            assert!(
                number(&plan["bound"]["ends_at_paths"]) >= number(&summary["paths"]),
                "{plan}\n{summary}"
            );
        }
    }
}

#[test]
fn more_workers_take_less_time_and_never_less_traffic() {
    let plan = CASES[0].plan();
    let workers = plan["workers"].as_array().unwrap();
    assert_eq!(
        workers.iter().map(|w| w["workers"].as_u64().unwrap()).collect::<Vec<_>>(),
        [1, 10, 100, 1000, 10_000]
    );
    for pair in workers.windows(2) {
        let of = |i: usize, key: &str| pair[i][key].as_f64().unwrap();
        assert!(of(1, "traffic_bytes") >= of(0, "traffic_bytes"), "{plan}");
        // The coordinator's time for the last result of each worker grows with the workers, by a millisecond here.
        assert!(of(1, "seconds") <= of(0, "seconds") + 0.05, "{plan}");
    }
}

#[test]
fn without_a_target_the_budget_is_planned_for() {
    let (code, stdout, _) = run(&["plan", "configs/furnace.toml", "--json", "--paths", "12345"]);
    let plan: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, plan["paths"].as_u64(), plan["ending"].is_null()), (0, Some(12_345), true));
}

#[test]
fn a_budget_that_will_not_do_is_said() {
    let (code, stdout, _) =
        run(&["plan", "configs/cube54.toml", "--paths", "20000", "--set", "target.relative_error=0.01"]);
    assert_eq!(code, 0);
    assert!(
        stdout.contains("the budget of 20.0 k paths ends the run before") && stdout.contains("--paths"),
        "{stdout}"
    );
}

#[test]
fn a_plan_for_workers_names_the_chains_that_suit_them() {
    let args = ["plan", "configs/cube54.toml", "--paths", "1000000", "--set", "method.walk=jacobi"];
    let plan = |workers: &str| -> Value {
        let (code, stdout, stderr) = run(&[&args[..], &["--json", "--workers", workers]].concat());
        assert_eq!(code, 0, "{stderr}");
        serde_json::from_str(&stdout).unwrap()
    };
    let of = |workers: &str| plan(workers)["chains"]["best"].clone();
    assert_eq!(of("64"), serde_json::json!({"workers": 64, "chains": 64, "batch_paths": 15_625}));
    // A chain has 32 rays per patch at least, whatever the workers.
    assert_eq!(of("100000")["chains"], 1_000_000 / (32 * 54));
    let plan = plan("2");
    assert_eq!(plan["chains"]["now"], plan["chains"]["best"]);
    assert_eq!(plan["workers"].as_array().unwrap().len(), 1);
}

#[test]
fn a_run_says_that_workers_have_no_chain_and_what_would_give_them_one() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let args =
        ["run", "configs/cube54.toml", "--paths", "80000", "--set", "method.walk=jacobi", "--workers", "10"];
    let (_, _, stderr) = run(&[&args[..], &["--out", out.to_str().unwrap()]].concat());
    assert!(stderr.contains("2 of 10 workers will have nothing to do: the job has 8 chains"), "{stderr}");
    assert!(stderr.contains("batch_paths = 8000 in [method] 10 workers would have one"), "{stderr}");
}

/// Bytes are written with a space before their unit, however few they are.
#[test]
fn units_stand_apart_from_numbers() {
    let (code, stdout, stderr) = run(&["plan", "tests/data/cube54.toml", "--paths", "20000"]);
    assert_eq!(code, 0, "{stderr}");
    let joined = |word: &&str| word.ends_with('B') && word.len() > 2;
    assert_eq!(stdout.split([' ', ',', '\n']).find(joined), None, "{stdout}");
}
