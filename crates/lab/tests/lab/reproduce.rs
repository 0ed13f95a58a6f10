//! Tests of the papers' tables and figures at reduced size. They take a minute of processor time.

use crate::run;
use serde_json::Value;

/// Every row that is held to a claim agrees with it. That any of them differs by chance alone has a probability below
/// 10⁻³ for all together (Šidák's bound, by which the command judges), once and for all with its seeds.
#[test]
fn every_row_of_the_papers_agrees() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("papers");
    let (code, stdout, stderr) = run(&["reproduce", "--quick", "--quiet", "--out", out.to_str().unwrap()]);
    assert_eq!((code, stdout.as_str()), (0, ""), "{stderr}");
    let table: Value = serde_json::from_slice(&std::fs::read(out.join("papers.json")).unwrap()).unwrap();
    let chapters = table["chapters"].as_array().unwrap();
    let rows = || chapters.iter().flat_map(|chapter| chapter["rows"].as_array().unwrap());
    let judged = rows().filter(|row| row["verdict"] != "shown").count();
    assert!(judged >= chapters.len(), "{judged} rows in {} chapters", chapters.len());
    for row in rows() {
        assert_ne!(row["verdict"], "differs", "{row}");
        if let Some(z) = row["z"].as_f64().filter(|_| row["verdict"] == "agrees") {
            assert!(z.abs() <= table["limit"].as_f64().unwrap(), "{row}");
        }
    }
    // The page names every figure that was drawn.
    let page = std::fs::read_to_string(out.join("papers.md")).unwrap();
    let figures = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name());
    for figure in
        figures.filter_map(|name| name.into_string().ok()).filter(|name| !name.starts_with("papers."))
    {
        assert!(page.contains(&format!("]({figure})")), "{figure}");
    }
    let (code, _, stderr) = run(&["reproduce", "--quick", "--out", out.to_str().unwrap()]);
    assert_eq!(code, 2, "results are not overwritten: {stderr}");
}

/// Every configuration with a closed form agrees with it, with the same probability of a false alarm. Of 100 factors at least, in their chapters, the
/// chi-square is judged with them.
#[test]
fn every_row_of_the_scorecard_agrees() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("validation");
    let words = ["reproduce", "--validation", "--quick", "--quiet", "--out", out.to_str().unwrap()];
    let (code, stdout, stderr) = run(&words);
    assert_eq!((code, stdout.as_str()), (0, ""), "{stderr}");
    let table: Value = serde_json::from_slice(&std::fs::read(out.join("validation.json")).unwrap()).unwrap();
    let chapters = table["chapters"].as_array().unwrap();
    let rows: Vec<&Value> = chapters.iter().flat_map(|chapter| chapter["rows"].as_array().unwrap()).collect();
    let factors = ["catalogue", "elements", "bodies", "cones", "enclosures"];
    let of_factors = chapters.iter().filter(|chapter| factors.contains(&chapter["name"].as_str().unwrap()));
    let of_factors: Vec<&Value> =
        of_factors.flat_map(|chapter| chapter["rows"].as_array().unwrap()).collect();
    let squares = of_factors.iter().filter(|row| row["label"].as_str().unwrap().contains("chi-square"));
    assert!(squares.count() == factors.len() && of_factors.len() >= 100 + factors.len(), "{table}");
    assert!(rows.iter().all(|row| row["verdict"] == "agrees"), "{table}");
    assert!(
        rows.iter().all(|row| row["standard_error"].as_f64().unwrap() > 0.0),
        "a row that cannot fail: {table}"
    );
    let page = std::fs::read_to_string(out.join("validation.md")).unwrap();
    assert!(page.contains("radwalk-lab reproduce --validation --quick"), "{page}");
}
