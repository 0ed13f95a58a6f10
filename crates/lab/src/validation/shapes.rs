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
        transmittance: Default::default(),
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

/// Rectangles of these ranges of x and y: the first at height 0, the second at height 1 above it.
pub(super) fn parallel([x, y]: [[f64; 2]; 2], [s, t]: [[f64; 2]; 2]) -> SceneSpec {
    let (u, v) = ([x[1] - x[0], 0.0, 0.0], [0.0, y[1] - y[0], 0.0]);
    let (p, q) = ([s[1] - s[0], 0.0, 0.0], [0.0, t[1] - t[0], 0.0]);
    black([quad([x[0], y[0], 0.0], u, v), quad([s[0], t[0], 1.0], q, p)])
}

/// A strip of a floor and a strip of a wall at x = 0, both of length 1.
pub(super) fn perpendicular_strips([x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) -> SceneSpec {
    let edge = [0.0, 1.0, 0.0];
    black([quad([x0, 0.0, 0.0], [x1 - x0, 0.0, 0.0], edge), quad([0.0, 0.0, z0], edge, [0.0, 0.0, z1 - z0])])
}

/// Endless strips between points of the plane x, z, whose fronts are on the left of the way from the first point to the second.
pub(super) fn endless(strips: impl IntoIterator<Item = [[f64; 2]; 2]>) -> SceneSpec {
    let strip = |[[x0, z0], [x1, z1]]: [[f64; 2]; 2]| {
        quad([x0, 0.0, z0], [x1 - x0, 0.0, z1 - z0], [0.0, ENDLESS, 0.0])
    };
    black(strips.into_iter().map(strip))
}

/// The side of a patch that stands for an element, where what it sees is some metres away: its factors differ from those of the
/// element by a millionth.
const ELEMENT: f64 = 1e-3;

/// An element at the origin that faces up, and rectangles by corner and two edges.
pub(super) fn element<const N: usize>(rectangles: [[[f64; 3]; 3]; N]) -> SceneSpec {
    let corner = [-0.5 * ELEMENT, -0.5 * ELEMENT, 0.0];
    let own = quad(corner, [ELEMENT, 0.0, 0.0], [0.0, ELEMENT, 0.0]);
    black([own].into_iter().chain(rectangles.map(|[corner, u, v]| quad(corner, u, v))))
}

/// An element at the origin that faces up, and a disc of radius r of [`SECTORS`] triangles above it, at distance 1 and `away`.
pub(super) fn element_and_disc(r: f64, away: f64) -> SceneSpec {
    let mut spec = element([]);
    let corner = |k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(SECTORS)).sin_cos();
        DVec3::new(away + r * cos, r * sin, 1.0)
    };
    let a = DVec3::new(away, 0.0, 1.0);
    let sector = |k| Shape::Triangle { a, b: corner(k + 1), c: corner(k), rows: 1 };
    spec.surfaces.extend((0..SECTORS).map(|k| grey(sector(k), 0.0)));
    spec
}

/// A closed icosphere seen from inside: an icosahedron whose triangles are cut in four and pushed out to radius 1, as often as
/// `cuts` says.
pub(super) fn icosphere(cuts: u32, reflectance: f64) -> SceneSpec {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    // Corners of an edge are 2 apart, all others more.
    let is_edge = |a: DVec3, b: DVec3| a.distance(b) < 2.1;
    let mut triangles = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in corners.iter().skip(j + 1).filter(|&&c| is_edge(a, b) && is_edge(b, c) && is_edge(a, c))
            {
                let inwards = (b - a).cross(c - a).dot(a) < 0.0;
                triangles.push(if inwards { [a, b, c] } else { [a, c, b] }.map(DVec3::normalize));
            }
        }
    }
    for _ in 0..cuts {
        let cut = |[a, b, c]: [DVec3; 3]| {
            let [d, e, f] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        triangles = triangles.into_iter().flat_map(cut).collect();
    }
    let surface = |[a, b, c]: [DVec3; 3]| grey(Shape::Triangle { a, b, c, rows: 1 }, reflectance);
    SceneSpec::new(triangles.into_iter().map(surface).collect())
}

/// An opening from `low` to `high` in the roof of a room of 4 × 4 × 3, its floor, and its walls.
pub(super) fn room_below_opening([low, high]: [f64; 2]) -> SceneSpec {
    let side = high - low;
    let opening = quad([low, low, 3.0], [0.0, side, 0.0], [side, 0.0, 0.0]);
    let room = enclosure([4.0, 4.0, 3.0], 0.0);
    let mut spec = black([opening, room.surfaces[4].shape.clone()]);
    spec.surfaces.extend(room.surfaces.into_iter().take(4));
    spec
}

/// The area of a scene of triangles, and that of its last [m²].
pub(super) fn areas(spec: &SceneSpec) -> (f64, f64) {
    let area = |surface: &SurfaceSpec| surface.shape.area();
    let last = spec.surfaces.last().map_or(0.0, area);
    (spec.surfaces.iter().map(area).sum(), last)
}

