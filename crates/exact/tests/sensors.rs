//! Sensors against closed forms and dense solutions: what they read, and whether their intervals are true.

use std::f64::consts::PI;

use exact::{BoxScene, Exact, Facing, Rectangle, form_factor};
use glam::DVec3;
use radiosity::{
    Birth, Chains, Direction, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence,
    Shape, Sides, Space, Spectrum, SurfaceSpec, Walks,
    methods::{BatchScore, Batches, Iterations, Sampler, Solve},
    sensors::{Readings, SensorShape, SensorSpec},
};

const LEVEL: f64 = 0.95;

/// H and its standard error of every cell and channel, with the interval.
type Read = (f64, f64, [f64; 2]);

fn read(experiment: &Experiment, seed: u64, walks: u64) -> Vec<Read> {
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(seed), 0..walks, &mut board);
    let tally = board.take().unwrap();
    let readings = Readings::new(experiment, &tally, LEVEL).unwrap();
    let cells = (0..readings.sensors().cell_count()).flat_map(|cell| readings.cell(cell));
    cells.map(|r| (r.irradiance.unwrap(), r.std_error.unwrap_or(f64::NAN), [r.ci_low, r.ci_high])).collect()
}

fn sensed(spec: &SceneSpec, method: impl Into<Method>, sensors: &[SensorSpec]) -> Experiment {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    Experiment::new(scene, method).unwrap().with_sensors(sensors).unwrap()
}

fn quad(corner: DVec3, u: DVec3, v: DVec3, cells: [u32; 2]) -> SensorSpec {
    let shape = SensorShape::Quad { corner, corner_u: corner + u, corner_v: corner + v, cells };
    SensorSpec { name: "quad".into(), shape }
}

fn point(point: DVec3, normal: DVec3) -> SensorSpec {
    SensorSpec { name: "point".into(), shape: SensorShape::Point { point, normal } }
}

fn black(corner: DVec3, u: DVec3, v: DVec3) -> SurfaceSpec {
    SurfaceSpec::new(Shape::parallelogram(corner, u, v, [1, 1]), 0.0)
}

fn collision() -> Method {
    Method::shooting(EstimatorKind::Collision)
}

/// The configuration factor of a point under the corner of a parallel rectangle a × b at distance 1 (Howell B-3).
fn under_a_corner(a: f64, b: f64) -> f64 {
    let term = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    (term(a, b) + term(b, a)) / (2.0 * PI)
}

/// The configuration factor where the point's normal is along side a, and the rectangle begins in the point's plane (Howell B-4).
fn beside_a_corner(height: f64, width: f64, distance: f64) -> f64 {
    let c = (height * height + distance * distance).sqrt();
    ((width / distance).atan() - distance / c * (width / c).atan()) / (2.0 * PI)
}

