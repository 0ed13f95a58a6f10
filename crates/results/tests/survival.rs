//! Scenes that a choice must survive: steep light beside lamps, high reflectance, no light, a half that no light reaches, one small lamp.

use std::fs;
use std::path::PathBuf;

use crate::common::tally;
use glam::DVec3;
use job::{Forecast, Job, Partition};
use judge::partition::{Missed, PatchControl};
use radiosity::{
    Estimates, EstimatorKind, Experiment, SceneSpec, Sequence, Shape, Space, SurfaceSpec, Walks,
};
use results::choose;
use tempfile::{TempDir, tempdir};

fn write(folder: &TempDir, spec: &SceneSpec) -> PathBuf {
    let path = folder.path().join("job.toml");
    fs::write(folder.path().join("scene.toml"), job::to_toml(spec)).unwrap();
    fs::write(&path, "[scene]\nfile = \"scene.toml\"\npatches = \"auto\"\n").unwrap();
    path
}

/// The choice for a job of some paths, the job on it, and what is predicted.
fn chosen(spec: &SceneSpec, seed: u64, paths: u64) -> (Partition, Job, Forecast) {
    let folder = tempdir().unwrap();
    let path = write(&folder, spec);
    let keys = [format!("seed={seed}"), format!("budget.paths={paths}")];
    let open = job::load(&path, &keys).unwrap();
    let partition = choose(&open, 2).unwrap().expect("all is open").partition;
    let job = open.cut(&keys, &partition).unwrap();
    let forecast = partition.forecast.unwrap();
    (partition, job, forecast)
}

/// The number of patches on each surface.
fn cells(partition: &Partition) -> Vec<u64> {
    partition.cuts.iter().map(|cut| cut.cells()).collect()
}

/// A hall of 16 m × 16 m whose 16 lamps hang 2 cm below its ceiling and shine up: most of the square of its light is in the gaps.
fn hall() -> SceneSpec {
    let hall = scenes::moved(&scenes::cube(1), |at| DVec3::new(16.0 * at.x, 16.0 * at.y, 3.0 * at.z));
    let mut surfaces = hall.surfaces;
    for surface in &mut surfaces {
        surface.cell_emittance.clear();
        (surface.emittance, surface.reflectance) = (0.0.into(), 0.5.into());
    }
    for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (f64::from(i), f64::from(j)))) {
        let corner = DVec3::new(1.3 + 4.0 * i, 1.1 + 4.0 * j, 2.98);
        let lamp = Shape::parallelogram(corner, 0.4 * DVec3::X, 0.4 * DVec3::Y, [1, 1]);
        surfaces.push(SurfaceSpec::new(lamp, 0.0).emitting(1.0));
    }
    SceneSpec::new(surfaces)
}

/// What the fits of a job leave out, by 2¹⁹ walks that have no part in its choice.
fn missed(job: &Job) -> Missed {
    let walks = Walks { space: Space::Continuous, ..Walks::shooting(EstimatorKind::Collision) };
    let experiment = Experiment::new(job.build_scene().unwrap(), walks).unwrap();
    let control = PatchControl::new(&experiment, 1 << 19);
    let sequence = Sequence::new(12_345);
    let groups: Vec<_> = (0..PatchControl::GROUPS).map(|group| control.group(group, &sequence).0).collect();
    control.missed(&groups, job.forecast.unwrap().linear).unwrap()
}

/// A floor of 4 m × 4 m in 512 triangles, and a lamp of 1 m² at 1.5 m above it.
fn tessellated_floor() -> SceneSpec {
    let at = |i: u32, j: u32| DVec3::new(0.25 * f64::from(i), 0.25 * f64::from(j), 0.0);
    let cells = (0..16).flat_map(|i| (0..16).map(move |j| (i, j)));
    let halves = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]].map(|[a, b, c]| SurfaceSpec::new(Shape::Triangle { a, b, c, rows: 1 }, 0.1))
    });
    let lamp = Shape::parallelogram(DVec3::new(1.5, 1.5, 1.5), DVec3::Y, DVec3::X, [1, 1]);
    SceneSpec::new(halves.chain([SurfaceSpec::new(lamp, 0.0).emitting(1.0)]).collect())
}

