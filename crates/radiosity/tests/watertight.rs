//! In a closed scene not one walk is lost: nothing escapes, nothing meets a back, in any pose and shape.
//!
//! 10⁷ rays for each scene in the everyday suite; `RADWALK_RAYS=1000000000` asks for more.

use crate::common::{
    box_scene, bumpy_sphere, collision, cube54, experiment, flipped, map_corners, rotation, walk,
};
use glam::DVec3;
use radiosity::{IndexChoice, Scene, SceneSpec, Side, Space, Spectrum, SurfaceSpec, rays::Ray};

/// Rays to trace in each scene.
fn rays_wanted() -> u64 {
    std::env::var("RADWALK_RAYS").map_or(10_000_000, |rays| rays.parse().expect("RADWALK_RAYS is a number"))
}

/// Shoots until enough rays are traced, half discrete, half continuous.
fn assert_watertight(name: &str, spec: &SceneSpec) {
    for space in [Space::Discrete, Space::Continuous] {
        let experiment = experiment(spec, IndexChoice::Auto, collision(space));
        let (mut next, mut rays) = (0, 0);
        while rays < rays_wanted() / 2 {
            let counts = walk(&experiment, 2026, next..next + 100_000).counts;
            next += 100_000;
            rays += counts.rays;
            assert_eq!((counts.escaped, counts.absorbed_back), (0, 0), "{name}, {space:?}, walks to {next}");
            assert_eq!(counts.absorbed, counts.walks, "{name}: emitted = absorbed");
        }
    }
}

#[test]
fn a_plain_cube_is_watertight() {
    assert_watertight("cube54", &cube54());
}

#[test]
fn a_rotated_box_is_watertight() {
    let spec = box_scene(DVec3::new(1.0, 2.0, 3.0), [3, 4]);
    assert_watertight("rotated box", &map_corners(&spec, |p| rotation() * p));
}

#[test]
fn a_rotated_box_offset_by_1e3_edges_is_watertight() {
    let offset = DVec3::new(1e3, -0.7e3, 0.3e3);
    assert_watertight("offset 1e3", &map_corners(&cube54(), |p| rotation() * p + offset));
}

#[test]
fn a_rotated_box_offset_by_1e5_edges_is_watertight() {
    let offset = DVec3::new(-1e5, 0.9e5, 1e5);
    assert_watertight("offset 1e5", &map_corners(&cube54(), |p| rotation() * p + offset));
}

/// The scene with every surface written once more, back to back.
fn doubled(spec: &SceneSpec) -> SceneSpec {
    let mut surfaces = spec.surfaces.clone();
    let dark = |surface: &SurfaceSpec| SurfaceSpec {
        shape: flipped(surface.shape.clone()),
        emittance: Spectrum::BLACK,
        cell_emittance: vec![],
        transmittance: Default::default(),
        ..surface.clone()
    };
    surfaces.extend(spec.surfaces.iter().map(dark));
    SceneSpec::new(surfaces)
}

#[test]
fn rooms_of_doubled_walls_are_watertight() {
    let offset = DVec3::new(1e3, -0.7e3, 0.3e3);
    assert_watertight("doubled cube", &doubled(&map_corners(&cube54(), |p| rotation() * p + offset)));
    assert_watertight("doubled sphere", &doubled(&map_corners(&bumpy_sphere(2, 1), |p| rotation() * p)));
}

#[test]
fn slivered_boxes_are_watertight() {
    for size in [DVec3::new(1.0, 1.0, 1e-4), DVec3::new(1e4, 1.0, 1.0), DVec3::new(1.0, 1e-4, 1e-2)] {
        let spec = box_scene(size, [2, 3]);
        assert_watertight("sliver", &map_corners(&spec, |p| rotation() * p));
    }
}

#[test]
fn a_closed_mesh_is_watertight() {
    assert_watertight("bumpy sphere", &bumpy_sphere(2, 1));
}

#[test]
fn an_offset_mesh_of_slivers_is_watertight() {
    let squash = |p: DVec3| rotation() * (p * DVec3::new(1.0, 1e-3, 1.0)) + DVec3::splat(100.0);
    assert_watertight("squashed sphere", &map_corners(&bumpy_sphere(2, 2), squash));
}

/// Rays by chance hardly ever meet a seam, which is a few roundings wide. Here each is aimed at one: from the
/// middle at 20 points of every edge, ends included, and past them by up to three roundings of a coordinate, about
/// as far as neighbours differ that were meant to coincide.
fn assert_seams_hold(name: &str, spec: &SceneSpec) {
    let corners = spec.surfaces.iter().flat_map(|surface| surface.shape.corners());
    let rounding = f64::EPSILON * corners.fold(0.0, |max: f64, corner| max.max(corner.abs().max_element()));
    let signs = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let past: Vec<DVec3> = [0.0, 0.1, 0.3, 1.0, 3.0]
        .iter()
        .flat_map(|roundings| signs.map(|signs| DVec3::from_array(signs) * (roundings * rounding)))
        .collect();
    for index in [IndexChoice::Flat, IndexChoice::Tree] {
        let scene = Scene::build(spec, index).unwrap();
        for surface in scene.surfaces() {
            let corners = surface.outline();
            for (i, start) in corners.iter().enumerate() {
                for (&end, step) in
                    corners[i + 1..].iter().flat_map(|end| (0..20).map(move |step| (end, step)))
                {
                    for &past in &past {
                        let target = start.lerp(end, f64::from(step) / 19.0) + past;
                        let ray = Ray { origin: DVec3::ZERO, direction: target, from: Ray::FREE };
                        let side = scene.closest_hit(&ray).map(|hit| hit.side);
                        assert_eq!(side, Some(Side::Front), "{name}, {index:?}: {target}");
                    }
                }
            }
        }
    }
}

#[test]
fn no_ray_falls_through_a_seam() {
    for (name, offset) in [("at home", DVec3::ZERO), ("far away", DVec3::new(-1e5, 0.9e5, 1e5))] {
        let unlike = box_scene(DVec3::new(1.0, 2.0, 3.0), [3, 4]);
        let twice = doubled(&unlike);
        for (shape, spec) in
            [("cube", cube54()), ("box", unlike), ("mesh", bumpy_sphere(1, 1)), ("doubled box", twice)]
        {
            assert_seams_hold(&format!("{shape} {name}"), &map_corners(&spec, |p| rotation() * p + offset));
        }
    }
}