/// A square lamp of 1 W/m² alone in the dark: opposed and perpendicular squares of textbooks (0.1998 and 0.2000), and points
/// that face a uniformly bright floor, as CIE 171:2006, 5.6 has them. All that errs are the sensors' own rays: 1,024
/// samples, five estimates at 5 standard errors, a false alarm has a chance of 3·10⁻⁶ for this seed, once and for all.
#[test]
fn sensors_read_a_lamp_as_closed_forms_have_it() {
    let lamp = black(DVec3::ZERO, DVec3::X, DVec3::Y).emitting(1.0);
    let spec = SceneSpec::new(vec![lamp]);
    let above = |x, y| DVec3::new(x, y, 1.0);
    let sensors = [
        // Opposed, facing down; perpendicular, facing the lamp, on its edge.
        quad(above(0.0, 0.0), DVec3::Y, DVec3::X, [1, 1]),
        quad(DVec3::ZERO, DVec3::Y, DVec3::Z, [1, 1]),
        point(above(0.0, 0.0), -DVec3::Z),
        point(above(0.5, 0.5), -3.0 * DVec3::Z),
        point(DVec3::new(0.0, 0.5, 1.0), DVec3::X),
        // Away from it.
        point(above(0.5, 0.5), DVec3::Z),
        point(DVec3::new(0.5, 0.5, -1.0), DVec3::Z),
    ];
    let whole = |lo: DVec3, hi: DVec3, axis, facing| Rectangle { axis, facing, lo, hi };
    let floor = whole(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), 2, Facing::Up);
    let ceiling = whole(DVec3::Z, DVec3::ONE, 2, Facing::Down);
    let wall = whole(DVec3::ZERO, DVec3::new(0.0, 1.0, 1.0), 0, Facing::Up);
    let truth = [
        form_factor(&ceiling, &floor),
        form_factor(&wall, &floor),
        under_a_corner(1.0, 1.0),
        4.0 * under_a_corner(0.5, 0.5),
        2.0 * beside_a_corner(1.0, 0.5, 1.0),
        0.0,
        0.0,
    ];
    assert!((truth[0] - 0.199_825).abs() < 1e-6 && (truth[1] - 0.200_044).abs() < 1e-6, "{truth:?}");
    let found = read(&sensed(&spec, collision(), &sensors), 5, 1 << 20);
    for (i, (&(h, error, _), truth)) in found.iter().zip(truth).enumerate() {
        println!("sensor {i}: {h} ± {error}, {truth}");
        match truth {
            0.0 => assert_eq!(h, 0.0),
            _ => assert!((h - truth).abs() < 5.0 * error && error < 6e-3 * truth, "sensor {i}"),
        }
    }
}

/// Where light is diffuse and all walls reflect alike, energy alone tells the mean: Φ/(A(1 − R)), of which Φ/A·R/(1 − R) is
/// reflected (CIE 171:2006, 5.8). Sensors cover all walls. 5 standard errors of 32 runs: a false alarm has a chance of 2·10⁻⁵ by
/// Student's t for these seeds, once and for all.
#[test]
fn sensors_on_all_walls_of_a_room_read_its_mean() {
    let mut spec = SceneSpec::furnace(2, 0.6);
    for surface in &mut spec.surfaces {
        surface.emittance = Spectrum::BLACK;
    }
    spec.surfaces[2].cell_emittance.push((1, 10.0.into()));
    let on = |surface: &SurfaceSpec| {
        let (corner, u, v) = surface.shape.edges();
        quad(corner, u, v, [1, 1])
    };
    let sensors: Vec<SensorSpec> = spec.surfaces.iter().map(on).collect();
    let truth = 10.0 * 0.25 / (6.0 * (1.0 - 0.6));
    let mut means = Vec::new();
    // The errors of the six walls of one run depend on each other.
    for seed in 0..32 {
        let found = read(&sensed(&spec, collision(), &sensors), 100 + seed, 16 << 10);
        means.push(found.iter().map(|&(h, ..)| h / 6.0).sum::<f64>());
    }
    let mean = Mean::of(&means);
    println!("{mean:?} {truth}");
    assert!(mean.is(truth, 5.0) && mean.error < 2e-3 * truth);
}

/// A mean and its standard error.
#[derive(Debug)]
struct Mean {
    value: f64,
    error: f64,
}

impl Mean {
    fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (n - 1.0);
        Mean { value, error: (variance / n).sqrt() }
    }

    fn is(&self, expected: f64, z: f64) -> bool {
        (self.value - expected).abs() <= z * self.error
    }
}

/// Samples of a run, and runs.
const SAMPLES: u64 = 10;
const SEEDS: u64 = 300;

