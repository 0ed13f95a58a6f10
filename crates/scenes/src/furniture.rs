//! The furniture of the interior: bodies that are closed, face outwards and nowhere touch, each in coordinates of its
//! own with its foot at z = 0. Lengths are in metres.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use radiosity::WalkRng;

use crate::material::SceneMaterial;
use crate::mesh::ObjMesh;

/// The air between bodies [m]: a patch that lay half under another body would send walks into it.
pub(crate) const GAP: f64 = 0.002;

const WOOD: SceneMaterial = SceneMaterial::new(0.42);
const DARK_WOOD: SceneMaterial = SceneMaterial::new(0.24);
const CHINA: SceneMaterial = SceneMaterial::new(0.8);
const GLAZE: SceneMaterial = SceneMaterial::new(0.55);
const PAPER: SceneMaterial = SceneMaterial::new(0.65);
const CLOTH: SceneMaterial = SceneMaterial::new(0.5);
const METAL: SceneMaterial = SceneMaterial::new(0.6);
const RUBBER: SceneMaterial = SceneMaterial::new(0.12);
const LEAF: SceneMaterial = SceneMaterial::new(0.35);
const LAMP: SceneMaterial = SceneMaterial::new(0.8).emitting(100.0);

/// The fineness of curves: numbers of segments are in proportion to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Detail(pub(crate) f64);

impl Detail {
    /// The number of segments: `base` at detail 1, and at least 4.
    fn segments(self, base: u32) -> u32 {
        ((f64::from(base) * self.0).round() as u32).max(4)
    }

    /// The number of things: `base` at detail 1, growing as the triangles of a curved surface do.
    fn count(self, base: u32) -> u32 {
        ((f64::from(base) * self.0 * self.0).round() as u32).max(1)
    }
}

/// A uniform number between `low` and `high`.
pub(crate) fn between(rng: &mut WalkRng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.pair()[0]
}

/// The `n` + 1 points of a curve over [0, 1].
fn curve<T>(n: u32, point: impl Fn(f64) -> T) -> Vec<T> {
    (0..=n).map(|i| point(f64::from(i) / f64::from(n))).collect()
}

/// A vessel with an inside: the outer profile radius(z) from foot to rim, then down again `wall` within it.
fn vessel(height: f64, wall: f64, steps: u32, radius: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let mut profile = vec![[0.0, 0.0]];
    profile.extend(curve(steps, |s| [radius(s), height * s]));
    profile.extend(curve(steps, |s| [radius(1.0 - s) - wall, wall + (height - wall) * (1.0 - s)]));
    profile.push([0.0, wall]);
    profile
}

/// A table of 1.8 × 0.9 × 0.76 m on four turned legs.
pub(crate) fn table(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let mut leg = vec![[0.0, GAP], [0.025, GAP]];
    leg.extend(curve(detail.segments(16), |s| {
        [0.032 + 0.008 * (3.0 * TAU * s).sin() + 0.006 * s, 0.02 + 0.68 * s]
    }));
    leg.push([0.0, 0.7]);
    for (x, y) in [(-0.8, -0.38), (0.8, -0.38), (-0.8, 0.38), (0.8, 0.38)] {
        let mut turned = ObjMesh::default();
        turned.lathe(&leg, detail.segments(12), WOOD);
        mesh.add(turned, DVec3::new(x, y, 0.0), 0.0);
    }
    mesh.cuboid(DVec3::new(-0.9, -0.45, 0.72), DVec3::new(0.9, 0.45, 0.76 - GAP), WOOD);
    mesh
}

