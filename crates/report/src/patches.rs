//! `patches.csv`: one row per patch, in patch order; two, one for each side, where a patch has two.
//!
//! Numbers are the shortest decimals that read back as the same f64, or [`Digits::Rounded`]. A whole number keeps its ".0", so that
//! a reader that guesses column types from the first rows never takes a column of them for integers.

use std::io::{self, Write};
use std::ops::Deref;

use radiosity::{Estimate, Estimates, Scene, Side, linear::Slopes, methods::Mix, surfaces::Face};

use crate::bounds::Bounds;

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

/// How exactly numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Digits {
    /// So that they read back as they are.
    All,
    /// To three digits of their standard error, which moves no number by more than half a hundredth of it; to [`SHORT`] digits what has no
    /// error, and places to that many of the scene's extent.
    Rounded,
}

/// Digits of numbers without an error where tables are short.
const SHORT: i32 = 6;

/// Writes the patches of a scene and what was estimated of them.
///
/// # Errors
/// Those of `writer`.
pub fn write_patches(writer: impl Write, estimates: &Estimates, digits: Digits) -> io::Result<()> {
    write_some(writer, (estimates, digits), estimates.scene().faces().by_patch())
}

/// [`write_patches`] of some rows, each the number of a face.
pub(crate) fn write_some(
    writer: impl Write,
    (estimates, digits): (&Estimates, Digits),
    rows: impl Iterator<Item = usize>,
) -> io::Result<()> {
    let (scene, method) = (estimates.scene(), estimates.experiment().method());
    let form = ColumnFormat {
        bias: estimates.experiment().is_biased(),
        mix: method.is_mix(),
        slopes: method.is_linear(),
        rounding: Rounding::new(digits, Bounds::of(scene).size().max_element()),
    };
    let faces = scene.faces();
    let rows = rows.map(|i| {
        let more = More { mix: estimates.mix(i), slopes: estimates.slopes(i) };
        (faces.get(i), estimates.face(i), more)
    });
    write_rows(writer, scene, form, rows)
}

/// What numbers are rounded to.
#[derive(Clone, Copy, Default)]
struct Rounding {
    /// The last digit of places, as an exponent of 10; `None` where nothing is rounded.
    of_places: Option<i32>,
}

impl Rounding {
    fn new(digits: Digits, extent: f64) -> Self {
        Rounding { of_places: (digits == Digits::Rounded).then(|| first_digit(extent) - SHORT) }
    }

    fn place(self, x: f64) -> f64 {
        self.of_places.map_or(x, |last| to_digit(x, last))
    }

    /// A number that has no error.
    fn exact(self, x: f64) -> f64 {
        self.of_places.map_or(x, |_| to_digit(x, first_digit(x) - SHORT + 1))
    }

    /// A number with a standard error, which may be unknown.
    fn measured(self, x: f64, error: Option<f64>) -> f64 {
        match error.filter(|error| *error > 0.0 && self.of_places.is_some()) {
            Some(error) => to_digit(x, first_digit(error) - 2),
            None => self.exact(x),
        }
    }
}

/// The place of the first digit of a number, as an exponent of 10; 0 of 0.
fn first_digit(x: f64) -> i32 {
    if x == 0.0 || !x.is_finite() { 0 } else { x.abs().log10().floor() as i32 }
}

/// The number nearest to x that ends at the digit worth 10^`last`, where such numbers are exact.
fn to_digit(x: f64, last: i32) -> f64 {
    // Powers of 10 up to this one are exact, so that whole numbers over them are the nearest to their decimals.
    const EXACT: i32 = 22;
    let power = 10_f64.powi(last.abs());
    let rounded = if last < 0 { (x * power).round() / power } else { (x / power).round() * power };
    if last.abs() <= EXACT && rounded.is_finite() { rounded } else { x }
}

/// Which columns there are that most methods have not, and how numbers are written.
#[derive(Clone, Copy, Default)]
struct ColumnFormat {
    bias: bool,
    mix: bool,
    slopes: bool,
    rounding: Rounding,
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
    form: ColumnFormat,
    rows: impl Iterator<Item = (Face, Option<K>, More)>,
) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(header(scene, form))?;
    let mut flags = String::new();
    for (face, known, more) in rows {
        let known = known.as_deref();
        set_flags(&mut flags, &face, known);
        table.serialize((
            place(scene, &face, form.rounding),
            light(&face, (scene.channels(), form.rounding), known),
            known.map(|channels| channels[0].hits),
            &flags,
            bias(scene.channels(), form, known),
            mix(form, more.mix),
            slopes(scene.channels(), form, more.slopes.as_deref().zip(known)),
        ))?;
    }
    table.flush()
}

