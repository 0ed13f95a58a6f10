//! Tests of `walk = "jacobi"` on a cluster: the bytes do not depend on what happens to the workers.

use std::process::Stdio;

use crate::support::{
    TABLES, answer, columns, finish, kill_until_done, numbers, path, radwalk, run, run_job, signal,
    storms_leave_no_trace, summary,
};
use tempfile::tempdir;

const CUBE: &str = "tests/data/cube54.toml";
const JACOBI: [&str; 2] = ["--set", "method.walk=jacobi"];

#[test]
fn workers_and_threads_leave_no_trace_in_the_answer() {
    let folder = tempdir().unwrap();
    let base = path(&folder, "base");
    let job = [&JACOBI[..], &["--paths", "200000"]].concat();
    let first = run_job(CUBE, &base, &[&job[..], &["--workers", "1"]].concat());
    let [walk, sampler] = ["walk", "sampler"].map(|key| first[key].as_str().unwrap().to_owned());
    assert_eq!((walk.as_str(), sampler.as_str()), ("jacobi", "sobol"));
    assert_eq!(
        (&first["paths"], &first["rays"], &first["streams"]),
        (&200_000.into(), &200_000.into(), &8.into())
    );
    let variants: &[&[&str]] = &[
        &["--workers", "2"],
        &["--workers", "5"],
        &["--workers", "2", "--threads", "3", "--set", "budget.stream_paths=7"],
        &["--workers", "1", "--set", "method.batch_paths=25000"],
        &["--workers", "2", "--set", "method.walk=auto"],
    ];
    for (i, variant) in variants.iter().enumerate() {
        let out = path(&folder, &format!("variant{i}"));
        run_job(CUBE, &out, &[&job[..], *variant].concat());
        assert!(answer(&out) == answer(&base), "{variant:?} changed the answer");
    }
    for (i, variant) in [["--seed", "77"], ["--set", "method.batch_paths=20000"]].iter().enumerate() {
        let out = path(&folder, &format!("other{i}"));
        run_job(CUBE, &out, &[&job[..], variant].concat());
        assert!(answer(&out) != answer(&base), "{variant:?} is another answer");
    }
}