/// Mean squared z is 1, and 95 % of the intervals hold the truth, within 4 of their own standard errors each, which are
/// small. Fixed seeds: a false alarm has a chance of 10⁻⁴, once and for all. With 1,500 seeds all are within 94 … 96 %.
fn intervals_are_true(name: &str, experiment: &Experiment, truth: &[f64]) {
    let walks = match experiment.unit().is_walk() {
        true => SAMPLES * experiment.sensors().unwrap().sample_walks(),
        false => SAMPLES,
    };
    let (mut squares, mut coverages) = (Vec::new(), Vec::new());
    for seed in 0..SEEDS {
        let found = read(experiment, 9000 + seed, walks);
        assert_eq!(found.len(), truth.len());
        let n = truth.len() as f64;
        let pairs = || found.iter().zip(truth);
        squares.push(pairs().map(|(&(h, error, _), &truth)| ((h - truth) / error).powi(2) / n).sum());
        let holds = |&(&(_, _, [low, high]), truth): &(&Read, &f64)| (low..=high).contains(truth);
        coverages.push(pairs().filter(holds).count() as f64 / n);
    }
    let (square, coverage) = (Mean::of(&squares), Mean::of(&coverages));
    println!(
        "{name}: z² {:.3} ± {:.3}, coverage {:.4} ± {:.4}",
        square.value, square.error, coverage.value, coverage.error
    );
    assert!(square.error < 0.08 && coverage.error < 0.01, "{name}: the test is blunt");
    assert!(square.is(1.0, 4.0), "{name}: {square:?}");
    assert!(coverage.is(LEVEL, 4.0), "{name}: {coverage:?}");
}

/// A closed box 2 × 1 × 1, walls of 0.3 … 0.8, one of its patches a lamp.
fn plain_box() -> SceneSpec {
    let (x, y, z) = (2.0 * DVec3::X, DVec3::Y, DVec3::Z);
    let walls =
        [(DVec3::ZERO, x, y), (z, y, x), (DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, y, z), (x, z, y)];
    let surface = |(i, (corner, u, v)): (usize, (DVec3, DVec3, DVec3))| {
        SurfaceSpec::new(Shape::parallelogram(corner, u, v, [3, 2]), 0.3 + 0.1 * i as f64)
    };
    let mut surfaces: Vec<SurfaceSpec> = walls.into_iter().enumerate().map(surface).collect();
    surfaces[1].cell_emittance.push((2, 1.0.into()));
    SceneSpec::new(surfaces)
}

/// A work plane in the middle of the box, facing up, and H of its cells.
fn work_plane() -> (SensorSpec, impl Fn(&SceneSpec) -> Vec<f64>) {
    let corner = DVec3::new(0.3, 0.2, 0.4);
    let sensor = quad(corner, DVec3::X * 1.5, DVec3::Y * 0.6, [2, 2]);
    let truth = move |spec: &SceneSpec| {
        let (boxed, b) = (BoxScene::recognise(spec).unwrap(), Exact::of_scene(spec).unwrap());
        let cell = |(i, j): (usize, usize)| {
            let lo = corner + DVec3::new(0.75 * i as f64, 0.3 * j as f64, 0.0);
            let hi = lo + DVec3::new(0.75, 0.3, 0.0);
            let cell = Rectangle { axis: 2, facing: Facing::Up, lo, hi };
            let b = &b.solution().radiosity;
            boxed.patches().iter().zip(b).map(|(patch, b)| form_factor(&cell, patch) * b).sum()
        };
        [(0, 0), (0, 1), (1, 0), (1, 1)].map(cell).to_vec()
    };
    (sensor, truth)
}

#[test]
fn intervals_of_single_walks_are_true() {
    let spec = plain_box();
    let (plane, truth) = work_plane();
    let truth = truth(&spec);
    for (name, method) in [
        ("collision", collision()),
        ("absorption", Method::shooting(EstimatorKind::Absorption)),
        (
            "infinite",
            Method::shooting(EstimatorKind::Infinite.ending(radiosity::methods::InfiniteEnd::default())),
        ),
        ("gathering", Method::gathering(Birth::Area, EstimatorKind::Collision)),
    ] {
        intervals_are_true(name, &sensed(&spec, method, std::slice::from_ref(&plane)), &truth);
    }
}

