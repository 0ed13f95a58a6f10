//! `patches.csv`: one row per patch, in patch order.
//!
//! Numbers are the shortest decimals that read back as the same f64. A whole number keeps its ".0", so that
//! a reader that guesses column types from the first rows never takes a column of them for integers.

use std::io::{self, Write};

use radiosity::{Estimate, Patch, Scene, Solution};
use serde::Serialize;

/// One row; the names are the header.
#[derive(Serialize)]
struct Row<'a> {
    patch: usize,
    surface: &'a str,
    u: u32,
    v: u32,
    x: f64,
    y: f64,
    z: f64,
    area: f64,
    reflectance: f64,
    emittance: f64,
    radiosity: Option<f64>,
    std_error: Option<f64>,
    ci_low: Option<f64>,
    ci_high: Option<f64>,
    irradiance: Option<f64>,
    irradiance_error: Option<f64>,
    hits: Option<u128>,
    flags: &'a str,
    /// A column that only biased methods have.
    #[serde(skip_serializing_if = "Option::is_none")]
    bias_bound: Option<Option<f64>>,
}

/// Writes the patches of a grey scene and what was estimated of them. `solution` is of this scene.
///
/// # Errors
/// Those of `writer`.
pub fn write_patches(writer: impl Write, scene: &Scene, solution: &Solution) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let mut flags = String::new();
    for (number, (patch, estimate)) in scene.patches().iter().zip(&solution.estimates).enumerate() {
        let estimate = estimate.as_ref();
        set_flags(&mut flags, patch, estimate);
        let mut row = row(scene, number, patch, estimate, &flags);
        row.bias_bound = solution.biased.then(|| estimate.map(|estimate| estimate.bias_bound));
        table.serialize(row)?;
    }
    table.flush()
}

fn row<'a>(
    scene: &'a Scene,
    number: usize,
    patch: &Patch,
    estimate: Option<&Estimate>,
    flags: &'a str,
) -> Row<'a> {
    let [u, v] = patch.cell;
    let [x, y, z] = patch.centroid.to_array();
    Row {
        patch: number,
        surface: scene.surface_name(patch.surface),
        u,
        v,
        x,
        y,
        z,
        area: patch.area,
        reflectance: patch.reflectance,
        emittance: patch.emittance,
        radiosity: estimate.map(|e| e.radiosity),
        std_error: estimate.and_then(|e| e.std_error),
        ci_low: estimate.map(|e| e.ci_low),
        ci_high: estimate.map(|e| e.ci_high),
        irradiance: estimate.and_then(|e| e.irradiance),
        irradiance_error: estimate.and_then(|e| e.irradiance_error),
        hits: estimate.map(|e| e.hits),
        flags,
        bias_bound: None,
    }
}

/// `emitter`: E > 0. `unsampled`: no walk could tell. `rare`: too few scores for the standard error to mean much.
/// `bias`: walks were cut off; `bias_bound` says how much too small b may be.
fn set_flags(flags: &mut String, patch: &Patch, estimate: Option<&Estimate>) {
    flags.clear();
    for (word, holds) in [
        ("emitter", patch.emittance > 0.0),
        ("unsampled", estimate.is_none()),
        ("rare", estimate.is_some_and(Estimate::is_rare)),
        ("bias", estimate.is_some_and(|estimate| estimate.bias_bound > 0.0)),
    ] {
        if holds {
            let separator = if flags.is_empty() { "" } else { "|" };
            flags.push_str(separator);
            flags.push_str(word);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::{cube, solution};

    const HEADER: &str = "patch,surface,u,v,x,y,z,area,reflectance,emittance,radiosity,std_error,\
                          ci_low,ci_high,irradiance,irradiance_error,hits,flags";

    fn table(scene: &Scene, solution: &Solution) -> String {
        let mut bytes = Vec::new();
        write_patches(&mut bytes, scene, solution).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn rows_are_as_the_format_says() {
        let scene = cube();
        let mut solution = solution(&scene);
        solution.estimates[1] = Some(Estimate {
            radiosity: 0.1,
            std_error: Some(1e-20),
            ci_low: 0.0,
            ci_high: 1e300,
            irradiance: Some(1.0 / 3.0),
            irradiance_error: None,
            hits: u128::MAX,
            effective_scores: 1e30,
            bias_bound: 0.0,
        });
        let text = table(&scene, &solution);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + scene.patches().len());
        assert_eq!(lines[0], HEADER);
        assert_eq!(
            lines[2],
            "1,\"floor, \"\"new\"\"\",0,1,0.16666666666666666,0.5,0.0,0.1111111111111111,0.5,0.0,\
             0.1,1e-20,0.0,1e300,0.3333333333333333,,340282366920938463463374607431768211455,"
        );
    }

    #[test]
    fn every_number_reads_back_the_same() {
        let scene = cube();
        let mut solution = solution(&scene);
        let values = [1e-20, 1e300, f64::MIN_POSITIVE, 5e-324, f64::MAX, 0.1 + 0.2, 1.0 / 3.0, 123456789.123];
        for (estimate, value) in solution.estimates.iter_mut().flatten().zip(values) {
            estimate.radiosity = value;
        }
        let text = table(&scene, &solution);
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        for (record, value) in reader.records().zip(values) {
            let record = record.unwrap();
            assert_eq!(record[10].parse::<f64>().unwrap().to_bits(), value.to_bits());
            assert!(record[10].len() <= 24, "{}", &record[10]);
        }
    }

    #[test]
    fn flags_are_joined_by_bars() {
        let scene = cube();
        let mut solution = solution(&scene);
        let emitter = scene.patches().iter().position(|patch| patch.emittance > 0.0).unwrap();
        for estimate in solution.estimates.iter_mut().flatten() {
            estimate.effective_scores = 1000.0;
        }
        solution.estimates[0].as_mut().unwrap().effective_scores = 0.0;
        let flag = |solution: &Solution, patch: usize| {
            let text = table(&scene, solution);
            text.lines().nth(1 + patch).unwrap().rsplit(',').next().unwrap().to_owned()
        };
        assert_eq!(flag(&solution, 0), "rare");
        assert_eq!(flag(&solution, 1), "");
        assert_eq!(flag(&solution, emitter), "emitter");
        solution.estimates[emitter].as_mut().unwrap().effective_scores = 3.0;
        assert_eq!(flag(&solution, emitter), "emitter|rare");
    }
}
