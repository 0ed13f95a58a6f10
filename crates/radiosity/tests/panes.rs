//! Panes on the way of light: every method against quadrature of the law of glass, and methods against each other.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::DVec3;
use radiosity::{
    Birth, Estimator, Experiment, IndexChoice, Method, Scene, SceneError, SceneSpec, Sequence, Shape,
    Solution, SurfaceSpec, Unfit,
    daylight::{Coefficients, SkyPatches, SkyTally},
    lamps::{Emission, LampSpec},
    sensors::{Readings, SensorShape, SensorSpec},
    surfaces::{CLEAREST, PaneSpec},
};
use stats::mean_squared_z;

/// A square of 2 m around the z axis; its front faces up, or down.
fn square(z: f64, up: bool) -> Shape {
    let (u, v) = if up { (DVec3::X, DVec3::Y) } else { (DVec3::Y, DVec3::X) };
    Shape::parallelogram(DVec3::new(0.0, 0.0, z) - u - v, 2.0 * u, 2.0 * v, [2, 2])
}

fn pane(shape: Shape, transmittance: f64) -> PaneSpec {
    PaneSpec { name: "pane".into(), shape, transmittance }
}

/// A plate of index 1.52: reflections between its faces, one after the other.
#[derive(Clone, Copy)]
struct Plate {
    /// What one way straight through it leaves.
    left: f64,
}

impl Plate {
    /// The plate that passes T at normal incidence, by bisection.
    fn new(transmittance: f64) -> Self {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            *(if through((0.52_f64 / 2.52).powi(2), middle) < transmittance {
                &mut low
            } else {
                &mut high
            }) = middle;
        }
        Plate { left: low }
    }

    fn passes(self, cosine: f64) -> f64 {
        let angle = cosine.clamp(0.0, 1.0 - 1e-15).acos();
        let inside = (angle.sin() / 1.52).asin();
        let left = self.left.powf(1.0 / inside.cos());
        let across = ((angle - inside).sin() / (angle + inside).sin()).powi(2);
        let along = ((angle - inside).tan() / (angle + inside).tan()).powi(2);
        0.5 * (through(across, left) + through(along, left))
    }
}

/// What passes two faces of reflectance r, given what one way between them leaves.
fn through(r: f64, left: f64) -> f64 {
    let (mut sum, mut term) = (0.0, (1.0 - r) * (1.0 - r) * left);
    while term > 1e-17 {
        sum += term;
        term *= r * r * left * left;
    }
    sum
}

