//! Tests of `radwalk run` and its processes: the bytes do not depend on what happens to the workers.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use crate::support::{
    TABLES, answer, children, columns, draw_job, finish, numbers, path, radwalk, run, run_job, signal,
    summary, wait_for,
};
use tempfile::tempdir;

#[test]
fn workers_threads_streams_and_index_leave_no_trace_in_the_answer() {
    let folder = tempdir().unwrap();
    let job = "tests/data/cube54.toml";
    let base = path(&folder, "base");
    let first = run_job(job, &base, &["--workers", "1", "--paths", "300000"]);
    assert_eq!(first["paths"], 300_000);
    assert_eq!(first["workers_seen"], 1);
    let variants: &[&[&str]] = &[
        &["--workers", "2"],
        &["--workers", "3", "--set", "budget.stream_paths=1000"],
        &["--workers", "7", "--set", "budget.stream_paths=4097"],
        &["--workers", "1", "--threads", "2"],
        &["--workers", "2", "--threads", "2", "--set", "budget.stream_paths=300000"],
        &["--workers", "1", "--set", "confidence=0.95"],
    ];
    for (i, variant) in variants.iter().enumerate() {
        let out = path(&folder, &format!("variant{i}"));
        run_job(job, &out, &[&["--paths", "300000"], *variant].concat());
        assert!(answer(&out) == answer(&base), "{variant:?} changed the answer");
    }
    let other = path(&folder, "other");
    run_job(job, &other, &["--paths", "300000", "--seed", "77"]);
    assert!(answer(&other) != answer(&base), "another seed gives another answer");
}

#[test]
fn every_method_gives_the_same_answer_on_any_cluster() {
    let folder = tempdir().unwrap();
    let methods: &[&[&str]] = &[
        &["method.estimator=absorption"],
        &["method.estimator=survival", "method.space=continuous"],
        &["method.estimator=infinite"],
        &["method.estimator=infinite", "method.infinite.end=cutoff"],
        &["method.walk=gathering"],
        &["method.walk=gathering", "method.estimator=infinite", "method.birth=uniform"],
        &["method.walk=gathering", "method.estimator=absorption", "method.birth={ patches = [0, 30] }"],
    ];
    for (i, method) in methods.iter().enumerate() {
        let set: Vec<&str> = method.iter().flat_map(|key| ["--set", key]).collect();
        let (one, three) = (path(&folder, &format!("one{i}")), path(&folder, &format!("three{i}")));
        let job = "tests/data/cube54.toml";
        run_job(job, &one, &[&set[..], &["--paths", "100000", "--workers", "1"]].concat());
        let split = ["--paths", "100000", "--workers", "3", "--set", "budget.stream_paths=3001"];
        let summary = run_job(job, &three, &[&set[..], &split].concat());
        assert!(answer(&one) == answer(&three), "{method:?}: the cluster changed the answer");
        let table = columns(&one.join("patches.csv"));
        let unsampled = table["flags"].iter().filter(|flags| flags.contains("unsampled")).count();
        assert_eq!(unsampled, if method.len() == 3 && i == 6 { 52 } else { 0 }, "{method:?}");
        assert_eq!(table.contains_key("bias_bound"), i == 3, "{method:?}");
        let energy = &summary["energy"];
        let part = |name: &str| energy[name].as_f64().unwrap();
        assert!((part("emitted") - part("absorbed") - part("escaped")).abs() <= 1e-9 * part("emitted"));
    }
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_the_answer() {
    let folder = tempdir().unwrap();
    let job = ["run", "configs/cornell.toml", "--paths", "3000000", "--workers", "3", "--quiet", "--out"];
    let calm = path(&folder, "calm");
    let (code, _, stderr) = run(&[&job[..], &[calm.to_str().unwrap()], &TABLES].concat());
    assert_eq!(code, 0, "{stderr}");

    let stormy = path(&folder, "stormy");
    let child = radwalk()
        .args(job)
        .arg(&stormy)
        .args(TABLES)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let coordinator = child.id();
    let mut state = 12_345_u64;
    for _ in 0..12 {
        let workers = children(coordinator);
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        if let Some(&victim) = workers.get((state >> 33) as usize % workers.len().max(1)) {
            signal("KILL", victim);
        }
        std::thread::sleep(std::time::Duration::from_millis(60 + (state >> 57)));
    }
    let (code, ..) = finish(child);
    assert_eq!(code, 0);
    let summary = summary(&stormy);
    assert!(summary["workers_lost"].as_u64().unwrap() > 0, "the storm must have hit some worker: {summary}");
    assert!(answer(&stormy) == answer(&calm), "deaths changed the answer");
}

/// A stopped worker says nothing and keeps its connection. Before it is given up for its silence, its leases are late
/// and go to other workers, too, so that it does not hold up the end.
#[test]
fn a_worker_that_hangs_is_done_without() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let job = ["run", "tests/data/cube54.toml", "--paths", "30000000", "--workers", "2", "--quiet", "--out"];
    let child = radwalk()
        .args(job)
        .arg(&out)
        .args(TABLES)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let workers = wait_for("two workers", || Some(children(child.id())).filter(|list| list.len() == 2));
    std::thread::sleep(std::time::Duration::from_millis(700));
    signal("STOP", workers[0]);
    let (code, ..) = finish(child);
    assert_eq!(code, 0);
    let held = summary(&out);
    assert!(held["streams_reissued"].as_u64().unwrap() > 0, "it held leases: {held}");
    let straight = path(&folder, "straight");
    run_job("tests/data/cube54.toml", &straight, &["--paths", "30000000"]);
    assert!(answer(&out) == answer(&straight));
    wait_for("the end of the hanging worker", || (!alive(workers[0])).then_some(()));
}

