//! Scenes that are no boxes.
#![allow(dead_code, reason = "every test file uses its own part")]

use glam::{DQuat, DVec3};
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};

/// A grey surface.
pub fn grey(shape: Shape, r: f64, e: f64) -> SurfaceSpec {
    SurfaceSpec {
        name: None,
        shape,
        sides: Sides::Front,
        reflectance: r.into(),
        emittance: e.into(),
        cell_emittance: vec![],
    }
}

/// A parallelogram from a corner and its edges; the front faces u × v.
pub fn quad(corner: [f64; 3], u: [f64; 3], v: [f64; 3], cells: [u32; 2]) -> Shape {
    let corner = DVec3::from(corner);
    Shape::Parallelogram {
        corner,
        corner_u: corner + DVec3::from(u),
        corner_v: corner + DVec3::from(v),
        cells,
    }
}

/// One reflectance and one emittance on every surface.
pub fn painted(shapes: impl IntoIterator<Item = Shape>, r: f64, e: f64) -> SceneSpec {
    SceneSpec { surfaces: shapes.into_iter().map(|shape| grey(shape, r, e)).collect() }
}

/// A closed tetrahedron seen from inside.
pub fn tetrahedron(rows: u32) -> Vec<Shape> {
    let [o, x, y, z] = [DVec3::ZERO, 2.0 * DVec3::X, DVec3::new(0.3, 1.5, 0.0), DVec3::new(0.2, 0.4, 1.0)];
    [[o, x, y], [o, z, x], [o, y, z], [x, z, y]].map(|[a, b, c]| Shape::Triangle { a, b, c, rows }).into()
}

/// An icosahedron, every triangle cut in four `levels` times, its corners moved out to `radius` of their
/// direction; seen from inside.
pub fn ball(levels: u32, radius: impl Fn(DVec3) -> f64) -> Vec<Shape> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let corner = |k: usize| {
        let (s, t) = ([1.0, -1.0][k & 1], [golden, -golden][k >> 1 & 1]);
        [DVec3::new(0.0, s, t), DVec3::new(s, t, 0.0), DVec3::new(t, 0.0, s)][k >> 2].normalize()
    };
    let corners: Vec<DVec3> = (0..12).map(corner).collect();
    let edge = 1.1;
    let mut triangles = vec![];
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let triangle = [corners[a], corners[b], corners[c]];
                if (0..3).all(|k| triangle[k].distance(triangle[(k + 1) % 3]) < edge) {
                    triangles.push(triangle);
                }
            }
        }
    }
    for _ in 0..levels {
        triangles = triangles.into_iter().flat_map(quarters).collect();
    }
    let inwards = |[a, b, c]: [DVec3; 3]| {
        let [a, b, c] = if a.cross(b).dot(c) > 0.0 { [a, c, b] } else { [a, b, c] };
        let [a, b, c] = [a, b, c].map(|corner| corner * radius(corner));
        Shape::Triangle { a, b, c, rows: 1 }
    };
    triangles.into_iter().map(inwards).collect()
}

fn quarters([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]
}

/// A closed surface with hills and valleys that hide parts of it from others.
pub fn bumpy_ball(levels: u32) -> Vec<Shape> {
    ball(levels, |d| 1.0 + 0.25 * (5.0 * d.x).sin() * (4.0 * d.y + 1.0).cos() + 0.1 * (6.0 * d.z).sin())
}

/// A room with an L for its floor: 2 × 2 less the quarter beyond (1, 1), of height 1.
pub fn l_room(n: u32) -> Vec<Shape> {
    let c = [n, n];
    let mut shapes = vec![];
    for [x, y] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] {
        shapes.push(quad([x, y, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], c));
        shapes.push(quad([x, y, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], c));
    }
    let up = [0.0, 0.0, 1.0];
    shapes.push(quad([0.0, 0.0, 0.0], up, [2.0, 0.0, 0.0], [n, 2 * n]));
    shapes.push(quad([2.0, 0.0, 0.0], up, [0.0, 1.0, 0.0], c));
    shapes.push(quad([2.0, 1.0, 0.0], up, [-1.0, 0.0, 0.0], c));
    shapes.push(quad([1.0, 1.0, 0.0], up, [0.0, 1.0, 0.0], c));
    shapes.push(quad([1.0, 2.0, 0.0], up, [-1.0, 0.0, 0.0], c));
    shapes.push(quad([0.0, 2.0, 0.0], up, [0.0, -2.0, 0.0], [n, 2 * n]));
    shapes
}

/// The six walls of the box from 0 to `size`, seen from inside.
pub fn room([x, y, z]: [f64; 3], n: u32) -> Vec<Shape> {
    let (ex, ey, ez) = ([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]);
    let o = [0.0; 3];
    [(o, ey, ez), (ex, ez, ey), (o, ez, ex), (ey, ex, ez), (o, ex, ey), (ez, ey, ex)]
        .map(|(corner, u, v)| quad(corner, u, v, [n, n]))
        .into()
}

/// The same scene turned about an axis that is none of the coordinates', and moved.
pub fn turned(spec: &SceneSpec) -> SceneSpec {
    let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let place = |point: DVec3| rotation * point + DVec3::new(3.0, -1.0, 7.0);
    let mut spec = spec.clone();
    for surface in &mut spec.surfaces {
        surface.shape = match surface.shape {
            Shape::Parallelogram { corner, corner_u, corner_v, cells } => Shape::Parallelogram {
                corner: place(corner),
                corner_u: place(corner_u),
                corner_v: place(corner_v),
                cells,
            },
            Shape::Triangle { a, b, c, rows } => {
                Shape::Triangle { a: place(a), b: place(b), c: place(c), rows }
            }
        };
    }
    spec
}
