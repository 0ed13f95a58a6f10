//! Patches that are groups of cells: the system of the groups, and walks, batches and chains against it.

use crate::shapes::{grey, quad};
use exact::Exact;
use glam::DVec3;
use radiosity::{
    Birth, Chains, Direction, Estimate, Estimator, EstimatorKind, Experiment, IndexChoice, Method, Scene,
    SceneSpec, Shape, Space, SurfaceSpec, Walks,
    methods::{BatchScore, Batches, InfiniteEnd, Iterations, RayBirths, Sampler, Score, Solve},
};

/// The walls of a unit cube, facing inwards: z low, z high, y low, y high, x low, x high.
fn walls(cells: [u32; 2]) -> Vec<Shape> {
    let (x, y, z) = ([1., 0., 0.], [0., 1., 0.], [0., 0., 1.]);
    vec![
        quad([0.; 3], x, y, cells),
        quad(z, y, x, cells),
        quad([0.; 3], z, x, cells),
        quad(y, x, z, cells),
        quad([0.; 3], y, z, cells),
        quad(x, z, y, cells),
    ]
}

/// A cube with walls of these reflectances; the upper one emits.
fn cube(cells: [u32; 2], reflectances: [f64; 6]) -> SceneSpec {
    let emittance = |wall: usize| if wall == 1 { 1.0 } else { 0.0 };
    let surfaces = walls(cells).into_iter().zip(reflectances).enumerate();
    SceneSpec::new(surfaces.map(|(wall, (shape, r))| grey(shape, r, emittance(wall))).collect())
}

const WALLS: [f64; 6] = [0.5, 0.3, 0.8, 0.7, 0.8, 0.6];

/// The cube with its floor in two triangles, which are one patch, as are the four cells of every other wall; walls 2 and 4, which
/// meet at a right angle, are one patch together.
fn bent() -> SceneSpec {
    let mut spec = cube([2, 2], WALLS);
    let floor = spec.surfaces.remove(0);
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    for [a, b, c] in
        [[corner(0., 0.), corner(1., 0.), corner(1., 1.)], [corner(0., 0.), corner(1., 1.), corner(0., 1.)]]
    {
        spec.surfaces.push(SurfaceSpec { shape: Shape::Triangle { a, b, c, rows: 1 }, ..floor.clone() });
    }
    // Walls 1 … 5 have four cells each, the triangles one.
    let labels: Vec<u32> = (0..22).map(|cell| [0, 1, 2, 1, 4, 5][cell / 4]).collect();
    spec.grouped(&labels)
}

/// The four cells of each wall as one patch have the system of the wall.
#[test]
fn groups_that_are_a_wall_have_the_system_of_the_wall() {
    let labels: Vec<u32> = (0..24).map(|cell| cell / 4).collect();
    let coarse = Exact::of_scene(&cube([1, 1], WALLS)).unwrap();
    let grouped = Exact::of_scene(&cube([2, 2], WALLS).grouped(&labels)).unwrap();
    assert_eq!(grouped.face_count(), 6);
    let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-11);
    assert!(near(&grouped.solution().radiosity, &coarse.solution().radiosity));
    assert!(near(grouped.xi(), coarse.xi()) && near(grouped.areas(), coarse.areas()));
    for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
        let [a, b] = [&grouped, &coarse].map(|exact| exact.exchange().form_factor(i, j));
        assert!((a - b).abs() < 1e-11, "F_{i}{j} {a} {b}");
    }
}

/// Two walls at a right angle see each other, so that a part of the light of their patch arrives on it again: 0.20004 of it, the
/// form factor of adjacent squares.
#[test]
fn a_bent_group_sees_itself() {
    let exact = Exact::of_scene(&bent()).unwrap();
    assert_eq!(exact.face_count(), 5);
    assert!((exact.exchange().form_factor(1, 1) - 0.200_043_776).abs() < 1e-8);
    assert!(exact.exchange().row_sums().iter().all(|sum| (sum - 1.0).abs() < 1e-7));
    assert!((exact.areas()[1] - 2.0).abs() < 1e-12);
}

/// b of every patch by a method, in standard errors from the truth.
fn z_scores(
    exact: &Exact,
    spec: &SceneSpec,
    method: impl Into<Method>,
    samples: u64,
) -> Vec<(f64, Estimate)> {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    let solution = Experiment::new(scene, method).unwrap().run(11, samples).unwrap();
    let z = |(face, estimate): (usize, &Option<Estimate>)| {
        let estimate = estimate.unwrap();
        let error = estimate.radiosity - exact.solution().radiosity[face];
        (error / estimate.std_error.unwrap(), estimate)
    };
    solution.estimates.iter().enumerate().map(z).collect()
}

/// Discrete walks, batches and chains solve the system of the groups: 75 z-scores at 5 σ, those of the 30 samples of batches and
/// chains by the deviation of Student's t. False-alarm rate 10⁻³, once and for all with this seed; walks of constants on the cells
/// would be off by 0.3 to 8 %, some 3 to 80 standard errors.
#[test]
fn every_method_solves_the_system_of_the_groups() {
    let (spec, exact) = (bent(), Exact::of_scene(&bent()).unwrap());
    let end = InfiniteEnd::Roulette { threshold: 0.01 };
    let estimators =
        [Estimator::Collision, Estimator::Absorption, Estimator::Survival, Estimator::Infinite(end)];
    for estimator in estimators {
        for direction in
            [Direction::Shooting, Direction::Gathering(Birth::Area), Direction::Gathering(Birth::Uniform)]
        {
            let method = Walks { direction, space: Space::Discrete, score: Score::Of(estimator) };
            for (patch, (z, _)) in z_scores(&exact, &spec, method.clone(), 200_000).into_iter().enumerate() {
                assert!(z.abs() < 5.0, "patch {patch}: z = {z} by {method:?}");
            }
        }
    }
    let sobol = Batches {
        walks: 8192,
        sampler: Sampler::Sobol,
        score: BatchScore::Of(Estimator::Collision, Space::Discrete),
    };
    let links = Chains { rays: 20_000, linear: false, solve: Solve::Links, final_gather: vec![] };
    let births = RayBirths::Systematic;
    let iterations = Chains {
        solve: Solve::Iterations(Iterations { regular: 1, births, sampler: Sampler::Random }),
        ..links.clone()
    };
    for method in [Method::Batches(sobol), Method::Chains(links), Method::Chains(iterations)] {
        for (patch, (z, _)) in z_scores(&exact, &spec, method.clone(), 30).into_iter().enumerate() {
            assert!(z.abs() < 5.0, "patch {patch}: z = {z} by {method:?}");
        }
    }
}

/// The variance of one walk, by the sample of 400,000 of them against theory, with ξ of a patch that sees itself. The sample's own
/// error is some 0.4 %: 3 % are above 7 σ.
#[test]
fn variances_are_those_of_the_system_of_the_groups() {
    let (spec, exact) = (bent(), Exact::of_scene(&bent()).unwrap());
    let walks = 400_000;
    for kind in [EstimatorKind::Collision, EstimatorKind::Absorption, EstimatorKind::Survival] {
        let predicted = exact.shooting_variances(kind);
        let found = z_scores(&exact, &spec, Walks::shooting(kind), walks);
        for (patch, ((_, estimate), predicted)) in found.into_iter().zip(predicted).enumerate() {
            let variance = estimate.std_error.unwrap().powi(2) * walks as f64;
            assert!((variance / predicted - 1.0).abs() < 0.03, "patch {patch}: {variance}, not {predicted}");
        }
    }
}
