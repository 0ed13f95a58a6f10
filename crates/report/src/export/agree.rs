//! All outputs say the same of every kind of patch: hit, unhit, black, sealed, emitting, tiny.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use radiosity::{
    Birth, Chains, Direction, Estimates, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec,
    Sequence, Space, SurfaceSpec, Walks,
    methods::{BatchScore, Batches, Sampler, Solve},
    precision::Quantity,
};

use super::{ColumnCells, columns, write_parquet, write_vtu};
use crate::precision::PrecisionSummary;
use crate::scenes::{cube_spec, experiment, quad, shot};

/// The cells of a patch that only some patches have: radiosity, std_error, irradiance, irradiance_error.
type PartialCells = [bool; 4];

/// The cube of 54 patches with a black floor and a lamp; then single patches of each kind, with what is known of them.
fn kinds() -> (SceneSpec, Vec<(&'static str, PartialCells)>) {
    let mut spec = cube_spec();
    spec.surfaces[0].reflectance = 0.0.into();
    let at = |z: f64, size: f64, flipped: bool| {
        let (u, v) = ([0.4 + size, 0.4, z], [0.4, 0.4 + size, z]);
        if flipped { [[0.4, 0.4, z], v, u] } else { [[0.4, 0.4, z], u, v] }
    };
    let emitting = |surface: SurfaceSpec| SurfaceSpec { emittance: 1.0.into(), ..surface };
    let single = [
        ("hit", quad("hit", at(0.5, 0.2, false), [1, 1], 0.5), [true; 4]),
        ("black", quad("black", at(0.4, 0.2, false), [1, 1], 0.0), [true; 4]),
        ("tiny", quad("tiny", at(0.9, 1e-5, false), [1, 1], 0.5), [false; 4]),
        ("sealed", quad("sealed", at(2.0, 0.2, false), [1, 1], 0.5), [false; 4]),
        ("sealed, black", quad("black back", at(2.1, 0.2, false), [1, 1], 0.0), [true, false, false, false]),
        (
            "sealed, emitting",
            emitting(quad("lamp back", at(3.0, 0.2, false), [1, 1], 0.5)),
            [true, false, false, false],
        ),
    ];
    let known = single.iter().map(|(kind, _, known)| (*kind, *known)).collect();
    spec.surfaces.extend(single.into_iter().map(|(_, surface, _)| surface));
    (spec, known)
}

/// The values of an array of a VTU file.
fn array(vtu: &str, name: &str) -> Vec<f64> {
    let at = vtu.find(&format!("Name=\"{name}\"")).expect("an array");
    let text = vtu[at..].split_once('>').unwrap().1.split_once('<').unwrap().0;
    let bytes = STANDARD.decode(text.trim()).unwrap();
    bytes[8..].chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect()
}

#[test]
fn every_output_has_the_same_cells_of_every_kind_of_patch() {
    let (spec, kinds) = kinds();
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let experiment = experiment(&scene);
    let tally = shot(&experiment);
    let estimates = Estimates::new(&experiment, &tally, 0.95);
    let table = columns(&estimates).unwrap();
    let number = |name: &str| -> &[Option<f64>] {
        let Some(ColumnCells::Number(cells)) =
            table.iter().find(|column| column.name == name).map(|c| &c.cells)
        else {
            panic!("no column {name}")
        };
        cells
    };
    let Some(ColumnCells::Words(flags)) =
        table.iter().find(|column| column.name == "flags").map(|c| &c.cells)
    else {
        panic!("no flags")
    };
    // The table follows the convention.
    for (row, (kind, known)) in (54..).zip(&kinds) {
        let cells =
            ["radiosity", "std_error", "irradiance", "irradiance_error"].map(|name| number(name)[row]);
        assert_eq!(cells.map(|cell| cell.is_some()), *known, "{kind}: {cells:?}");
        let [b_low, b_high, low, high] =
            ["ci_low", "ci_high", "irradiance_low", "irradiance_high"].map(|name| number(name)[row].unwrap());
        assert!(low >= 0.0 && high > low && high.is_finite(), "{kind}: {low} … {high}");
        let (r, e) = (number("reflectance")[row].unwrap(), number("emittance")[row].unwrap());
        for (b, h) in [(b_low, low), (b_high, high)] {
            assert!((b - (e + r * h)).abs() <= 1e-12 * (1.0 + b), "{kind}: B {b}, H {h}");
        }
        assert_eq!(flags[row].contains("unsampled"), !known[2], "{kind}: {}", flags[row]);
        if r == 0.0 {
            assert_eq!((cells[0], cells[1]), (Some(e), known[2].then_some(0.0)), "{kind}");
        } else if !known[2] && e > 0.0 {
            assert_eq!(cells[0], Some(e), "{kind}");
        }
    }
    // Parquet leaves out what is unknown, VTU has NaN there, and all else is the same to the last bit.
    let mut parquet = Vec::new();
    write_parquet(&mut parquet, &estimates).unwrap();
    let reader = SerializedFileReader::new(bytes::Bytes::from(parquet)).unwrap();
    let rows: Vec<Vec<(String, Field)>> = reader
        .get_row_iter(None)
        .unwrap()
        .map(|row| {
            row.unwrap().get_column_iter().map(|(name, field)| (name.clone(), field.clone())).collect()
        })
        .collect();
    let mut vtu = Vec::new();
    write_vtu(&mut vtu, &estimates).unwrap();
    let vtu = String::from_utf8(vtu).unwrap();
    let mut compared = 0;
    for column in &table {
        let ColumnCells::Number(cells) = &column.cells else { continue };
        let of_vtu = array(&vtu, &column.name);
        for (row, cell) in cells.iter().enumerate() {
            let (_, field) = rows[row].iter().find(|(name, _)| *name == column.name).unwrap();
            let of_parquet = match field {
                Field::Double(value) => Some(*value),
                Field::Null => None,
                other => panic!("{}: {other:?}", column.name),
            };
            assert_eq!(of_parquet.map(f64::to_bits), cell.map(f64::to_bits), "{}, row {row}", column.name);
            let same = cell.map_or(of_vtu[row].is_nan(), |cell| cell.to_bits() == of_vtu[row].to_bits());
            assert!(same, "{}, row {row}: {cell:?}, {}", column.name, of_vtu[row]);
            compared += 1;
        }
    }
    assert_eq!(compared, 60 * 14);
    // The summary counts what the table leaves empty: the tiny patch as unhit, three as sealed.
    let summary = PrecisionSummary::new(
        &scene,
        &estimates.precision(Quantity::Irradiance, &radiosity::parallel::in_turn),
    );
    assert_eq!(summary.unhit.patches, 1);
    assert!((summary.headline.sealed_area - 3.0 * 0.04).abs() < 1e-12);
    let area: f64 = number("area").iter().flatten().sum();
    assert!((summary.headline.area + summary.headline.sealed_area - area).abs() < 1e-9);
    assert_ne!(summary.headline.worst_patch, Some(56), "a tiny patch is not named as the worst");
}

/// What has no score has the flag `unsampled` and no estimate, by every method, and what has an estimate has not.
#[test]
fn unknown_is_empty_by_every_method() {
    let (spec, _) = kinds();
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let gathering =
        Walks { direction: Direction::Gathering(Birth::Area), ..Walks::shooting(EstimatorKind::Collision) };
    let score = BatchScore::Of(EstimatorKind::Collision.into(), Space::Discrete);
    let links = Chains { rays: 32 * 60, solve: Solve::Links, linear: false, final_gather: vec![] };
    let methods: [(Method, u64); 5] = [
        (Method::shooting(EstimatorKind::Collision), 20_000),
        (Method::shooting(EstimatorKind::Survival), 20_000),
        (gathering.into(), 20_000),
        (Batches { walks: 2_500, sampler: Sampler::Sobol, score }.into(), 8),
        (links.into(), 8),
    ];
    for (method, samples) in methods {
        let experiment = Experiment::new(scene.clone(), method.clone()).unwrap();
        let (mut board, mut tally) = (experiment.board(), experiment.tally());
        experiment.walk(&Sequence::new(1), 0..samples, &mut board);
        board.add_to(&mut tally).unwrap();
        let estimates = Estimates::new(&experiment, &tally, 0.95);
        let table = columns(&estimates).unwrap();
        let cells = |name: &str| &table.iter().find(|column| column.name == name).unwrap().cells;
        let number = |name: &str, row: usize| match cells(name) {
            ColumnCells::Number(numbers) => numbers[row],
            _ => panic!("{name} holds numbers"),
        };
        let ColumnCells::Words(flags) = cells("flags") else { panic!("flags are words") };
        let mut unsampled = 0;
        for (row, flags) in flags.iter().enumerate() {
            let known =
                ["std_error", "irradiance", "irradiance_error"].map(|name| number(name, row).is_some());
            let is_unsampled = flags.contains("unsampled");
            assert_eq!(known, [!is_unsampled; 3], "{method:?}, row {row}: {flags}");
            if is_unsampled {
                let b = number("radiosity", row);
                assert!(b.is_none() || b == number("emittance", row), "{method:?}, row {row}: {b:?}");
            }
            unsampled += usize::from(is_unsampled);
        }
        assert!((3..20).contains(&unsampled), "{method:?}: {unsampled}");
    }
}
