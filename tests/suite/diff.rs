//! Tests of `radwalk diff`, which compares results.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{path, run, run_job};

const JOB: &str = "tests/data/cube54.toml";

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

/// Jobs that differ are said to, before any number; and the exact solution may be given as its table.
#[test]
fn differences_of_jobs_come_first() {
    let folder = tempdir().unwrap();
    let [a, b, exact] = ["a", "b", "exact"].map(|name| path(&folder, name));
    run_job(JOB, &a, &["--paths", "200000", "--seed", "1"]);
    run_job(JOB, &b, &["--paths", "200000", "--seed", "1", "--set", "method.space=continuous"]);
    assert_eq!(run(&["exact", JOB, "--quiet", "--out", exact.to_str().unwrap()]).0, 0);
    let (_, stdout, _) = diff(&a, &b, &[]);
    let first = stdout.lines().next().unwrap();
    assert!(first.starts_with("the jobs differ in space: discrete against continuous"), "{stdout}");
    assert!(stdout.contains("the jobs share the seed 1; walks of one seed"), "{stdout}");
    // Nine patches a wall: the error of discretisation is beyond chance at 200 times the walks.
    let many = path(&folder, "many");
    run_job(JOB, &many, &["--paths", "8000000", "--seed", "2", "--set", "method.space=continuous"]);
    let table = exact.join("exact.csv");
    let (code, stdout, stderr) = diff(&many, &table, &[]);
    assert_eq!(code, 3, "{stdout}");
    assert!(stdout.starts_with("the jobs differ in space: continuous against discrete"), "{stdout}");
    assert!(stderr.contains("jobs that differ in space have other answers"), "{stderr}");
    let (code, stdout, _) = diff(&a, &table, &["--json"]);
    let found: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, &found["agree"], &found["jobs"][0]["subject"]), (0, &true.into(), &"method".into()));
    // What was cut off is too dark.
    let short = path(&folder, "short");
    let cutoff =
        ["--set", "method.estimator=infinite", "--set", "method.infinite={end=\"cutoff\",threshold=0.3}"];
    run_job(JOB, &short, &[&["--paths", "200000"], &cutoff[..]].concat());
    let (_, stdout, _) = diff(&short, &table, &[]);
    assert!(
        stdout.starts_with("the jobs differ in end: Cutoff { threshold: 0.3 } against no walk is cut off"),
        "{stdout}"
    );
    // Other scenes, and other patches.
    let [dim, other] = ["dim", "other"].map(|name| path(&folder, name));
    let scene = std::fs::read_to_string("configs/scenes/cube54.toml").unwrap();
    std::fs::write(folder.path().join("dim.toml"), scene.replace("reflectance = 0.3", "reflectance = 0.25"))
        .unwrap();
    let dimmed = folder.path().join("dim.toml");
    run_job(
        dimmed.to_str().unwrap(),
        &dim,
        &["--paths", "200000", "--seed", "3", "--set", "method.walk=shooting"],
    );
    let (_, stdout, _) = diff(&a, &dim, &[]);
    assert!(stdout.starts_with("the jobs differ in scene: hash "), "{stdout}");
    run_job("configs/cube6-r90.toml", &other, &["--paths", "3000"]);
    let (code, _, stderr) = diff(&a, &other, &[]);
    assert!(code == 2 && stderr.contains("scene: hash "), "{stderr}");
}