fn alive(pid: u32) -> bool {
    let state = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    !state.is_empty() && !state.contains(") Z ")
}

#[test]
fn a_signal_ends_a_run_in_good_order_with_a_prefix() {
    for name in ["INT", "TERM"] {
        let folder = tempdir().unwrap();
        let out = path(&folder, "out");
        let job =
            ["run", "tests/data/cube54.toml", "--paths", "100000000000", "--workers", "2", "--json", "--out"];
        let child = radwalk()
            .args(job)
            .arg(&out)
            .args(TABLES)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let workers = wait_for("two workers", || Some(children(child.id())).filter(|list| list.len() == 2));
        std::thread::sleep(std::time::Duration::from_millis(700));
        signal(name, child.id());
        let (code, ..) = finish(child);
        assert_eq!(code, 130, "SIG{name}");
        assert!(workers.iter().all(|&worker| !alive(worker)), "workers are taken down");
        let paths = summary(&out)["paths"].as_u64().unwrap();
        assert!(paths > 0 && paths < 100_000_000_000);
        let straight = path(&folder, "straight");
        run_job("tests/data/cube54.toml", &straight, &["--paths", &paths.to_string()]);
        assert!(answer(&out) == answer(&straight), "what is reported is walks 0 … {paths} − 1");
    }
}

#[test]
fn workers_outlive_no_coordinator() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let job =
        ["run", "tests/data/cube54.toml", "--paths", "100000000000", "--workers", "2", "--quiet", "--out"];
    let mut child = radwalk()
        .args(job)
        .arg(&out)
        .args(TABLES)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let workers = wait_for("two workers", || Some(children(child.id())).filter(|list| list.len() == 2));
    child.kill().unwrap();
    child.wait().unwrap();
    wait_for("the end of the workers", || workers.iter().all(|&worker| !alive(worker)).then_some(()));
}

