//! Cylindrical and semi-cylindrical illuminance, against closed forms and quadrature: light of a point, of everywhere alike, of a large ceiling.

use std::f64::consts::{FRAC_1_PI, PI};

use crate::common::surface;
use glam::DVec3;
use radiosity::{
    EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, Tally,
    lamps::{Emission, LampSpec},
    sensors::{Readings, SensorShape, SensorSpec},
};

/// A full cylinder at some places, then half ones that face these directions there.
fn cylinders(places: &[[DVec3; 2]]) -> [SensorSpec; 2] {
    [false, true].map(|half| SensorSpec {
        name: half.to_string(),
        shape: SensorShape::Cylinders { points: places.to_vec(), grid: [places.len() as u32, 1], half },
    })
}

/// sin ε/π of light from a direction, or sin ε (1 + cos α)/π.
fn weight(towards: DVec3, facing: Option<DVec3>) -> f64 {
    let sine = (1.0 - towards.z * towards.z).max(0.0).sqrt();
    let along = facing.map_or(0.0, |facing| facing.with_z(0.0).normalize().dot(towards));
    FRAC_1_PI * (sine + along).max(0.0)
}

/// A parallelogram of one cell by its corners c, c + u, c + v.
fn quad(corners: [[f64; 3]; 3]) -> Shape {
    let [corner, corner_u, corner_v] = corners.map(DVec3::from);
    Shape::Parallelogram { corner, corner_u, corner_v, cells: [1, 1] }
}

fn run(spec: &SceneSpec, sensors: &[SensorSpec], walks: u64) -> (Experiment, Tally) {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    let experiment = Experiment::new(scene, Method::shooting(EstimatorKind::Collision)).unwrap();
    let experiment = experiment.with_sensors(sensors).unwrap();
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(11), 0..walks, &mut board);
    let tally = board.take().unwrap();
    (experiment, tally)
}

fn places() -> Vec<[DVec3; 2]> {
    let at = |x, y, z, dx, dy, dz| [DVec3::new(x, y, z), DVec3::new(dx, dy, dz)];
    vec![
        at(0.3, 0.4, 0.2, 1.0, 0.0, 0.0),
        at(0.8, 0.1, 0.5, -1.0, 2.0, 0.7),
        at(0.5, 0.5, 0.9, 0.0, -3.0, 0.0),
    ]
}

/// In black surroundings lamps bring I sin ε/(πd²), and (1 + cos α) times as much to half a cylinder, without an error.
#[test]
fn light_of_points_is_exact() {
    let lamps = [DVec3::new(0.45, 0.55, 0.97), DVec3::new(0.1, 0.9, 0.1)];
    let mut spec = SceneSpec::furnace(1, 0.0);
    spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
    spec.lamps.list = lamps.map(|place| LampSpec::new(place, Emission::Uniform, 3.0)).to_vec();
    let places = places();
    let (experiment, tally) = run(&spec, &cylinders(&places), 4096);
    let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
    for (cell, [place, facing]) in places.iter().chain(&places).enumerate() {
        let facing = (cell >= places.len()).then_some(*facing);
        let light = |lamp: DVec3| {
            let way = lamp - place;
            3.0 * weight(way.normalize(), facing) / way.length_squared()
        };
        let (found, expected) = (readings.cell(cell)[0].irradiance.unwrap(), lamps.map(light));
        let expected: f64 = expected.iter().sum();
        assert!((found / expected - 1.0).abs() < 1e-9, "{cell}: {found} for {expected}");
    }
}

/// Where light is alike from everywhere, cylinders of both kinds get as much as a wall; below a sky, half of what the ground gets. Of 12 readings one is
/// beyond 4.5 standard errors once in 12,000 times.
#[test]
fn even_light_is_that_of_planes() {
    let places = places();
    let (experiment, tally) = run(&SceneSpec::furnace(3, 0.6), &cylinders(&places), 1 << 17);
    let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
    let expected = experiment.scene().faces().get(0).emittance[0] / (1.0 - 0.6);
    for cell in 0..2 * places.len() {
        let reading = readings.cell(cell)[0];
        let z = (reading.irradiance.unwrap() - expected) / reading.std_error.unwrap();
        assert!(z.abs() < 4.5, "{cell}: {z} of {reading:?}");
    }
    // The upper half of a cube that gives light, on the points of its middle plane: an even sky.
    let mut spec = SceneSpec::furnace(1, 0.0);
    spec.surfaces.clear();
    let far = 1e4;
    for (c, u, v) in [
        ([-far, -far, far], [-far, far, far], [far, -far, far]),
        ([-far, -far, 0.0], [-far, far, 0.0], [-far, -far, far]),
        ([far, -far, 0.0], [far, -far, far], [far, far, 0.0]),
        ([-far, -far, 0.0], [-far, -far, far], [far, -far, 0.0]),
        ([-far, far, 0.0], [far, far, 0.0], [-far, far, far]),
    ] {
        spec.surfaces.push(surface(quad([c, u, v]), 0.0).emitting(PI));
    }
    let places = [[DVec3::new(1.0, 2.0, 1e-3), DVec3::X], [DVec3::new(0.0, 0.0, 1e-3), DVec3::Y]];
    let (experiment, tally) = run(&spec, &cylinders(&places), 1 << 17);
    let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
    for cell in 0..4 {
        let reading = readings.cell(cell)[0];
        let z = (reading.irradiance.unwrap() - 0.5 * PI) / reading.std_error.unwrap();
        assert!(z.abs() < 4.5, "{cell}: {z} of {reading:?}");
    }
}

/// Below a luminous ceiling of 1 m², by midpoints of 400 × 400 cells, whose error is below 10⁻⁴ of the light; of 6 readings one is beyond 4.5
/// standard errors once in 24,000 times.
#[test]
fn a_ceiling_lights_cylinders_as_quadrature_says() {
    let mut spec = SceneSpec::furnace(1, 0.0);
    spec.surfaces.clear();
    let ceiling = quad([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]]);
    spec.surfaces.push(surface(ceiling, 0.0).emitting(PI));
    let places = places();
    let (experiment, tally) = run(&spec, &cylinders(&places), 1 << 16);
    let readings = Readings::new(&experiment, &tally, 0.95).unwrap();
    for (cell, [place, facing]) in places.iter().chain(&places).enumerate() {
        let facing = (cell >= places.len()).then_some(*facing);
        const N: u32 = 400;
        let mut expected = 0.0;
        for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
            let [x, y] = [i, j].map(|i| (f64::from(i) + 0.5) / f64::from(N));
            let way = DVec3::new(x, y, 1.0) - place;
            let towards = way.normalize();
            expected += weight(towards, facing) * towards.z / way.length_squared() / f64::from(N * N);
        }
        let reading = readings.cell(cell)[0];
        let error = reading.std_error.unwrap() + 1e-4 * expected;
        let z = (reading.irradiance.unwrap() - expected) / error;
        assert!(z.abs() < 4.5, "{cell}: {z} of {reading:?} for {expected}");
    }
}
