//! Scenes that are no boxes.
#![allow(dead_code, reason = "every test file uses its own part")]

use glam::{DQuat, DVec3};
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};

/// A grey, one-sided surface.
pub fn grey(shape: Shape, r: f64, e: f64) -> SurfaceSpec {
    SurfaceSpec {
        name: None,
        shape,
        sides: Sides::Front,
        reflectance: r.into(),
        emittance: e.into(),
        cell_emittance: vec![],
        transmittance: Default::default(),
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
    SceneSpec::new(shapes.into_iter().map(|shape| grey(shape, r, e)).collect())
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

/// The scene turned about an axis that is none of the coordinates', and moved.
pub fn turned(spec: &SceneSpec) -> SceneSpec {
    let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let place = |point: DVec3| rotation * point + DVec3::new(3.0, -1.0, 7.0);
    let mut spec = spec.clone();
    for surface in &mut spec.surfaces {
        surface.shape = surface.shape.moved(place);
    }
    spec
}

/// The sides of a box and its top, seen from outside, in cells of about `cell` [m]; its foot, too, unless it
/// stands on the floor. Turned about its first corner.
pub fn furniture([x, y, z]: [f64; 3], size: [f64; 3], angle: f64, cell: f64) -> Vec<Shape> {
    let corner = DVec3::new(x, y, z);
    let turn = DQuat::from_rotation_z(angle);
    let [ex, ey, ez] = [0, 1, 2].map(|k| turn * (DVec3::AXES[k] * size[k]));
    let cells = |edge: DVec3| (edge.length() / cell).ceil() as u32;
    let face = |corner: DVec3, u: DVec3, v: DVec3| Shape::Parallelogram {
        corner,
        corner_u: corner + u,
        corner_v: corner + v,
        cells: [cells(u), cells(v)],
    };
    let mut faces = vec![
        face(corner, ez, ey),
        face(corner + ex, ey, ez),
        face(corner, ex, ez),
        face(corner + ey, ez, ex),
        face(corner + ez, ex, ey),
    ];
    if z > 0.0 {
        faces.push(face(corner, ey, ex));
    }
    faces
}

/// A room of 4 m × 5 m × 2.5 m, one ceiling light, a table on four legs with a box on it, a cupboard, a
/// wardrobe askew, a screen that is lit from both sides; patches of about `cell` [m].
pub fn furnished_room(cell: f64) -> SceneSpec {
    let mut walls = room([4.0, 5.0, 2.5], 1);
    for wall in &mut walls {
        let (_, e_u, e_v) = wall.edges();
        let Shape::Parallelogram { cells, .. } = wall else { unreachable!("walls are parallelograms") };
        *cells = [e_u, e_v].map(|edge| (edge.length() / cell).ceil() as u32);
    }
    let pieces = [
        ([1.0, 1.5, 0.7], [1.6, 0.9, 0.05], 0.0),
        ([1.05, 1.55, 0.0], [0.06, 0.06, 0.7], 0.0),
        ([2.49, 1.55, 0.0], [0.06, 0.06, 0.7], 0.0),
        ([1.05, 2.29, 0.0], [0.06, 0.06, 0.7], 0.0),
        ([2.49, 2.29, 0.0], [0.06, 0.06, 0.7], 0.0),
        ([1.5, 1.8, 0.75], [0.4, 0.3, 0.25], 0.3),
        ([3.3, 0.4, 0.0], [0.5, 1.3, 0.9], 0.0),
        ([0.9, 3.6, 0.0], [0.6, 0.9, 1.9], 0.5),
    ];
    let pieces = pieces.into_iter().flat_map(|(at, size, angle)| furniture(at, size, angle, cell));
    let mut spec = painted(walls.into_iter().chain(pieces), 0.5, 0.0);
    let mut screen = grey(quad([2.2, 3.4, 0.05], [1.1, 0.5, 0.0], [0.0, 0.0, 1.6], [1, 1]), 0.7, 0.0);
    let Shape::Parallelogram { cells, .. } = &mut screen.shape else { unreachable!("it is a parallelogram") };
    *cells = [1.2, 1.6].map(|length: f64| (length / cell).ceil() as u32);
    screen.sides = Sides::Both;
    spec.surfaces.push(screen);
    spec.surfaces[5].cell_emittance = vec![(0, 100.0.into())];
    spec
}
