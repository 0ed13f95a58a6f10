//! `patches.csv`: one row per patch, in patch order; two, one for each side, where a patch has two.
//!
//! Numbers are the shortest decimals that read back as the same f64. A whole number keeps its ".0", so that
//! a reader that guesses column types from the first rows never takes a column of them for integers.

use std::io::{self, Write};
use std::ops::Deref;

use radiosity::{Estimate, Estimates, Face, Mix, Scene, Side, Slopes};

/// Columns before those of the channels; between them, where some surfaces are two-sided, [`SIDE`].
const PLACE: [&[&str]; 2] = [&["patch", "surface", "u", "v"], &["x", "y", "z", "area"]];

/// Which side of its patch a row is about: `front` or `back`.
const SIDE: &str = "side";

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
    "irradiance_low",
    "irradiance_high",
];

/// Columns of a run that looked for the best mix of absorption and survival.
const MIX: &[&str] = &["mix_alpha", "mix_radiosity", "mix_std_error", "collision_excess"];

/// Columns of a run with a linear basis; each channel has them.
const SLOPES: &[&str] =
    &["gradient_u", "gradient_u_error", "gradient_v", "gradient_v_error", "spread", "spread_error"];

/// A column of one channel: its name.
const CHANNELS: [&str; 3] = ["r", "g", "b"];

/// Writes the patches of a scene and what was estimated of them.
///
/// # Errors
/// Those of `writer`.
pub fn write_patches(writer: impl Write, estimates: &Estimates) -> io::Result<()> {
    let (scene, method) = (estimates.scene(), estimates.experiment().method());
    let bias = estimates.experiment().is_biased();
    let extras = Extras { bias, mix: method.is_mix(), slopes: method.is_linear() };
    let faces = scene.faces();
    let rows = faces.by_patch().map(|i| {
        let more = More { mix: estimates.mix(i), slopes: estimates.slopes(i) };
        (faces.get(i), estimates.face(i), more)
    });
    write_rows(writer, scene, extras, rows)
}

/// Which columns there are that most methods have not.
#[derive(Clone, Copy, Default)]
struct Extras {
    bias: bool,
    mix: bool,
    slopes: bool,
}

/// What most methods do not tell of a face.
#[derive(Default)]
struct More {
    mix: Option<Mix>,
    slopes: Option<Vec<Slopes>>,
}

fn write_rows<K: Deref<Target = [Estimate]>>(
    writer: impl Write,
    scene: &Scene,
    extras: Extras,
    rows: impl Iterator<Item = (Face, Option<K>, More)>,
) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(header(scene, extras))?;
    let mut flags = String::new();
    for (face, known, more) in rows {
        let known = known.as_deref();
        set_flags(&mut flags, &face, known);
        table.serialize((
            place(scene, &face),
            light(&face, scene.channels(), known),
            known.map(|channels| channels[0].hits),
            &flags,
            bias(scene.channels(), extras, known),
            mix(extras, more.mix),
            slopes(scene.channels(), extras, more.slopes.as_deref()),
        ))?;
    }
    table.flush()
}

fn header(scene: &Scene, extras: Extras) -> Vec<String> {
    let channels = scene.channels();
    let side: &[&str] = if scene.faces().two_sided() { &[SIDE] } else { &[] };
    let place = [PLACE[0], side, PLACE[1]].concat();
    let mut names: Vec<String> = place.into_iter().map(String::from).collect();
    names.extend(LIGHT.iter().flat_map(|name| per_channel(name, channels)));
    names.extend(["hits", "flags"].map(String::from));
    if extras.bias {
        names.extend(per_channel("bias_bound", channels));
    }
    if extras.mix {
        names.extend(MIX.iter().copied().map(String::from));
    }
    if extras.slopes {
        names.extend(SLOPES.iter().flat_map(|name| per_channel(name, channels)));
    }
    names
}

pub(crate) fn per_channel(name: &str, channels: usize) -> Vec<String> {
    match channels {
        1 => vec![name.into()],
        _ => CHANNELS.iter().map(|channel| format!("{name}_{channel}")).collect(),
    }
}

/// The values of the columns [`PLACE`] and [`SIDE`].
type Columns<'a> = (u32, &'a str, [u32; 2], Vec<&'static str>, [f64; 3], f64);

fn place<'a>(scene: &'a Scene, face: &Face) -> Columns<'a> {
    let side = side_columns(scene, face);
    let name = scene.surface_name(face.surface);
    (face.patch, name, face.cell, side, face.centroid.to_array(), face.area)
}

/// The head of the column that tells sides, where some surfaces are two-sided.
pub(crate) fn side_heads(scene: &Scene) -> Option<&'static str> {
    scene.faces().two_sided().then_some(SIDE)
}

/// The value of that column.
pub(crate) fn side_columns(scene: &Scene, face: &Face) -> Vec<&'static str> {
    side_heads(scene).map(|_| side_name(face.side)).into_iter().collect()
}

