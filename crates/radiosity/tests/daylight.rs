//! Daylight coefficients against closed forms.

use glam::DVec3;
use radiosity::{
    Experiment, IndexChoice, Scene, SceneSpec, Sequence, Shape, Sides, SurfaceSpec, Unfit,
    daylight::{Coefficients, DaylightSpec, Segment, SkyPatches, SkyTally, sky_tallies},
    sensors::{SensorShape, SensorSpec},
};

/// A square of side 2 a around the z axis at height z.
fn square(a: f64, z: f64, reflectance: f64) -> SurfaceSpec {
    SurfaceSpec {
        name: None,
        shape: Shape::Parallelogram {
            corner: DVec3::new(-a, -a, z),
            corner_u: DVec3::new(a, -a, z),
            corner_v: DVec3::new(-a, a, z),
            cells: [1, 1],
        },
        sides: Sides::Both,
        reflectance: reflectance.into(),
        // Walks from sensors ask nothing of light, but a scene has some.
        emittance: 1.0.into(),
        cell_emittance: Vec::new(),
        transmittance: Default::default(),
    }
}

fn point(z: f64, normal: DVec3) -> SensorSpec {
    SensorSpec { name: "s".into(), shape: SensorShape::Point { point: DVec3::new(0.0, 0.0, z), normal } }
}

fn coefficients(surfaces: Vec<SurfaceSpec>, sensors: &[SensorSpec]) -> Coefficients {
    let spec = SceneSpec::new(surfaces);
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    Coefficients::new(scene, sensors, SkyPatches::new(145).unwrap()).unwrap()
}

fn walked(coefficients: &Coefficients, cell: usize, walks: u64) -> SkyTally {
    let mut tally = SkyTally::new(coefficients.sky().count());
    coefficients.walk(&Sequence::new(7), cell, 0..walks, &mut tally);
    tally
}

/// How far counts are from what is expected of them: Σ (n − N·p)²/(N·p) over its degrees of freedom, in standard deviations.
fn deviation(counts: &[u64], walks: u64, probabilities: impl Iterator<Item = f64>) -> f64 {
    let chi: f64 = counts
        .iter()
        .zip(probabilities)
        .filter(|&(_, p)| p > 0.0)
        .map(|(&n, p)| (n as f64 - walks as f64 * p).powi(2) / (walks as f64 * p))
        .sum();
    (chi - counts.len() as f64) / (2.0 * counts.len() as f64).sqrt()
}

/// The configuration factor of a square of side 2 a at the distance h from a point that faces its middle: four corners of
/// (X/√(1 + X²)·atan(X/√(1 + X²)))/π with X = a/h.
fn facing(a: f64, h: f64) -> f64 {
    let x = a / h;
    let s = x / (1.0 + x * x).sqrt();
    4.0 * (s * s.atan() * 2.0) / std::f64::consts::TAU
}

/// In the open a sensor that faces up sees each patch by its horizontal factor; false alarms: one in 10⁴.
#[test]
fn a_sensor_in_the_open_sees_the_whole_sky() {
    let open = coefficients(vec![square(1.0, -3.0, 0.5)], &[point(0.0, DVec3::Z)]);
    let tally = walked(&open, 0, 1 << 20);
    assert_eq!((tally.walks, tally.backs, tally.straight[0]), (1 << 20, 0, 0));
    assert_eq!(tally.straight.iter().sum::<u64>(), 1 << 20);
    let z = deviation(&tally.straight[1..], 1 << 20, open.sky().horizontal_factors().into_iter());
    assert!(z.abs() < 4.0, "{z}");
}

/// A sensor that faces a square of reflectance R from above: 1 − F leave below the horizon without a reflection; F·R are reflected and leave as from a
/// plane in the open, cosine-distributed.
#[test]
fn reflections_are_told_apart() {
    let (a, h, reflectance) = (1.5, 2.0, 0.6);
    let down = coefficients(vec![square(a, 0.0, reflectance)], &[point(h, -DVec3::Z)]);
    let walks = 1 << 20;
    let tally = walked(&down, 0, walks);
    let factor = facing(a, h);
    let within = |n: u64, p: f64| {
        let z = (n as f64 - walks as f64 * p) / (walks as f64 * p * (1.0 - p)).sqrt();
        assert!(z.abs() < 4.5, "{n} of {walks}, where {p} is expected: {z} standard errors");
    };
    within(tally.straight[0], 1.0 - factor);
    within(tally.reflected[1..].iter().sum(), factor * reflectance);
    assert_eq!((tally.straight[1..].iter().sum::<u64>(), tally.reflected[0]), (0, 0));
    let factors = down.sky().horizontal_factors().into_iter().map(|p| p * factor * reflectance);
    let z = deviation(&tally.reflected[1..], walks, factors);
    assert!(z.abs() < 4.5, "{z}");
}

