//! Scenes that the tests share.

use glam::DVec3;
use radiosity::{
    EstimatorKind, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, Sides, Solution,
    Spectrum, SurfaceSpec, Tally, precision::Precision,
};

use crate::model::Model;
use crate::summary::{Provenance, RunFacts, Summary, Units};

/// A one-sided grey parallelogram: corner c, c + u, c + v.
pub(crate) fn quad(name: &str, corners: [[f64; 3]; 3], cells: [u32; 2], reflectance: f64) -> SurfaceSpec {
    let [corner, corner_u, corner_v] = corners.map(DVec3::from);
    SurfaceSpec {
        name: Some(name.into()),
        shape: Shape::Parallelogram { corner, corner_u, corner_v, cells },
        sides: Sides::Front,
        reflectance: reflectance.into(),
        emittance: Spectrum::BLACK,
        cell_emittance: vec![],
        transmittance: Default::default(),
    }
}

/// The unit cube in 54 patches of reflectance ½, the middle of its ceiling (z = 1) emitting.
pub(crate) fn cube() -> Scene {
    Scene::build(&cube_spec(), IndexChoice::Auto).unwrap()
}

pub(crate) fn cube_spec() -> SceneSpec {
    let corners = [
        ("floor, \"new\"", [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]),
        ("ceiling", [[0., 0., 1.], [0., 1., 1.], [1., 0., 1.]]),
        ("front", [[0., 0., 0.], [0., 0., 1.], [1., 0., 0.]]),
        ("back", [[0., 1., 0.], [1., 1., 0.], [0., 1., 1.]]),
        ("left", [[0., 0., 0.], [0., 1., 0.], [0., 0., 1.]]),
        ("right", [[1., 0., 0.], [1., 0., 1.], [1., 1., 0.]]),
    ];
    let mut surfaces: Vec<_> =
        corners.into_iter().map(|(name, corners)| quad(name, corners, [3, 3], 0.5)).collect();
    surfaces[1].cell_emittance = vec![(4, 1.0.into())];
    SceneSpec::new(surfaces)
}

/// A box like Cornell's: y is up, open towards −z, a dark wall at x = 0, a light one at x = 1, two blocks, a
/// lamp below the ceiling.
pub(crate) fn cornell() -> SceneSpec {
    let n = [8, 8];
    let mut lamp = quad("lamp", [[0.35, 0.999, 0.35], [0.65, 0.999, 0.35], [0.35, 0.999, 0.65]], [2, 2], 0.0);
    lamp.emittance = 20.0.into();
    let mut surfaces = vec![
        quad("floor", [[0., 0., 0.], [0., 0., 1.], [1., 0., 0.]], n, 0.75),
        quad("ceiling", [[0., 1., 0.], [1., 1., 0.], [0., 1., 1.]], n, 0.75),
        quad("back", [[0., 0., 1.], [0., 1., 1.], [1., 0., 1.]], n, 0.75),
        quad("dark", [[0., 0., 0.], [0., 1., 0.], [0., 0., 1.]], n, 0.15),
        quad("light", [[1., 0., 0.], [1., 0., 1.], [1., 1., 0.]], n, 0.6),
        lamp,
    ];
    surfaces.extend(block("short", [0.67, 0.28], 0.3, 0.3, 0.29));
    surfaces.extend(block("tall", [0.33, 0.66], 0.3, 0.6, -0.30));
    SceneSpec::new(surfaces)
}

/// The five visible faces of a block that stands on the floor, turned about the vertical.
fn block(name: &str, [x, z]: [f64; 2], width: f64, height: f64, turn: f64) -> Vec<SurfaceSpec> {
    let (middle, up) = (DVec3::new(x, 0.0, z), DVec3::Y * height);
    let a = DVec3::new(turn.cos(), 0.0, turn.sin()) * (0.5 * width);
    let b = DVec3::new(-turn.sin(), 0.0, turn.cos()) * (0.5 * width);
    let face = |corner: DVec3, u: DVec3, v: DVec3| {
        quad(name, [corner, corner + u, corner + v].map(DVec3::into), [4, 4], 0.75)
    };
    let mut faces = vec![face(middle + up - a - b, 2.0 * b, 2.0 * a)];
    for (out, along) in [(a, b), (b, -a), (-a, -b), (-b, a)] {
        faces.push(face(middle + out - along, up, 2.0 * along));
    }
    faces
}

/// An experiment with collision shooting.
pub(crate) fn experiment(scene: &Scene) -> Experiment {
    Experiment::new(scene.clone(), Method::shooting(EstimatorKind::Collision)).unwrap()
}

/// The tally of 100,000 walks.
pub(crate) fn shot(experiment: &Experiment) -> Tally {
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(1), 0..100_000, &mut board);
    board.take().unwrap()
}

/// The summary of a run of which nothing but its tally is known.
pub(crate) fn summary(experiment: &Experiment, tally: &Tally) -> Summary {
    let facts = RunFacts {
        model: Model::new(experiment.scene(), experiment.method(), None),
        version: String::new(),
        git: None,
        job_hash: [0; 32],
        seed: 1,
        method: experiment.method().clone(),
        paths: tally.counts.walks,
        seconds: 1.0,
        cpu_seconds: 1.0,
        workers_seen: 1,
        workers_lost: 0,
        streams: 1,
        streams_reissued: 0,
        target: None,
        discretised: None,
        accuracy: None,
        predicted: None,
        choice: None,
        partition: None,
        sensors: None,
        planes: Vec::new(),
        sources: Vec::new(),
        sensitivities: Vec::new(),
        import: Vec::new(),
        units: Units::RADIANT,
        checks: Vec::new(),
        confidence: 0.95,
        simultaneous: false,
        provenance: Provenance::default(),
    };
    Summary::new(experiment.scene(), tally, Precision::default(), facts)
}

/// B of every patch [W/m²].
pub(crate) fn radiosities(scene: &Scene) -> Vec<f64> {
    let experiment = experiment(scene);
    let solution = Solution::new(&experiment, &shot(&experiment), 0.95);
    solution.estimates.iter().flatten().map(|estimate| estimate.radiosity).collect()
}