#[test]
fn intervals_of_batches_and_chains_are_true() {
    let spec = plain_box();
    let (plane, truth) = work_plane();
    let truth = truth(&spec);
    let gathered =
        Batches { walks: 1 << 10, sampler: Sampler::Random, score: BatchScore::FinalGather(vec![0, 20]) };
    let iterations = Solve::Iterations(Iterations::default());
    for (name, method) in [
        ("sobol", Method::batches(1 << 10, Sampler::Sobol)),
        ("final gather", gathered.into()),
        ("links", Chains { rays: 1 << 12, linear: false, solve: Solve::Links, final_gather: vec![] }.into()),
        (
            "iterations",
            Chains { rays: 1 << 12, linear: false, solve: iterations, final_gather: vec![] }.into(),
        ),
    ] {
        intervals_are_true(name, &sensed(&spec, method, std::slice::from_ref(&plane)), &truth);
    }
}

/// Sensors on patches read what the patches get: colour, a sheet with two sides that hides the lamp from some, an open room.
#[test]
fn intervals_are_true_in_any_scene() {
    let mut spec = plain_box();
    let sheet = Shape::parallelogram(DVec3::new(1.1, 0.0, 0.0), DVec3::Y, 0.7 * DVec3::Z, [1, 1]);
    spec.surfaces.push(SurfaceSpec { sides: Sides::Both, ..SurfaceSpec::new(sheet, 0.7) });
    // The wall at y = 0 is gone.
    spec.surfaces.remove(2);
    spec.surfaces[0].reflectance = Spectrum::rgb([0.9, 0.5, 0.1]);
    spec.surfaces[1].cell_emittance.push((0, Spectrum::rgb([0.0, 0.5, 2.0])));
    let sheet = DVec3::new(1.1, 0.0, 0.0);
    let sensors = [
        // Patch 0 of the floor; both sides of the sheet.
        quad(DVec3::ZERO, DVec3::X * 2.0 / 3.0, DVec3::Y * 0.5, [1, 1]),
        quad(sheet, DVec3::Y, 0.7 * DVec3::Z, [1, 1]),
        quad(sheet, 0.7 * DVec3::Z, DVec3::Y, [1, 1]),
    ];
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let front = (scene.surfaces().len() - 1) as u32;
    let of_sheet = |side| scene.faces().iter().position(|f| (f.surface, f.side) == (front, side)).unwrap();
    let faces = [0, of_sheet(radiosity::Side::Front), of_sheet(radiosity::Side::Back)];
    let channels: Vec<Exact> = (0..3).map(|c| Exact::of_scene(&spec.channel(c)).unwrap()).collect();
    let irradiance = |exact: &Exact, face: usize| {
        let reflected = exact.solution().radiosity[face] - exact.emittance()[face];
        reflected / exact.reflectance()[face]
    };
    let truth: Vec<f64> =
        faces.iter().flat_map(|&face| channels.iter().map(move |exact| irradiance(exact, face))).collect();
    for (name, method) in [
        ("coloured walks", collision()),
        (
            "coloured chains",
            Chains { rays: 1 << 12, linear: false, solve: Solve::Links, final_gather: vec![] }.into(),
        ),
    ] {
        intervals_are_true(name, &sensed(&spec, method, &sensors), &truth);
    }
}

/// In a furnace B = 1 W/m² everywhere also where walks are continuous, whose means over patches sensors take for the patches'
/// light.
#[test]
fn intervals_of_continuous_walks_are_true() {
    let plane = quad(DVec3::new(0.2, 0.3, 0.4), 0.6 * DVec3::X, 0.5 * DVec3::Y, [2, 2]);
    let mut spec = SceneSpec::furnace(2, 0.7);
    // Walks of several weights, and a furnace still: E = 1 − R on every wall.
    for (i, surface) in spec.surfaces.iter_mut().enumerate() {
        let reflectance = 0.2 + 0.1 * i as f64;
        surface.reflectance = reflectance.into();
        surface.emittance = (1.0 - reflectance).into();
    }
    for direction in [Direction::Shooting, Direction::Gathering(Birth::Uniform)] {
        let name = format!("continuous {direction:?}");
        let method = Walks { direction, space: Space::Continuous, score: EstimatorKind::Collision.into() };
        intervals_are_true(&name, &sensed(&spec, method, std::slice::from_ref(&plane)), &[1.0; 4]);
    }
}
