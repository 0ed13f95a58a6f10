//! Tests of scenes whose light vanishes: the program says so before anything else, with names and the remedy.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::tempdir;

use crate::support::{path, run, summary};

/// The shipped cube with every quad's second and third corner swapped: all fronts face out of it.
fn inside_out(folder: &Path) -> PathBuf {
    let scene =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/configs/scenes/cube54.toml")).unwrap();
    let flipped = scene.lines().map(|line| match line.split_once("= [[") {
        Some((key, corners)) if key.trim() == "quad" => {
            let corners: Vec<&str> = corners.trim_end_matches("]]").split("], [").collect();
            let [a, b, c] = corners[..] else { panic!("{line}") };
            format!("{key}= [[{a}], [{c}], [{b}]]\n")
        }
        _ => format!("{line}\n"),
    });
    let file = folder.join("flipped.toml");
    fs::write(&file, flipped.collect::<String>()).unwrap();
    file
}

#[test]
fn a_room_turned_inside_out_is_found_said_first_and_mended() {
    let folder = tempdir().unwrap();
    let scene = inside_out(folder.path());
    let (scene, out) = (scene.to_str().unwrap(), path(&folder, "out"));
    let (code, stdout, _) = run(&["check", scene]);
    assert_eq!(code, 1);
    assert!(
        stdout.contains("fault 1: 100.0 % of the power vanishes at once") && !stdout.contains("no fault"),
        "{stdout}"
    );
    assert!(stdout.contains("By power: z0 (100.0 %)") && stdout.contains("sides = 2"), "{stdout}");

    let (code, stdout, stderr) = run(&["run", scene, "--paths", "10000", "--out", out.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let first = stderr.lines().next().unwrap();
    assert!(
        first.contains("100.0 % of the power vanishes at once") && first.contains("--repair"),
        "{stderr}"
    );
    assert!(
        !stdout.contains("half-width")
            && stdout.contains("nothing to judge: no walk can tell of the irradiance of any patch"),
        "{stdout}"
    );
    assert!(
        stdout.contains("its lamps face away from it") && !stdout.contains("smaller and nearer"),
        "{stdout}"
    );
    assert!(summary(&out)["rms_relative_error"].is_null(), "nothing is known to any part of itself");

    let (_, stdout, _) = run(&["check", scene, "--fix-report"]);
    assert!(stdout.contains("flipped:"), "{stdout}");
    let (code, stdout, stderr) = run(&["check", scene, "--repair"]);
    assert_eq!(code, 1, "{stderr}");
    assert!(stdout.contains("turned round"), "{stdout}");
    let repaired = path(&folder, "flipped.repaired.toml");
    let (_, stdout, _) = run(&["check", repaired.to_str().unwrap()]);
    assert!(stdout.contains("no fault found"), "{stdout}");
}

/// A copy of a scene file has all that the file has: lamps, sensors, the names of materials. A lamp outside of its room is named.
#[test]
fn a_repair_leaves_all_but_what_it_mends() {
    let folder = tempdir().unwrap();
    let sound =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/configs/scenes/furnace.toml")).unwrap();
    let flipped = sound.replacen("[4, 0, 0], [0, 3, 0]]", "[0, 3, 0], [4, 0, 0]]", 1);
    assert_ne!(sound, flipped);
    let lamp = "\n[[lamp]]\nname = \"a\"\nposition = [1, 1, 1.5]\nintensity = 3.0\n";
    let sensor = "\n[[sensor]]\npoint = [1, 1, 0.1]\nnormal = [0, 0, 1]\n";
    let scene = path(&folder, "scene.toml");
    fs::write(&scene, format!("{flipped}{lamp}{sensor}")).unwrap();
    let (_, stdout, stderr) = run(&["check", scene.to_str().unwrap(), "--repair"]);
    assert!(stdout.contains("turned round"), "{stdout}{stderr}");
    let repaired = fs::read_to_string(path(&folder, "scene.repaired.toml")).unwrap();
    for kept in ["[[lamp]]", "[[sensor]]", "[material.wall]", "[4, 0, 0], [0, 3, 0]]"] {
        assert!(repaired.contains(kept), "{repaired}");
    }

    fs::write(&scene, format!("{sound}{}", lamp.replace("1.5]", "90]"))).unwrap();
    let (code, stdout, _) = run(&["check", scene.to_str().unwrap()]);
    assert!(code == 1 && stdout.contains("the lamp at (1, 1, 90) m is lost at once"), "{stdout}");
}

/// One wall is flipped: a part of the light ends on its back, which is named.
#[test]
fn a_flipped_wall_is_named_before_the_run() {
    let folder = tempdir().unwrap();
    let scene = fs::read_to_string(inside_out(folder.path())).unwrap();
    let sound =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/configs/scenes/cube54.toml")).unwrap();
    // Only the last surface is flipped.
    let split = |text: &str| text.rfind("[[surface]]").unwrap();
    let file = path(&folder, "one.toml");
    fs::write(&file, format!("{}{}", &sound[..split(&sound)], &scene[split(&scene)..])).unwrap();
    let out = path(&folder, "out");
    let args = ["run", file.to_str().unwrap(), "--paths", "10000", "--out", out.to_str().unwrap()];
    let (code, _, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("of the power ends on the backs of one-sided surfaces"), "{stderr}");
    assert_eq!(stderr.matches(" %)").count(), 1, "one surface is named: {stderr}");
    let (_, stdout, _) = run(&["check", "configs/cornell.toml"]);
    assert!(stdout.contains("no fault found"), "{stdout}");
}

/// A scene that does not fit into memory is refused before it is built.
#[test]
fn what_cannot_fit_is_refused_with_its_memory() {
    let folder = tempdir().unwrap();
    let scene = path(&folder, "huge.toml");
    let text = "[material.m]\nreflectance = 0.5\nemittance = 1\n[[surface]]\nmaterial = \"m\"\n\
                quad = [[0,0,0],[1,0,0],[0,1,0]]\npatches = [65000, 65000]\n";
    fs::write(&scene, text).unwrap();
    let out = path(&folder, "out");
    for args in [
        &["check"][..],
        &["plan"],
        &["run", "--out", out.to_str().unwrap()],
        &["coordinate", "--out", out.to_str().unwrap()],
    ] {
        let (code, _, stderr) = run(&[&args[..1], &[scene.to_str().unwrap()], &args[1..]].concat());
        assert_eq!(code, 2, "{args:?}: {stderr}");
        assert!(stderr.contains("4225000000 patches need") && stderr.contains("GB"), "{args:?}: {stderr}");
    }
    assert!(!out.exists(), "nothing is made for a job that is refused");
}