/// A chair that looks along +x: round legs, a cushion, a back of curved rods under a rail.
pub(crate) fn chair(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let sides = detail.segments(8);
    for (x, y) in [(-0.18, -0.18), (0.18, -0.18), (-0.18, 0.18), (0.18, 0.18)] {
        let path = curve(detail.segments(4), |s| {
            DVec3::new(x * (1.1 - 0.1 * s), y * (1.1 - 0.1 * s), GAP + 0.42 * s)
        });
        mesh.tube(&path, |_| 0.012, sides, DARK_WOOD);
    }
    mesh.cuboid(DVec3::new(-0.22, -0.22, 0.43), DVec3::new(0.22, 0.22, 0.45), DARK_WOOD);
    let mut seat = ObjMesh::default();
    seat.cushion(DVec3::new(0.2, 0.2, 0.025), 0.6, detail.segments(20), CLOTH);
    mesh.add(seat, DVec3::new(0.0, 0.0, 0.475 + GAP), 0.0);
    for rod in 0..7 {
        let y = -0.18 + 0.06 * f64::from(rod);
        let path =
            curve(detail.segments(8), |s| DVec3::new(-0.21 - 0.03 * (PI * s).sin(), y, 0.452 + 0.4 * s));
        mesh.tube(&path, |_| 0.006, detail.segments(6), DARK_WOOD);
    }
    let rail =
        curve(detail.segments(12), |s| DVec3::new(-0.21 - 0.02 * (PI * s).sin(), -0.21 + 0.42 * s, 0.88));
    mesh.tube(&rail, |_| 0.02, sides, DARK_WOOD);
    mesh
}

/// A teapot 0.2 m long: body, lid and knob by the lathe, spout and handle as tubes that all but touch it.
pub(crate) fn teapot(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let body = |s: f64| (0.045 + 0.04 * (PI * s).sin()).max(0.03);
    let (around, along) = (detail.segments(28), detail.segments(18));
    mesh.lathe(&vessel(0.11, 0.004, along, body), around, CHINA);
    let mut lid = vec![[0.0, 0.112 + GAP], [0.046, 0.112 + GAP]];
    lid.extend(curve(detail.segments(8), |s| {
        [0.046 * (0.5 * PI * s).cos() + 1e-3, 0.116 + 0.02 * (0.5 * PI * s).sin()]
    }));
    lid.push([0.0, 0.138]);
    mesh.lathe(&lid, around, CHINA);
    let mut knob = ObjMesh::default();
    knob.cushion(DVec3::splat(0.01), 1.0, detail.segments(12), CHINA);
    mesh.add(knob, DVec3::Z * 0.151, 0.0);
    let spout = curve(detail.segments(12), |s| {
        DVec3::new(0.1 + 0.05 * s + 0.02 * s * s, 0.0, 0.04 + 0.07 * s + 0.015 * (TAU * s).sin())
    });
    mesh.tube(&spout, |i| 0.012 - 0.007 * i as f64 / spout.len() as f64, detail.segments(10), CHINA);
    let handle =
        curve(detail.segments(14), |s| DVec3::new(-0.095 - 0.045 * (PI * s).sin(), 0.0, 0.025 + 0.065 * s));
    mesh.tube(&handle, |_| 0.006, detail.segments(8), CHINA);
    mesh
}

/// A vase of a random bulge and neck.
pub(crate) fn vase(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let (belly, neck) = (between(rng, 0.03, 0.06), between(rng, 0.5, 1.5));
    let height = between(rng, 0.2, 0.4);
    let radius = |s: f64| 0.035 + belly * (PI * s.powf(neck)).sin().max(0.0) + 0.01 * s;
    let mut mesh = ObjMesh::default();
    mesh.lathe(&vessel(height, 0.005, detail.segments(20), radius), detail.segments(24), GLAZE);
    mesh
}

/// A bowl with fruit in it.
pub(crate) fn fruit_bowl(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let radius = |s: f64| 0.06 + 0.1 * s.sqrt();
    mesh.lathe(&vessel(0.08, 0.005, detail.segments(10), radius), detail.segments(28), CHINA);
    for i in 0..5 {
        let mut fruit = ObjMesh::default();
        fruit.cushion(DVec3::new(0.036, 0.036, 0.033), 1.0, detail.segments(16), GLAZE);
        let (sin, cos) = (TAU * f64::from(i) / 5.0).sin_cos();
        mesh.add(fruit, DVec3::new(0.07 * cos, 0.07 * sin, 0.075), f64::from(i));
    }
    mesh
}

/// A plate with a cup on it.
pub(crate) fn cover(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let around = detail.segments(24);
    mesh.lathe(&vessel(0.02, 0.003, detail.segments(6), |s| 0.07 + 0.04 * s), around, CHINA);
    let mut cup = ObjMesh::default();
    cup.lathe(&vessel(0.08, 0.003, detail.segments(8), |s| 0.025 + 0.015 * s.sqrt()), around, CHINA);
    mesh.add(cup, DVec3::Z * (0.003 + GAP), 0.0);
    mesh
}