fn header(scene: &Scene, form: ColumnFormat) -> Vec<String> {
    let channels = scene.channels();
    let side: &[&str] = if scene.faces().two_sided() { &[SIDE] } else { &[] };
    let place = [PLACE[0], side, PLACE[1]].concat();
    let mut names: Vec<String> = place.into_iter().map(String::from).collect();
    names.extend(LIGHT.iter().flat_map(|name| per_channel(name, channels)));
    names.extend(["hits", "flags"].map(String::from));
    if form.bias {
        names.extend(per_channel("bias_bound", channels));
    }
    if form.mix {
        names.extend(MIX.iter().copied().map(String::from));
    }
    if form.slopes {
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
type FaceColumns<'a> = (u32, &'a str, [u32; 2], Vec<&'static str>, [f64; 3], f64);

fn place<'a>(scene: &'a Scene, face: &Face, rounding: Rounding) -> FaceColumns<'a> {
    let side = side_columns(scene, face);
    let name = scene.surface_name(face.surface);
    let centroid = face.centroid.to_array().map(|x| rounding.place(x));
    (face.patch, name, face.cell, side, centroid, rounding.exact(face.area))
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

/// A column that is estimated; an unknown number is missing.
type EstimateColumn = fn(&Estimate) -> Option<f64>;

/// The columns [`LIGHT`] that are estimated.
pub(crate) const ESTIMATED: [EstimateColumn; 8] = [
    Estimate::known_radiosity,
    known_error,
    |e| Some(e.ci_low),
    |e| Some(e.ci_high),
    |e| e.irradiance,
    |e| e.irradiance_error,
    |e| e.irradiance_interval.map(|[low, _]| low),
    |e| e.irradiance_interval.map(|[_, high]| high),
];

/// The standard errors of [`ESTIMATED`].
const ERRORS: [EstimateColumn; 8] = {
    let [b, h]: [EstimateColumn; 2] = [known_error, |e| e.irradiance_error];
    [b, b, b, b, h, h, h, h]
};

/// The standard error of B; missing where nothing was scored, even where no score could change B.
pub(crate) fn known_error(estimate: &Estimate) -> Option<f64> {
    estimate.std_error.filter(|_| !estimate.is_unsampled())
}

/// The columns [`LIGHT`], the channels of each side by side; empty where nothing is known.
fn light(
    face: &Face,
    (channels, rounding): (usize, Rounding),
    known: Option<&[Estimate]>,
) -> Vec<Option<f64>> {
    let given = [face.reflectance, face.emittance];
    let given =
        given.into_iter().flat_map(|spectrum| (0..channels).map(move |c| Some(rounding.exact(spectrum[c]))));
    let column = |(of, error): (&EstimateColumn, &EstimateColumn), c: usize| {
        let estimate = &known?[c];
        of(estimate).map(|x| rounding.measured(x, error(estimate)))
    };
    let estimated = ESTIMATED.iter().zip(&ERRORS).flat_map(|of| (0..channels).map(move |c| column(of, c)));
    given.chain(estimated).collect()
}

/// The columns that only biased methods have.
fn bias(channels: usize, form: ColumnFormat, known: Option<&[Estimate]>) -> Vec<Option<f64>> {
    let channels = if form.bias { channels } else { 0 };
    (0..channels).map(|c| known.map(|known| form.rounding.exact(known[c].bias_bound))).collect()
}

/// The columns [`MIX`] where they were asked for.
fn mix(form: ColumnFormat, best: Option<Mix>) -> Vec<Option<f64>> {
    match best {
        Some(mix) => {
            let radiosity = form.rounding.measured(mix.radiosity, mix.std_error);
            let [alpha, error, excess] =
                [mix.alpha, mix.std_error, mix.collision_excess].map(|x| x.map(|x| form.rounding.exact(x)));
            vec![alpha, Some(radiosity), error, excess]
        }
        None => vec![None; if form.mix { MIX.len() } else { 0 }],
    }
}

/// A number of a slope, and its error.
type WithError = fn(&Slopes) -> (f64, Option<f64>);

/// The columns [`SLOPES`], the channels of each side by side; empty where nothing is known.
fn slopes(channels: usize, form: ColumnFormat, known: Option<(&[Slopes], &[Estimate])>) -> Vec<Option<f64>> {
    if !form.slopes {
        return Vec::new();
    }
    let rounded = |x: f64, error: Option<f64>| {
        [
            Some(form.rounding.measured(x, error)),
            error.map(|error| form.rounding.measured(error, Some(error))),
        ]
    };
    let columns: [WithError; 3] = [
        |s| (s.gradient[0], s.gradient_error.map(|error| error[0])),
        |s| (s.gradient[1], s.gradient_error.map(|error| error[1])),
        |s| (s.spread(), s.spread_error()),
    ];
    let of = |column: WithError, which: usize, c: usize| {
        // A face that no walk has told of is not known to be even.
        let (slopes, _) = known.filter(|(_, estimates)| !estimates[c].is_unsampled())?;
        let (x, error) = column(&slopes[c]);
        rounded(x, error)[which]
    };
    columns
        .into_iter()
        .flat_map(|column| [(column, 0), (column, 1)])
        .flat_map(|(column, which)| (0..channels).map(move |c| of(column, which, c)))
        .collect()
}

/// The flags of one face, joined by bars; `known` holds the estimates of its channels.
pub fn flags(face: &Face, known: Option<&[Estimate]>) -> String {
    let mut flags = String::new();
    set_flags(&mut flags, face, known);
    flags
}

/// `emitter`: E > 0. `unsampled`: no walk has told anything of some channel. `rare`: too few scores for the standard error to mean much.
/// `bias`: walks were cut off; `bias_bound` says how much too small b may be; H may be, too, where nothing is reflected.
fn set_flags(flags: &mut String, face: &Face, known: Option<&[Estimate]>) {
    flags.clear();
    let any = |holds: fn(&Estimate) -> bool| known.into_iter().flatten().any(holds);
    for (word, holds) in [
        ("emitter", face.emittance.is_lit()),
        ("unsampled", known.is_none() || any(Estimate::is_unsampled)),
        ("rare", any(|e| e.effective_scores > 0.0 && e.is_rare())),
        ("bias", any(|estimate| estimate.irradiance_bias > 0.0)),
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
        write_patches(&mut bytes, &Estimates::new(experiment, tally, 0.95), Digits::All).unwrap();
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
        write_rows(&mut bytes, estimates.scene(), ColumnFormat::default(), rows).unwrap();
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
            irradiance_bias: 0.0,
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

    /// Beside a table with all digits, numbers move by less than half a hundredth of their errors, and none is long.
    #[test]
    fn printed_digits_are_those_of_the_errors() {
        let (experiment, mut tables) = (experiment(&cube()), Vec::new());
        let tally = shot(&experiment);
        for digits in [Digits::All, Digits::Rounded] {
            let mut bytes = Vec::new();
            write_patches(&mut bytes, &Estimates::new(&experiment, &tally, 0.95), digits).unwrap();
            let mut reader = csv::Reader::from_reader(&bytes[..]);
            tables.push(reader.records().map(Result::unwrap).collect::<Vec<_>>());
        }
        let at = |name: &str| HEADER.split(',').position(|column| column == name).unwrap();
        let columns = [("std_error", ["radiosity", "ci_low", "ci_high"])];
        let columns = columns
            .into_iter()
            .chain([("irradiance_error", ["irradiance", "irradiance_low", "irradiance_high"])]);
        for (error, of) in columns {
            for (all, rounded) in tables[0].iter().zip(&tables[1]) {
                let Ok(sigma) = all[at(error)].parse::<f64>() else { continue };
                let number = |row: &csv::StringRecord, name| row[at(name)].parse::<f64>().unwrap();
                for name in of {
                    let moved = (number(all, name) - number(rounded, name)).abs();
                    assert!(
                        moved <= 0.005_001 * sigma,
                        "{name}: {} for {}",
                        &rounded[at(name)],
                        &all[at(name)]
                    );
                }
                assert!(rounded.iter().skip(at("x")).all(|cell| cell.len() <= 12), "{rounded:?}");
                let digits = rounded[at(error)].trim_start_matches(['0', '.']);
                assert!(digits.chars().filter(char::is_ascii_digit).count() <= 4, "{digits}");
            }
        }
    }

    #[test]
    fn numbers_end_at_a_digit_where_that_is_exact() {
        for (x, last, rounded) in [
            (1234.5678, -2, 1234.57),
            (1234.5678, 2, 1200.0),
            (0.1 + 0.2, -3, 0.3),
            (-7.6e-9, -9, -8e-9),
            (1e300, -22, 1e300),
            (1e-300, -40, 1e-300),
        ] {
            assert_eq!(to_digit(x, last), rounded);
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
        let method = radiosity::Method::shooting(radiosity::methods::Score::Mix);
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
            let [constant, linear] =
                [radiosity::methods::Score::Of(collision), radiosity::methods::Score::Linear(collision)].map(
                    |score| {
                        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
                        let experiment = Experiment::new(scene, radiosity::Method::shooting(score)).unwrap();
                        table(&experiment, &shot(&experiment))
                    },
                );
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

    /// Ten walks leave most patches without a score, and their slopes are unknown, not 0.
    #[test]
    fn slopes_of_unsampled_patches_are_empty() {
        let method =
            radiosity::Method::shooting(radiosity::methods::Score::Linear(radiosity::Estimator::Collision));
        let experiment = Experiment::new(cube(), method).unwrap();
        let mut board = experiment.board();
        experiment.walk(&radiosity::Sequence::new(1), 0..10, &mut board);
        let text = table(&experiment, &board.take().unwrap());
        let rows = csv::Reader::from_reader(text.as_bytes()).into_records().map(Result::unwrap);
        let (unsampled, told): (Vec<_>, Vec<_>) = rows.partition(|row| row[19].contains("unsampled"));
        assert!(!unsampled.is_empty() && !told.is_empty());
        assert!(unsampled.iter().all(|row| row.iter().skip(20).all(str::is_empty)), "{unsampled:?}");
        assert!(told.iter().all(|row| !row[20].is_empty()), "{told:?}");
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