/// The walks of a cell are the same in one piece and in many, and whatever other cells walk; cells of a grid are born in each.
#[test]
fn parts_of_walks_add_up_to_all() {
    let quad = SensorSpec {
        name: "grid".into(),
        shape: SensorShape::Quad {
            corner: DVec3::new(-1.0, -1.0, 1.0),
            corner_u: DVec3::new(1.0, -1.0, 1.0),
            corner_v: DVec3::new(-1.0, 1.0, 1.0),
            cells: [2, 2],
        },
    };
    let surfaces = || vec![square(1.0, 2.0, 0.5), square(3.0, 0.0, 0.3)];
    let room = coefficients(surfaces(), &[point(1.0, DVec3::Z), quad]);
    let whole = walked(&room, 3, 5000);
    let mut parts = SkyTally::new(145);
    for range in [0..1, 1..777, 777..5000] {
        let mut part = SkyTally::new(145);
        room.walk(&Sequence::new(7), 3, range, &mut part);
        parts.add(&part);
    }
    assert_eq!(parts, whole);
    assert_ne!(walked(&room, 2, 5000), whole);
    assert!(whole.reflected[1..].iter().sum::<u64>() > 0 && whole.straight[0] == 0);
}

/// A shadow ray from the middle of a cell: the cosine where the way is free.
#[test]
fn the_sun_is_seen_where_nothing_is_in_its_way() {
    let room = coefficients(vec![square(1.0, 2.0, 0.5)], &[point(0.0, DVec3::Z)]);
    let at = |x: f64| DVec3::new(x, 0.0, 2.0).normalize().to_array();
    assert_eq!(room.receives(0, at(0.0)), 0.0);
    assert_eq!(room.receives(0, at(0.999)), 0.0);
    assert_eq!(room.receives(0, at(1.001)), at(1.001)[2]);
    assert_eq!(room.receives(0, [0.0, 0.6, -0.8]), 0.0);
}

/// An experiment counts the walks of [`Coefficients`] segment by segment, however they are shared out, and refuses cells and skies that are not there.
#[test]
fn experiments_count_the_same_walks() {
    let sensors = [point(0.0, DVec3::Z), point(1.0, -DVec3::Z)];
    let scene = Scene::build(&SceneSpec::new(vec![square(1.0, 2.0, 0.5)]), IndexChoice::Auto).unwrap();
    let segment = |group, first, walks| Segment { group, first, walks };
    let with = |patches, segments: &[Segment]| {
        let spec = DaylightSpec { sensors: sensors.to_vec(), patches, segments: segments.to_vec() };
        Experiment::of_daylight(scene.clone(), spec.clone()).map(|experiment| (experiment, spec))
    };
    let (experiment, spec) =
        with(145, &[segment(1, 100, 700), segment(0, 0, 1000), segment(1, 50, 3)]).unwrap();
    let (sequence, mut board, mut tally) = (Sequence::new(7), experiment.board(), experiment.tally());
    for walks in [900..1703, 0..1, 1..900] {
        experiment.walk(&sequence, walks, &mut board);
        board.add_to(&mut tally).unwrap();
    }
    assert_eq!((tally.counts.walks, tally.patches()), (1703, 3 * 293));
    let direct = Coefficients::new(scene.clone(), &sensors, SkyPatches::new(145).unwrap()).unwrap();
    let tallies = sky_tallies(&tally, &spec);
    assert!(tallies.iter().all(|tally| tally.is_of(145) && !tally.is_of(577)));
    for (Segment { group, first, walks }, found) in spec.segments.iter().zip(&tallies) {
        let mut expected = SkyTally::new(145);
        direct.walk(&sequence, *group as usize, *first..first + walks, &mut expected);
        assert_eq!(*found, expected);
    }
    assert_eq!(with(145, &[segment(2, 0, 1)]).unwrap_err(), Unfit::NoSuchCells);
    assert_eq!(with(145, &[segment(0, 1 << 40, 1)]).unwrap_err(), Unfit::NoSuchCells);
    assert_eq!(with(146, &[]).unwrap_err(), Unfit::NoSuchSky { patches: 146 });
}

#[test]
fn cylinders_have_no_daylight() {
    let scene = Scene::build(&SceneSpec::furnace(1, 0.5), IndexChoice::Auto).unwrap();
    let points = vec![[DVec3::splat(0.5), DVec3::Z]];
    let shape = SensorShape::Cylinders { points, grid: [1, 1], half: false };
    let sensor = SensorSpec { name: "people".into(), shape };
    let refused = Coefficients::new(scene, &[sensor], SkyPatches::new(145).unwrap()).unwrap_err();
    assert_eq!(refused, Unfit::DaylightOffPlanes { name: "people".into() });
}