/// A bookcase of 3.6 × 0.3 × 2.1 m against the plane y = 0, open towards −y, filled with books.
pub(crate) fn bookcase(rng: &mut WalkRng) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let (bays, shelves, pitch) = (4, 6, 0.4);
    for upright in 0..=bays {
        let x = 0.9 * f64::from(upright);
        mesh.cuboid(DVec3::new(x - 0.01, -0.3, GAP), DVec3::new(x + 0.01, -GAP, 2.1), DARK_WOOD);
    }
    for bay in 0..bays {
        let (left, right) = (0.9 * f64::from(bay) + 0.01 + GAP, 0.9 * f64::from(bay + 1) - 0.01 - GAP);
        for shelf in 0..shelves {
            let z = 0.06 + pitch * f64::from(shelf);
            mesh.cuboid(DVec3::new(left, -0.29, z - 0.02), DVec3::new(right, -GAP, z), DARK_WOOD);
            if shelf + 1 < shelves {
                books(&mut mesh, [left, right], z + GAP, rng);
            }
        }
    }
    mesh
}

/// A rack of 2.6 × 0.36 × 1.9 m, seen through: boards of wires on posts, set with bottles, jars and bowls.
pub(crate) fn wire_rack(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    for (x, y) in [(-0.02, 0.0), (2.62, 0.0), (-0.02, 0.36), (2.62, 0.36)] {
        mesh.tube(&[DVec3::new(x, y, GAP), DVec3::new(x, y, 1.9)], |_| 0.012, detail.segments(8), METAL);
    }
    for board in 0..5 {
        let z = 0.15 + 0.38 * f64::from(board);
        for wire in 0..14 {
            let y = 0.02 + 0.32 / 13.0 * f64::from(wire);
            mesh.tube(&[DVec3::new(0.0, y, z), DVec3::new(2.6, y, z)], |_| 0.003, 4, METAL);
        }
        for place in 0..18_u32 {
            let at = DVec3::new(
                0.14 * f64::from(place) + 0.11,
                0.1 + 0.15 * f64::from(place % 2),
                z + 0.003 + GAP,
            );
            mesh.add(bottle(detail, rng), at, between(rng, 0.0, TAU));
        }
    }
    mesh
}

/// A solid bottle, jar or beaker by chance, at most 0.13 m wide and 0.33 m high.
fn bottle(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let (radius, height) = (between(rng, 0.02, 0.065), between(rng, 0.06, 0.33));
    let neck = between(rng, 0.25, 1.0);
    let mut profile = vec![[0.0, 0.0]];
    profile.extend(curve(detail.segments(6), |s| {
        let taper = if s < 0.6 { 1.0 } else { 1.0 - (1.0 - neck) * (2.5 * (s - 0.6)).min(1.0) };
        [radius * taper, height * s]
    }));
    profile.push([0.0, height]);
    let mut mesh = ObjMesh::default();
    mesh.lathe(&profile, detail.segments(12), GLAZE);
    mesh
}

/// A row of books of random sizes, some of it left empty.
fn books(mesh: &mut ObjMesh, [left, right]: [f64; 2], z: f64, rng: &mut WalkRng) {
    let end = right - between(rng, 0.0, 0.3);
    let mut x = left + GAP;
    loop {
        let (thickness, height, depth) =
            (between(rng, 0.008, 0.05), between(rng, 0.18, 0.33), between(rng, 0.13, 0.24));
        if x + thickness > end {
            return;
        }
        mesh.cuboid(DVec3::new(x, -0.02 - depth, z), DVec3::new(x + thickness, -0.02, z + height), PAPER);
        x += thickness + between(rng, 0.0005, 0.002);
    }
}

/// A sideboard of 1.4 × 0.4 × 0.8 m along x with vases and balls on it.
pub(crate) fn sideboard(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    mesh.cuboid(DVec3::new(0.0, 0.0, 0.05), DVec3::new(1.4, 0.4, 0.8), WOOD);
    for door in 0..3 {
        let mut knob = ObjMesh::default();
        knob.cushion(DVec3::splat(0.012), 1.0, detail.segments(10), METAL);
        mesh.add(knob, DVec3::new(0.4 + 0.3 * f64::from(door), 0.4 + 0.012 + GAP, 0.5), 0.0);
    }
    for place in 0..4 {
        let at = DVec3::new(0.2 + 0.33 * f64::from(place), between(rng, 0.15, 0.25), 0.8 + GAP);
        mesh.add(vase(detail, rng), at, between(rng, 0.0, TAU));
    }
    mesh
}