#[test]
fn separate_coordinator_and_workers_give_the_same_answer() {
    let folder = tempdir().unwrap();
    let (out, access) = (path(&folder, "out"), path(&folder, "access.json"));
    let coordinator = radwalk()
        .args([
            "coordinate",
            "tests/data/cube54.toml",
            "--paths",
            "500000",
            "--quiet",
            "--listen",
            "127.0.0.1:0",
        ])
        .args(TABLES)
        .arg("--out")
        .arg(&out)
        .arg("--access")
        .arg(&access)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for("the access file", || access.exists().then_some(()));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        assert_eq!(std::fs::metadata(&access).unwrap().permissions().mode() & 0o777, 0o600);
    }
    let workers: Vec<_> = (0..2)
        .map(|_| {
            radwalk()
                .args(["work", "--threads", "2", "--access"])
                .arg(&access)
                .stderr(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()
                .unwrap()
        })
        .collect();
    for worker in workers {
        let (code, _, stderr) = finish(worker);
        // A worker that came when everything was done is told so; one that came later finds no coordinator.
        assert!(code == 0 || stderr.contains("cannot reach"), "{code} {stderr}");
    }
    let (code, _, stderr) = finish(coordinator);
    assert_eq!(code, 0, "{stderr}");
    assert!(!access.exists(), "the key is removed when it is of no use any more");
    let straight = path(&folder, "straight");
    run_job("tests/data/cube54.toml", &straight, &["--paths", "500000"]);
    assert!(answer(&out) == answer(&straight));
}

#[test]
fn a_worker_that_a_launcher_started_waits_for_the_access_file_and_tells_its_rank() {
    let folder = tempdir().unwrap();
    let (out, access) = (path(&folder, "out"), path(&folder, "access.json"));
    let mut worker = radwalk();
    worker.env("SLURM_JOB_ID", "7").env("SLURM_PROCID", "2").env("SLURM_NTASKS", "4");
    let mut worker = worker.args(["work", "--access"]).arg(&access).stderr(Stdio::piped()).spawn().unwrap();
    let mut words = String::new();
    BufReader::new(worker.stderr.as_mut().unwrap()).read_line(&mut words).unwrap();
    assert!(words.contains("access.json") && words.contains("waiting"), "{words}");
    let mut coordinator = radwalk();
    coordinator.args(["coordinate", "tests/data/cube54.toml", "--paths", "100000", "--quiet"]).args(TABLES);
    coordinator.args(["--listen", "127.0.0.1:0", "--out"]).arg(&out).arg("--access").arg(&access);
    let (code, _, stderr) = finish(coordinator.stderr(Stdio::piped()).spawn().unwrap());
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(finish(worker).0, 0);
    let workers = &summary(&out)["provenance"]["workers"];
    assert!(workers[0]["name"].as_str().unwrap().contains("Slurm 7 rank 2/4 at"), "{workers}");
}

#[test]
fn a_worker_that_is_told_to_end_says_so_and_leaves() {
    let folder = tempdir().unwrap();
    let (out, access) = (path(&folder, "out"), path(&folder, "access.json"));
    let mut coordinator = radwalk();
    coordinator.args(["coordinate", "tests/data/cube54.toml", "--paths", "10000000", "--json"]).args(TABLES);
    coordinator.args(["--listen", "127.0.0.1:0", "--out"]).arg(&out).arg("--access").arg(&access);
    let mut coordinator = coordinator.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(coordinator.stderr.take().unwrap()).lines();
    let mut hear = |words: &str| lines.find(|line| line.as_ref().unwrap().contains(words)).unwrap().unwrap();
    hear("listening");
    let work = || {
        let mut worker = radwalk();
        worker.args(["work", "--quiet", "--access"]).arg(&access).spawn().unwrap()
    };
    let leaver = work();
    hear("\"workers\":1");
    signal("TERM", leaver.id());
    assert_eq!(finish(leaver).0, 130);
    assert!(hear(" left, as it was told to").contains("worker"));
    let other = work();
    assert_eq!(finish(other).0, 0);
    hear("done");
    assert!(coordinator.wait().unwrap().success());
    assert_eq!(summary(&out)["workers_lost"], 1);
    let straight = path(&folder, "straight");
    run_job("tests/data/cube54.toml", &straight, &["--paths", "10000000"]);
    assert!(answer(&out) == answer(&straight));
}

