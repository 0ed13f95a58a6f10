//! `patches.csv`: one row per patch, in patch order.
//!
//! Numbers are the shortest decimals that read back as the same f64. A whole number keeps its ".0", so that
//! a reader that guesses column types from the first rows never takes a column of them for integers.

use std::io::{self, Write};

use radiosity::{Estimate, Patch, Scene, Solution};

/// Columns before those of the channels.
const PLACE: &[&str] = &["patch", "surface", "u", "v", "x", "y", "z", "area"];

/// Columns that each channel has.
const LIGHT: &[&str] = &[
    "reflectance",
    "emittance",
    "radiosity",
    "std_error",
    "ci_low",
    "ci_high",
    "irradiance",
    "irradiance_error",
];

/// Columns of a run that looked for the best mix of absorption and survival.
const MIX: &[&str] = &["mix_alpha", "mix_radiosity", "mix_std_error", "collision_excess"];

/// A column of one channel: its name.
const CHANNELS: [&str; 3] = ["r", "g", "b"];

/// Writes the patches of a scene and what was estimated of them. `solution` is of this scene.
///
/// # Errors
/// Those of `writer`.
pub fn write_patches(writer: impl Write, scene: &Scene, solution: &Solution) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(header(solution))?;
    let mut flags = String::new();
    let estimates = solution.estimates.chunks_exact(solution.channels);
    for (number, (patch, estimates)) in scene.patches().iter().zip(estimates).enumerate() {
        set_flags(&mut flags, &patch, estimates);
        table.serialize((
            place(scene, number, &patch),
            light(&patch, estimates),
            estimates[0].map(|estimate| estimate.hits),
            &flags,
            bias(solution, estimates),
            mix(solution, number),
        ))?;
    }
    table.flush()
}

fn header(solution: &Solution) -> Vec<String> {
    let mut names: Vec<String> = PLACE.iter().copied().map(String::from).collect();
    names.extend(LIGHT.iter().flat_map(|name| per_channel(name, solution.channels)));
    names.extend(["hits", "flags"].map(String::from));
    if solution.biased {
        names.extend(per_channel("bias_bound", solution.channels));
    }
    if solution.mixes.is_some() {
        names.extend(MIX.iter().copied().map(String::from));
    }
    names
}

fn per_channel(name: &str, channels: usize) -> Vec<String> {
    match channels {
        1 => vec![name.into()],
        _ => CHANNELS.iter().map(|channel| format!("{name}_{channel}")).collect(),
    }
}

type Place<'a> = (usize, &'a str, [u32; 2], [f64; 3], f64);

fn place<'a>(scene: &'a Scene, number: usize, patch: &Patch) -> Place<'a> {
    (number, scene.surface_name(patch.surface), patch.cell, patch.centroid.to_array(), patch.area)
}

/// The columns [`LIGHT`], the channels of each side by side; empty where nothing is known.
fn light(patch: &Patch, estimates: &[Option<Estimate>]) -> Vec<Option<f64>> {
    let channels = 0..estimates.len();
    let given = [patch.reflectance, patch.emittance];
    let given = given.into_iter().flat_map(|spectrum| channels.clone().map(move |c| Some(spectrum[c])));
    let known: [fn(&Estimate) -> Option<f64>; 6] = [
        |e| Some(e.radiosity),
        |e| e.std_error,
        |e| Some(e.ci_low),
        |e| Some(e.ci_high),
        |e| e.irradiance,
        |e| e.irradiance_error,
    ];
    let known = known.into_iter().flat_map(|of| estimates.iter().map(move |e| e.as_ref().and_then(of)));
    given.chain(known).collect()
}

/// The columns that only biased methods have.
fn bias(solution: &Solution, estimates: &[Option<Estimate>]) -> Vec<Option<f64>> {
    let bounds = estimates.iter().map(|estimate| estimate.map(|estimate| estimate.bias_bound));
    if solution.biased { bounds.collect() } else { Vec::new() }
}

/// The columns [`MIX`] where they were asked for.
fn mix(solution: &Solution, patch: usize) -> Vec<Option<f64>> {
    let Some(mixes) = &solution.mixes else { return Vec::new() };
    match mixes[patch] {
        Some(mix) => vec![mix.alpha, Some(mix.radiosity), mix.std_error, mix.collision_excess],
        None => vec![None; MIX.len()],
    }
}

/// `emitter`: E > 0. `unsampled`: no walk could tell. `rare`: too few scores for the standard error to mean much.
/// `bias`: walks were cut off; `bias_bound` says how much too small b may be.
fn set_flags(flags: &mut String, patch: &Patch, estimates: &[Option<Estimate>]) {
    flags.clear();
    let any = |holds: fn(&Estimate) -> bool| estimates.iter().flatten().any(holds);
    for (word, holds) in [
        ("emitter", patch.emittance.is_lit()),
        ("unsampled", estimates[0].is_none()),
        ("rare", any(Estimate::is_rare)),
        ("bias", any(|estimate| estimate.bias_bound > 0.0)),
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
    use radiosity::{Experiment, IndexChoice, Sequence, Spectrum};

    use super::*;
    use crate::scenes::{cube, cube_spec, experiment, solution};

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
    fn each_channel_has_its_columns() {
        let mut spec = cube_spec();
        spec.surfaces[0].reflectance = Spectrum::rgb([0.25, 0.5, 0.0]);
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        let text = table(&scene, &solution(&scene));
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().unwrap().split(',').collect();
        assert_eq!(
            header[8..14].join(","),
            "reflectance_r,reflectance_g,reflectance_b,emittance_r,emittance_g,emittance_b"
        );
        assert_eq!(
            header[29..].join(","),
            "irradiance_error_r,irradiance_error_g,irradiance_error_b,hits,flags"
        );
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        for (number, record) in reader.records().enumerate() {
            let (record, patch) = (record.unwrap(), scene.patches().get(number));
            assert_eq!(record.len(), header.len());
            for (c, channel) in CHANNELS.iter().enumerate() {
                let column = |name: &str| {
                    let name = format!("{name}_{channel}");
                    record[header.iter().position(|head| *head == name).unwrap()].parse::<f64>().unwrap()
                };
                assert_eq!(column("reflectance"), patch.reflectance[c]);
                let expected = patch.emittance[c] + patch.reflectance[c] * column("irradiance");
                assert!((column("radiosity") - expected).abs() < 1e-12);
                assert!(column("ci_low") <= expected && expected <= column("ci_high"));
            }
        }
    }

    #[test]
    fn the_best_mix_has_columns_where_it_was_asked_for() {
        let method = radiosity::Method { mix: true, ..experiment(&cube()).method().clone() };
        let experiment = Experiment::new(cube(), method).unwrap();
        let mut board = experiment.board::<2>();
        experiment.walk(&Sequence::new(1), 0..10_000, &mut board);
        let solution = Solution::new(&experiment, &board.take().unwrap(), 0.95);
        let text = table(experiment.scene(), &solution);
        assert!(
            text.lines()
                .next()
                .unwrap()
                .ends_with("flags,mix_alpha,mix_radiosity,mix_std_error,collision_excess")
        );
        let last = text.lines().last().unwrap().rsplit(',').next().unwrap().parse::<f64>().unwrap();
        assert!((1.0..2.0).contains(&last), "{last}");
    }

    #[test]
    fn flags_are_joined_by_bars() {
        let scene = cube();
        let mut solution = solution(&scene);
        let emitter = scene.patches().iter().position(|patch| patch.emittance.is_lit()).unwrap();
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