/// A face as messages name it: its patch, its side where patches have two, its surface where that has a name.
pub fn face_words(scene: &Scene, face: usize) -> String {
    let face = scene.faces().get(face);
    let side = if scene.faces().two_sided() { format!(", {}", side_name(face.side)) } else { String::new() };
    let name = scene.surface_name(face.surface);
    let surface = if name == face.surface.to_string() { String::new() } else { format!(" of {name}") };
    format!("patch {}{surface}{side}", face.patch)
}

/// How outputs call a side.
pub fn side_name(side: Side) -> &'static str {
    match side {
        Side::Front => "front",
        Side::Back => "back",
    }
}

/// The columns [`LIGHT`] that are estimated; an unknown number is missing.
pub(crate) const ESTIMATED: [fn(&Estimate) -> Option<f64>; 8] = [
    Estimate::known_radiosity,
    known_error,
    |e| Some(e.ci_low),
    |e| Some(e.ci_high),
    |e| e.irradiance,
    |e| e.irradiance_error,
    |e| e.irradiance_interval.map(|[low, _]| low),
    |e| e.irradiance_interval.map(|[_, high]| high),
];

/// The standard error of B; missing where nothing was scored, even where no score could change B.
pub(crate) fn known_error(estimate: &Estimate) -> Option<f64> {
    estimate.std_error.filter(|_| !estimate.is_unsampled())
}

/// The columns [`LIGHT`], the channels of each side by side; empty where nothing is known.
fn light(face: &Face, channels: usize, known: Option<&[Estimate]>) -> Vec<Option<f64>> {
    let given = [face.reflectance, face.emittance];
    let given = given.into_iter().flat_map(|spectrum| (0..channels).map(move |c| Some(spectrum[c])));
    let estimated = ESTIMATED.iter().flat_map(|of| (0..channels).map(move |c| of(&known?[c])));
    given.chain(estimated).collect()
}

/// The columns that only biased methods have.
fn bias(channels: usize, extras: Extras, known: Option<&[Estimate]>) -> Vec<Option<f64>> {
    let channels = if extras.bias { channels } else { 0 };
    (0..channels).map(|c| known.map(|known| known[c].bias_bound)).collect()
}

/// The columns [`MIX`] where they were asked for.
fn mix(extras: Extras, best: Option<Mix>) -> Vec<Option<f64>> {
    match best {
        Some(mix) => vec![mix.alpha, Some(mix.radiosity), mix.std_error, mix.collision_excess],
        None => vec![None; if extras.mix { MIX.len() } else { 0 }],
    }
}

/// The columns [`SLOPES`], the channels of each side by side; empty where nothing is known.
fn slopes(channels: usize, extras: Extras, known: Option<&[Slopes]>) -> Vec<Option<f64>> {
    if !extras.slopes {
        return Vec::new();
    }
    let columns: [fn(&Slopes) -> Option<f64>; 6] = [
        |s| Some(s.gradient[0]),
        |s| Some(s.gradient_error?[0]),
        |s| Some(s.gradient[1]),
        |s| Some(s.gradient_error?[1]),
        |s| Some(s.spread()),
        Slopes::spread_error,
    ];
    columns.into_iter().flat_map(|of| (0..channels).map(move |c| of(&known?[c]))).collect()
}

/// The flags of one face, joined by bars; `known` holds the estimates of its channels.
pub fn flags(face: &Face, known: Option<&[Estimate]>) -> String {
    let mut flags = String::new();
    set_flags(&mut flags, face, known);
    flags
}

