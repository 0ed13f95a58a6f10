//! Chains of links where emitters are small, or reflect next to nothing, and where few rays meet a patch.

use glam::DVec3;
use radiosity::{
    Chains, Estimate, Estimator, Experiment, IndexChoice, Method, Scene, SceneSpec, Sequence, Shape, Sides,
    Solution, SurfaceSpec,
    lamps::{Emission, LampSpec, LampsSpec},
    methods::Solve,
};
use stats::mean_squared_z;

/// A cube of 1 m whose sides have `cells` × `cells` cells, and a sheet in it whose edges are `edge` times [1, 0, 0] and [0, 1, 1].
fn cube_with_sheet(cells: u32, reflectance: f64, (corner, edge, sheet): (DVec3, f64, f64)) -> SceneSpec {
    let mut spec = SceneSpec::furnace(cells, reflectance);
    spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
    let shape =
        Shape::parallelogram(corner, corner + edge * DVec3::X, corner + edge * (DVec3::Y + DVec3::Z), [1, 1]);
    spec.surfaces.push(SurfaceSpec { sides: Sides::Both, ..SurfaceSpec::new(shape, sheet) });
    spec
}

fn links(rays: u64) -> Chains {
    Chains { rays, solve: Solve::Links, linear: false, final_gather: Vec::new() }
}

/// What some samples say of all faces; `None` where they say nothing.
fn estimates(spec: &SceneSpec, method: impl Into<Method>, samples: u64) -> Vec<Option<Estimate>> {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    let experiment = Experiment::new(scene, method).unwrap();
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(5), 0..samples, &mut board);
    let tally = board.take().unwrap();
    Solution::new(&experiment, &tally, 0.95).estimates
}

fn irradiance(estimate: &Option<Estimate>) -> f64 {
    estimate.unwrap().irradiance.unwrap()
}

/// A ceiling that emits and reflects next to nothing lights a cube as a black one does.
#[test]
fn a_nearly_black_emitter_lights_as_a_black_one() {
    let at = |reflectance: f64| {
        let mut spec = SceneSpec::furnace(2, 0.5);
        spec.surfaces.iter_mut().for_each(|surface| surface.emittance = 0.0.into());
        spec.surfaces[1].emittance = 1.0.into();
        spec.surfaces[1].reflectance = reflectance.into();
        estimates(&spec, links(2000), 8)
    };
    let black = at(0.0);
    for reflectance in [1e-30, 1e-12, 1e-9, 1e-5] {
        for (black, found) in black.iter().zip(at(reflectance)) {
            let [black, found] = [black, &found].map(irradiance);
            assert!((found / black - 1.0).abs() < 1e-3, "{reflectance}: {found}, black {black}");
        }
    }
}

/// A lamp of 1 mm that reflects lights a cube as walks find it. Of 24 faces no |z| is above 6, and the mean of z² is below 2: a false alarm in 1,000.
#[test]
fn a_small_emitter_lights_as_walks_find() {
    let mut spec = cube_with_sheet(2, 0.5, (DVec3::new(0.5, 0.5, 0.96), 1e-3, 0.9));
    spec.surfaces[6].emittance = 1e6.into();
    let walks = estimates(&spec, Method::shooting(Estimator::Collision), 400_000);
    let chains = estimates(&spec, links(3000), 24);
    let error = |estimate: &Option<Estimate>| estimate.unwrap().irradiance_error.unwrap();
    let z = |(a, b)| (irradiance(a) - irradiance(b)) / error(a).hypot(error(b));
    // The faces of the walls: no walk comes back to the lamp.
    let z: Vec<f64> = walks.iter().zip(&chains).take(24).map(z).collect();
    let squares = mean_squared_z(z.iter().copied()).unwrap().value;
    assert!(z.iter().all(|z| z.abs() < 6.0) && squares < 2.0, "{squares} {z:?}");
}

/// Chains may agree on a sheet because none of their rays met it. Intervals allow for a link to what emits. The rays to a faint lamp do not end
/// that: they are no shadow rays of faces.
#[test]
fn a_lamp_makes_rare_patches_no_more_certain() {
    let mut spec = cube_with_sheet(1, 0.05, (DVec3::new(0.3, 0.35, 0.4), 3e-3, 0.05));
    spec.surfaces[1].emittance = 1.0.into();
    spec.surfaces[1].reflectance = 0.5.into();
    let width = |spec: &SceneSpec| {
        let of_sheet = estimates(spec, links(2500), 8)[6];
        let [low, high] = of_sheet.unwrap().irradiance_interval.unwrap();
        (high - low) / irradiance(&of_sheet)
    };
    let alone = width(&spec);
    let list = vec![LampSpec::new(DVec3::splat(0.5), Emission::Uniform, 1e-4)];
    spec.lamps = LampsSpec { list, ..LampsSpec::default() };
    let beside = width(&spec);
    assert!(alone > 0.1 && beside > 0.5 * alone && beside < 2.0 * alone, "{alone} {beside}");
}
