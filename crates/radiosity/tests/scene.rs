//! What a scene makes of its description.

use std::collections::HashSet;

use crate::common::{box_scene, quad, surface};
use glam::DVec3;
use radiosity::{
    EstimatorKind, Experiment, IndexChoice, Scene, SceneSpec, Sequence, Shape, Side, Sides, Solution,
    SurfaceSpec, Walks,
};

fn build(surfaces: Vec<SurfaceSpec>) -> Scene {
    Scene::build(&SceneSpec::new(surfaces), IndexChoice::Auto).unwrap()
}

/// Replicas of a scene are compared by digest: whatever a walk can see must change it, and a name must not.
#[test]
fn the_digest_of_a_scene_tells_all_that_walks_see() {
    let changes: [fn(&mut SurfaceSpec); 9] = [
        |_| {},
        |surface| surface.sides = Sides::Both,
        |surface| surface.reflectance = 0.31.into(),
        |surface| surface.emittance = 0.1.into(),
        |surface| surface.cell_emittance[0].0 = 1,
        |surface| surface.cell_emittance[0].1 = 1.1.into(),
        |surface| surface.cell_emittance.push((2, 0.0.into())),
        |surface| surface.shape = quad(DVec3::ZERO, DVec3::X, DVec3::Y, [3, 2]),
        |surface| surface.shape = quad(DVec3::ZERO, DVec3::X, DVec3::Y.with_z(1e-9), [2, 3]),
    ];
    let hash = |change: &dyn Fn(&mut SurfaceSpec)| {
        let mut spec = box_scene(DVec3::ONE, [2, 3]);
        change(&mut spec.surfaces[0]);
        build(spec.surfaces).hash()
    };
    let hashes: HashSet<[u8; 32]> = changes.iter().map(|change| hash(change)).collect();
    assert_eq!(hashes.len(), changes.len());
    assert!(hashes.contains(&hash(&|surface| surface.name = Some("floor".into()))));
}

/// A cell's own emittance stands instead of its surface's, whose area is shared out evenly; triangles are half as
/// large as their parallelograms, and two sides emit twice.
#[test]
fn patches_have_their_share_of_area_and_power() {
    let triangle = Shape::Triangle { a: DVec3::ZERO, b: DVec3::X * 4.0, c: DVec3::Y * 2.0, rows: 2 };
    let square = quad(DVec3::Z, DVec3::X * 2.0, DVec3::Y * 3.0, [1, 3]);
    let scene = build(vec![
        SurfaceSpec {
            emittance: 5.0.into(),
            cell_emittance: vec![(1, 2.0.into()), (3, 0.0.into())],
            ..surface(triangle, 0.5)
        },
        SurfaceSpec { sides: Sides::Both, emittance: 1.5.into(), ..surface(square, 0.5) },
    ]);
    let faces = scene.faces().iter().map(|face| (face.area, face.emittance[0], face.power(0)));
    let [dark, dim, bright] = [0.0, 2.0, 5.0].map(|e| (1.0, e, e));
    let plate = (2.0, 1.5, 3.0);
    let plates = [plate; 6];
    let all: Vec<_> = [bright, dim, bright, dark].into_iter().chain(plates).collect();
    assert_eq!(faces.collect::<Vec<_>>(), all);
    assert_eq!(scene.total_power(0), 30.0);
    // Fronts in patch order, then backs.
    let places = scene.faces().iter().map(|face| (face.patch, face.side)).collect::<Vec<_>>();
    assert_eq!(places[6..], [(6, Side::Front), (4, Side::Back), (5, Side::Back), (6, Side::Back)]);
    assert_eq!(scene.faces().by_patch().collect::<Vec<_>>(), [0, 1, 2, 3, 4, 7, 5, 8, 6, 9]);
    assert_eq!(scene.faces().get(6).centroid, DVec3::new(1.0, 2.5, 1.0));
}

/// The survival estimator divides by the reflectance: at the end of the range of numbers its estimates were NaN in NaN … ∞.
#[test]
fn reflectances_that_scores_cannot_be_divided_by_are_refused() {
    let box_of = |reflectance: f64| {
        let mut spec = box_scene(DVec3::ONE, [1, 1]);
        spec.surfaces[1].reflectance = reflectance.into();
        spec
    };
    for reflectance in [5e-324, 1e-200, 9e-31] {
        let refused = Scene::build(&box_of(reflectance), IndexChoice::Auto).err().unwrap().to_string();
        assert!(refused.contains("is below 1e-30") && refused.contains("choose 0"), "{refused}");
    }
    for reflectance in [0.0, 1e-30] {
        let scene = build(box_of(reflectance).surfaces);
        let experiment = Experiment::new(scene, Walks::shooting(EstimatorKind::Survival)).unwrap();
        let mut board = experiment.board();
        experiment.walk(&Sequence::new(1), 0..1000, &mut board);
        let solution = Solution::new(&experiment, &board.take().unwrap(), 0.95);
        for estimate in solution.estimates.iter().flatten() {
            let values = [estimate.radiosity, estimate.ci_low, estimate.ci_high];
            assert!(
                values.iter().all(|x| x.is_finite()) && values[1] <= values[0] && values[0] <= values[2],
                "{values:?}"
            );
        }
    }
}
