//! The faces of any scene as polygons.

use glam::DVec3;
use radiosity::{SceneSpec, Shape, Side, Sides, SurfaceSpec, surfaces::Stack};

use crate::cubature::{GAUSS_3, GAUSS_4, GAUSS_5, Rule};
use crate::layers::{PlaneLayers, SideRegion};
use crate::polygon::{CutPlane, Polygon, area, bounding_sphere, doubled_area_vector, fan};
use crate::rectangle::{Facing, Rectangle};

/// One side of a patch that exchanges light.
#[derive(Clone, Debug)]
pub(crate) struct ExchangeFace {
    pub surface: u32,
    pub side: Side,
    /// The whole of it.
    pub polygon: Polygon,
    /// The area of the face [m²].
    pub area: f64,
    /// What no layer in front covers: the whole of it where surfaces do not coincide.
    pub exposed: Vec<ConvexPiece>,
}

/// A convex piece of a face.
#[derive(Clone, Debug)]
pub(crate) struct ConvexPiece {
    pub polygon: Polygon,
    pub plane: CutPlane,
    pub center: DVec3,
    pub radius: f64,
    /// The area of the piece [m²].
    pub area: f64,
    /// The face as an axis-aligned rectangle, if it is one.
    pub rectangle: Option<Rectangle>,
    /// Nodes and weights [m²] to integrate over it, for the rules of [`FAR`].
    pub nodes: [Vec<(DVec3, f64)>; 3],
}

/// Rules by distance: beyond each number of diameters, the Gauss rule along either side whose relative error is near
/// 10⁻¹⁰ there.
pub(crate) const FAR: [(f64, Rule); 3] = [(8.0, GAUSS_3), (4.0, GAUSS_4), (2.0, GAUSS_5)];

/// The faces of a scene around the origin, in the order of the pieces of [`radiosity::surfaces::Faces`], and the outlines of its surfaces.
pub(crate) struct FaceScene {
    pub faces: Vec<ExchangeFace>,
    pub outlines: Vec<Polygon>,
    pub layers: PlaneLayers,
    /// Lengths below this are rounding [m].
    pub tolerance: f64,
    /// Where the origin is in the scene [m].
    pub origin: DVec3,
}

impl FaceScene {
    /// The faces of a scene that [`radiosity::Scene::build`] accepts, given its stacks of coincident surfaces.
    pub(crate) fn new(spec: &SceneSpec, stacks: &[Stack]) -> Self {
        let corners: Vec<DVec3> = spec.surfaces.iter().flat_map(|surface| surface.shape.corners()).collect();
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let (center, extent) = (0.5 * (low + high), (high - low).max_element());
        let farthest = low.abs().max(high.abs()).max_element();
        // Corners that were meant to coincide differ by some roundings of their coordinates.
        let tolerance = 1e-10 * extent.max(1e-3 * farthest);
        let outline = |surface: &SurfaceSpec| {
            surface.shape.corners().into_iter().map(|corner| corner - center).collect()
        };
        let outlines: Vec<Polygon> = spec.surfaces.iter().map(outline).collect();
        let layers = PlaneLayers::new(&outlines, stacks, tolerance);
        let faces_on = |side: Side| {
            let surfaces =
                (0..).zip(&spec.surfaces).filter(move |(_, s)| side == Side::Front || s.sides == Sides::Both);
            let layers = &layers;
            surfaces.flat_map(move |(number, surface)| {
                let cells = 0..surface.shape.cell_count() as u32;
                cells.map(move |cell| {
                    let mut polygon = cell_outline(&surface.shape, cell, center);
                    if side == Side::Back {
                        polygon.reverse();
                    }
                    ExchangeFace::new(number, side, polygon, layers, tolerance)
                })
            })
        };
        let faces = [Side::Front, Side::Back].into_iter().flat_map(faces_on).collect();
        FaceScene { faces, outlines, layers, tolerance, origin: center }
    }
}

impl ExchangeFace {
    fn new(surface: u32, side: Side, polygon: Polygon, layers: &PlaneLayers, tolerance: f64) -> Self {
        let exposed = layers.exposed(&SideRegion { surface, side, polygon: &polygon });
        ExchangeFace {
            surface,
            side,
            area: area(&polygon),
            polygon,
            exposed: exposed.into_iter().map(|polygon| ConvexPiece::new(polygon, tolerance)).collect(),
        }
    }

