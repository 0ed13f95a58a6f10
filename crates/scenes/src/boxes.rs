//! Small scenes of parallelograms.

use glam::DVec3;
use radiosity::{SceneSpec, Shape, Sides, SurfaceSpec};

use crate::material::SceneMaterial;

/// The unit cube with faces of n × n cells, reflectances from 0.3 (first face) to 0.8 (last); the cell in the
/// middle of the first face emits 1 W/m². n = 3 is the 54-patch cube of S97 figs 2 and 3 (Sbert 1997).
///
/// Faces lie in z = 0, z = 1, x = 0, x = 1, y = 0, y = 1, in this order, and face inwards.
///
/// # Panics
/// Where n is 0.
pub fn cube(n: u32) -> SceneSpec {
    assert!(n > 0, "a face has at least one cell");
    let [o, x, y, z] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let faces = [(o, x, y), (z, y, x), (o, y, z), (x, z, y), (o, z, x), (y, x, z)];
    let reflectances = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
    let mut surfaces: Vec<SurfaceSpec> = faces
        .into_iter()
        .zip(reflectances)
        .map(|((corner, u, v), reflectance)| {
            SceneMaterial::new(reflectance).surface(quad(corner, u, v, [n, n]))
        })
        .collect();
    surfaces[0].cell_emittance = vec![(n / 2 * n + n / 2, 1.0.into())];
    SceneSpec::new(surfaces)
}

/// The cube of [`cube`] where every patch has reflectance R and emits 1 − R W/m²: B = 1 everywhere. n = 1 is the cube
/// of BS table 1 (Bekaert & Seidel), R = ½ that of Sh91 (Shirley 1991).
///
/// # Panics
/// Where n is 0.
pub fn furnace(n: u32, reflectance: f64) -> SceneSpec {
    let mut spec = cube(n);
    for surface in &mut spec.surfaces {
        surface.reflectance = reflectance.into();
        surface.emittance = (1.0 - reflectance).into();
        surface.cell_emittance.clear();
    }
    spec
}

/// A box of 1 × 1 × `length` metres in cells of ⅓ m, R = ½, with an emitter of 1 W/m² in the middle of one end.
///
/// # Panics
/// Where `length` is 0.
pub fn corridor(length: u32) -> SceneSpec {
    assert!(length > 0, "a corridor has some length");
    let mut spec = cube(3);
    let stretch = DVec3::new(1.0, 1.0, f64::from(length));
    for surface in &mut spec.surfaces {
        surface.reflectance = 0.5.into();
        let Shape::Parallelogram { corner, corner_u, corner_v, cells } = &mut surface.shape else {
            unreachable!("cubes are made of parallelograms");
        };
        let along = |edge: DVec3| if edge.z != 0.0 { 3 * length } else { 3 };
        *cells = [along(*corner_u - *corner), along(*corner_v - *corner)];
        for point in [corner, corner_u, corner_v] {
            *point *= stretch;
        }
    }
    spec
}

/// [`cube`] with a surface for every cell: 6 n² surfaces of one patch each, where walks see no difference.
///
/// # Panics
/// Where n is 0.
pub fn cube_of_surfaces(n: u32) -> SceneSpec {
    in_cells(&cube(n))
}

/// A scene of parallelograms with a surface for every cell, in the order of its patches.
///
/// # Panics
/// If there is a triangle.
pub fn in_cells(spec: &SceneSpec) -> SceneSpec {
    SceneSpec::new(spec.surfaces.iter().flat_map(cells_as_surfaces).collect())
}

/// Every cell of a parallelogram as a surface of its own, its corners rounded alike on both sides of an edge.
fn cells_as_surfaces(face: &SurfaceSpec) -> Vec<SurfaceSpec> {
    let Shape::Parallelogram { cells: [nu, nv], .. } = face.shape else {
        panic!("a triangle has no cells that are parallelograms");
    };
    let (corner, u, v) = face.shape.edges();
    let at =
        |i: u32, j: u32| corner + u * (f64::from(i) / f64::from(nu)) + v * (f64::from(j) / f64::from(nv));
    let cell = |cell: u32| {
        let (i, j) = (cell / nv, cell % nv);
        let shape = Shape::Parallelogram {
            corner: at(i, j),
            corner_u: at(i + 1, j),
            corner_v: at(i, j + 1),
            cells: [1, 1],
        };
        let own = face.cell_emittance.iter().filter(|(emitter, _)| *emitter == cell);
        let cell_emittance = own.map(|&(_, emittance)| (0, emittance)).collect();
        SurfaceSpec { shape, cell_emittance, ..face.clone() }
    };
    (0..nu * nv).map(cell).collect()
}

