//! What the program chooses for a mesh that stands in place of a job.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::support::{TABLES, answer, columns, numbers, path, radwalk, run, run_job, summary, wait_for};
use tempfile::{TempDir, tempdir};

/// A box of five large walls, open in front, with a lamp below its ceiling: one object and material for each wall.
fn written() -> (TempDir, PathBuf) {
    let walls = [
        ("floor", "white", [[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]]),
        ("ceiling", "white", [[0, 0, 10], [0, 10, 10], [10, 10, 10], [10, 0, 10]]),
        ("back", "white", [[0, 10, 0], [10, 10, 0], [10, 10, 10], [0, 10, 10]]),
        ("left", "red", [[0, 0, 0], [0, 10, 0], [0, 10, 10], [0, 0, 10]]),
        ("right", "green", [[10, 0, 0], [10, 0, 10], [10, 10, 10], [10, 10, 0]]),
        ("lamp", "lamp", [[4, 4, 9], [4, 6, 9], [6, 6, 9], [6, 4, 9]]),
    ];
    let mut text = String::from("mtllib box.mtl\n");
    for (name, material, corners) in walls {
        text += &format!("o {name}\nusemtl {material}\n");
        for [x, y, z] in corners {
            text += &format!("v 0.{x} 0.{y} 0.{z}\n").replace("0.10", "1");
        }
        text += "f -4 -3 -2 -1\n";
    }
    let materials = "newmtl white\nKd 0.7 0.7 0.7\nnewmtl red\nKd 0.6 0.1 0.1\nnewmtl green\nKd 0.1 0.5 0.1\n\
        newmtl lamp\nKd 0 0 0\nKe 10 10 10\n";
    let folder = tempdir().unwrap();
    let mesh = path(&folder, "box.obj");
    fs::write(&mesh, text).unwrap();
    fs::write(path(&folder, "box.mtl"), materials).unwrap();
    (folder, mesh)
}

const SIDES: [&str; 4] = ["--set", "import.up=z", "--set", "import.sides=1"];

/// The power that arrives on each object in red, and the variance of what is known of it if patches were independent.
fn power_by_object(out: &Path) -> Vec<(String, f64, f64)> {
    let table = columns(&out.join("patches.csv"));
    let mut objects: Vec<(String, f64, f64)> = Vec::new();
    for (row, name) in table["surface"].iter().enumerate() {
        let value = |column: &str| table[column][row].parse::<f64>().unwrap_or(0.0);
        let object = name.split(':').next().unwrap().to_owned();
        if objects.last().is_none_or(|last| last.0 != object) {
            objects.push((object, 0.0, 0.0));
        }
        let last = objects.last_mut().unwrap();
        last.1 += value("area") * value("irradiance_r");
        last.2 += (value("area") * value("irradiance_error_r")).powi(2);
    }
    objects
}

/// Without a word the walls of a mesh get the light of the integral equation, on chosen patches, for any number of workers; what is written makes the same again.
#[test]
fn a_bare_mesh_is_solved_continuously() {
    let (folder, mesh) = written();
    let mesh = mesh.to_str().unwrap();
    let [one, two, many, long, again] =
        ["one", "two", "many", "long", "again"].map(|name| path(&folder, name));
    let result = run_job(mesh, &one, &[&SIDES[..], &["--workers", "1"]].concat());
    run_job(mesh, &two, &[&SIDES[..], &["--workers", "2"]].concat());
    run_job(mesh, &many, &[&SIDES[..], &["--workers", "16"]].concat());
    assert!(answer(&one) == answer(&two) && answer(&one) == answer(&many));
    let (choice, accuracy) = (&result["choice"], &result["accuracy"]);
    assert_eq!(
        (&choice["method"], &choice["basis"]),
        (&"continuous shooting by collision".into(), &"linear".into())
    );
    assert!(choice["why"].as_str().unwrap().contains("predicted"), "{choice}");
    assert_eq!((&accuracy["target"], &accuracy["reached"]), (&0.05.into(), &true.into()));
    assert!(result["paths"].as_u64().unwrap() < 10_000_000);

    // A patch a wall is enough for means of walls, where walks are continuous. Six walls within 5 standard errors and 2 %: false alarms 4·10⁻⁶.
    let by_hand = ["method.walk=shooting", "method.space=continuous", "scene.patches=given"];
    let by_hand: Vec<&str> = by_hand.iter().flat_map(|set| ["--set", set]).collect();
    run_job(mesh, &long, &[&SIDES[..], &by_hand, &["--paths", "1000000"]].concat());
    let (chosen, truth) = (power_by_object(&one), power_by_object(&long));
    assert_eq!((chosen.len(), truth.len()), (6, 6));
    for (chosen, truth) in chosen.iter().zip(&truth) {
        let error = 5.0 * (chosen.2 + truth.2).sqrt() + 0.02 * truth.1;
        assert!((chosen.1 - truth.1).abs() < error, "{chosen:?} {truth:?}");
    }

    let given = format!("scene.patches={}", one.join("partition.toml").to_str().unwrap());
    let paths = result["paths"].to_string();
    run_job(mesh, &again, &[&SIDES[..], &["--set", &given, "--paths", &paths]].concat());
    assert!(answer(&again) == answer(&one));
}

/// A run that is killed as soon as its patches are chosen goes on with them, without another pilot.
#[test]
fn a_choice_survives_the_run() {
    let (folder, mesh) = written();
    let [killed, calm] = ["killed", "calm"].map(|name| path(&folder, name));
    let set = ["--set", "import.up=z", "--set", "import.sides=1", "--workers", "1"];
    let mut command = radwalk();
    command
        .args(["run", mesh.to_str().unwrap(), "--paths", "6000000", "--out"])
        .arg(&killed)
        .args(set)
        .args(TABLES);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_for("the chosen patches", || killed.join("tally.bin").exists().then_some(()));
    child.kill().unwrap();
    child.wait().unwrap();
    let resumed = ["run", mesh.to_str().unwrap(), "--resume", "--paths", "7000000", "--out"];
    let resumed =
        [&resumed[..], &[killed.to_str().unwrap()], &set, &["--set", "budget.wall_seconds=2"]].concat();
    let (code, _, stderr) = run(&resumed);
    assert!(code == 0 && stderr.contains("resumed after"), "{stderr}");
    let result = summary(&killed);
    // Another pilot would have chosen for 7 million.
    assert_eq!(result["partition"]["for_paths"], 6_000_000_u64, "{result}");
    // The tally is that of its walks on the chosen patches.
    let given = format!("scene.patches={}", killed.join("partition.toml").to_str().unwrap());
    let paths = result["paths"].to_string();
    run_job(mesh.to_str().unwrap(), &calm, &[&set[..], &["--set", &given, "--paths", &paths]].concat());
    assert!(answer(&calm) == answer(&killed));
    assert!(numbers(&columns(&calm.join("patches.csv"))["area"]).len() > 6);
}