/// Endless parallel strips of width 1 at distance h.
pub(super) fn strips(h: f64) -> SceneSpec {
    let (u, v) = ([1.0, 0.0, 0.0], [0.0, ENDLESS, 0.0]);
    black([quad([0.0; 3], u, v), quad([0.0, 0.0, h], v, u)])
}

/// Endless plates of width 1 along a common edge, at an angle [rad].
pub(super) fn wedge(angle: f64) -> SceneSpec {
    plates(angle, [1.0; 2], ENDLESS)
}

/// Plates of two widths along a common edge of some length, at an angle [rad].
pub(super) fn plates(angle: f64, [w, h]: [f64; 2], length: f64) -> SceneSpec {
    let edge = [0.0, length, 0.0];
    let (sin, cos) = angle.sin_cos();
    black([quad([0.0; 3], [w, 0.0, 0.0], edge), quad([0.0; 3], edge, [h * cos, 0.0, h * sin])])
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
    piece_of_street(h, ENDLESS)
}

/// A piece of a street of width 1 between walls of height h.
pub(super) fn piece_of_street(h: f64, length: f64) -> SceneSpec {
    let (edge, up) = ([0.0, length, 0.0], [0.0, 0.0, h]);
    black([quad([0.0; 3], [1.0, 0.0, 0.0], edge), quad([0.0; 3], edge, up), quad([1.0, 0.0, 0.0], up, edge)])
}

/// The triangles of a disc, and how many.
pub(super) const SECTORS: u32 = 192;

/// Coaxial discs of these radii at distance 1, each of [`SECTORS`] triangles.
pub(super) fn discs(r1: f64, r2: f64) -> SceneSpec {
    SceneSpec::new(disc(0.0, r1, true).chain(disc(1.0, r2, false)).collect())
}

/// A disc about the axis, of [`SECTORS`] triangles, which faces up or down.
pub(super) fn disc(z: f64, radius: f64, up: bool) -> impl Iterator<Item = SurfaceSpec> {
    let corner = move |k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(SECTORS)).sin_cos();
        DVec3::new(radius * cos, radius * sin, z)
    };
    (0..SECTORS).map(move |k| {
        let [b, c] = if up { [corner(k), corner(k + 1)] } else { [corner(k + 1), corner(k)] };
        grey(Shape::Triangle { a: DVec3::new(0.0, 0.0, z), b, c, rows: 1 }, 0.0)
    })
}

/// How often the triangles of a sphere are cut in four.
pub(super) const CUTS: u32 = 4;

/// A sphere seen from outside, its centre at some height: an [`icosphere`] of [`CUTS`] cuts.
pub(super) fn sphere(radius: f64, height: f64) -> SceneSpec {
    let mut spec = icosphere(CUTS, 0.0);
    let placed = |point: DVec3| radius * point + height * DVec3::Z;
    for surface in &mut spec.surfaces {
        if let Shape::Triangle { a, b, c, .. } = &mut surface.shape {
            [*a, *b, *c] = [*a, *c, *b].map(placed);
        }
    }
    spec
}

/// The sides of a cylinder.
pub(super) const STAVES: u32 = 384;

/// A cylinder about the z axis from 0 to a height, without ends, of [`STAVES`] sides that face inwards or outwards.
pub(super) fn cylinder(radius: f64, height: f64, inwards: bool) -> SceneSpec {
    staves(inwards, |sin, cos| [radius * cos, radius * sin, 0.0], [0.0, 0.0, height])
}

fn staves(inwards: bool, corner: impl Fn(f64, f64) -> [f64; 3], axis: [f64; 3]) -> SceneSpec {
    let corner = |k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(STAVES)).sin_cos();
        DVec3::from(corner(sin, cos))
    };
    let side = |k| {
        let along = (corner(k + 1) - corner(k)).to_array();
        let [u, v] = if inwards { [axis, along] } else { [along, axis] };
        quad(corner(k).to_array(), u, v)
    };
    black((0..STAVES).map(side))
}

/// Two endless cylinders of radius 1 seen from outside, with a gap between them.
pub(super) fn endless_cylinders(gap: f64) -> SceneSpec {
    let mut spec = endless_cylinder([0.0; 2]);
    spec.surfaces.extend(endless_cylinder([2.0 + gap, 0.0]).surfaces);
    spec
}

/// An endless cylinder of radius 1 about the point x, z, seen from outside.
fn endless_cylinder([x, z]: [f64; 2]) -> SceneSpec {
    staves(false, |sin, cos| [x + sin, 0.0, z + cos], [0.0, ENDLESS, 0.0])
}

/// Pieces of length 1 of coaxial cylinders of radii 1, seen from outside, and r, seen from inside, about a horizontal axis.
pub(super) fn pieces_of_coaxial_cylinders(r: f64) -> SceneSpec {
    let mut spec = staves(false, |sin, cos| [sin, 0.0, cos], [0.0, 1.0, 0.0]);
    spec.surfaces.extend(staves(true, |sin, cos| [r * sin, 0.0, r * cos], [0.0, 1.0, 0.0]).surfaces);
    spec
}

