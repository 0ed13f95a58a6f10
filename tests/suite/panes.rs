//! Panes as users meet them: in runs on workers, in daylight, and where a method cannot see through them.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::{TempDir, tempdir};

use crate::support::{columns, numbers, path, run, run_job};

/// A black room of 4 × 4 × 3 m with an opening in its roof, a lamp below it, and two points straight below the lamp.
fn room(folder: &TempDir, tables: &str) -> PathBuf {
    let quads = ["[[0,0,0], [4,0,0], [0,4,0]]", "[[0,0,0], [0,4,0], [0,0,3]]", "[[0,0,3], [0,4,3], [1,0,3]]"];
    let surface = |quad: &&str| format!("[[surface]]\nmaterial = \"wall\"\nquad = {quad}\n");
    let surfaces: String = quads.iter().map(surface).collect();
    let points = "[[points]]\nname = \"below\"\nfile = \"below.pts\"\n";
    let scene = format!("[material.wall]\nreflectance = 0.0\n{surfaces}{LAMP}{points}{tables}");
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    fs::write(folder.path().join("below.pts"), "2 2 1 0 0 1\n2 2 0.5 0 0 1\n").unwrap();
    let job = folder.path().join("job.toml");
    fs::write(&job, "scene = \"scene.toml\"\nseed = 1\n[budget]\npaths = 20_000\nstream_paths = 5000\n")
        .unwrap();
    job
}

const LAMP: &str = "[[lamp]]\nintensity = 80.0\nposition = [2, 2, 2]\n";

const PANE: &str =
    "[[pane]]\nname = \"glass\"\nquad = [[0, 0, 0.75], [4, 0, 0.75], [0, 4, 0.75]]\ntransmittance = 0.5\n";

/// Takes the lamp out of the room, and gives the walls another key.
fn dim(folder: &TempDir, key: &str) {
    let scene = path(folder, "scene.toml");
    let text = fs::read_to_string(&scene).unwrap().replace(LAMP, "");
    fs::write(&scene, text.replace("reflectance = 0.0", &format!("reflectance = 0.0\n{key}"))).unwrap();
}

fn light(out: &Path) -> Vec<f64> {
    numbers(&columns(&out.join("planes.csv"))["illuminance"])
}

/// Panes travel to workers: the point behind the glass has half of I/d², the one before it all, and a result is resumed. `check` tells of them.
#[test]
fn workers_and_resumed_runs_see_the_pane() {
    let folder = tempdir().unwrap();
    let job = room(&folder, PANE);
    let out = path(&folder, "out");
    let words = ["--workers", "2", "--paths", "10000"];
    run_job(job.to_str().unwrap(), &out, &words);
    let expected = [80.0, 0.5 * 80.0 / 2.25];
    let close =
        |light: Vec<f64>| light.iter().zip(expected).all(|(light, lux)| (light / lux - 1.0).abs() < 1e-9);
    assert!(close(light(&out)), "{:?}", light(&out));
    run_job(job.to_str().unwrap(), &out, &["--resume"]);
    let whole = path(&folder, "whole");
    run_job(job.to_str().unwrap(), &whole, &[]);
    for file in ["planes.csv", "patches.csv"] {
        assert!(fs::read(out.join(file)).unwrap() == fs::read(whole.join(file)).unwrap(), "{file}");
    }
    assert!(close(light(&whole)));
    let (_, stdout, _) = run(&["check", job.to_str().unwrap()]);
    assert!(stdout.contains("1 pane of clear glass"), "{stdout}");
}

/// Daylight through glass over the whole opening: every hour of the overcast sky is weaker by what lies between the transmittance at normal incidence and 0.8
/// of it, as a room sees the sky at moderate angles.
#[test]
fn daylight_is_weaker_behind_glass() {
    let factor = |tables: &str| {
        let folder = tempdir().unwrap();
        room(&folder, tables);
        let scene = path(&folder, "scene.toml");
        dim(&folder, "");
        let sensor = "[[sensor]]\nname = \"desk\"\npoint = [3, 2, 0.2]\nnormal = [0, 0, 1]\n";
        fs::write(&scene, fs::read_to_string(&scene).unwrap() + sensor).unwrap();
        let weather = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/weather/made.epw");
        let out = path(&folder, "out");
        let words = [
            "daylight",
            scene.to_str().unwrap(),
            "--weather",
            weather,
            "--paths",
            "4e6",
            "--out",
            out.to_str().unwrap(),
        ];
        let (code, _, stderr) = run(&[&words[..], &["--tolerance", "0.02"]].concat());
        assert_eq!(code, 0, "{stderr}");
        let table = columns(&out.join("annual.csv"));
        let desk = table["sensor"].iter().position(|name| name == "desk").unwrap();
        numbers(&table["daylight_factor"])[desk]
    };
    let (open, behind) = (factor(""), factor(PANE));
    assert!(behind < 0.5 * open && behind > 0.4 * open, "{behind} of {open}");
}

#[test]
fn what_cannot_see_through_panes_says_so() {
    let folder = tempdir().unwrap();
    let job = room(&folder, PANE);
    let file = job.to_str().unwrap();
    let out = path(&folder, "out");
    dim(&folder, "emittance = 1.0");
    let chains = ["run", file, "--set", "method.walk=jacobi", "--out", out.to_str().unwrap()];
    let exact = ["exact", file];
    let factors = ["factors", file, "--out", out.to_str().unwrap()];
    for words in [&chains[..], &exact, &factors] {
        let (code, _, stderr) = run(words);
        assert!(code == 2 && stderr.contains("pane"), "{words:?}: {code} {stderr}");
    }
    let refused = |from: &str, to: &str, problem: &str| {
        let folder = tempdir().unwrap();
        let job = room(&folder, &PANE.replace(from, to));
        let (code, _, stderr) = run(&["run", job.to_str().unwrap()]);
        assert!(code == 2 && stderr.contains(problem), "{code} {stderr}");
    };
    refused("0.5", "0.95", "an opening needs none");
    refused("0.5", "0.0", "[[surface]] in place of the pane");
    refused("[0, 4, 0.75]]", "[8, 0, 0.75]]", "no area");
    refused("transmittance", "tau", "transmittance");
}