/// `emitter`: E > 0. `unsampled`: no walk has told anything of some channel. `rare`: too few scores for the standard error to mean much.
/// `bias`: walks were cut off; `bias_bound` says how much too small b may be.
fn set_flags(flags: &mut String, face: &Face, known: Option<&[Estimate]>) {
    flags.clear();
    let any = |holds: fn(&Estimate) -> bool| known.into_iter().flatten().any(holds);
    for (word, holds) in [
        ("emitter", face.emittance.is_lit()),
        ("unsampled", known.is_none() || any(Estimate::is_unsampled)),
        ("rare", any(|e| e.effective_scores > 0.0 && e.is_rare())),
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
    use radiosity::{Experiment, IndexChoice, Spectrum, Tally};

    use super::*;
    use crate::scenes::{cube, cube_spec, experiment, shot};

    const HEADER: &str = "patch,surface,u,v,x,y,z,area,reflectance,emittance,radiosity,std_error,\
                          ci_low,ci_high,irradiance,irradiance_error,irradiance_low,irradiance_high,hits,flags";

    fn table(experiment: &Experiment, tally: &Tally) -> String {
        let mut bytes = Vec::new();
        write_patches(&mut bytes, &Estimates::new(experiment, tally, 0.95)).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// The table of the cube, each estimate `changed`.
    fn table_with(changed: impl Fn(usize, &mut Estimate)) -> String {
        let experiment = experiment(&cube());
        let tally = shot(&experiment);
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let rows = estimates.iter().map(|(i, face, known)| {
            let mut estimate = known.unwrap()[0];
            changed(i, &mut estimate);
            (face, Some(vec![estimate]), More::default())
        });
        let mut bytes = Vec::new();
        write_rows(&mut bytes, estimates.scene(), Extras::default(), rows).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn rows_are_as_the_format_says() {
        let odd = Estimate {
            radiosity: 0.1,
            std_error: Some(1e-20),
            ci_low: 0.0,
            ci_high: 1e300,
            irradiance: Some(1.0 / 3.0),
            irradiance_error: None,
            irradiance_interval: Some([0.25, 1e10]),
            hits: u128::MAX,
            effective_scores: 1e30,
            bias_bound: 0.0,
        };
        let text = table_with(|_, estimate| *estimate = odd);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 1 + 54);
        assert_eq!(lines[0], HEADER);
        assert_eq!(
            lines[2],
            "1,\"floor, \"\"new\"\"\",0,1,0.16666666666666666,0.5,0.0,0.1111111111111111,0.5,0.0,\
             0.1,1e-20,0.0,1e300,0.3333333333333333,,0.25,10000000000.0,340282366920938463463374607431768211455,"
        );
    }

    #[test]
    fn every_number_reads_back_the_same() {
        let values = [1e-20, 1e300, f64::MIN_POSITIVE, 5e-324, f64::MAX, 0.1 + 0.2, 1.0 / 3.0, 123456789.123];
        let text = table_with(|i, estimate| {
            if let Some(&value) = values.get(i) {
                estimate.radiosity = value;
            }
        });
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
        let experiment = experiment(&scene);
        let text = table(&experiment, &shot(&experiment));
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().unwrap().split(',').collect();
        assert_eq!(
            header[8..14].join(","),
            "reflectance_r,reflectance_g,reflectance_b,emittance_r,emittance_g,emittance_b"
        );
        assert_eq!(
            header[32..].join(","),
            "irradiance_low_r,irradiance_low_g,irradiance_low_b,irradiance_high_r,irradiance_high_g,irradiance_high_b,hits,flags"
        );
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        for (number, record) in reader.records().enumerate() {
            let (record, patch) = (record.unwrap(), scene.faces().get(number));
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
        let method = radiosity::Method::shooting(radiosity::Score::Mix);
        let experiment = Experiment::new(cube(), method).unwrap();
        let text = table(&experiment, &shot(&experiment));
        assert!(
            text.lines()
                .next()
                .unwrap()
                .ends_with("flags,mix_alpha,mix_radiosity,mix_std_error,collision_excess")
        );
        let last = text.lines().last().unwrap().rsplit(',').next().unwrap().parse::<f64>().unwrap();
        assert!((1.0..2.0).contains(&last), "{last}");
    }

    /// The columns of a constant job are the first, with the same bytes.
    #[test]
    fn slopes_have_columns_at_the_end_where_they_were_asked_for() {
        let mut spec = cube_spec();
        for coloured in [false, true] {
            if coloured {
                spec.surfaces[0].reflectance = Spectrum::rgb([0.25, 0.5, 0.0]);
            }
            let collision = radiosity::Estimator::Collision;
            let [constant, linear] = [radiosity::Score::Of(collision), radiosity::Score::Linear(collision)]
                .map(|score| {
                    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
                    let experiment = Experiment::new(scene, radiosity::Method::shooting(score)).unwrap();
                    table(&experiment, &shot(&experiment))
                });
            let channels = if coloured { 3 } else { 1 };
            for (number, (constant, linear)) in constant.lines().zip(linear.lines()).enumerate() {
                let more = linear.strip_prefix(constant).unwrap();
                assert_eq!(more.split(',').count(), 1 + 6 * channels);
                if number == 0 {
                    assert_eq!(more, slopes_header(channels));
                }
            }
        }
    }

    fn slopes_header(channels: usize) -> String {
        SLOPES.iter().flat_map(|name| per_channel(name, channels)).map(|name| format!(",{name}")).collect()
    }

    #[test]
    fn flags_are_joined_by_bars() {
        let emitter = cube().faces().iter().position(|patch| patch.emittance.is_lit()).unwrap();
        // Patch 0 was not hit, and this patch three times.
        let flags = |seldom: usize| -> Vec<String> {
            let text = table_with(|i, estimate| {
                estimate.effective_scores = if i == 0 { 0.0 } else { 1000.0 };
                if i == seldom {
                    estimate.effective_scores = 3.0;
                }
            });
            text.lines().skip(1).map(|line| line.rsplit(',').next().unwrap().to_owned()).collect()
        };
        let expected = |i: usize| if i == 0 { "rare" } else { "" };
        for (i, flag) in flags(0).iter().enumerate() {
            assert_eq!(flag, if i == emitter { "emitter" } else { expected(i) });
        }
        assert_eq!(flags(emitter)[emitter], "emitter|rare");
    }
}