/// A Cornell box of parallelograms alone: right angles where the measured box is a few millimetres off, and
/// blocks that stand on a millimetre of air, so that no patch lies half under one. 21 surfaces of about
/// 28 mm patches; the front is open, as published.
pub fn cornell() -> SceneSpec {
    const WHITE: SceneMaterial = SceneMaterial::new(0.737);
    const GREEN: SceneMaterial = SceneMaterial::new(0.283);
    const RED: SceneMaterial = SceneMaterial::new(0.184);
    const LAMP: SceneMaterial = SceneMaterial::new(0.78).emitting(100.0);
    let [w, h, d] = [DVec3::X * 0.556, DVec3::Y * 0.5488, DVec3::Z * 0.5592];
    let (lamp_low, lamp_high) = (DVec3::new(0.213, 0.0, 0.227), DVec3::new(0.343, 0.0, 0.332));
    // A rectangle of the ceiling, facing down.
    let ceiling = |x: [f64; 2], z: [f64; 2]| {
        let corner = h + DVec3::new(x[0], 0.0, z[0]);
        panel(corner, DVec3::X * (x[1] - x[0]), DVec3::Z * (z[1] - z[0]))
    };
    let mut surfaces = vec![
        LAMP.surface(ceiling([lamp_low.x, lamp_high.x], [lamp_low.z, lamp_high.z])),
        WHITE.surface(ceiling([0.0, w.x], [0.0, lamp_low.z])),
        WHITE.surface(ceiling([0.0, w.x], [lamp_high.z, d.z])),
        WHITE.surface(ceiling([0.0, lamp_low.x], [lamp_low.z, lamp_high.z])),
        WHITE.surface(ceiling([lamp_high.x, w.x], [lamp_low.z, lamp_high.z])),
        WHITE.surface(panel(DVec3::ZERO, d, w)),
        WHITE.surface(panel(d, h, w)),
        GREEN.surface(panel(DVec3::ZERO, h, d)),
        RED.surface(panel(w, d, h)),
    ];
    let air = DVec3::Y * 0.001;
    let short =
        [DVec3::new(0.130, 0.0, 0.065), DVec3::new(0.160, 0.0, 0.049), DVec3::new(-0.048, 0.0, 0.160)];
    let tall = [DVec3::new(0.423, 0.0, 0.247), DVec3::new(0.049, 0.0, 0.159), DVec3::new(-0.158, 0.0, 0.049)];
    surfaces.extend(block(short[0] + air, short[1], DVec3::Y * 0.165, short[2]).map(|f| WHITE.surface(f)));
    surfaces.extend(block(tall[0] + air, tall[1], DVec3::Y * 0.330, tall[2]).map(|f| WHITE.surface(f)));
    SceneSpec::new(surfaces)
}

/// A closed room of 4 × 2.5 × 3 m with a table and shelves of two-sided panels, which touch nothing: 16 rectangles of
/// n × n cells each. The middle quarter of the ceiling emits 1 W/m². n = 4, 8, 16 are the 256, 1,024 and 4,096 zones of
/// Sh91 fig 1 (Shirley 1991).
///
/// # Panics
/// Unless n is a multiple of 4.
pub fn room(n: u32) -> SceneSpec {
    assert!(n > 0 && n.is_multiple_of(4), "a quarter of the ceiling is whole cells");
    let [w, h, d] = [DVec3::X * 4.0, DVec3::Y * 2.5, DVec3::Z * 3.0];
    let walls =
        [(DVec3::ZERO, d, w), (h, w, d), (d, h, w), (DVec3::ZERO, w, h), (DVec3::ZERO, h, d), (w, d, h)];
    let reflectances = [0.4, 0.8, 0.7, 0.7, 0.6, 0.5];
    let wall = |((corner, u, v), r)| SceneMaterial::new(r).surface(quad(corner, u, v, [n, n]));
    let mut surfaces: Vec<SurfaceSpec> = walls.into_iter().zip(reflectances).map(wall).collect();
    let middle = n / 4..n - n / 4;
    surfaces[1].cell_emittance =
        middle.clone().flat_map(|i| middle.clone().map(move |j| (i * n + j, 1.0.into()))).collect();
    let panel = |corner: [f64; 3], u: DVec3, v: DVec3| SurfaceSpec {
        sides: Sides::Both,
        ..SceneMaterial::new(0.6).surface(quad(corner.into(), u, v, [n, n]))
    };
    // The table: its top and four legs.
    surfaces.push(panel([0.7, 0.8, 0.9], DVec3::X * 1.5, DVec3::Z * 1.2));
    let legs = [[0.75, 0.95], [1.85, 0.95], [0.75, 2.05], [1.85, 2.05]];
    surfaces.extend(legs.map(|[x, z]| panel([x, 0.01, z], DVec3::X * 0.3, DVec3::Y * 0.78)));
    // The shelves and their back.
    surfaces.extend([0.4, 0.9, 1.4, 1.9].map(|y| panel([3.3, y, 0.8], DVec3::X * 0.4, DVec3::Z * 1.4)));
    surfaces.push(panel([3.75, 0.2, 0.8], DVec3::Y * 2.0, DVec3::Z * 1.4));
    SceneSpec::new(surfaces)
}

pub(crate) fn quad(corner: DVec3, u: DVec3, v: DVec3, cells: [u32; 2]) -> Shape {
    Shape::Parallelogram { corner, corner_u: corner + u, corner_v: corner + v, cells }
}

/// A parallelogram in cells of about 28 mm.
fn panel(corner: DVec3, u: DVec3, v: DVec3) -> Shape {
    let cells = |edge: DVec3| (edge.length() / 0.028).ceil() as u32;
    quad(corner, u, v, [cells(u), cells(v)])
}

/// The six outward faces of a parallelepiped; the edges u, v, w from its corner turn left-handed or right.
fn block(corner: DVec3, u: DVec3, v: DVec3, w: DVec3) -> [Shape; 6] {
    let (v, w) = if u.cross(v).dot(w) > 0.0 { (v, w) } else { (w, v) };
    [
        panel(corner, v, u),
        panel(corner + w, u, v),
        panel(corner, w, v),
        panel(corner + u, v, w),
        panel(corner, u, w),
        panel(corner + v, w, u),
    ]
}
