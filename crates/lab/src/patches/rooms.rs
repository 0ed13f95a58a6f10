//! The scenes: grey rooms of quads whose lamps are surfaces of their own.

use glam::DVec3;
use radiosity::{SceneSpec, Shape, SurfaceSpec};

/// Cells of a reference, about.
const FINE: f64 = 130_000.0;

/// A scene, and the cells of its references: light that is even needs few.
pub struct Room {
    pub name: &'static str,
    pub spec: SceneSpec,
    pub cells: f64,
}

pub fn rooms() -> Vec<Room> {
    let lamp = |corner: [f64; 3], u: DVec3, v: DVec3| {
        let shape = Shape::parallelogram(corner.into(), u, v, [1, 1]);
        SurfaceSpec::new(shape, 0.0).emitting(1.0)
    };
    let lit_by = |mut spec: SceneSpec, lamp: SurfaceSpec| {
        for surface in &mut spec.surfaces {
            surface.cell_emittance.clear();
        }
        spec.surfaces.push(lamp);
        spec
    };
    // A hole of 0.3 × 0.3 m becomes a slit of 0.06 × 0.8 m.
    let slit = scenes::moved(&scenes::two_rooms(0.3, 0.6), |DVec3 { x, y, z }| {
        DVec3::new(x, stretched(y, [0.35, 0.65], [0.47, 0.53]), stretched(z, [0.35, 0.65], [0.1, 0.9]))
    });
    let room = |name, spec| Room { name, spec, cells: FINE };
    vec![
        room("cornell", scenes::cornell()),
        room("box", lit_by(scenes::corridor(6), lamp([0.35, 0.4, 0.01], DVec3::X * 0.3, DVec3::Y * 0.2))),
        room("two-rooms", lit_by(slit, lamp([0.3, 0.3, 0.98], DVec3::Y * 0.3, DVec3::X * 0.3))),
        room("office", lit_by(scenes::room(4), lamp([1.7, 2.48, 0.9], DVec3::X * 0.3, DVec3::Z * 1.2))),
        Room { name: "even-cube", spec: scenes::furnace(3, 0.6), cells: 1536.0 },
    ]
}

/// 0 … 1 with two places moved to others.
fn stretched(x: f64, from: [f64; 2], to: [f64; 2]) -> f64 {
    let part = |x: f64, [a, b]: [f64; 2], [c, d]: [f64; 2]| c + (d - c) * (x - a) / (b - a);
    match x {
        x if x < from[0] => part(x, [0.0, from[0]], [0.0, to[0]]),
        x if x > from[1] => part(x, [from[1], 1.0], [to[1], 1.0]),
        x => part(x, from, to),
    }
}