/// A sofa of 0.9 × 1.6 m that looks along +x: cushions between arms.
pub(crate) fn sofa(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let segments = detail.segments(28);
    let mut cushion = |at: DVec3, size: DVec3| {
        let mut body = ObjMesh::default();
        body.cushion(size, 0.45, segments, CLOTH);
        mesh.add(body, at, 0.0);
    };
    for y in [0.42, 1.18] {
        cushion(DVec3::new(0.55, y, 0.34), DVec3::new(0.34, 0.37, 0.1));
        cushion(DVec3::new(0.09, y, 0.64), DVec3::new(0.08, 0.37, 0.26));
    }
    for y in [-0.06, 1.66] {
        cushion(DVec3::new(0.45, y, 0.3), DVec3::new(0.42, 0.09, 0.28));
    }
    mesh.cuboid(DVec3::new(0.02, 0.04, 0.04), DVec3::new(0.88, 1.56, 0.22), DARK_WOOD);
    mesh
}

/// A curtain 1.8 m wide and 2.4 m high along x: a sheet in waves that deepen downwards.
pub(crate) fn curtain(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let rows = curve(detail.segments(8), |t| {
        curve(detail.segments(72), |s| {
            let depth = 0.025 + 0.03 * t;
            let wave = (9.0 * TAU * s).sin() + 0.3 * (23.0 * s + 2.0 * t).sin();
            DVec3::new(1.8 * s, depth * wave, 2.4 * (1.0 - t) + 0.02)
        })
    });
    mesh.sheet(&rows, CLOTH);
    mesh
}

/// A blind 1.6 m wide and 1.5 m high along x, of tilted slats 2 cm deep and 0.4 mm thick, and its cords.
pub(crate) fn blind() -> ObjMesh {
    let mut mesh = ObjMesh::default();
    for slat in 0..60 {
        let z = 0.025 * f64::from(slat);
        let (across, up) = (DVec3::new(0.0, 0.009, 0.004), DVec3::new(0.0, -0.0001, 0.0002));
        let end = |x: f64| {
            [-across - up, across - up, across + up, -across + up].map(|p| p + DVec3::new(x, 0.0, z)).to_vec()
        };
        let point = |x: f64| vec![DVec3::new(x, 0.0, z); 4];
        mesh.skin(&[point(0.0), end(0.0), end(1.6), point(1.6)], METAL);
    }
    for x in [-0.01, 1.61] {
        mesh.tube(&[DVec3::new(x, 0.0, 0.0), DVec3::new(x, 0.0, 1.49)], |_| 0.0015, 5, CLOTH);
    }
    mesh
}

/// A plant in a pot: two-sided leaves in a ball of radius 0.4 m.
pub(crate) fn plant(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    mesh.lathe(&vessel(0.35, 0.01, detail.segments(6), |s| 0.13 + 0.06 * s), detail.segments(24), GLAZE);
    for _ in 0..detail.count(400) {
        let at = DVec3::Z * 0.95 + in_ball(rng) * 0.36;
        let along = in_ball(rng).normalize() * between(rng, 0.02, 0.04);
        let across = along.cross(in_ball(rng)).normalize() * along.length() * 0.35;
        let droop = DVec3::Z * -0.005;
        mesh.triangle([at - along, at + across + droop, at + along], LEAF.two_sided());
        mesh.triangle([at - along, at + along, at - across + droop], LEAF.two_sided());
    }
    mesh
}

/// A uniform point of the unit ball, by rejection.
fn in_ball(rng: &mut WalkRng) -> DVec3 {
    loop {
        let ([x, y], [z, _]) = (rng.pair(), rng.pair());
        let point = DVec3::new(x, y, z) * 2.0 - 1.0;
        if point.length_squared() <= 1.0 {
            return point;
        }
    }
}

/// Balls of many sizes in a square of 1 m, apart from each other.
pub(crate) fn toys(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    for place in 0..9_u32 {
        let radius = 0.02 * (1.0 + f64::from(place % 4)) * between(rng, 0.8, 1.2);
        let mut ball = ObjMesh::default();
        ball.cushion(DVec3::splat(radius), between(rng, 0.7, 1.0), detail.segments(14), GLAZE);
        let at = DVec3::new(f64::from(place % 3), f64::from(place / 3), 0.0) * 0.33;
        mesh.add(ball, at + DVec3::Z * (radius + GAP), between(rng, 0.0, TAU));
    }
    mesh
}