/// Tests BS §4's own iterations, in grey and in colour, with both kinds of numbers.
#[test]
fn workers_leave_no_trace_in_iterations() {
    let folder = tempdir().unwrap();
    let coloured = folder.path().join("coloured.toml");
    let scene = "[material.w]\nreflectance = [0.8, 0.5, 0.2]\n[material.lamp]\nreflectance = 0.1\nemittance = [1, 2, 3]\n\
                 [[surface]]\nmaterial = \"w\"\nquad = [[0,0,0],[1,0,0],[0,1,0]]\npatches = [2, 2]\n\
                 [[surface]]\nmaterial = \"lamp\"\nquad = [[0,0,1],[0,1,1],[1,0,1]]\n";
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    std::fs::write(&coloured, "scene = \"s.toml\"\n[budget]\npaths = 700001\n").unwrap();
    let iterations = [&JACOBI[..], &["--set", "method.jacobi.solve=iterations"]].concat();
    for (job, set) in [
        (CUBE, &["--paths", "500000"][..]),
        (CUBE, &["--paths", "500000", "--set", "method.sampler=sobol"]),
        (coloured.to_str().unwrap(), &[]),
    ] {
        let answers = ["1", "2", "5"].map(|workers| {
            let out = path(&folder, &format!("{workers}-{}", set.join("-")));
            let summary = run_job(job, &out, &[&iterations[..], set, &["--workers", workers]].concat());
            let kind = summary["model"]["jacobi"].as_str().unwrap();
            assert!(kind.contains("8 regular ones") && kind.contains("births"), "{kind}");
            assert!(
                summary["checks"].as_array().unwrap().iter().all(|check| check["ok"] != false),
                "{summary}"
            );
            answer(&out)
        });
        assert!(answers.iter().all(|answer| *answer == answers[0]), "{job} {set:?}");
    }
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_the_answer() {
    let links = ["--paths", "2400000", "--set", "method.batch_paths=100000", "--set", "method.basis=linear"];
    storms_leave_no_trace("configs/cornell.toml", &[&JACOBI[..], &links].concat());
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_iterations() {
    let iterations = ["--set", "method.jacobi.solve=iterations", "--set", "method.batch_paths=60000"];
    storms_leave_no_trace(CUBE, &[&JACOBI[..], &iterations, &["--paths", "12000000"]].concat());
}

/// A chain takes long; a run must still end when it is asked to, with the chains that are in.
#[test]
fn a_signal_ends_a_run_in_mid_chain() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let job = [&["run", CUBE][..], &JACOBI, &["--paths", "100000000000", "--quiet", "--out"]].concat();
    let child = radwalk()
        .args(job)
        .arg(&out)
        .args(TABLES)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    let asked = std::time::Instant::now();
    signal("INT", child.id());
    let (code, ..) = finish(child);
    assert_eq!(code, 130);
    assert!(asked.elapsed().as_secs() < 10, "a chain was waited for");
}

/// Chains that are in survive any number of deaths of the coordinator; the others are shot again.
#[test]
fn chains_outlive_their_coordinator() {
    let folder = tempdir().unwrap();
    let (out, straight) = (path(&folder, "out"), path(&folder, "straight"));
    let job = [&JACOBI[..], &["--paths", "20000000", "--set", "method.batch_paths=50000"]].concat();
    let expected = run_job(CUBE, &straight, &job);
    let start = || {
        let args = ["run", CUBE, "--resume", "--quiet", "--set", "budget.checkpoint_seconds=0.02", "--out"];
        let mut command = radwalk();
        command.args(args).arg(&out).args(["--workers", "2"]).args(TABLES).args(&job);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let pause = |killed| std::time::Duration::from_millis(300 + 50 * killed);
    let killed = kill_until_done(start, pause, 100);
    assert!(answer(&out) == answer(&straight), "after {killed} deaths");
    let resumed = summary(&out);
    assert_eq!(resumed["paths"], expected["paths"]);
    let workers = resumed["provenance"]["workers"].as_array().unwrap();
    let paths: u64 = workers.iter().map(|worker| worker["paths"].as_u64().unwrap()).sum();
    assert_eq!(paths, 20_000_000, "the ledger has every ray once");
}

#[test]
fn chains_are_extended_merged_and_audited() {
    let folder = tempdir().unwrap();
    let [straight, head, tail, merged] =
        ["straight", "head", "tail", "merged"].map(|name| path(&folder, name));
    let job = [&JACOBI[..], &["--set", "method.batch_paths=5000"]].concat();
    run_job(CUBE, &straight, &[&job[..], &["--paths", "120000"]].concat());
    run_job(CUBE, &head, &[&job[..], &["--paths", "60000"]].concat());
    run_job(CUBE, &tail, &[&job[..], &["--paths", "60000", "--set", "budget.first_path=60000"]].concat());
    let text = |path: &std::path::Path| path.to_str().unwrap().to_owned();
    let (code, _, stderr) = run(&["merge", &text(&tail), &text(&head), "--quiet", "--out", &text(&merged)]);
    assert_eq!(code, 0, "{stderr}");
    assert!(answer(&merged) == answer(&straight));
    let parts = &summary(&merged)["provenance"]["parts"];
    assert_eq!((&parts[0]["first_path"], &parts[0]["paths"]), (&0.into(), &120_000.into()), "{parts}");
    let (code, stdout, stderr) = run(&["audit", &text(&merged), "--share", "1"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("120000 of 120000 paths"), "{stdout}");
    run_job(CUBE, &head, &[&job[..], &["--paths", "120000", "--resume"]].concat());
    assert!(answer(&head) == answer(&straight));
    let (code, _, stderr) =
        run(&["merge", &text(&tail), &text(&straight), "--out", &text(&merged), "--force"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("would count twice"), "{stderr}");
    let other = path(&folder, "other");
    run_job(CUBE, &other, &[&JACOBI[..], &["--paths", "60000", "--set", "method.batch_paths=6000"]].concat());
    let (code, _, stderr) = run(&["merge", &text(&tail), &text(&other), "--out", &text(&merged), "--force"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("length of chains"), "{stderr}");
}

#[test]
fn chains_of_another_length_and_replays_are_refused() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    run_job(CUBE, &out, &[&JACOBI[..], &["--paths", "80000"]].concat());
    let before = std::fs::read(out.join("tally.bin")).unwrap();
    let resume = [&["run", CUBE, "--resume", "--out", out.to_str().unwrap()], &JACOBI[..]].concat();
    let (code, _, stderr) = run(&[&resume[..], &["--paths", "160000"]].concat());
    assert_eq!(code, 2);
    assert!(
        stderr.contains("batches of 10000 paths") && stderr.contains("method.batch_paths=10000"),
        "{stderr}"
    );
    for other in
        [&["--paths", "160000", "--seed", "9"][..], &["--paths", "80000", "--set", "budget.first_path=10000"]]
    {
        let (code, _, stderr) = run(&[&resume[..], other].concat());
        assert_eq!(code, 2);
        assert!(stderr.contains("those of another job"), "{stderr}");
    }
    let walks = ["run", CUBE, "--resume", "--paths", "80000", "--out", out.to_str().unwrap()];
    let (code, _, stderr) = run(&walks);
    assert_eq!(code, 2);
    assert!(stderr.contains("those of another job"), "{stderr}");
    assert!(std::fs::read(out.join("tally.bin")).unwrap() == before, "nothing was touched");
    let fewer = ["--paths", "80000", "--set", "method.batch_paths=10000", "--quiet"];
    assert_eq!(run(&[&resume[..], &fewer].concat()).0, 0, "there is nothing left to do");
    assert!(std::fs::read(out.join("tally.bin")).unwrap().len() >= before.len());
    let (code, _, stderr) =
        run(&[&["replay", CUBE, "--walk", "0", "--paths", "80000"], &JACOBI[..]].concat());
    assert_eq!(code, 2);
    assert!(stderr.contains("no walks to replay"), "{stderr}");
}

#[test]
fn the_files_are_those_of_the_format() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let summary = run_job(CUBE, &out, &[&JACOBI[..], &["--paths", "400000"]].concat());
    let table = columns(&out.join("patches.csv"));
    let hits: f64 = numbers(&table["hits"]).iter().sum();
    assert_eq!(hits, 300_000.0, "every ray lands in a closed scene, and one in four is a shadow ray");
    let energy = &summary["energy"];
    let part = |name: &str| energy[name].as_f64().unwrap();
    assert!((part("emitted") - 1.0 / 9.0).abs() < 1e-12 && part("escaped") == 0.0, "{energy}");
    assert_eq!(part("absorbed"), part("emitted"));
    assert!(summary["checks"].as_array().unwrap().iter().all(|check| check["ok"] != false), "{summary}");
    let (b, low, high) =
        (numbers(&table["radiosity"]), numbers(&table["ci_low"]), numbers(&table["ci_high"]));
    assert!((0..54).all(|i| low[i] <= b[i] && b[i] <= high[i]));
}

#[test]
fn too_few_rays_are_walked_and_said() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let summary = run_job(CUBE, &out, &[&JACOBI[..], &["--paths", "5000"]].concat());
    assert_eq!((&summary["walk"], &summary["paths"]), (&"shooting".into(), &5000.into()));
    let method = &summary["checks"][0];
    assert!(method["ok"] == false && method["message"].as_str().unwrap().contains("fell back"), "{method}");
}

#[test]
fn a_target_is_looked_at_chain_by_chain() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let target = ["--set", "target.relative_error=0.02", "--set", "target.fraction=0.9"];
    let chains = ["--paths", "4000000", "--set", "method.batch_paths=2000"];
    let summary = run_job(CUBE, &out, &[&JACOBI[..], &chains, &target].concat());
    assert_eq!(summary["target"]["reached"], true);
    let reached = summary["paths"].as_u64().unwrap() / 2000;
    let power = 1 << reached.ilog2();
    assert!(reached >= 8 && (reached == power || reached == power + power / 2), "{reached} chains");
    // A run that was stopped at the first look and resumed ends at the same chain. Resumed once more, it has nothing
    // left to do.
    let again = path(&folder, "again");
    let first = ["--paths", "16000", "--set", "method.batch_paths=2000", "--quiet", "--out"];
    let (code, ..) =
        run(&[&["run", CUBE], &JACOBI[..], &target, &first, &[again.to_str().unwrap()]].concat());
    assert_eq!(code, 1, "the target is missed");
    for _ in 0..2 {
        run_job(CUBE, &again, &[&JACOBI[..], &chains, &target, &["--resume"]].concat());
        assert!(answer(&again) == answer(&out));
    }
}

/// A cube of R = 0.999, of which a hole in a wall loses as much light as all walls absorb, by a ray or two of each chain: chains that lose none are too bright.
#[test]
fn chains_that_lose_much_light_by_few_rays_say_so() {
    let folder = tempdir().unwrap();
    let quad = |name: &str, material: &str, corners: &str| {
        format!(
            "[[surface]]\nname = \"{name}\"\nmaterial = \"{material}\"\nquad = [{corners}]\npatches = [2, 2]\n"
        )
    };
    let mut scene =
        "[material.w]\nreflectance = 0.999\n[material.lamp]\nreflectance = 0.999\nemittance = 1\n".to_owned();
    for (name, material, corners) in [
        ("floor", "w", "[0,0,0],[1,0,0],[0,1,0]"),
        ("ceiling", "lamp", "[0,0,1],[0,1,1],[1,0,1]"),
        ("west", "w", "[0,0,0],[0,1,0],[0,0,1]"),
        ("east", "w", "[1,0,0],[1,0,1],[1,1,0]"),
        ("south", "w", "[0,0,0],[0,0,1],[1,0,0]"),
        // A slit of 6 mm is left beside it.
        ("north", "w", "[0,1,0],[0.994,1,0],[0,1,1]"),
    ] {
        scene += &quad(name, material, corners);
    }
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    let job = folder.path().join("j.toml");
    std::fs::write(&job, "scene = \"s.toml\"\n[method]\nwalk = \"jacobi\"\n[budget]\npaths = 1\n").unwrap();
    let escape = |name: &str, paths: &str| {
        let summary = run_job(job.to_str().unwrap(), &path(&folder, name), &["--paths", paths]);
        let checks = summary["checks"].as_array().unwrap().clone();
        let check = checks.into_iter().find(|check| check["name"] == "escape").unwrap();
        (check["ok"].as_bool().unwrap(), check["message"].as_str().unwrap().to_owned())
    };
    let (few, told) = escape("few", "12000");
    assert!(!few && told.contains("left the scene by") && told.contains("of 8 chains"), "{told}");
    let (many, told) = escape("many", "4000000");
    assert!(many, "{told}");
}