/// A piece of 1 × 1 of a plane, and above its middle a piece of a tube along y of some radius, seen from outside.
pub(super) fn plane_and_tube(radius: f64) -> SceneSpec {
    let mut spec = black([quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])]);
    let corner = |sin: f64, cos: f64| [0.5 + radius * sin, 0.0, 1.0 + radius * cos];
    spec.surfaces.extend(staves(false, corner, [0.0, 1.0, 0.0]).surfaces);
    spec
}

/// A piece of 1.5 × 1 of a floor, and above it a slat of some width that faces it.
pub(super) fn floor_and_slat(width: f64) -> SceneSpec {
    let edge = [0.0, 1.0, 0.0];
    black([quad([0.0; 3], [1.5, 0.0, 0.0], edge), quad([0.3, 0.0, 0.7], edge, [width, 0.0, 0.0])])
}

/// The triangles that [`bands`] makes of a piece of its path.
pub(super) const BAND: u32 = 2 * STAVES;

/// A path of radius and height turned about the z axis, [`BAND`] triangles a piece; their fronts are on the right of the path, where up is up and
/// radii grow to the right. Where the path meets the axis there are half as many.
pub(super) fn bands(path: &[[f64; 2]]) -> impl Iterator<Item = SurfaceSpec> + '_ {
    let corner = |k: u32, [radius, z]: [f64; 2]| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(STAVES)).sin_cos();
        DVec3::new(radius * cos, radius * sin, z)
    };
    path.windows(2).flat_map(move |ends| {
        (0..STAVES).flat_map(move |k| {
            let [a, b] = [k, (k + 1) % STAVES].map(|k| corner(k, ends[0]));
            let [d, c] = [k, (k + 1) % STAVES].map(|k| corner(k, ends[1]));
            let halves = [(ends[0][0], [a, b, c]), (ends[1][0], [a, c, d])];
            let halves = halves.into_iter().filter(|(radius, _)| *radius > 0.0);
            halves.map(|(_, [a, b, c])| grey(Shape::Triangle { a, b, c, rows: 1 }, 0.0))
        })
    })
}

/// A part of a sphere of radius 1 about the origin, seen from inside: what lies up to a height above its lowest point.
pub(super) fn bowl(height: f64) -> SceneSpec {
    const RINGS: u32 = 64;
    let most = (1.0 - height).acos();
    let point = |k: u32| {
        let (sin, cos) = (most * f64::from(RINGS - k) / f64::from(RINGS)).sin_cos();
        [sin, -cos]
    };
    let path: Vec<[f64; 2]> = (0..=RINGS).map(point).collect();
    SceneSpec::new(bands(&path).collect())
}

/// An element at the origin that faces up, and a sphere of some radius about a point over x and z: its triangles have the area of the round one, so
/// that in the mean over directions they look as large.
pub(super) fn element_and_sphere(radius: f64, [x, z]: [f64; 2]) -> SceneSpec {
    let round = 4.0 * std::f64::consts::PI;
    let mut ball = sphere(1.0, 0.0);
    let scale = radius * (round / areas(&ball).0).sqrt();
    for surface in &mut ball.surfaces {
        if let Shape::Triangle { a, b, c, .. } = &mut surface.shape {
            [*a, *b, *c] = [*a, *b, *c].map(|point| scale * point + DVec3::new(x, 0.0, z));
        }
    }
    let mut spec = element([]);
    spec.surfaces.extend(ball.surfaces);
    spec
}

/// Rectangles at right angles: x by y of a floor, and y by z of the wall at x = 0 above it.
pub(super) fn floor_and_wall([x, y]: [[f64; 2]; 2], [s, z]: [[f64; 2]; 2]) -> SceneSpec {
    let floor = quad([x[0], y[0], 0.0], [x[1] - x[0], 0.0, 0.0], [0.0, y[1] - y[0], 0.0]);
    black([floor, quad([0.0, s[0], z[0]], [0.0, s[1] - s[0], 0.0], [0.0, 0.0, z[1] - z[0]])])
}

/// An endless strip of the floor between two places, and an endless cylinder of radius 1 with its axis above 0.
pub(super) fn strip_and_cylinder([a, b]: [f64; 2], height: f64) -> SceneSpec {
    let mut spec = endless([[[a, 0.0], [b, 0.0]]]);
    spec.surfaces.extend(endless_cylinder([0.0, height]).surfaces);
    spec
}

/// A disc of radius r₁, and above it two discs in one plane, of which the smaller leaves of the larger an annulus: three groups
/// of [`SECTORS`] triangles, the annulus the last.
pub(super) fn disc_and_annulus(r1: f64, [r2, r3]: [f64; 2]) -> SceneSpec {
    let mut spec = discs(r1, r2);
    spec.surfaces.extend(discs(r1, r3).surfaces.split_off(SECTORS as usize));
    spec
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
