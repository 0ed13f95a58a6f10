//! What commands take, and what they say of what they do not take.

use crate::run;
use serde_json::Value;

/// The page that lists the laboratory's commands.
const PAGE: &str = include_str!("../../../../docs/developer/laboratory.md");

#[test]
fn the_page_of_the_laboratory_has_every_command() {
    let (code, help, _) = run(&["--help"]);
    assert_eq!(code, 0);
    let commands =
        help.split("Commands:\n").nth(1).and_then(|rest| rest.split("\n\n").next()).expect("a list");
    let names: Vec<&str> = commands
        .lines()
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next())
        .filter(|name| !name.is_empty())
        .collect();
    assert!(names.len() >= 17, "{help}");
    for name in names {
        assert!(PAGE.contains(&format!("`radwalk-lab {name}")), "{name} is not on the page");
    }
}

#[test]
fn json_streams_hold_nothing_but_json() {
    let folder = tempfile::tempdir().unwrap();
    let [atlas, none] = ["atlas", "none"].map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    for (code, args) in [
        (0, &["stability", "--only", "few-walks", "--quick", "--out", &atlas][..]),
        (2, &["stability", "--only", "no-such-entry", "--out", &none]),
    ] {
        let (got, _, stderr) = run(&[args, &["--json"]].concat());
        assert_eq!(got, code, "{args:?}: {stderr}");
        let events: Vec<Value> = stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert!(events.iter().all(|event| event["event"].is_string()), "{args:?}: {stderr}");
        if code >= 2 {
            let last = events.last().expect("a failure is told");
            assert_eq!((&last["event"], &last["level"]), (&"error".into(), &"error".into()), "{args:?}");
        }
    }
}

#[test]
fn made_scenes_are_printed_and_wrong_words_refused() {
    let (code, stdout, stderr) = run(&["write", "cube", "2"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert_eq!(stdout.matches("[[surface]]").count(), 6, "{stdout}");
    let (code, _, stderr) = run(&["write", "sphere"]);
    assert!(code == 2 && stderr.contains("usage: write cornell"), "{code}: {stderr}");
}

/// The laboratory and its made scenes may be used by tests of the program, not by the program.
#[test]
fn the_program_uses_nothing_of_the_laboratory() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let crates = std::fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let product =
        crates.filter(|path| !path.ends_with("lab") && !path.ends_with("scenes")).chain([root.clone()]);
    let mut read = 0;
    for manifest in product.map(|path| path.join("Cargo.toml")).filter(|path| path.exists()) {
        let text = std::fs::read_to_string(&manifest).unwrap();
        let rest = text.split("\n[dependencies]\n").nth(1).unwrap_or("");
        let needs = rest.split("\n[").next().unwrap().lines();
        let of_lab = |line: &str| ["lab", "scenes"].iter().any(|name| line.starts_with(&format!("{name}.")));
        assert!(!needs.clone().any(of_lab), "{}", manifest.display());
        read += needs.count();
    }
    assert!(read > 100, "{read} dependencies");
}
