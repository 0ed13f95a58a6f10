//! Patches that are groups of a mesh's faces, end to end.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use tempfile::{TempDir, tempdir};

use crate::support::{answer, columns, draw_job, numbers, path, run, run_job, storms_leave_no_trace};

/// The inner sides of a unit cube as an OBJ, z up: every wall in 4 × 4 squares, the ceiling of material `lamp`.
fn cube() -> String {
    let mut obj = "mtllib cube.mtl\no Cube\n".to_owned();
    let mut vertices = 0;
    for wall in 0..6 {
        let (axis, far) = (wall / 2, wall % 2);
        writeln!(obj, "usemtl {}", if wall == 5 { "lamp" } else { "wall" }).unwrap();
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let mut ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            if far == 1 {
                ring.reverse();
            }
            for (u, v) in ring {
                let mut corner = [0.0; 3];
                corner[axis] = far as f64;
                corner[(axis + 1) % 3] = f64::from(u) / 4.0;
                corner[(axis + 2) % 3] = f64::from(v) / 4.0;
                writeln!(obj, "v {} {} {}", corner[0], corner[1], corner[2]).unwrap();
            }
            writeln!(obj, "f {} {} {} {}", vertices + 1, vertices + 2, vertices + 3, vertices + 4).unwrap();
            vertices += 4;
        }
    }
    obj
}

const JOB: &str = "scene = \"cube.obj\"\nseed = 3\n[import]\nup = \"z\"\nsides = 1\ngroup_size = 0.5\n\
    [method]\nwalk = \"shooting\"\n[budget]\npaths = 200_000\nstream_paths = 1024\n";

fn written() -> (TempDir, PathBuf) {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("cube.obj"), cube()).unwrap();
    let mtl = "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0.2 0.2 0.2\nKe 3 3 3\n";
    fs::write(folder.path().join("cube.mtl"), mtl).unwrap();
    let job = path(&folder, "cube.toml");
    fs::write(&job, JOB).unwrap();
    (folder, job)
}

/// 192 triangles make 24 patches: a quarter of every wall each. Every method agrees with the exact solution of these: 24 z-scores of
/// each of five methods at 5 σ, false-alarm rate 7·10⁻⁵, once and for all with this seed.
#[test]
fn every_walk_finds_the_light_of_groups() {
    let (folder, job) = written();
    let job = job.to_str().unwrap();
    let exact = path(&folder, "exact");
    let (code, said, error) = run(&["exact", job, "--out", exact.to_str().unwrap(), "--quiet"]);
    assert_eq!(code, 0, "{said}{error}");
    let truth = numbers(&columns(&exact.join("exact.csv"))["radiosity"]);
    assert_eq!(truth.len(), 24);
    for (name, keys) in [
        ("collision", &[][..]),
        ("absorption", &["method.estimator=absorption"]),
        ("gathering", &["method.walk=gathering", "budget.paths=1_000_000"]),
        ("sobol", &["method.sampler=sobol", "method.batch_paths=8192", "budget.paths=196608"]),
        ("jacobi", &["method.walk=jacobi", "budget.paths=400_000"]),
    ] {
        let out = path(&folder, name);
        let set: Vec<&str> = keys.iter().flat_map(|key| ["--set", *key]).collect();
        let summary = run_job(job, &out, &[&["--workers", "2"], &set[..]].concat());
        assert!(summary["import"].to_string().contains("192 faces are grouped in 24 patches"), "{summary}");
        let table = columns(&out.join("patches.csv"));
        let column = |name: &str| numbers(&table[name]);
        assert!(column("area").iter().all(|area| (area - 0.25).abs() < 1e-12));
        assert_eq!(table["surface"][..2], ["Cube:0", "Cube:2"]);
        for (patch, ((b, error), truth)) in
            column("radiosity").iter().zip(column("std_error")).zip(&truth).enumerate()
        {
            assert!(((b - truth) / error).abs() < 5.0, "{name}, patch {patch}: {b} ± {error}, not {truth}");
        }
    }
}

/// Workers, deaths and resumption change no byte; `audit` and `merge` read what was written.
#[test]
fn groups_have_one_answer() {
    let (folder, job) = written();
    let job = job.to_str().unwrap();
    // Short leases would take longer than their walks.
    storms_leave_no_trace(job, &["--paths", "5000000", "--set", "budget.stream_paths=16384"]);
    let outs = ["one", "three"].map(|name| path(&folder, name));
    run_job(job, &outs[0], &["--workers", "1"]);
    run_job(job, &outs[1], &["--workers", "3"]);
    assert!(answer(&outs[0]) == answer(&outs[1]));
    let (code, said, error) = run(&["audit", outs[0].to_str().unwrap()]);
    assert_eq!(code, 0, "{said}{error}");
    let second = path(&folder, "second");
    run_job(job, &second, &["--seed", "4"]);
    let merged = path(&folder, "merged");
    let [first, second, merged] = [&outs[0], &second, &merged].map(|path| path.to_str().unwrap());
    let (code, said, error) = run(&["merge", first, second, "--out", merged]);
    assert_eq!(code, 0, "{said}{error}");
    // A run without groups is of another scene.
    let alone = path(&folder, "alone");
    fs::write(path(&folder, "alone.toml"), JOB.replace("group_size = 0.5\n", "")).unwrap();
    run_job(path(&folder, "alone.toml").to_str().unwrap(), &alone, &[]);
    let (code, _, error) =
        run(&["merge", first, alone.to_str().unwrap(), "--out", path(&folder, "none").to_str().unwrap()]);
    assert!(code == 2 && error.contains("scene"), "{error}");
}

