//! `radwalk lamp`: what it says, draws and refuses.

use std::fs;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::{self, run};

const STRIP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/photometry/tests/lamps/strip.ldt");

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    support::path(folder, name).to_str().unwrap().to_owned()
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
    let (code, stdout, stderr) = run(&["lamp", STRIP, "--out", &out, "--force", "--quiet"]);
    assert_eq!((code, &stdout[..], &stderr[..]), (0, "", ""));

    let svg = path(&folder, "strip.svg");
    let (code, stdout, _) = run(&["lamp", STRIP, "--svg", &svg, "--json"]);
    let json: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!((code, &json["lamps"][1]["flux"]), (0, &4450.0.into()));
    assert_eq!(fs::read_to_string(svg).unwrap(), curve);
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