/// A cable of 3 mm radius that winds 1.6 m along y on the floor.
pub(crate) fn cable(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let path = curve(detail.segments(60), |s| {
        DVec3::new(0.05 * (5.0 * TAU * s).sin(), 1.6 * s, 0.01 + 0.003 * (7.0 * TAU * s).cos())
    });
    mesh.tube(&path, |_| 0.003, detail.segments(6), RUBBER);
    mesh
}

/// A lamp on a stand: a foot, a rod 1.4 m long, a luminous globe.
pub(crate) fn standing_lamp(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let foot = [[0.0, GAP], [0.14, GAP], [0.14, 0.02], [0.03, 0.035], [0.0, 0.035]];
    mesh.lathe(&foot, detail.segments(24), METAL);
    mesh.tube(&[DVec3::Z * 0.037, DVec3::Z * 1.4], |_| 0.008, detail.segments(8), METAL);
    let mut globe = ObjMesh::default();
    globe.cushion(DVec3::splat(0.13), 1.0, detail.segments(24), LAMP);
    mesh.add(globe, DVec3::Z * 1.54, 0.0);
    mesh
}

/// A luminous globe on a cable, hanging from z = 0 to −1.2 m.
pub(crate) fn pendant(detail: Detail) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    mesh.tube(&[DVec3::Z * -0.9, DVec3::Z * -GAP], |_| 0.003, detail.segments(6), RUBBER);
    let mut globe = ObjMesh::default();
    globe.cushion(DVec3::splat(0.15), 1.0, detail.segments(28), LAMP);
    mesh.add(globe, DVec3::Z * -1.06, 0.0);
    mesh
}

/// A mobile: beads on threads round a pendant lamp, hanging from z = 0 to −1.1 m.
pub(crate) fn mobile(detail: Detail, rng: &mut WalkRng) -> ObjMesh {
    let mut mesh = ObjMesh::default();
    for thread in 0..48 {
        let (sin, cos) = (TAU * f64::from(thread) / 16.0).sin_cos();
        let foot = DVec3::new(cos, sin, 0.0) * (0.25 + 0.15 * f64::from(thread / 16));
        let length = between(rng, 0.3, 1.0);
        mesh.tube(&[foot - DVec3::Z * length, foot - DVec3::Z * GAP], |_| 0.0008, 4, CLOTH);
        let mut bead = ObjMesh::default();
        bead.cushion(DVec3::splat(0.03), between(rng, 0.6, 1.0), detail.segments(10), GLAZE);
        mesh.add(bead, foot - DVec3::Z * (length + 0.03 + GAP), between(rng, 0.0, TAU));
    }
    mesh
}

/// A flat ceiling lamp of 1.2 × 0.3 m, hanging under z = 0.
pub(crate) fn ceiling_lamp() -> ObjMesh {
    let mut mesh = ObjMesh::default();
    mesh.cuboid(DVec3::new(0.0, 0.0, -0.05), DVec3::new(1.2, 0.3, -0.01), LAMP);
    mesh
}

/// A picture in a frame of four bars, 0.7 × 0.5 m, against the plane y = 0.
pub(crate) fn picture() -> ObjMesh {
    let mut mesh = ObjMesh::default();
    let mut bar = |x: [f64; 2], z: [f64; 2], depth: f64, material: SceneMaterial| {
        mesh.cuboid(DVec3::new(x[0], -depth, z[0]), DVec3::new(x[1], -GAP, z[1]), material);
    };
    bar([0.0, 0.7], [0.0, 0.03], 0.03, DARK_WOOD);
    bar([0.0, 0.7], [0.47, 0.5], 0.03, DARK_WOOD);
    bar([0.0, 0.03], [0.03 + GAP, 0.47 - GAP], 0.03, DARK_WOOD);
    bar([0.67, 0.7], [0.03 + GAP, 0.47 - GAP], 0.03, DARK_WOOD);
    bar([0.03 + GAP, 0.67 - GAP], [0.03 + GAP, 0.47 - GAP], 0.012, PAPER);
    mesh
}
