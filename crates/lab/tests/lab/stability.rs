//! Tests of the atlas of failure at reduced size: every entry asserts the prediction of theory, the measurement and the
//! program's words. Each claim carries the probability that it fails by chance alone, once and for all with its seeds:
//! together below 10⁻³.

use crate::run;
use serde_json::Value;

/// The names of all entries, as the program answers a wrong name.
fn names() -> Vec<String> {
    let (code, _, stderr) = run(&["stability", "--only", "nonsense"]);
    assert_eq!(code, 2);
    let names = stderr.split("choose from ").nth(1).unwrap_or_else(|| panic!("{stderr}"));
    names.trim().split(", ").map(String::from).collect()
}

/// Runs entry by entry, each with its own page.
#[test]
fn every_entry_holds() {
    let folder = tempfile::tempdir().unwrap();
    let mut false_alarms = 0.0;
    let names = names();
    assert!(names.len() >= 24, "{names:?}");
    for name in &names {
        let out = folder.path().join(name);
        let (code, stdout, stderr) =
            run(&["stability", "--quick", "--only", name, "--out", out.to_str().unwrap()]);
        assert_eq!(code, 0, "{stdout}{stderr}");
        let entries: Value = serde_json::from_slice(&std::fs::read(out.join("atlas.json")).unwrap()).unwrap();
        let entry = &entries[0];
        assert_eq!(entry["name"], name.as_str());
        let claims = entry["claims"].as_array().unwrap();
        assert!(claims.len() >= 2, "{name} claims hardly anything");
        for claim in claims {
            assert_eq!(claim["holds"], true, "{name}: {claim}");
            false_alarms += claim["false_alarm"].as_f64().unwrap();
        }
        assert!(claims.iter().any(|claim| claim["remedy"] == true), "{name}: no claim is about the remedy");
        let messages = entry["told"].as_array().unwrap();
        assert!(!messages.is_empty(), "{name}: silence is the only wrong answer");
        let page = std::fs::read_to_string(out.join("atlas.md")).unwrap();
        let svg = std::fs::read_to_string(out.join("atlas").join(format!("{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && page.contains(&format!("(atlas/{name}.svg)")));
    }
    assert!(false_alarms < 1e-3, "{false_alarms}");
}

#[test]
fn entries_are_chosen_by_name_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("atlas");
    let args = ["stability", "--quick", "--only", "scales", "--out", out.to_str().unwrap()];
    let (code, stdout, stderr) = run(&args);
    assert_eq!(code, 0, "{stdout}{stderr}");
    assert!(stdout.starts_with("holds  scales: "), "{stdout}");
    let before = std::fs::read(out.join("atlas.md")).unwrap();
    let (code, _, stderr) = run(&args);
    assert_eq!(code, 2);
    assert!(stderr.contains("is not empty"), "{stderr}");
    assert_eq!(std::fs::read(out.join("atlas.md")).unwrap(), before);
}