#[test]
fn a_run_leaves_the_files_of_the_format() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let summary = draw_job("configs/furnace.toml", &out, &["--paths", "200000"]);
    let energy = &summary["energy"];
    assert_eq!(energy["emitted"], 200_000);
    assert_eq!(
        energy["emitted"].as_u64().unwrap(),
        energy["absorbed"].as_u64().unwrap() + energy["escaped"].as_u64().unwrap()
    );
    assert_eq!(summary["escaped"], 0);
    assert_eq!(summary["absorbed_back"], 0);
    for file in ["tally.bin", "patches.csv", "summary.json", "radiosity.png"] {
        assert!(std::fs::metadata(out.join(file)).unwrap().len() > 100, "{file}");
    }
    let table = columns(&out.join("patches.csv"));
    let patches = table["patch"].len();
    assert_eq!(summary["model"]["patches"], patches);
    // B = E/(1 − R) on all patches, whatever their shape. The sum over all is good to 0.1 %.
    let (b, e, r) =
        (numbers(&table["radiosity"]), numbers(&table["emittance"]), numbers(&table["reflectance"]));
    let areas = numbers(&table["area"]);
    let mean = b.iter().zip(&areas).map(|(b, a)| a * b).sum::<f64>() / areas.iter().sum::<f64>();
    let truth = e[0] / (1.0 - r[0]);
    assert!((mean / truth - 1.0).abs() < 0.01, "{mean} for {truth}");
    let (low, high) = (numbers(&table["ci_low"]), numbers(&table["ci_high"]));
    let covered = low.iter().zip(&high).filter(|(low, high)| (**low..=**high).contains(&truth)).count();
    // Binomial(256, 0.95): fewer than 90 % has a probability below 10⁻³ for this seed, once and for all.
    assert!(covered as f64 >= 0.9 * patches as f64, "{covered} of {patches} intervals cover");
}

#[test]
fn a_target_ends_a_run_at_a_look_and_sets_the_exit_code() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let target = ["--set", "target.relative_error=0.05", "--set", "target.fraction=0.9"];
    let reached = run_job("tests/data/cube54.toml", &out, &[&target[..], &["--workers", "3"]].concat());
    assert_eq!(reached["target"]["reached"], true);
    let paths = reached["paths"].as_u64().unwrap();
    let power = 1 << paths.ilog2();
    assert!(paths == power || paths == power + power / 2, "{paths} is a look of the ladder");
    let again = path(&folder, "again");
    run_job(
        "tests/data/cube54.toml",
        &again,
        &[&target[..], &["--workers", "1", "--set", "budget.stream_paths=999"]].concat(),
    );
    assert!(answer(&again) == answer(&out), "the look does not depend on the cluster");

    let missed = path(&folder, "missed");
    let args = [
        "run",
        "tests/data/cube54.toml",
        "--quiet",
        "--paths",
        "2000",
        "--set",
        "target.relative_error=0.0001",
        "--out",
    ];
    let (code, ..) = run(&[&args[..], &[missed.to_str().unwrap()]].concat());
    assert_eq!(code, 1);
    assert_eq!(summary(&missed)["target"]["reached"], false);
}

#[test]
fn a_wall_clock_limit_ends_a_run() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let args = ["--paths", "100000000000", "--set", "budget.wall_seconds=1"];
    let summary = run_job("tests/data/cube54.toml", &out, &args);
    assert!(summary["paths"].as_u64().unwrap() > 0);
}

