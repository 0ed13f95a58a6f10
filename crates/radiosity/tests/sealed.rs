//! Which faces light cannot reach: by who sees whom, not by the luck of walks.

use crate::common::{box_walls, flipped, quad, surface};
use glam::DVec3;
use radiosity::{IndexChoice, Scene, SceneSpec, Shape, Sides, SurfaceSpec};

fn sealed(spec: &SceneSpec) -> Vec<usize> {
    let scene = Scene::build(spec, IndexChoice::Auto).unwrap();
    (0..scene.faces().len()).filter(|&face| scene.sealed().group_of(face as u32).is_some()).collect()
}

fn moved(shape: &Shape, by: DVec3) -> Shape {
    shape.moved(|point| point + by)
}

/// A cube whose floor emits, with the walls given besides.
fn lit_cube(size: f64, more: Vec<SurfaceSpec>) -> SceneSpec {
    let mut surfaces: Vec<SurfaceSpec> =
        box_walls(DVec3::splat(size), [2, 2]).into_iter().map(|wall| surface(wall, 0.5)).collect();
    surfaces[0].emittance = 1.0.into();
    surfaces.extend(more);
    SceneSpec::new(surfaces)
}

#[test]
fn a_closed_box_within_a_box_is_sealed_and_nothing_else() {
    let within = |shape: &Shape| moved(shape, DVec3::splat(1.0));
    let inner: Vec<SurfaceSpec> = box_walls(DVec3::ONE, [1, 1])
        .iter()
        .map(|wall| SurfaceSpec { sides: Sides::Both, ..surface(within(wall), 0.5) })
        .collect();
    // 24 faces of the outer box and 6 fronts, which face the inside of the inner box; then the backs of these.
    assert_eq!(sealed(&lit_cube(3.0, inner)), (24..30).collect::<Vec<_>>());
    let outwards = |walls: Vec<Shape>| walls.into_iter().map(|wall| surface(flipped(wall), 0.5)).collect();
    let within: Vec<Shape> = box_walls(DVec3::ONE, [1, 1]).iter().map(within).collect();
    assert_eq!(sealed(&lit_cube(3.0, outwards(within))), [0_usize; 0]);
}

#[test]
fn backs_that_look_into_the_open_are_sealed() {
    let mut spec = lit_cube(1.0, Vec::new());
    spec.surfaces[1].sides = Sides::Both;
    assert_eq!(sealed(&spec), (24..28).collect::<Vec<_>>());
}

/// A second cube beside the first. The wall between them has a hole of 4 cm, a 3,700th of what the second cube sees.
#[test]
fn a_room_behind_a_small_hole_is_not_sealed() {
    let (low, high) = (0.48, 0.52);
    let piece = |from: [f64; 2], to: [f64; 2]| {
        let (u, v) = (DVec3::Y * (to[0] - from[0]), DVec3::Z * (to[1] - from[1]));
        let shape = quad(DVec3::new(1.0, from[0], from[1]), u, v, [1, 1]);
        SurfaceSpec { sides: Sides::Both, ..surface(shape, 0.5) }
    };
    let rooms = |hole: bool| {
        let mut spec = lit_cube(1.0, Vec::new());
        // The wall x = 1 of both rooms is made of pieces.
        spec.surfaces.pop();
        let second = box_walls(DVec3::ONE, [2, 2]).into_iter().enumerate().filter(|(wall, _)| *wall != 4);
        spec.surfaces.extend(second.map(|(_, wall)| surface(moved(&wall, DVec3::X), 0.5)));
        spec.surfaces.extend([
            piece([0.0, 0.0], [1.0, low]),
            piece([0.0, high], [1.0, 1.0]),
            piece([0.0, low], [low, high]),
            piece([high, low], [1.0, high]),
        ]);
        if !hole {
            spec.surfaces.push(piece([low, low], [high, high]));
        }
        spec
    };
    assert_eq!(sealed(&rooms(true)), [0_usize; 0]);
    // The second room has 20 faces and five sides of pieces, which are the fronts.
    assert_eq!(sealed(&rooms(false)), (20..45).collect::<Vec<_>>());
}

/// Black faces join nothing: each must see the small lamp by itself, which takes up down to a 60,000th of what a face sees.
#[test]
fn black_walls_that_see_a_small_lamp_are_not_sealed() {
    let walls = box_walls(DVec3::ONE, [8, 8]).into_iter().map(|wall| surface(wall, 0.0));
    let lamp = quad(DVec3::new(0.5, 0.5, 0.5), DVec3::X * 0.01, DVec3::Y * 0.01, [1, 1]);
    let lamp = SurfaceSpec { emittance: 1.0.into(), sides: Sides::Both, ..surface(lamp, 0.0) };
    // Nothing lights the lamp.
    assert_eq!(sealed(&SceneSpec::new(walls.chain([lamp]).collect())), [384, 385]);
}