/// Means of small faces leave out 0.06² of the light of a floor, of which this pilot and the shortest control see nothing. What is said to keep within
/// a total error of 5 % does, within two standard errors.
#[test]
fn a_total_error_is_judged_by_walks_that_can_tell() {
    const ASKED: f64 = 0.05;
    let folder = tempdir().unwrap();
    let path = write(&folder, &tessellated_floor());
    let asked = format!("target.total_error={ASKED}");
    let keys = ["seed=2".into(), "budget.paths=10000000".into(), asked];
    let open = job::load(&path, &keys).unwrap();
    let partition = choose(&open, 2).unwrap().expect("all is open").partition;
    let missed = missed(&open.cut(&keys, &partition).unwrap());
    let discretisation = partition.forecast.unwrap().discretisation;
    assert!(discretisation < ASKED, "{discretisation}");
    let most = discretisation.powi(2) + 0.2 * ASKED.powi(2) + 2.0 * missed.error;
    assert!(missed.part < most, "{discretisation}: {missed:?}");
}

/// Of the light beside lamps little is left out, where a pilot's cells lose 0.3 of its energy, and that is what the choice says. One in 20,000 seeds
/// would be off by four standard errors.
#[test]
fn steep_light_is_cut_until_it_is_seen() {
    let (_, job, forecast) = chosen(&hall(), 3, 1_000_000);
    let missed = missed(&job);
    assert!(missed.part < 0.04, "{missed:?}, {forecast:?}");
    let predicted = forecast.discretisation * forecast.discretisation;
    assert!(
        (predicted - missed.part).abs() < 0.6 * missed.part + 4.0 * missed.error,
        "{predicted}: {missed:?}"
    );
}

/// Many reflections of a small lamp's light, R = 0.99: what is predicted is what a run errs by, within a factor of two.
#[test]
fn light_that_hardly_fades_is_predicted() {
    const PATHS: u64 = 1 << 14;
    let mut spec = scenes::cube_with_tile(0.1, 0.99);
    spec.surfaces[0].emittance = 1.0.into();
    let (mut square, mut predicted) = (0.0, 0.0);
    for seed in 0..2 {
        let (_, job, forecast) = chosen(&spec, seed, PATHS);
        let experiment = Experiment::new(job.build_scene().unwrap(), job.method.walks()).unwrap();
        let far = tally(&experiment, 1_000 + seed, 8 * PATHS);
        let near = tally(&experiment, seed, PATHS);
        let [near, far] = [&near, &far].map(|tally| Estimates::new(&experiment, tally, 0.95));
        let (mut error, mut light) = (0.0, 0.0);
        for ((_, face, near), (_, _, far)) in near.known().zip(far.known()) {
            let [near, far] = [near, far].map(|known| known[0].radiosity - face.emittance[0]);
            error += face.area * (near - far).powi(2);
            light += face.area * far * far;
        }
        square += error / light;
        predicted += forecast.noise * forecast.noise;
    }
    let ratio = (square / predicted).sqrt();
    assert!((0.4..1.6).contains(&ratio), "true noise over predicted: {ratio}");
}

/// No walk could begin: the choice says so, and does not walk.
#[test]
fn a_night_is_refused_in_words() {
    let folder = tempdir().unwrap();
    let path = write(&folder, &scenes::cube_with_tile(0.1, 0.5));
    let job = job::load(&path, &["budget.paths=100000".into()]).unwrap();
    let refusal = choose(&job, 2).unwrap_err().to_string();
    assert!(refusal.contains("no emitter"), "{refusal}");
}

/// The walls that no light reaches stay whole.
#[test]
fn a_dark_half_is_not_cut() {
    let (partition, _, forecast) = chosen(&scenes::unequal_rooms(0.0), 1, 300_000);
    let cells = cells(&partition);
    assert!(cells[6..].iter().all(|&count| count == 1), "{cells:?}");
    assert!(cells[..6].iter().sum::<u64>() > 12 && forecast.total() < 0.05, "{cells:?}: {forecast:?}");
}