/// Mixtures of the same walks differ by their factors and by no chance; those of other walks have the differences of chance, too.
#[test]
fn mixtures_are_compared_as_mixtures() {
    let folder = tempdir().unwrap();
    let [out, other, dimmed, again] = ["out", "other", "dimmed", "again"].map(|name| path(&folder, name));
    let lamps = "configs/lamps.toml";
    run_job(lamps, &out, &["--paths", "100000"]);
    run_job(lamps, &other, &["--paths", "100000", "--seed", "9"]);
    let combine = |from: &Path, to: &Path, left: &str| {
        let (from, to) = (from.to_str().unwrap(), to.to_str().unwrap());
        let done = run(&["combine", from, "--set", left, "--out", to, "--quiet", "--force"]);
        assert_eq!(done.0, 0, "{done:?}");
    };
    combine(&out, &dimmed, "left=0.25");
    combine(&out, &again, "left=1");
    let (code, stdout, stderr) = diff(&out, &dimmed, &[]);
    assert_eq!(code, 3, "{stdout}");
    assert!(stdout.starts_with("the jobs differ in sources: as written against left × 0.25"), "{stdout}");
    assert!(
        stdout.contains("differs by no chance") && !stdout.contains("the tallies are the same"),
        "{stdout}"
    );
    assert!(!stdout.contains("standard errors") && stderr.contains("differ in sources"), "{stdout}{stderr}");
    let (code, stdout, _) = diff(&out, &again, &[]);
    assert!(code == 0 && stdout.contains("the same, to the last bit"), "{stdout}");
    // The same mixture of other walks agrees (a false alarm once in 1,000).
    combine(&other, &again, "left=0.25");
    let (code, stdout, _) = diff(&dimmed, &again, &[]);
    assert!(code == 0 && stdout.starts_with("the jobs differ in seed: 42 against 9"), "{stdout}");
    // A table that is not made from the tally beside it.
    let table = std::fs::read_to_string(again.join("patches.csv")).unwrap();
    std::fs::write(other.join("patches.csv"), table).unwrap();
    let copy = path(&folder, "copy");
    run_job(lamps, &copy, &["--paths", "100000", "--seed", "9"]);
    let (code, stdout, _) = diff(&copy, &other, &[]);
    assert!(code == 3 && stdout.contains("not made from the tally beside it"), "{stdout}");
}

/// Green light of a corridor that is red but for little, far from its lamp: many walks arrive, and few of them with much green. Such patches are left out as rare. Of
/// 20 comparisons of Sobol batches with a long run at most one raises an alarm (two have a probability of 2·10⁻⁴); 48 of 60 did when hits were counted.
#[test]
fn batches_whose_walks_weigh_unequally_are_not_trusted() {
    let folder = tempdir().unwrap();
    let wall = |name: &str, quad: &str, patches: &str| {
        format!("[[surface]]\nname = \"{name}\"\nmaterial = \"wall\"\nquad = {quad}\npatches = {patches}\n")
    };
    let surfaces = [
        wall("floor", "[[0,0,0], [5,0,0], [0,1,0]]", "[10, 1]"),
        wall("ceiling", "[[0,0,1], [0,1,1], [5,0,1]]", "[1, 10]"),
        wall("lamp", "[[0,0,0], [0,1,0], [0,0,1]]", "[1, 1]").replace("\"wall\"", "\"light\""),
        wall("end", "[[5,0,0], [5,0,1], [5,1,0]]", "[2, 2]"),
        wall("south", "[[0,0,0], [0,0,1], [5,0,0]]", "[1, 10]"),
        wall("north", "[[0,1,0], [5,1,0], [0,1,1]]", "[10, 1]"),
    ];
    let materials = "[material.wall]\nreflectance = [0.9, 0.1, 0.1]\n[material.light]\nreflectance = 0.0\nemittance = 1.0\n";
    std::fs::write(folder.path().join("scene.toml"), [materials, &surfaces.concat()].concat()).unwrap();
    let job = path(&folder, "job.toml");
    let text = "scene = \"scene.toml\"\n[method]\nwalk = \"shooting\"\nbasis = \"constant\"\n[budget]\npaths = 2000\n";
    std::fs::write(&job, text).unwrap();
    let (job, reference) = (job.to_str().unwrap(), path(&folder, "reference"));
    run_job(job, &reference, &["--paths", "3000000", "--seed", "77"]);
    let mut alarms = Vec::new();
    for seed in 1..=20 {
        let out = path(&folder, &seed.to_string());
        run_job(job, &out, &["--seed", &seed.to_string(), "--set", "method.sampler=sobol"]);
        let (code, stdout, stderr) = diff(&out, &reference, &[]);
        match code {
            0 => {}
            3 => alarms.push(stdout),
            _ => panic!("{stderr}"),
        }
    }
    assert!(alarms.len() < 2, "{}: {}", alarms.len(), alarms[0]);
}