#[test]
fn exact_agrees_with_a_run() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    run_job("tests/data/cube54.toml", &out, &["--paths", "1000000"]);
    let (code, _, stderr) = run(&["exact", "tests/data/cube54.toml", "--out", out.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let (table, exact) = (columns(&out.join("patches.csv")), columns(&out.join("exact.csv")));
    let (b, error, h) =
        (numbers(&table["radiosity"]), numbers(&table["std_error"]), numbers(&table["irradiance"]));
    let (truth, true_h) = (numbers(&exact["radiosity"]), numbers(&exact["irradiance"]));
    assert!(exact["var_gather_infinite"].iter().all(|variance| !variance.is_empty()));
    let variance = numbers(&exact["var_shoot_collision"]);
    for i in 0..54 {
        // 54 z-scores at 5 σ: false-alarm rate 3·10⁻⁵ for this seed, once and for all.
        assert!(((b[i] - truth[i]) / error[i]).abs() < 5.0, "patch {i}: {} for {}", b[i], truth[i]);
        assert!((h[i] / true_h[i] - 1.0).abs() < 0.05);
        let predicted = (variance[i] / 1e6).sqrt();
        assert!((error[i] / predicted - 1.0).abs() < 0.05, "patch {i}: error {} for {predicted}", error[i]);
    }
}

#[test]
fn threads_that_share_chains_leave_no_trace_in_the_answer() {
    let folder = tempdir().unwrap();
    let chains = |name: &str, workers: &[&str]| {
        let out = path(&folder, name);
        let job = ["--paths", "2000000", "--set", "method.walk=jacobi", "--set", "method.batch_paths=250000"];
        run_job("tests/data/cube54.toml", &out, &[&job, workers].concat());
        answer(&out)
    };
    let alone = chains("alone", &["--workers", "1"]);
    assert!(chains("one", &["--workers", "1", "--threads", "16"]) == alone, "more threads than chains");
    assert!(chains("two", &["--workers", "2", "--threads", "3"]) == alone, "threads that join at the end");
}

/// A dark floor of `n` by `n` wavy quadrilaterals below a lamp, of two triangles each, as a mesh.
fn wavy_floor(n: usize) -> String {
    let height = |i: usize, j: usize| 0.05 * ((i as f64).sin() + (j as f64).cos());
    let corners = (0..=n).flat_map(|i| (0..=n).map(move |j| [i, j]));
    let mut mesh: String = corners.map(|[i, j]| format!("v {i} {j} {}\n", height(i, j))).collect();
    let number = |i: usize, j: usize| 1 + i * (n + 1) + j;
    for [i, j] in (0..n).flat_map(|i| (0..n).map(move |j| [i, j])) {
        let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
        mesh += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    mesh + &format!("v 0 0 9\nv 0 {n} 9\nv {n} {n} 9\nv {n} 0 9\nusemtl lamp\nf -4 -3 -2 -1\n")
}

/// A scene of over 64 MB is there once: its worker is a part of the run, which a signal ends in good order, too.
#[test]
fn a_large_scene_is_walked_by_the_run_itself_with_the_same_answer() {
    let folder = tempdir().unwrap();
    let (mesh, out) = (path(&folder, "floor.obj"), |name| path(&folder, name));
    std::fs::write(&mesh, wavy_floor(220)).unwrap();
    let walk = |name, paths: &str, more: &[&str]| {
        let lamp = ["--light", "lamp=1000W", "--set", "import.material.lamp.sides=2"];
        let given = ["--set", "scene.patches=\"given\"", "--quiet", "--paths", paths];
        let mut run = radwalk();
        run.arg("run").arg(&mesh).args(lamp).args(given).args(more).args(TABLES).arg("--out").arg(out(name));
        run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let alone = walk("alone", "100000000000", &[]);
    wait_for("the first walks", || {
        assert!(children(alone.id()).is_empty(), "a process of its own has a scene of its own");
        let status = std::fs::read(out("alone").join("status.json")).ok()?;
        let status: serde_json::Value = serde_json::from_slice(&status).ok()?;
        status["paths"].as_u64().filter(|&paths| paths > 0)
    });
    signal("INT", alone.id());
    assert_eq!(finish(alone).0, 130);
    let paths = summary(&out("alone"))["paths"].as_u64().unwrap();
    assert!(paths > 0 && summary(&out("alone"))["workers_seen"] == 1);
    let with_a_child = walk("child", &paths.to_string(), &["--workers", "1"]);
    wait_for("the worker", || Some(children(with_a_child.id())).filter(|list| list.len() == 1));
    assert_eq!(finish(with_a_child).0, 0);
    assert!(answer(&out("alone")) == answer(&out("child")), "of walks 0 … {paths} − 1");
}