/// Beside a lamp of 10⁻⁵ of the area light is steep on a ten-thousandth of the walls, and the pilot's cells lose 0.06 of its energy: fewer than 0.005
/// are left out. Within four standard errors, of which one in 30,000 seeds is off.
#[test]
fn one_small_lamp_is_enough() {
    let mut spec = scenes::cube_with_tile(0.007_746, 0.5);
    spec.surfaces[0].emittance = 1.0.into();
    let (_, job, forecast) = chosen(&spec, 1, 1_000_000);
    let missed = missed(&job);
    assert!(forecast.linear && forecast.total() < 0.1, "{forecast:?}");
    assert!(missed.part < 0.005 + 4.0 * missed.error && missed.error < 0.005, "{missed:?}, {forecast:?}");
}

/// A closed hall of 10 m × 10 m × 3 m as a mesh, with a box that shines and other ones, by their lowest and highest corners, or parallelograms.
fn write_hall(folder: &TempDir, lamp: [DVec3; 2], boxes: &[[DVec3; 2]], sheets: &[[DVec3; 3]]) -> PathBuf {
    let (mut obj, mut corners) = ("mtllib hall.mtl\n".to_string(), 0);
    let mut add = |material: &str, places: [DVec3; 4]| {
        places.iter().for_each(|at| obj += &format!("v {} {} {}\n", at.x, at.y, at.z));
        let [a, b, c, d] = [1, 2, 3, 4].map(|corner| corners + corner);
        obj += &format!("usemtl {material}\nf {a} {b} {c} {d}\n");
        corners += 4;
    };
    let mut add_box = |material: &str, [low, high]: [DVec3; 2]| {
        let corner =
            |bits: u32| DVec3::select(glam::BVec3::new(bits & 1 > 0, bits & 2 > 0, bits & 4 > 0), high, low);
        for side in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            add(material, side.map(corner));
        }
    };
    add_box("white", [DVec3::ZERO, DVec3::new(10.0, 10.0, 3.0)]);
    add_box("lamp", lamp);
    boxes.iter().for_each(|&corners| add_box("white", corners));
    sheets.iter().for_each(|&[corner, u, v]| add("white", [corner, corner + u, corner + u + v, corner + v]));
    let materials = "newmtl white\nKd .7 .7 .7\nnewmtl lamp\nKd .5 .5 .5\nKe 10 10 10\n";
    fs::write(folder.path().join("hall.mtl"), materials).unwrap();
    let path = folder.path().join("hall.obj");
    fs::write(&path, obj).unwrap();
    path
}

/// Faces that few paths find are grouped where that pays: small boxes far from a lamp, but not pleats that a lamp lights from the side.
#[test]
fn faces_are_grouped_where_groups_err_less() {
    const PATHS: u64 = 60_000;
    let is_grouped = |path: &PathBuf| {
        let job = job::load(path, &[format!("budget.paths={PATHS}")]).unwrap();
        let faces = job.scene.spec().surfaces.len() as u64;
        assert!((16 * faces..512 * faces).contains(&PATHS), "{faces}");
        !choose(&job, 2).unwrap().unwrap().partition.groups.is_empty()
    };
    let folder = tempdir().unwrap();
    let spread =
        |k: u32| [0.754_877_666, 0.569_840_290, 0.430_159_709].map(|step: f64| (step * f64::from(k)).fract());
    let boxes: Vec<[DVec3; 2]> = (1..=300)
        .map(|k| {
            let low = DVec3::from(spread(k)) * DVec3::new(9.5, 9.5, 2.3) + 0.1;
            [low, low + 0.26]
        })
        .collect();
    let lamp = [DVec3::new(4.0, 4.0, 2.8), DVec3::new(6.0, 6.0, 2.9)];
    assert!(is_grouped(&write_hall(&folder, lamp, &boxes, &[])));

    let step = DVec3::X * 0.1;
    let pleats: Vec<[DVec3; 3]> = (0..90)
        .flat_map(|i| {
            (0..10).map(move |j| DVec3::new(0.5 + 0.1 * f64::from(i), 0.5 + 0.9 * f64::from(j), 0.1))
        })
        .flat_map(|foot| {
            let top = 0.5 * step + 0.15 * DVec3::Z;
            [[foot, top, 0.9 * DVec3::Y], [foot + top, step - top, 0.9 * DVec3::Y]]
        })
        .collect();
    let lamp = [DVec3::new(0.2, 4.0, 0.5), DVec3::new(0.3, 6.0, 1.5)];
    assert!(!is_grouped(&write_hall(&folder, lamp, &[], &pleats)));
}
