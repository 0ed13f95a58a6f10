//! Tests of `radwalk exact` on a scene that is no box: its output, and the accuracy that it claims.

use std::fs;

use crate::support::{columns, numbers, path, run};
use serde_json::Value;
use tempfile::tempdir;

/// Two squares face each other; a two-sided screen between them hides half.
const SCENE: &str = r#"
[material.lamp]
reflectance = 0.5
emittance   = 2.0

[material.grey]
reflectance = 0.7

[[surface]]
material = "lamp"
quad     = [[0,0,0], [1,0,0], [0,1,0]]
patches  = [2, 2]

[[surface]]
material = "grey"
quad     = [[0,0,1], [0,1,1], [1,0,1]]

[[surface]]
material = "grey"
quad     = [[-1,-1,0.5], [0.5,-1,0.5], [-1,2,0.5]]
sides    = 2
"#;

fn solved() -> (Value, std::collections::HashMap<String, Vec<String>>, String) {
    let folder = tempdir().unwrap();
    fs::write(path(&folder, "scene.toml"), SCENE).unwrap();
    fs::write(path(&folder, "job.toml"), "scene = \"scene.toml\"\n[budget]\npaths = 1000\n").unwrap();
    let out = path(&folder, "out");
    let job = path(&folder, "job.toml");
    let (code, stdout, stderr) = run(&["exact", job.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let summary = serde_json::from_slice(&fs::read(out.join("exact.json")).unwrap()).unwrap();
    (summary, columns(&out.join("exact.csv")), stdout)
}

#[test]
fn exact_states_its_accuracy() {
    let (summary, table, stdout) = solved();
    assert_eq!(summary["patches"], 6);
    assert_eq!(summary["faces"], 7);
    assert_eq!(summary["checks"][0]["ok"], true);
    assert!(summary["form_factors"].as_str().unwrap().contains("cubature"));
    let number = |key: &str| summary[key].as_f64().unwrap();
    assert!(number("row_sum_min") < 0.5 && number("row_sum_max") < 1.0, "an open scene: {summary}");
    assert!((1e-12..1e-2).contains(&number("row_error")) && number("residual") < 1e-12);
    assert!(summary["bounds"]["shooting_mse"].as_array().unwrap().len() == 4);
    let (b, errors) = (numbers(&table["radiosity"]), numbers(&table["radiosity_error"]));
    let relative = errors.iter().zip(&b).map(|(error, b)| error / b).fold(0.0, f64::max);
    assert!((relative / number("max_relative_error") - 1.0).abs() < 1e-12);
    assert!(stdout.contains("relative error of radiosities is at most"), "{stdout}");
    // The row of a face is found by its patch and side, as in the file.
    let worst = (0..7).find(|&i| errors[i] / b[i] == relative).unwrap();
    assert_eq!(summary["worst_patch"].to_string(), table["patch"][worst]);
    assert_eq!(summary["worst_side"], *table["side"][worst]);
    assert_eq!(table["patch"], ["0", "1", "2", "3", "4", "5", "5"]);
    assert_eq!(table["side"], ["front", "front", "front", "front", "front", "front", "back"]);
}

/// Squaring reflectances leaves less light: 0 < ψ < φ, β ≤ R b.
#[test]
fn exact_tables_the_scene_of_squared_reflectances() {
    let (_, table, _) = solved();
    let of = |name: &str| numbers(&table[name]);
    let (h, b, psi, beta) = (of("irradiance"), of("reflected"), of("psi"), of("beta"));
    // The faces have 1/4 m² at reflectance 1/2, 1 m² at 0.7, and there are the two of the screen.
    let area = [0.25, 0.25, 0.25, 0.25, 1.0, 4.5, 4.5];
    let reflectance = [0.5, 0.5, 0.5, 0.5, 0.7, 0.7, 0.7];
    for i in 0..7 {
        assert!(psi[i] > 0.0 && psi[i] < h[i] * area[i], "row {i}: ψ {} of φ {}", psi[i], h[i] * area[i]);
        let expected = reflectance[i] * reflectance[i] * psi[i] / area[i];
        assert!((beta[i] / expected - 1.0).abs() < 1e-12 && beta[i] <= reflectance[i] * b[i], "row {i}");
    }
}

/// If light has only two colours, the third channel is dark, which is no fault of the scene.
#[test]
fn a_channel_without_light_is_dark() {
    let folder = tempdir().unwrap();
    let (scene, out) = (path(&folder, "scene.toml"), path(&folder, "out"));
    let text = "[material.wall]\nreflectance = [0.8, 0.3, 0.1]\n[material.lamp]\nemittance = [1.0, 2.0, 0.0]\n\
                [[surface]]\nmaterial = \"wall\"\nquad = [[0,0,0],[1,0,0],[0,1,0]]\n\
                [[surface]]\nmaterial = \"lamp\"\nquad = [[0.2,0,1],[0.2,1,1],[1.1,0,1]]\n";
    fs::write(&scene, text).unwrap();
    let (code, _, stderr) =
        run(&["exact", scene.to_str().unwrap(), "--quiet", "--out", out.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let radiosity = |channel: &str| numbers(&columns(&out.join(format!("exact_{channel}.csv")))["radiosity"]);
    let ([red, green, blue], share) = (["r", "g", "b"].map(radiosity), 0.3 / 0.8 * 2.0);
    assert!(red[0] > 0.0 && blue == [0.0, 0.0]);
    // Light is reflected at most once, so that the channels differ by reflectance and emittance alone.
    assert!((green[0] / red[0] - share).abs() < 1e-9, "{red:?} {green:?}");
}
