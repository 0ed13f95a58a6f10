//! Tests of furnished rooms: cupboards on floors and against walls, two-sided shelves, boxes that touch, rugs. All
//! methods are held to the exact solution, face by face.

use crate::common::{box_walls, quad, surface};
use crate::verdict::{Truth, exactly, judge};
use glam::DVec3;
use radiosity::{Experiment, IndexChoice, Method, Scene, SceneSpec, Sides, SurfaceSpec, methods::Sampler};

const X: DVec3 = DVec3::X;
const Y: DVec3 = DVec3::Y;
const Z: DVec3 = DVec3::Z;

/// A unit cube with a lamp in the middle of its ceiling.
fn room() -> SceneSpec {
    let mut surfaces: Vec<SurfaceSpec> =
        box_walls(DVec3::ONE, [2, 2]).into_iter().map(|wall| surface(wall, 0.7)).collect();
    let lamp = quad(DVec3::new(0.4, 0.4, 1.0), 0.2 * Y, 0.2 * X, [1, 1]);
    surfaces.push(SurfaceSpec { emittance: 5.0.into(), ..surface(lamp, 0.0) });
    // The lamp hangs in the plane of the ceiling, and before it.
    surfaces.rotate_right(1);
    SceneSpec::new(surfaces)
}

/// A panel of a piece of furniture.
fn panel(c: DVec3, u: DVec3, v: DVec3, sides: Sides) -> SurfaceSpec {
    SurfaceSpec { sides, ..surface(quad(c, u, v, [1, 1]), 0.5) }
}

/// The panels of a box from one corner to the opposite one; fronts outside.
fn crate_at(low: DVec3, high: DVec3, sides: Sides) -> Vec<SurfaceSpec> {
    let (x, y, z) = ((high.x - low.x) * X, (high.y - low.y) * Y, (high.z - low.z) * Z);
    [(low, y, x), (low + z, x, y), (low, x, z), (low + y, z, x), (low, z, y), (low + x, y, z)]
        .map(|(c, u, v)| panel(c, u, v, sides))
        .into()
}

/// A cupboard of two-sided panels that stands on the floor, open at the front by a slit.
fn cupboard_on_floor() -> SceneSpec {
    let mut spec = room();
    let mut cupboard = crate_at(DVec3::new(0.25, 0.5, 0.0), DVec3::new(0.5, 0.75, 0.5), Sides::Both);
    cupboard[2] = panel(DVec3::new(0.25, 0.5, 0.0), 0.15 * X, 0.5 * Z, Sides::Both);
    spec.surfaces.extend(cupboard);
    spec
}

/// A closed chest in a corner: on the floor, and against two walls.
fn chest_in_a_corner() -> SceneSpec {
    let mut spec = room();
    spec.surfaces.extend(crate_at(DVec3::ZERO, DVec3::new(0.5, 0.5, 0.25), Sides::Front));
    spec
}

/// Three boxes, one on the other, and one that touches them from the side.
fn boxes_that_touch() -> SceneSpec {
    let mut spec = room();
    for (low, high) in [
        ([0.25, 0.25, 0.0], [0.75, 0.75, 0.25]),
        ([0.25, 0.25, 0.25], [0.5, 0.5, 0.5]),
        ([0.75, 0.25, 0.0], [1.0, 0.5, 0.25]),
    ] {
        spec.surfaces.extend(crate_at(low.into(), high.into(), Sides::Front));
    }
    spec
}

/// Shelves between two uprights that stand against a wall, all of them two-sided sheets.
fn shelves() -> SceneSpec {
    let mut spec = room();
    for x in [0.25, 0.75] {
        spec.surfaces.push(panel(DVec3::new(x, 0.0, 0.0), 0.25 * Y, 0.75 * Z, Sides::Both));
    }
    for z in [0.25, 0.5, 0.75] {
        spec.surfaces.push(panel(DVec3::new(0.25, 0.0, z), 0.5 * X, 0.25 * Y, Sides::Both));
    }
    spec
}

/// Rugs on the floor that overlap, a picture on a wall, and the wall behind it written twice.
fn rugs_and_a_doubled_wall() -> SceneSpec {
    let mut spec = room();
    let again = spec.surfaces[3].clone();
    spec.surfaces.push(again);
    spec.surfaces.push(panel(DVec3::new(0.25, 0.0, 0.25), 0.5 * Z, 0.5 * X, Sides::Front));
    spec.surfaces.push(panel(DVec3::new(0.0, 0.0, 0.0), 0.5 * X, 0.5 * Y, Sides::Both));
    spec.surfaces.push(panel(DVec3::new(0.0, 0.5, 0.0), 1.0 * X, 0.5 * Y, Sides::Front));
    spec
}

/// A scene with a wall of one sheet that leaves a dark room behind it, lit through a door, and a tent in the lit room.
fn a_wall_and_a_tent() -> SceneSpec {
    let mut spec = room();
    spec.surfaces.push(panel(DVec3::new(0.0, 0.75, 0.0), 0.75 * X, 1.0 * Z, Sides::Both));
    spec.surfaces.push(panel(DVec3::new(0.25, 0.25, 0.0), 0.4 * Y, DVec3::new(0.25, 0.0, 0.4), Sides::Both));
    spec.surfaces.push(panel(DVec3::new(0.75, 0.25, 0.0), 0.4 * Y, DVec3::new(-0.25, 0.0, 0.4), Sides::Both));
    spec
}

fn experiment(spec: &SceneSpec, method: Method) -> Experiment {
    Experiment::new(Scene::build(spec, IndexChoice::Auto).unwrap(), method).unwrap()
}

/// Checks the mean squared z and the coverage of chains and of batches of walks, 8 per seed, within 4 standard errors
/// of their expectation (false-alarm rate 10⁻⁴ each, once and for all with these seeds).
fn all_methods_are_true(spec: &SceneSpec) {
    let truth: Truth = exactly(spec);
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    println!("{} faces, {} stacks", scene.faces().len(), scene.stacks().len());
    judge(&experiment(spec, Method::chains(1 << 14)), &truth, 60).agrees(0.2);
    judge(&experiment(spec, Method::batches(1 << 12, Sampler::Random)), &truth, 60).agrees(0.2);
}

#[test]
fn a_cupboard_on_the_floor() {
    all_methods_are_true(&cupboard_on_floor());
}

#[test]
fn a_chest_in_a_corner() {
    all_methods_are_true(&chest_in_a_corner());
}

#[test]
fn three_boxes_that_touch() {
    all_methods_are_true(&boxes_that_touch());
}

#[test]
fn two_sided_shelves() {
    all_methods_are_true(&shelves());
}

#[test]
fn overlapping_rugs_and_a_doubled_wall() {
    all_methods_are_true(&rugs_and_a_doubled_wall());
}

#[test]
fn a_sheet_between_two_rooms_and_a_tent() {
    all_methods_are_true(&a_wall_and_a_tent());
}
