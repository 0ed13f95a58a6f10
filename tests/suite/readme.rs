//! The TOML blocks of the README run as they stand.

use std::fs;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{path, run, run_job};

/// The TOML blocks of the README, in its order: a job, a scene, sensors in it, the import.
fn blocks() -> [String; 4] {
    let readme = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).unwrap();
    let blocks = readme.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap().to_owned());
    blocks.collect::<Vec<_>>().try_into().expect("every block is tested here: add the new one")
}

fn lit_part(summary: &Value) -> f64 {
    1.0 - summary["unhit"]["area"].as_f64().unwrap()
}

#[test]
fn the_job_runs_and_so_does_what_its_comments_offer() {
    let folder = tempdir().unwrap();
    let [job, ..] = blocks();
    fs::create_dir(path(&folder, "scenes")).unwrap();
    fs::copy(
        concat!(env!("CARGO_MANIFEST_DIR"), "/configs/scenes/cornell.toml"),
        path(&folder, "scenes/cornell.toml"),
    )
    .unwrap();
    let file = path(&folder, "job.toml");
    let short = ["--paths", "30000", "--workers", "2", "--set", "target.relative_error=1"];
    fs::write(&file, &job).unwrap();
    let summary = run_job(file.to_str().unwrap(), &path(&folder, "out"), &short);
    assert_eq!((&summary["walk"], &summary["seed"]), (&"shooting".into(), &42.into()));
    // What is commented out is meant for other methods.
    let offered = job
        .replace("# final_gather", "final_gather")
        .replace("# batch_paths = 1_250_000", "batch_paths = 125_000");
    let offered = offered
        .replace("# jacobi  =", "jacobi =")
        .replace("\"shooting\"", "\"jacobi\"")
        .replace("sampler ", "# sampler ");
    fs::write(&file, offered).unwrap();
    let short = ["--paths", "1e6", "--workers", "2", "--set", "target.relative_error=1"];
    let summary = run_job(file.to_str().unwrap(), &path(&folder, "offered"), &short);
    assert_eq!(summary["walk"], "jacobi");
}

#[test]
fn the_scene_is_lit() {
    let folder = tempdir().unwrap();
    let [_, scene, ..] = blocks();
    let file = path(&folder, "scene.toml");
    fs::write(&file, scene).unwrap();
    let (code, stdout, stderr) = run(&["check", file.to_str().unwrap(), "--fix-report"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(!stdout.contains("coincident") && !stdout.contains("buried"), "{stdout}");
    let summary = run_job(file.to_str().unwrap(), &path(&folder, "out"), &["--paths", "100000"]);
    // The ceiling sees the floor and the sail, which fronts it.
    assert!(lit_part(&summary) > 0.99, "{summary}");
}

#[test]
fn the_sensors_read_its_light() {
    let folder = tempdir().unwrap();
    let [_, scene, sensors, _] = blocks();
    let file = path(&folder, "scene.toml");
    fs::write(&file, format!("{scene}\n{sensors}")).unwrap();
    let summary = run_job(file.to_str().unwrap(), &path(&folder, "out"), &["--paths", "100000"]);
    assert_eq!(
        (&summary["sensors"]["list"][0]["name"], &summary["sensors"]["samples"]),
        (&"desk".into(), &97.into())
    );
    let rows = fs::read_to_string(path(&folder, "out/sensors.csv")).unwrap().lines().count();
    assert_eq!(rows, 1 + 8 + 1);
}

#[test]
fn the_import_is_read() {
    let folder = tempdir().unwrap();
    let [.., import] = blocks();
    fs::write(path(&folder, "two.mtl"), "newmtl Lamp1\nKd 0 0 0\nnewmtl Wall\nKd 0.5 0.5 0.5\n").unwrap();
    let mesh = "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\nv 1 0 1\nusemtl Wall\nf 1 2 3\nusemtl Lamp1\nf 4 5 6\n";
    fs::write(path(&folder, "two.obj"), mesh).unwrap();
    let file = path(&folder, "job.toml");
    fs::write(&file, format!("scene = \"two.obj\"\n[budget]\npaths = 10000\n{import}")).unwrap();
    let summary = run_job(file.to_str().unwrap(), &path(&folder, "out"), &[]);
    // The wall has a back, which faces away from the lamp.
    assert!((0.49..0.51).contains(&lit_part(&summary)), "{summary}");
}
