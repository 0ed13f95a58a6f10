//! Small scenes that drive methods to where they fail.

use glam::DVec3;
use radiosity::{SceneSpec, Shape, SurfaceSpec};

use crate::boxes::quad;
use crate::material::SceneMaterial;

const X: DVec3 = DVec3::X;
const Y: DVec3 = DVec3::Y;
const Z: DVec3 = DVec3::Z;

/// The six walls of the unit cube, facing inwards: z low, z high, x low, x high, y low, y high.
fn walls() -> [Shape; 6] {
    let o = DVec3::ZERO;
    [(o, X, Y), (Z, Y, X), (o, Y, Z), (X, Z, Y), (o, Z, X), (Y, X, Z)]
        .map(|(corner, u, v)| quad(corner, u, v, [1, 1]))
}

/// A wedge: two unit squares that meet at an angle [rad], with the third side and the two ends closed. Everything
/// reflects R and emits 1 − R, so that B = 1 W/m² everywhere.
pub fn wedge(angle: f64, reflectance: f64) -> SceneSpec {
    let material = SceneMaterial::new(reflectance).emitting(1.0 - reflectance);
    let slope = DVec3::new(angle.cos(), 0.0, angle.sin());
    let shapes = [
        quad(DVec3::ZERO, X, Y, [2, 1]),
        quad(DVec3::ZERO, Y, slope, [1, 2]),
        quad(X, slope - X, Y, [1, 1]),
        Shape::Triangle { a: DVec3::ZERO, b: slope, c: X, rows: 1 },
        Shape::Triangle { a: Y, b: X + Y, c: slope + Y, rows: 1 },
    ];
    SceneSpec::new(shapes.map(|shape| material.surface(shape)).into())
}

/// A closed unit cube of reflectance R. Patch 0, a square of this side in a corner of the floor, and patches 1 and 2
/// make up the floor; the other walls are a patch each, 3 to 7, the first of them the ceiling. Nothing emits yet.
pub fn cube_with_tile(side: f64, reflectance: f64) -> SceneSpec {
    let material = SceneMaterial::new(reflectance);
    let (u, v) = (X * side, Y * side);
    let floor = [quad(DVec3::ZERO, u, v, [1, 1]), quad(v, u, Y - v, [1, 1]), quad(u, X - u, Y, [1, 1])];
    let rest = walls().into_iter().skip(1);
    SceneSpec::new(floor.into_iter().chain(rest).map(|shape| material.surface(shape)).collect())
}

/// Two unit squares that face each other, of reflectance R, the first in z = 1; it emits 1 W/m².
pub fn plates(gap: f64, reflectance: f64) -> SceneSpec {
    let material = SceneMaterial::new(reflectance);
    let surfaces = vec![
        material.emitting(1.0).surface(quad(Z, X, Y, [1, 1])),
        material.surface(quad(Z * (1.0 + gap), Y, X, [1, 1])),
    ];
    SceneSpec::new(surfaces)
}

/// A black lamp, a square of side 0.1 m · `scale`, at the height `distance` · `scale` [m] above the middle of a unit
/// floor of 3 × 3 patches, whose reflectance is 0.5. Lamps of one distance and different scales look alike from where
/// the floor's middle is. The floor comes first.
pub fn far_lamp(distance: f64, scale: f64) -> SceneSpec {
    let side = 0.1 * scale;
    let corner = DVec3::new(0.5 * (1.0 - side), 0.5 * (1.0 - side), distance * scale);
    let floor = SceneMaterial::new(0.5).surface(quad(DVec3::ZERO, X, Y, [3, 3]));
    let lamp = SceneMaterial::new(0.0).emitting(1.0).surface(quad(corner, Y * side, X * side, [1, 1]));
    SceneSpec::new(vec![floor, lamp])
}

/// Two closed unit cubes apart, R = 0.5, of six patches each. The floor of the first emits 1 W/m², that of the second
/// (patch 6) `dim`.
pub fn unequal_rooms(dim: f64) -> SceneSpec {
    let mut surfaces: Vec<SurfaceSpec> = Vec::new();
    for (from, emittance) in [(0.0, 1.0), (2.0, dim)] {
        let room = walls().map(|shape| SceneMaterial::new(0.5).surface(shape));
        let room = SceneSpec::new(room.into());
        let mut room = moved(&room, |corner| corner + X * from).surfaces;
        room[0].emittance = emittance.into();
        surfaces.append(&mut room);
    }
    SceneSpec::new(surfaces)
}

/// Two unit cubes whose common wall, 2 cm thick, has a square hole of this side in its middle; reflectance R
/// everywhere, a lamp in the floor of the first, x < 1.
pub fn two_rooms(hole: f64, reflectance: f64) -> SceneSpec {
    let material = SceneMaterial::new(reflectance);
    let room = |from: f64| {
        let (o, x) = (X * from, X * 0.99);
        [(o, x, Y), (o + Z, Y, x), (o, Z, x), (o + Y, x, Z)].map(|(c, u, v)| quad(c, u, v, [2, 2]))
    };
    let mut shapes: Vec<Shape> = room(0.0).into_iter().chain(room(1.01)).collect();
    shapes.push(quad(DVec3::ZERO, Y, Z, [2, 2]));
    shapes.push(quad(X * 2.0, Z, Y, [2, 2]));
    // Each room sees four pieces of the wall, and the hole has four sides.
    let (low, high) = (0.5 - 0.5 * hole, 0.5 + 0.5 * hole);
    let pieces = [
        ([0.0, 0.0], [1.0, low]),
        ([0.0, high], [1.0, 1.0]),
        ([0.0, low], [low, high]),
        ([high, low], [1.0, high]),
    ];
    for (from, to) in pieces {
        let (u, v) = (Y * (to[0] - from[0]), Z * (to[1] - from[1]));
        let corner = |x: f64| DVec3::new(x, from[0], from[1]);
        shapes.push(quad(corner(0.99), v, u, [1, 1]));
        shapes.push(quad(corner(1.01), u, v, [1, 1]));
    }
    let (through, u, v) = (X * 0.02, Y * (high - low), Z * (high - low));
    let corner = DVec3::new(0.99, low, low);
    shapes.push(quad(corner, through, u, [1, 1]));
    shapes.push(quad(corner + v, u, through, [1, 1]));
    shapes.push(quad(corner, v, through, [1, 1]));
    shapes.push(quad(corner + u, through, v, [1, 1]));
    let mut surfaces: Vec<SurfaceSpec> = shapes.into_iter().map(|shape| material.surface(shape)).collect();
    surfaces[0].cell_emittance = vec![(0, 1.0.into())];
    SceneSpec::new(surfaces)
}

/// The given scene with every corner moved.
pub fn moved(scene: &SceneSpec, to: impl Fn(DVec3) -> DVec3) -> SceneSpec {
    let surfaces = scene.surfaces.iter().map(|s| SurfaceSpec { shape: s.shape.moved(&to), ..s.clone() });
    SceneSpec::new(surfaces.collect())
}
