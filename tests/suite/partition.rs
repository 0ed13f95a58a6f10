//! `patches = "auto"` in the program: runs, resumes, partitions that are given on, and refusals.

use std::fs;

use crate::support::{answer, path, run, run_job, summary};
use tempfile::{TempDir, tempdir};

const CORNELL: &str = "configs/cornell.toml";
const AUTO: [&str; 4] = ["--set", "scene.patches=auto", "--set", "budget.checkpoint_seconds=0.02"];

fn text(path: &std::path::Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// Workers have no part in it, a resumed run keeps its patches whatever its budget, and the partition makes the same run again.
#[test]
fn a_chosen_partition_is_kept_and_given_on() {
    let folder = tempdir().unwrap();
    let [one, five, again] = ["one", "five", "again"].map(|name| path(&folder, name));
    let result = run_job(CORNELL, &one, &[&AUTO[..], &["--paths", "100000", "--workers", "1"]].concat());
    run_job(CORNELL, &five, &[&AUTO[..], &["--paths", "100000", "--workers", "5"]].concat());
    assert!(answer(&one) == answer(&five));
    let partition = &result["partition"];
    assert_eq!(partition["basis"], "linear", "{partition}");
    assert_eq!((&result["space"], &partition["for_paths"]), (&"continuous".into(), &100_000.into()));
    let patches = partition["patches"].as_u64().unwrap();
    let rows = fs::read_to_string(one.join("patches.csv")).unwrap().lines().count() as u64;
    assert!(rows == patches + 1 && (30..2692).contains(&patches), "{patches}");
    let number = |of: &serde_json::Value, key: &str| of[key].as_f64().unwrap();
    // One quantity before and after, and what was predicted of the noise holds.
    let [before, after] = [&result["predicted"], &result["accuracy"]];
    assert!(before["answer"] == "linear" && after["answer"] == "linear", "{result}");
    assert!((number(before, "noise") / number(after, "noise") - 1.0).abs() < 0.1, "{result}");

    // With more paths a pilot would choose finer patches; a resumed run has its own.
    let more = ["--paths", "200000", "--resume"];
    run_job(CORNELL, &five, &[&AUTO[..], &more].concat());
    let given = format!("scene.patches={}", text(&one.join("partition.toml")));
    let given = ["--set", &given, "--paths", "200000"];
    let straight = run_job(CORNELL, &again, &given);
    assert!(answer(&five) == answer(&again));
    assert_eq!(straight["partition"], serde_json::Value::Null);
    assert_eq!(summary(&five)["partition"]["for_paths"], 100_000);
    assert!(!again.join("partition.toml").exists());
    // What belongs to the other run goes.
    run_job(CORNELL, &five, &[&given[..], &["--force"]].concat());
    assert!(!five.join("partition.toml").exists() && answer(&five) == answer(&again));
}

/// A sheet of 1,800 faces that lies before a wall, and a lamp: an OBJ file with its materials. Faces of the sheet are grouped. Workers have
/// no part in it, a resumed run keeps its groups, and two runs on the same groups add up in any order.
#[test]
fn chosen_groups_are_kept_given_on_and_merged() {
    let folder = tempdir().unwrap();
    let mesh = path(&folder, "sheet.obj");
    let corner = |i: u32, j: u32| format!("v {} {} 1\n", f64::from(i) / 52.0, f64::from(j) / 52.0);
    let corners: String = (0..53).flat_map(|i| (0..53).map(move |j| corner(i, j))).collect();
    let square = |i: u32, j: u32| {
        let a = 53 * i + j + 1;
        format!("f {a} {} {}\nf {a} {} {}\n", a + 54, a + 53, a + 1, a + 54)
    };
    let faces: String = (0..52).flat_map(|i| (0..52).map(move |j| square(i, j))).collect();
    let lamp = "v 0 0 0\nv 0.5 0 0\nv 0.5 0.5 0\nv 0 0.5 0\no lamp\nusemtl lamp\nf 2810 2811 2812 2813\n";
    fs::write(&mesh, format!("mtllib m.mtl\n{corners}o sheet\nusemtl white\n{faces}{lamp}")).unwrap();
    fs::write(path(&folder, "m.mtl"), "newmtl white\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 1 1 1\n").unwrap();
    let mesh = mesh.to_str().unwrap();
    let args = [&AUTO[..], &["--set", "import.up=z"]].concat();
    let [one, five, again] = ["one", "five", "again"].map(|name| path(&folder, name));
    let result = run_job(mesh, &one, &[&args[..], &["--paths", "40000", "--workers", "1"]].concat());
    run_job(mesh, &five, &[&args[..], &["--paths", "40000", "--workers", "5"]].concat());
    assert!(answer(&one) == answer(&five));
    let partition = &result["partition"];
    assert_eq!(partition["grouped"], true);
    assert!((4..600).contains(&partition["patches"].as_u64().unwrap()), "{partition}");
    run_job(mesh, &five, &[&args[..], &["--paths", "80000", "--resume"]].concat());
    let given = format!("scene.patches={}", text(&one.join("partition.toml")));
    let given = ["--set", &given, "--set", "import.up=z"];
    run_job(mesh, &again, &[&given[..], &["--paths", "80000"]].concat());
    assert!(answer(&five) == answer(&again));
    let other = path(&folder, "other");
    run_job(mesh, &other, &[&given[..], &["--paths", "80000", "--seed", "9"]].concat());
    let merged = ["ab", "ba"].map(|name| path(&folder, name));
    for (out, [a, b]) in merged.iter().zip([[&again, &other], [&other, &again]]) {
        let args = [text(a), text(b), "--out".into(), text(out)];
        let (code, _, stderr) = run(&[&["merge"], &args.each_ref().map(String::as_str)[..]].concat());
        assert_eq!(code, 0, "{stderr}");
    }
    assert!(answer(&merged[0]) == answer(&merged[1]));
}

/// One surface of a scene may be left open, the others keep their cells.
#[test]
fn a_surface_may_be_left_open_alone() {
    let folder = tempdir().unwrap();
    let scene = path(&folder, "room.toml");
    let wall = |corners: &str, patches: &str| {
        format!("[[surface]]\nmaterial = \"wall\"\nquad = {corners}\npatches = {patches}\n")
    };
    let lamp = "[[surface]]\nmaterial = \"lamp\"\nquad = [[0.4, 0.4, 0.9], [0.4, 0.6, 0.9], [0.6, 0.4, 0.9]]\npatches = [1, 1]\n";
    let text = [
        "[material.wall]\nreflectance = 0.5\n[material.lamp]\nreflectance = 0\nemittance = 1\n",
        lamp,
        &wall("[[0, 0, 0], [1, 0, 0], [0, 1, 0]]", "\"auto\""),
        &wall("[[0, 0, 1], [0, 1, 1], [1, 0, 1]]", "[3, 5]"),
    ]
    .concat();
    fs::write(&scene, text).unwrap();
    let out = path(&folder, "out");
    let result = run_job(scene.to_str().unwrap(), &out, &["--paths", "100000"]);
    assert_eq!(result["partition"]["surfaces"], 1);
    let partition = fs::read_to_string(out.join("partition.toml")).unwrap();
    assert!(partition.contains("\n  [1, 1],") && partition.contains("[3, 5],"), "{partition}");
    let (code, stdout, stderr) = run(&["check", CORNELL, AUTO[0], AUTO[1]]);
    assert!(code == 0 && stdout.contains("a pilot cuts 50 surfaces"), "{stdout}{stderr}");
}

fn refused(folder: &TempDir, args: &[&str]) -> String {
    let out = path(folder, "refused");
    let (code, _, stderr) = run(&[&["run", CORNELL, "--out", out.to_str().unwrap()], args].concat());
    assert_eq!(code, 2, "{args:?}: {stderr}");
    stderr
}

#[test]
fn what_cannot_be_cut_so_is_refused_in_words() {
    let folder = tempdir().unwrap();
    let numbers =
        refused(&folder, &[&AUTO[..], &["--set", "target={relative_error=0.1,patches=[3]}"]].concat());
    assert!(numbers.contains("target.patches") && numbers.contains("no numbers yet"), "{numbers}");
    let file = path(&folder, "other.toml");
    let set = format!("scene.patches={}", text(&file));
    let given = ["--set", &set[..]];
    let missing = refused(&folder, &given);
    assert!(missing.contains("no file") && missing.contains("\"auto\""), "{missing}");
    for (partition, words) in [
        ("surfaces = [[1, 1]]", "there are 1 surfaces, and the scene has"),
        ("surfaces = [[0, 1]]", "out of range"),
        ("surfaces = [\"uv.\"]", "the cuts end before 2 of their parts"),
        ("surfaces = [\"ux..\"]", "character 2 is 'x', not u, v or a point"),
        ("surfaces = [\"u...\"]", "the cuts end at character 3"),
        ("basis = \"linear\"", "missing"),
        ("surfaces = []\ncells = 3", "unknown key"),
        ("surfaces = [1]\ngroups = [\"+1 0\"]", "more cells in groups than surfaces have"),
        ("surfaces = [2]\ngroups = [\"+2 2*2\"]", "\"2*2\" tells no patch of cells"),
    ] {
        fs::write(&file, partition).unwrap();
        let message = refused(&folder, &given);
        assert!(message.contains(words) && message.contains("other.toml"), "{partition}: {message}");
    }
    for command in ["compare", "factors"] {
        let (code, _, stderr) = run(&[command, CORNELL, AUTO[0], AUTO[1]]);
        assert!(code == 2 && stderr.contains("not cut yet"), "{command}: {stderr}");
    }
}
