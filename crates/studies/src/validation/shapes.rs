//! Scenes of which closed forms are known.

use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};

/// Endless, in units of the other sides.
const ENDLESS: f64 = 1e5;

/// A grey surface that emits 1 W/m².
pub(super) fn grey(shape: Shape, reflectance: f64) -> SurfaceSpec {
    SurfaceSpec {
        name: None,
        shape,
        sides: Sides::Front,
        reflectance: reflectance.into(),
        emittance: 1.0.into(),
        cell_emittance: Vec::new(),
    }
}

/// A scene of black surfaces.
pub(super) fn black(shapes: impl IntoIterator<Item = Shape>) -> SceneSpec {
    SceneSpec::new(shapes.into_iter().map(|shape| grey(shape, 0.0)).collect())
}

fn quad(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Shape {
    let [corner, u, v] = [corner, u, v].map(DVec3::from);
    Shape::Parallelogram { corner, corner_u: corner + u, corner_v: corner + v, cells: [1, 1] }
}

/// Rectangles of x × y opposite each other at distance 1.
pub(super) fn opposed(x: f64, y: f64) -> SceneSpec {
    let (u, v) = ([x, 0.0, 0.0], [0.0, y, 0.0]);
    black([quad([0.0; 3], u, v), quad([0.0, 0.0, 1.0], v, u)])
}

/// Rectangles of width w and height h along an edge of length 1.
pub(super) fn perpendicular(w: f64, h: f64) -> SceneSpec {
    let (edge, up) = ([0.0, 1.0, 0.0], [0.0, 0.0, h]);
    black([quad([0.0; 3], [w, 0.0, 0.0], edge), quad([0.0; 3], edge, up)])
}

/// Endless parallel strips of width 1 at distance h.
pub(super) fn strips(h: f64) -> SceneSpec {
    let (u, v) = ([1.0, 0.0, 0.0], [0.0, ENDLESS, 0.0]);
    black([quad([0.0; 3], u, v), quad([0.0, 0.0, h], v, u)])
}

/// Endless plates of width 1 along a common edge, at an angle [rad].
pub(super) fn wedge(angle: f64) -> SceneSpec {
    let edge = [0.0, ENDLESS, 0.0];
    let (sin, cos) = angle.sin_cos();
    black([quad([0.0; 3], [1.0, 0.0, 0.0], edge), quad([0.0; 3], edge, [cos, 0.0, sin])])
}

/// An endless prism of sides a, b and c, without ends.
pub(super) fn prism(a: f64, b: f64, c: f64) -> SceneSpec {
    // The apex above side a, at distance c from its beginning and b from its end.
    let x = (a * a + c * c - b * b) / (2.0 * a);
    let z = (c * c - x * x).sqrt();
    let edge = [0.0, ENDLESS, 0.0];
    black([
        quad([0.0; 3], [a, 0.0, 0.0], edge),
        quad([a, 0.0, 0.0], [x - a, 0.0, z], edge),
        quad([x, 0.0, z], [-x, 0.0, -z], edge),
    ])
}

/// An endless street of width 1 between walls of height h.
pub(super) fn street(h: f64) -> SceneSpec {
    let (edge, up) = ([0.0, ENDLESS, 0.0], [0.0, 0.0, h]);
    black([quad([0.0; 3], [1.0, 0.0, 0.0], edge), quad([0.0; 3], edge, up), quad([1.0, 0.0, 0.0], up, edge)])
}

/// The triangles of a disc, and how many.
pub(super) const SECTORS: u32 = 192;

/// Coaxial discs of these radii at distance 1, each of [`SECTORS`] triangles.
pub(super) fn discs(r1: f64, r2: f64) -> SceneSpec {
    let disc = |z: f64, radius: f64, up: bool| {
        let corner = move |k: u32| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(SECTORS)).sin_cos();
            DVec3::new(radius * cos, radius * sin, z)
        };
        (0..SECTORS).map(move |k| {
            let [b, c] = if up { [corner(k), corner(k + 1)] } else { [corner(k + 1), corner(k)] };
            Shape::Triangle { a: DVec3::new(0.0, 0.0, z), b, c, rows: 1 }
        })
    };
    black(disc(0.0, r1, true).chain(disc(1.0, r2, false)))
}

/// A box of 1 × 1 × depth without its lid, seen from inside.
pub(super) fn open_box(depth: f64) -> SceneSpec {
    let mut spec = enclosure([1.0, 1.0, depth], 0.0);
    spec.surfaces.pop();
    spec
}

/// A pit of four triangles below a square of 1 × 1.
pub(super) fn pit(depth: f64) -> SceneSpec {
    let apex = DVec3::new(0.5, 0.5, -depth);
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    black((0..4).map(|k| Shape::Triangle { a: apex, b: corners[k], c: corners[(k + 1) % 4], rows: 1 }))
}

/// The six sides of the box from 0 to `size`, seen from inside; its lid is the last.
pub(super) fn enclosure([x, y, z]: [f64; 3], reflectance: f64) -> SceneSpec {
    let (ex, ey, ez) = ([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]);
    let o = [0.0; 3];
    let sides = [(o, ey, ez), (ex, ez, ey), (o, ez, ex), (ey, ex, ez), (o, ex, ey), (ez, ey, ex)];
    SceneSpec::new(sides.into_iter().map(|(corner, u, v)| grey(quad(corner, u, v), reflectance)).collect())
}

/// A cube of side 1 in the middle of one of side 2: the sides of the inner one first, whose fronts face outwards.
pub(super) fn cube_in_cube([inner, outer]: [f64; 2]) -> SceneSpec {
    let mut body = enclosure([1.0; 3], inner);
    for surface in &mut body.surfaces {
        if let Shape::Parallelogram { corner, corner_u, corner_v, .. } = &mut surface.shape {
            std::mem::swap(corner_u, corner_v);
            [corner, corner_u, corner_v].into_iter().for_each(|point| *point += 0.5);
        }
    }
    body.surfaces.extend(enclosure([2.0; 3], outer).surfaces);
    body
}

/// A closed octahedron seen from inside.
pub(super) fn octahedron(reflectance: f64) -> SceneSpec {
    let mut surfaces = Vec::new();
    for signs in 0..8_u32 {
        let axis = |k: usize| if signs >> k & 1 == 0 { DVec3::AXES[k] } else { -DVec3::AXES[k] };
        let [a, b, c] = [axis(0), axis(1), axis(2)];
        let [b, c] = if (b - a).cross(c - a).dot(a) > 0.0 { [c, b] } else { [b, c] };
        surfaces.push(grey(Shape::Triangle { a, b, c, rows: 2 }, reflectance));
    }
    SceneSpec::new(surfaces)
}
