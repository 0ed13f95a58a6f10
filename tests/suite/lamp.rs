//! `radwalk lamp`: what it says, draws and refuses.

use std::fs;
use std::process::Stdio;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{self, radwalk, run};

const STRIP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/photometry/tests/lamps/strip.ldt");

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    support::path(folder, name).to_str().unwrap().to_owned()
}

fn stdout_of(args: &[&str]) -> String {
    run(args).1
}

#[test]
fn a_luminaire_is_described_and_drawn() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "strip");
    let (code, stdout, stderr) = run(&["lamp", STRIP, "--out", &out]);
    assert_eq!((code, &stderr[..]), (0, ""), "{stdout}");
    assert!(stdout.contains("EULUMDAT") && stdout.contains("(the file says 80 %)"), "{stdout}");
    let curve = fs::read_to_string(path(&folder, "strip/polar.svg")).unwrap();
    assert!(curve.contains("C90–C270 [cd/klm]"), "{curve}");

    // What is there is replaced where that is asked for.
    let (code, _, stderr) = run(&["lamp", STRIP, "--out", &out]);
    assert!(code == 2 && stderr.contains("polar.svg is there already"), "{stderr}");
    assert!(stderr.contains("--force") && stdout_of(&["lamp", STRIP, "--out", &out]).is_empty());
    let (code, stdout, stderr) = run(&["lamp", STRIP, "--out", &out, "--force", "--quiet"]);
    assert_eq!((code, &stdout[..], &stderr[..]), (0, "", ""));

    let svg = path(&folder, "strip.svg");
    let (code, stdout, _) = run(&["lamp", STRIP, "--svg", &svg, "--json"]);
    let json: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, &json["lamps"][1]["flux"]), (0, &4450.0.into()));
    assert_eq!(fs::read_to_string(svg).unwrap(), curve);
}

/// Files of one luminaire in two formats have folders of their own, and JSON alone draws nothing.
#[test]
fn curves_go_to_folders_of_full_names() {
    let folder = tempdir().unwrap();
    let lamp = |words: &[&str]| {
        let mut command = radwalk();
        command.current_dir(&folder).args(["lamp", STRIP]).args(words).stdout(Stdio::null());
        assert!(command.status().unwrap().success());
    };
    lamp(&["--json"]);
    assert!(!folder.path().join("out").exists());
    lamp(&["-q"]);
    assert!(folder.path().join("out/strip.ldt/polar.svg").exists());
}

#[test]
fn a_broken_luminaire_is_refused_with_its_line() {
    let folder = tempdir().unwrap();
    let text = fs::read_to_string(STRIP).unwrap();
    let cut: Vec<&str> = text.lines().take(60).collect();
    let file = path(&folder, "cut.ldt");
    fs::write(&file, cut.join("\n")).unwrap();
    for (file, expected) in
        [(&file[..], "cut.ldt:60: the file ends where"), ("none.ies", "there is no such file")]
    {
        let (code, stdout, stderr) = run(&["lamp", file, "--out", &path(&folder, "out")]);
        assert!(code == 2 && stdout.is_empty() && stderr.contains(expected), "{stderr}");
    }
    assert!(!folder.path().join("out").exists());
}
