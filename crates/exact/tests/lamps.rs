//! Lamps without area: their light on faces against walks, and what can be said exactly.

use std::f64::consts::PI;

use crate::common::{assert_near, plain_box};
use crate::shapes::{grey, painted, quad, room};
use exact::{Exact, ExactError, SystemAccuracy};
use glam::DVec3;
use photometry::{Distribution, Luminaire};
use radiosity::{
    Estimator, EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Sides, Solution,
    lamps::{Emission, LampSpec, LampsSpec},
};

/// A table without symmetry that lights the lower half of the sphere.
fn table() -> Distribution {
    let file = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 5 1 2 0 0 0\n1 1 10\n0 30 60 90\n0 90 180 270 360\n\
                100 80 20 0\n100 300 40 0\n100 10 5 0\n100 120 90 0\n100 80 20 0\n";
    Luminaire::read(file.as_bytes()).unwrap().distribution
}

fn lit(spec: SceneSpec, list: Vec<LampSpec>) -> SceneSpec {
    SceneSpec { lamps: LampsSpec { tables: vec![table()], list, ..LampsSpec::default() }, ..spec }
}

/// A dark room 2 × 1 × 1 with a wall half-way up, and a two-sided plate that hangs askew.
fn furnished() -> SceneSpec {
    let mut spec = painted(room([2.0, 1.0, 1.0], 2), 0.5, 0.0);
    let wall = quad([0.9, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.6], [2, 2]);
    let plate = quad([0.3, 0.2, 0.3], [0.4, 0.1, 0.1], [-0.1, 0.5, 0.2], [2, 1]);
    spec.surfaces.extend([wall, plate].map(|shape| grey(shape, 0.6, 0.0)));
    spec.surfaces.iter_mut().rev().take(2).for_each(|surface| surface.sides = Sides::Both);
    spec
}

fn lamps() -> Vec<LampSpec> {
    let at = |x: f64, y: f64, z: f64, emission: Emission| LampSpec::new(DVec3::new(x, y, z), emission, 1.0);
    vec![
        // In the plane of the ceiling, on the side that it is aimed at.
        at(0.45, 0.4, 1.0, Emission::Table(0)),
        at(1.4, 0.3, 0.5, Emission::Table(0)).aimed(DVec3::new(-1.0, 0.3, 0.2), 40.0),
        at(1.2, 0.6, 0.7, Emission::Spot { inner: 0.9, outer: 0.4 }).aimed(DVec3::new(0.2, -0.3, -1.0), 0.0),
        at(0.6, 0.7, 0.8, Emission::Uniform),
    ]
}

/// All light of a lamp meets a face where the scene is closed, a sixth of it each wall of a cube around it.
#[test]
fn a_closed_scene_gets_all_light_of_a_lamp() {
    let spec = plain_box(DVec3::ZERO, DVec3::ONE, [1, 1], 0.5, 0.0);
    let cube = lit(spec, vec![LampSpec::new(DVec3::splat(0.5), Emission::Uniform, 3.0)]);
    let exact = Exact::of_scene(&cube).unwrap();
    for met in &exact.lamps().incoming {
        assert_near(*met, 3.0 * 4.0 * PI / 6.0, 1e-6);
    }
    // A furnace by reciprocity: half of all light is absorbed wherever it meets a face, 4π·3/6 of twice the flux on each.
    for (phi, radiosity) in exact.solution().incoming.iter().zip(&exact.solution().radiosity) {
        assert_near(*phi, 2.0 * 2.0 * PI, 1e-6);
        assert_near(*radiosity, 2.0 * PI, 1e-6);
    }
    for lamp in lamps() {
        let exact = Exact::of_scene(&lit(furnished(), vec![lamp.clone()])).unwrap();
        let (met, error): (f64, f64) =
            (exact.lamps().incoming.iter().sum(), exact.lamps().error.iter().sum());
        assert_near(met / exact.total_power(), 1.0, 2e-5);
        assert!(error / met < 2e-5, "{lamp:?}: {error:e} of {met}");
    }
}

/// H of 32 faces by 4 million walks from four lamps: |z| < 4.5, a false alarm in 4,600 once and for all with this seed. Variances of 4·10⁴ walks
/// each, of blocks, are those of the closed form within 30 %: 100 blocks tell a variance within 14 %, and those of all faces together within 5 %.
#[test]
fn walks_find_the_light_of_lamps() {
    let spec = lit(furnished(), lamps());
    let exact = Exact::of_scene(&spec).unwrap();
    let accuracy = SystemAccuracy::of(&exact);
    let scene = Scene::build(&spec, IndexChoice::Auto).unwrap();
    let experiment = Experiment::new(scene, Method::shooting(Estimator::Collision)).unwrap();
    const BLOCKS: u64 = 100;
    const WALKS: u64 = 40_000;
    let n = exact.face_count();
    let (mut sums, mut squares) = (vec![0.0; n], vec![0.0; n]);
    for block in 0..BLOCKS {
        let (mut board, mut tally) = (experiment.board(), experiment.tally());
        experiment.walk(&Sequence::new(9), block * WALKS..(block + 1) * WALKS, &mut board);
        board.add_to(&mut tally).unwrap();
        let solution = Solution::new(&experiment, &tally, 0.95);
        for (i, estimate) in solution.estimates.iter().enumerate() {
            let b = estimate.as_ref().map_or(0.0, |estimate| estimate.radiosity);
            sums[i] += b;
            squares[i] += b * b;
        }
    }
    let variances = exact.shooting_variances(EstimatorKind::Collision);
    let (mut ratios, mut dark) = (0.0, 0);
    for i in 0..n {
        let truth = exact.solution().radiosity[i];
        let mean = sums[i] / BLOCKS as f64;
        let expected = variances[i] / WALKS as f64;
        let allowed = 4.5 * (expected / BLOCKS as f64).sqrt() + accuracy.radiosity_error[i];
        assert_near(mean, truth, allowed);
        if truth == 0.0 {
            dark += 1;
            continue;
        }
        ratios += (squares[i] / BLOCKS as f64 - mean * mean) / expected;
    }
    assert!(dark < n / 4, "{dark} of {n} faces are dark");
    assert_near(ratios / (n - dark) as f64, 1.0, 0.15);
}

#[test]
fn lamps_that_no_rule_could_find_are_refused() {
    let distant = LampSpec::new(DVec3::ZERO, Emission::Distant { rim: 1.0 }, 1.0);
    assert_eq!(Exact::of_scene(&lit(furnished(), vec![distant])).unwrap_err(), ExactError::DistantLamp);
    let near = LampSpec::new(DVec3::new(0.5, 0.5, 1.0), Emission::Uniform, 1.0);
    let refused = Exact::of_scene(&lit(furnished(), vec![near])).unwrap_err();
    assert_eq!(refused, ExactError::NearLamp { lamp: 0 });
}