/// Points and weights of Gauss's rule of 5 points on [−1, 1].
fn gauss() -> [[f64; 2]; 5] {
    let (a, b) = (
        (5.0 - 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0,
        (5.0 + 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0,
    );
    let (wa, wb) = ((322.0 + 13.0 * 70.0_f64.sqrt()) / 900.0, (322.0 - 13.0 * 70.0_f64.sqrt()) / 900.0);
    [[0.0, 128.0 / 225.0], [a, wa], [-a, wa], [b, wb], [-b, wb]]
}

/// The integral over [0, 1]², in 2 × 2 parts.
fn over_square(f: impl Fn([f64; 2]) -> f64) -> f64 {
    let points: Vec<[f64; 2]> = (0..2)
        .flat_map(|part| gauss().map(|[x, w]| [(f64::from(part) + 0.5 + 0.5 * x) / 2.0, w / 4.0]))
        .collect();
    points.iter().map(|[x, wx]| points.iter().map(|[y, wy]| wx * wy * f([*x, *y])).sum::<f64>()).sum()
}

/// A grey floor under a black ceiling that emits 1 W/m², 1.5 m apart, with two panes between, one of them tilted.
fn plates() -> SceneSpec {
    let mut spec = SceneSpec::new(vec![
        SurfaceSpec::new(square(0.0, true), 0.5),
        SurfaceSpec::new(square(1.5, false), 0.0).emitting(1.0),
    ]);
    spec.panes = vec![pane(square(0.4, true), 0.7), pane(wide_and_tilted(), 0.9)];
    // All light crosses the first one.
    let Shape::Parallelogram { corner, corner_u, corner_v, .. } = &mut spec.panes[0].shape else {
        unreachable!()
    };
    *corner = DVec3::new(-9.0, -9.0, 0.4);
    *corner_u = DVec3::new(9.0, -9.0, 0.4);
    *corner_v = DVec3::new(-9.0, 9.0, 0.4);
    spec
}

/// Its normal is (0.2, 0, 1), and all light between the plates crosses it.
fn wide_and_tilted() -> Shape {
    let corner = DVec3::new(-1.5, -9.0, 0.9 + 0.3);
    Shape::parallelogram(corner, DVec3::new(3.0, 0.0, -0.6), DVec3::new(0.0, 18.0, 0.0), [1, 1])
}

/// What passes both panes of [`plates`] along a direction.
fn through_both(direction: DVec3) -> f64 {
    static PLATES: LazyLock<[Plate; 2]> = LazyLock::new(|| [0.7, 0.9].map(Plate::new));
    let tilted = DVec3::new(0.2, 0.0, 1.0).normalize();
    PLATES[0].passes(direction.z.abs()) * PLATES[1].passes(direction.dot(tilted).abs())
}

/// H of a point of the floor, by quadrature.
fn floor_light(x: f64, y: f64) -> f64 {
    4.0 * over_square(|[s, t]| {
        let way = DVec3::new(2.0 * s - 1.0 - x, 2.0 * t - 1.0 - y, 1.5);
        let square = way.length_squared();
        let direction = way / square.sqrt();
        direction.z * direction.z / (PI * square) * through_both(direction)
    })
}

/// B of the floor's cells by walks from both ends, and H of a point by a sensor, whose rays are those of a final gather, against quadrature. The floor's four cells
/// are alike but for the tilt. Five figures a seed, 40 seeds each: mean squares of z within 4 of their standard errors of 1 (one false alarm in
/// 4,000 in all).
#[test]
fn every_method_sees_through_panes() {
    let scene = Scene::build(&plates(), IndexChoice::Auto).unwrap();
    let cell = |i: usize| {
        let [x, y] = [i / 2, i % 2].map(|i| i as f64 - 1.0);
        over_square(|[s, t]| floor_light(x + s, y + t))
    };
    let cells: Vec<f64> = (0..4).map(cell).collect();
    assert!(cells[0] < 0.5 && (cells[0] / cells[3] - 1.0).abs() > 1e-4, "{cells:?}");
    let shooting = Method::shooting(Estimator::Collision);
    let gathering = Method::gathering(Birth::Area, Estimator::Collision);
    for method in [shooting.clone(), gathering] {
        let experiment = Experiment::new(scene.clone(), method.clone()).unwrap();
        let mut z = Vec::new();
        for seed in 0..40 {
            let solution = experiment.run(seed, 50_000).unwrap();
            for (estimate, exact) in solution.estimates[..4].iter().zip(&cells) {
                let estimate = estimate.as_ref().unwrap();
                z.push((estimate.radiosity - 0.5 * exact) / estimate.std_error.unwrap());
            }
        }
        let squares = mean_squared_z(z).unwrap();
        assert!(squares.z(1.0).abs() < 4.0, "{squares:?}, {method:?}");
    }
    let point = SensorShape::Point { point: DVec3::new(0.3, -0.2, 0.0), normal: DVec3::Z };
    let sensors = [SensorSpec { name: "s".into(), shape: point }];
    let experiment = Experiment::new(scene, shooting).unwrap().with_sensors(&sensors).unwrap();
    let exact = floor_light(0.3, -0.2);
    let z = (0..40).map(|seed| {
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(seed), 0..32_768, &mut board);
        let tally = board.take().unwrap();
        let reading = Readings::new(&experiment, &tally, 0.95).unwrap().cell(0)[0];
        (reading.irradiance.unwrap() - exact) / reading.std_error.unwrap()
    });
    let squares = mean_squared_z(z).unwrap();
    assert!(squares.z(1.0).abs() < 4.0, "{squares:?}");
}

/// A lamp's light at a point through a pane, to the last digits.
#[test]
fn lamps_shine_through_panes() {
    let mut spec = plates();
    spec.surfaces.pop();
    spec.lamps.list = vec![LampSpec::new(DVec3::new(0.4, 0.3, 1.4), Emission::Uniform, 5.0)];
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    for [x, y] in [[0.0, 0.0], [0.4, 0.3], [-0.8, 0.9]] {
        let way = DVec3::new(0.4 - x, 0.3 - y, 1.4);
        let square = way.length_squared();
        let expected = 5.0 * way.z / square.sqrt() / square * through_both(way.normalize());
        let light =
            scene.lamps_at(DVec3::new(x, y, 0.0) - scene.origin(), DVec3::Z, radiosity::rays::Ray::FREE)[0];
        assert!((light / expected - 1.0).abs() < 1e-12, "{light} {expected}");
    }
}

/// Light that crosses the edge where panes adjoin, the corner of four, or the diagonal of two triangles crosses one of them, in every order and with
/// every turn of their sides; two panes behind each other weaken it twice there, too.
#[test]
fn light_crosses_one_of_adjoining_panes() {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let quad = |x: f64, y: f64, z: f64, [u, v]: [DVec3; 2]| Shape::parallelogram(at(x, y, z), u, v, [1, 1]);
    let four = |z: f64| {
        let [x, y] = [DVec3::X, DVec3::Y];
        [
            quad(-1.0, -1.0, z, [x, y]),
            quad(1.0, -1.0, z, [-x, y]),
            quad(-1.0, 1.0, z, [-y, x]),
            quad(0.0, 0.0, z, [x, y]),
        ]
    };
    let halves = [
        Shape::Triangle { a: at(-1.0, -1.0, 0.7), b: at(1.0, -1.0, 0.7), c: at(1.0, 1.0, 0.7), rows: 1 },
        Shape::Triangle { a: at(1.0, 1.0, 0.7), b: at(-1.0, 1.0, 0.7), c: at(-1.0, -1.0, 0.7), rows: 1 },
    ];
    let passes = Plate::new(0.5).passes(1.0);
    for (shapes, times) in
        [(four(0.7).to_vec(), 1), (halves.to_vec(), 1), ([four(0.7), four(0.9)].concat(), 2)]
    {
        let mut spec = SceneSpec::new(vec![SurfaceSpec::new(square(0.0, true), 0.5).emitting(1.0)]);
        spec.panes = shapes.into_iter().map(|shape| pane(shape, 0.5)).collect();
        let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
        for [x, y] in [[0.0, 0.0], [0.0, 0.3], [-0.4, 0.0], [0.25, 0.25], [0.3, 0.2]] {
            let origin = at(x, y, 0.1) - scene.origin();
            let ray = radiosity::rays::Ray { origin, direction: DVec3::Z, from: radiosity::rays::Ray::FREE };
            let passed = scene.passed_panes(&ray, 10.0);
            assert!((passed / passes.powi(times) - 1.0).abs() < 1e-9, "{x} {y}: {passed}");
        }
    }
}

/// Under a pane as wide as the sky a sensor that faces up receives 2·∫ τ(μ)·μ dμ of a uniform sky: of 10⁶ walks within 4 standard errors (a false
/// alarm in 16,000). A direction that it sees comes with its cosine and what passes.
#[test]
fn daylight_comes_through_panes() {
    let side = 1e7;
    let shape = Shape::parallelogram(
        DVec3::new(-side, -side, 1.0),
        2.0 * side * DVec3::X,
        2.0 * side * DVec3::Y,
        [1, 1],
    );
    let mut spec = SceneSpec::new(vec![SurfaceSpec::new(square(-1.0, true), 0.5).emitting(1.0)]);
    spec.panes = vec![pane(shape, 0.8)];
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let shape = SensorShape::Point { point: DVec3::ZERO, normal: DVec3::Z };
    let sensors = [SensorSpec { name: "s".into(), shape }];
    let coefficients = Coefficients::new(scene, &sensors, SkyPatches::new(145).unwrap()).unwrap();
    let mut tally = SkyTally::new(145);
    coefficients.walk(&Sequence::new(1), 0, 0..1_000_000, &mut tally);
    let (steps, plate) = (20_000, Plate::new(0.8));
    let expected: f64 = (0..steps)
        .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
        .map(|cosine| 2.0 * cosine * plate.passes(cosine) / f64::from(steps))
        .sum();
    let found = tally.straight.iter().sum::<u64>() as f64 / 1e6;
    let z = (found - expected) / (expected * (1.0 - expected) / 1e6).sqrt();
    assert!(z.abs() < 4.0, "{found} {expected}");
    assert_eq!(tally.backs, 0);
    let direction = DVec3::new(0.6, 0.0, 0.8).to_array();
    assert!((coefficients.receives(0, direction) - 0.8 * plate.passes(0.8)).abs() < 1e-12);
}

/// A closed box that a pane divides, lit on one side, in colour and with long walks: walks from the light, and walks from the dark half, in both spaces,
/// find equal radiosities. Mean squares of the differences within 4 standard errors of 1 (a false alarm in 16,000 each).
#[test]
fn shooting_and_gathering_agree_behind_a_pane() {
    let mut spec = SceneSpec::furnace(2, 0.7);
    for (i, surface) in spec.surfaces.iter_mut().enumerate() {
        surface.emittance = if i == 0 { 1.0.into() } else { 0.0.into() };
        surface.reflectance = radiosity::Spectrum::rgb([0.7, 0.5, 0.3]);
    }
    let middle = Shape::parallelogram(DVec3::new(0.5, 0.0, 0.0), DVec3::Y, DVec3::Z, [1, 1]);
    spec.panes = vec![pane(middle, 0.6)];
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let run = |method: Method, seed: u64, walks: u64| {
        let experiment = Experiment::new(scene.clone(), method).unwrap();
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(seed), 0..walks, &mut board);
        let tally = board.take().unwrap();
        let solution = Solution::new(&experiment, &tally, 0.95);
        (solution, tally.counts)
    };
    let (shot, counts) = run(Method::shooting(Estimator::Collision), 5, 400_000);
    let (gathered, _) = run(Method::gathering(Birth::Area, Estimator::Collision), 6, 1_600_000);
    let z = shot.estimates.iter().zip(&gathered.estimates).filter_map(|(a, b)| {
        let (a, b) = (a.as_ref()?, b.as_ref()?);
        let error = a.std_error?.hypot(b.std_error?);
        Some((a.radiosity - b.radiosity) / error)
    });
    let squares = mean_squared_z(z.collect::<Vec<_>>()).unwrap();
    assert!(squares.z(1.0).abs() < 4.0, "{squares:?}");
    assert_eq!(
        (counts.absorbed, counts.escaped, counts.absorbed_back),
        (400_000, 0, 0),
        "panes absorb the rest"
    );
}

#[test]
fn what_panes_cannot_be_is_refused() {
    let mut spec = plates();
    spec.panes[1].transmittance = CLEAREST + 1e-9;
    let Err(SceneError::Whole(problem)) = Scene::build(&spec, IndexChoice::Auto) else {
        panic!("it is built")
    };
    assert!(problem.contains("0.918"), "{problem}");
    let scene = Scene::build(&plates(), IndexChoice::Auto).unwrap();
    let chains = Experiment::new(scene.clone(), Method::chains(1 << 12));
    assert!(matches!(chains, Err(Unfit::PanesOfChains)));
    let bare = Scene::build(&SceneSpec { panes: Vec::new(), ..plates() }, IndexChoice::Auto).unwrap();
    assert_ne!(scene.hash(), bare.hash());
}