    /// All of it as a part of its surface.
    pub(crate) fn whole(&self) -> SideRegion<'_> {
        SideRegion { surface: self.surface, side: self.side, polygon: &self.polygon }
    }
}

impl ConvexPiece {
    fn new(polygon: Polygon, tolerance: f64) -> Self {
        let (center, radius) = bounding_sphere(&polygon);
        ConvexPiece {
            plane: CutPlane::through(polygon[0], doubled_area_vector(&polygon)),
            center,
            radius,
            area: area(&polygon),
            rectangle: rectangle(&polygon, tolerance),
            nodes: FAR.map(|(_, rule)| nodes(&polygon, rule, tolerance)),
            polygon,
        }
    }
}

/// The corners of a cell relative to `origin`, counterclockwise seen from the front.
fn cell_outline(shape: &Shape, cell: u32, origin: DVec3) -> Polygon {
    let (corner, e_u, e_v) = shape.edges();
    let [first, second] = shape.cell_label(cell);
    let at = |[u, v]: [f64; 2]| (corner - origin) + e_u * u + e_v * v;
    let on_grid = |[n_u, n_v]: [u32; 2], [i_u, i_v]: [u32; 2]| {
        let corner =
            |[i, j]: [u32; 2]| at([f64::from(i_u + i) / f64::from(n_u), f64::from(i_v + j) / f64::from(n_v)]);
        [[0, 0], [1, 0], [1, 1], [0, 1]].map(corner).to_vec()
    };
    match *shape {
        Shape::Parallelogram { cells, .. } => on_grid(cells, [first, second]),
        Shape::Divided { ref leaves, .. } => on_grid(leaves.get(cell).grid(), leaves.get(cell).at),
        Shape::Triangle { rows, .. } => {
            let j = second / 2;
            let i = first - j;
            let corners = if second.is_multiple_of(2) {
                [[i, j], [i + 1, j], [i, j + 1]]
            } else {
                [[i, j + 1], [i - 1, j + 1], [i, j]]
            };
            corners.map(|corner| at(corner.map(|k| f64::from(k) / f64::from(rows)))).to_vec()
        }
    }
}

/// Whether a polygon is a parallelogram.
fn is_parallelogram(polygon: &[DVec3], tolerance: f64) -> bool {
    matches!(polygon, &[a, b, c, d] if (a - b + c - d).length() <= tolerance)
}

/// The axis-aligned rectangle that a polygon is, if it is one.
fn rectangle(polygon: &[DVec3], tolerance: f64) -> Option<Rectangle> {
    let &[a, b, c, d] = polygon else { return None };
    let along = |edge: DVec3| {
        let mut axes = (0..3).filter(|&axis| edge[axis].abs() > tolerance);
        axes.next().filter(|_| axes.next().is_none())
    };
    let (along_u, along_v) = (along(b - a)?, along(d - a)?);
    if along_u == along_v || !is_parallelogram(polygon, tolerance) {
        return None;
    }
    let axis = 3 - along_u - along_v;
    let facing = if (b - a).cross(d - a)[axis] > 0.0 { Facing::Up } else { Facing::Down };
    let (mut lo, mut hi) = (a.min(c), a.max(c));
    (lo[axis], hi[axis]) = (a[axis], a[axis]);
    Some(Rectangle { axis, facing, lo, hi })
}

/// Gauss's rule along both sides of a parallelogram; of the triangles that any other polygon is cut in, a square folded up
/// at one corner.
fn nodes(polygon: &[DVec3], rule: Rule, tolerance: f64) -> Vec<(DVec3, f64)> {
    let product = || rule.iter().flat_map(|&(s, w_s)| rule.iter().map(move |&(t, w_t)| (s, t, w_s * w_t)));
    if is_parallelogram(polygon, tolerance) {
        let (corner, e_u, e_v) = (polygon[0], polygon[1] - polygon[0], polygon[3] - polygon[0]);
        let cross = e_u.cross(e_v).length();
        return product().map(|(s, t, weight)| (corner + e_u * s + e_v * t, weight * cross)).collect();
    }
    let folded = |[corner, b, c]: [DVec3; 3]| {
        let (e_u, e_v) = (b - corner, c - corner);
        let cross = e_u.cross(e_v).length();
        product()
            .map(move |(s, t, weight)| (corner + e_u * (s * (1.0 - t)) + e_v * (s * t), weight * s * cross))
    };
    fan(polygon).flat_map(folded).collect()
}