/// Linear fits on groups tell the spread of the light and both errors, in the same bytes for any workers and merged in either order.
#[test]
fn linear_fits_on_groups_have_one_answer() {
    let (folder, job) = written();
    let job = job.to_str().unwrap();
    let set = ["--set", "method.basis=linear"];
    let outs = ["one", "two", "three"].map(|name| path(&folder, name));
    for (workers, out) in ["1", "2", "3"].into_iter().zip(&outs) {
        let summary = run_job(job, out, &[&["--workers", workers], &set[..]].concat());
        let accuracy = |key: &str| summary["accuracy"][key].as_f64().unwrap();
        // A quarter of a wall has less light in its corner than beside the middle of the wall: several per cent.
        assert!((0.02..0.5).contains(&accuracy("discretisation")), "{summary}");
        assert!(accuracy("total") > accuracy("discretisation") && accuracy("noise") > 0.0);
        assert!(summary["checks"].to_string().contains("resolution"), "{summary}");
    }
    assert!(outs[1..].iter().all(|out| answer(out) == answer(&outs[0])));
    let table = columns(&outs[0].join("patches.csv"));
    let [gradient, spread] = ["gradient_u", "spread"].map(|name| numbers(&table[name]));
    assert!(gradient.len() == 24 && spread.iter().any(|&spread| spread > 0.0));
    let (code, said, error) = run(&["audit", outs[0].to_str().unwrap()]);
    assert_eq!(code, 0, "{said}{error}");
    let second = path(&folder, "second");
    run_job(job, &second, &[&["--seed", "4"], &set[..]].concat());
    let merged = ["there", "back"].map(|name| path(&folder, name));
    for (merged, parts) in merged.iter().zip([[&outs[0], &second], [&second, &outs[0]]]) {
        let [first, second, merged] = [parts[0], parts[1], merged].map(|path| path.to_str().unwrap());
        let (code, said, error) = run(&["merge", first, second, "--out", merged]);
        assert_eq!(code, 0, "{said}{error}");
    }
    let [there, back] = merged.map(|folder| fs::read(folder.join("patches.csv")).unwrap());
    assert!(there == back);
}

/// Pictures and exports draw every face with the numbers of its patch.
#[test]
fn every_face_is_drawn() {
    let (folder, job) = written();
    let out = path(&folder, "out");
    let more = ["--export", "vtu", "--export", "glb", "--export", "parquet", "--paths", "20000"];
    draw_job(job.to_str().unwrap(), &out, &more);
    let vtu = fs::read_to_string(out.join("patches.vtu")).unwrap();
    assert!(vtu.contains("NumberOfPoints=\"576\" NumberOfCells=\"192\""), "{}", &vtu[..400]);
    // A black picture of this size has less than 200 bytes.
    for (file, least) in
        [("scene.glb", 1000), ("patches.parquet", 1000), ("report.html", 1000), ("radiosity.png", 500)]
    {
        assert!(fs::metadata(out.join(file)).unwrap().len() > least, "{file}");
    }
    // Light is the same on all faces of a patch.
    let (code, said, _) = run(&["replay", job.to_str().unwrap(), "--walk", "5"]);
    assert!(code == 0 && said.contains("a group of 8 faces from Cube:"), "{said}");
}

#[test]
fn what_groups_cannot_do_is_refused_in_words() {
    let (folder, job) = written();
    let job = job.to_str().unwrap();
    let out = path(&folder, "out");
    let refused = |command: &str, set: &[&str]| {
        let set: Vec<&str> = set.iter().flat_map(|key| ["--set", *key]).collect();
        let (code, _, error) = run(&[&[command, job, "--out", out.to_str().unwrap()], &set[..]].concat());
        assert_eq!(code, 2, "{error}");
        error
    };
    for (set, words) in [
        ("method.final_gather=[0]", "is a group of cells"),
        ("import.group_size=0", "0 is not above 0"),
        ("import.group_angle=100", "100 is outside [0, 90]"),
        (
            "source=[{ name = \"one\", surfaces = [\"Cube:81\"] }]",
            "is a group of faces of which some are named",
        ),
        ("birth={ patches = [24] }", "birth"),
    ] {
        let error = refused("run", &[set]);
        assert!(error.contains(words), "{set}: {error}");
    }
    let angle_alone = JOB.replace("group_size = 0.5", "group_angle = 30");
    fs::write(path(&folder, "angle.toml"), angle_alone).unwrap();
    let (code, _, error) = run(&["check", path(&folder, "angle.toml").to_str().unwrap()]);
    assert!(code == 2 && error.contains("there is no group_size"), "{error}");
    assert!(refused("factors", &[]).contains("import.group_size makes patches of several faces"));
}
