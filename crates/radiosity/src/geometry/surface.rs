//! A surface ready for walks: a frame to shoot from, cells to find a hit's patch in at bounded cost (S97
//! case 1: tracing runs against the surfaces, never against the patches).

use std::sync::Arc;

use glam::DVec3;

use crate::geometry::cells::{
    grid_step_of, in_grid_step, inside, place_in_grid_cell, place_in_leaf, place_in_triangle_cell,
    point_in_leaf, point_in_triangle_cell, triangle_cell,
};
use crate::geometry::face::Face;
use crate::geometry::frame::SurfaceFrame;
use crate::geometry::leaf_table::LeafTable;
use crate::geometry::spec::{Shape, Side, Sides, Spectrum, SurfaceSpec};
use crate::random::sampling::{cosine_direction, fixed_64};

/// How a surface is cut into cells.
#[derive(Clone, Debug)]
enum SurfaceCells {
    /// With 1/n_u and 1/n_v.
    Grid {
        nu: u32,
        nv: u32,
        inverse: [f64; 2],
    },
    Rows {
        k: u32,
    },
    Leaves(Arc<LeafTable>),
}

/// A planar surface in the scene's local coordinates (origin in the middle of the scene).
///
/// What every walk asks for fills three cache lines; colour, which not every walk asks for, is in a fourth.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Surface {
    /// σ as a threshold for 64 random bits.
    survival: u64,
    first_piece: u32,
    /// The number of the back of a cell less that of its front; 0 where backs are not active.
    to_back: u32,
    cells: SurfaceCells,
    sides: Sides,
    corner: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    /// Orthonormal frame; `normal` points to the front.
    tangent: DVec3,
    normal: DVec3,
    reflectance: Spectrum,
    tint: [f64; 3],
}

impl Surface {
    /// Prepares a surface that [`crate::Scene::build`] has found valid, given the numbers of its first front and, where
    /// it has two sides, of its first back; `origin` becomes (0, 0, 0).
    pub(crate) fn new(spec: &SurfaceSpec, first_piece: u32, first_back: Option<u32>, origin: DVec3) -> Self {
        let (corner, edge_u, edge_v) = spec.shape.edges();
        let normal = edge_u.cross(edge_v).normalize();
        let tangent = edge_u.normalize();
        let cells = match spec.shape {
            Shape::Parallelogram { cells: [nu, nv], .. } => {
                SurfaceCells::Grid { nu, nv, inverse: [nu, nv].map(|n| 1.0 / f64::from(n)) }
            }
            Shape::Triangle { rows, .. } => SurfaceCells::Rows { k: rows },
            Shape::Divided { ref leaves, .. } => SurfaceCells::Leaves(Arc::new(LeafTable::new(leaves))),
        };
        Surface {
            corner: corner - origin,
            edge_u,
            edge_v,
            tangent,
            normal,
            reflectance: spec.reflectance,
            survival: fixed_64(spec.passed_on().max()),
            tint: tint(spec.reflectance),
            first_piece,
            to_back: first_back.map_or(0, |back| back - first_piece),
            cells,
            sides: spec.sides,
        }
    }

    /// Takes on the normal of a plane that it lies in, this one or its opposite.
    pub(crate) fn lie_in(&mut self, normal: DVec3) {
        self.normal = if self.normal.dot(normal) > 0.0 { normal } else { -normal };
        self.tangent = (self.edge_u - self.normal * self.normal.dot(self.edge_u)).normalize();
    }

    pub(crate) fn corner(&self) -> DVec3 {
        self.corner
    }

    /// The edges along u and v.
    pub fn edges(&self) -> [DVec3; 2] {
        [self.edge_u, self.edge_v]
    }

    /// The dual of the edges: u_axis·e_u = 1, u_axis·e_v = 0. Its length is 1 over the height above the other edge.
    pub(crate) fn dual_basis(&self) -> [DVec3; 2] {
        let ([e_u, e_v], normal) = (self.edges(), self.normal);
        [e_v.cross(normal) / e_v.cross(normal).dot(e_u), normal.cross(e_u) / normal.cross(e_u).dot(e_v)]
    }

    /// What departures need of it.
    #[inline(always)]
    pub(crate) fn frame(&self) -> SurfaceFrame<f64> {
        SurfaceFrame::new(self.corner, self.edges(), self.tangent, self.normal)
    }

    /// Cells along u and v; of a triangle, rows; of leaves, those of the grid that holds them.
    pub(crate) fn cells_along(&self) -> [u32; 2] {
        match self.cells {
            SurfaceCells::Leaves(ref table) => table.grid(),
            SurfaceCells::Grid { nu, nv, .. } => [nu, nv],
            SurfaceCells::Rows { k } => [k, k],
        }
    }

    /// Area of one side [m²].
    pub fn area(&self) -> f64 {
        let whole = self.edge_u.cross(self.edge_v).length();
        if self.is_triangle() { 0.5 * whole } else { whole }
    }

    /// How many cells it is cut into.
    pub fn cell_count(&self) -> u32 {
        match self.cells {
            SurfaceCells::Grid { nu, nv, .. } => nu * nv,
            SurfaceCells::Rows { k } => k * k,
            SurfaceCells::Leaves(ref table) => table.len(),
        }
    }

    /// Whether it is a triangle; else it is a parallelogram.
    pub fn is_triangle(&self) -> bool {
        matches!(self.cells, SurfaceCells::Rows { .. })
    }

    /// The leaves that it is cut into, where it is cut so.
    pub(crate) fn leaves(&self) -> Option<&LeafTable> {
        match &self.cells {
            SurfaceCells::Leaves(table) => Some(table),
            _ => None,
        }
    }

    /// Unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Which sides are active.
    pub fn sides(&self) -> Sides {
        self.sides
    }

    /// The number of its first front; the others follow in cell order.
    pub(crate) fn first_piece(&self) -> u32 {
        self.first_piece
    }

    /// The number of the back of a cell less that of its front; 0 where backs are not active.
    pub(crate) fn to_back(&self) -> u32 {
        self.to_back
    }

    /// The cell of this surface that a face of one piece is a side of.
    #[inline(always)]
    pub(crate) fn cell_of(&self, face: &Face) -> u32 {
        let [i, j] = face.cell;
        match self.cells {
            SurfaceCells::Grid { nv, .. } => i * nv + j,
            SurfaceCells::Rows { .. } => i * i + j,
            SurfaceCells::Leaves(_) => i,
        }
    }

    /// The number of the piece that is an active side of a cell.
    #[inline(always)]
    pub fn piece(&self, cell: u32, side: Side) -> u32 {
        self.first_piece + cell + if side == Side::Back { self.to_back } else { 0 }
    }

    /// R: the reflectance, per channel.
    #[inline(always)]
    pub fn reflectance(&self) -> Spectrum {
        self.reflectance
    }

    /// R_c/σ of each channel: what is left of the weights of a walk that survives.
    #[inline(always)]
    pub(crate) fn tint(&self) -> [f64; 3] {
        self.tint
    }

    /// Whether a side reflects and emits.
    #[inline(always)]
    pub fn is_active(&self, side: Side) -> bool {
        side == Side::Front || self.sides == Sides::Both
    }

    /// Whether a walk survives here, given 64 random bits: probability σ, the largest channel of R.
    #[inline(always)]
    pub fn survives(&self, bits: u64) -> bool {
        bits < self.survival
    }

    /// What the bits of survivors are below.
    pub(crate) fn survival_threshold(&self) -> u64 {
        self.survival
    }

    /// The cell that holds the point with local coordinates (u, v).
    #[inline(always)]
    pub fn cell_at(&self, [u, v]: [f64; 2]) -> u32 {
        match self.cells {
            SurfaceCells::Grid { nu, nv, .. } => grid_step_of(u, nu) * nv + grid_step_of(v, nv),
            SurfaceCells::Rows { k } => triangle_cell([u, v], k),
            SurfaceCells::Leaves(ref table) => table.leaf_at([u, v]),
        }
    }

    /// Local coordinates of a uniform point of a cell, from two uniforms in (0, 1).
    #[inline(always)]
    pub fn point_in_cell(&self, cell: u32, [r1, r2]: [f64; 2]) -> [f64; 2] {
        match self.cells {
            SurfaceCells::Grid { nv, inverse, .. } => {
                // ⌊cell/n_v⌋ without a division: the half keeps the quotient away from whole numbers.
                let iu = ((f64::from(cell) + 0.5) * inverse[1]) as u32;
                let iv = cell - iu * nv;
                [in_grid_step(iu.into(), r1, inverse[0]), in_grid_step(iv.into(), r2, inverse[1])]
            }
            SurfaceCells::Rows { k } => point_in_triangle_cell(cell, k, [r1, r2]),
            SurfaceCells::Leaves(ref table) => point_in_leaf(table.get(cell), [r1, r2]),
        }
    }

    /// Where the point with local coordinates (u, v) lies in a cell: 0 … 1 along the edges of the cell from its first corner.
    #[inline(always)]
    pub(crate) fn place_in_cell(&self, cell: u32, uv: [f64; 2]) -> [f64; 2] {
        match self.cells {
            SurfaceCells::Grid { nu, nv, .. } => place_in_grid_cell(uv, cell, [nu, nv]),
            SurfaceCells::Rows { k } => place_in_triangle_cell(uv, cell, k),
            SurfaceCells::Leaves(ref table) => place_in_leaf(uv, table.get(cell)),
        }
    }

    /// The nearest local coordinates strictly inside the surface: where a continuous walk leaves from.
    #[inline(always)]
    pub fn inside(&self, uv: [f64; 2]) -> [f64; 2] {
        inside(uv, self.is_triangle())
    }

    /// The point with local coordinates (u, v) [m].
    #[inline(always)]
    pub fn point(&self, uv: [f64; 2]) -> DVec3 {
        self.frame().point(uv).into()
    }

    /// A cosine-distributed direction into the half-space of a side, from 64 random bits. Its length is 1
    /// within 10⁻¹¹.
    #[inline(always)]
    pub fn direction(&self, side: Side, bits: u64) -> DVec3 {
        self.to_scene(side, cosine_direction(bits))
    }

    /// A direction in the frame of a side, in that of the scene.
    #[inline(always)]
    pub(crate) fn to_scene(&self, side: Side, direction: [f64; 3]) -> DVec3 {
        self.frame().direction(side.sign(), direction).into()
    }
}

fn tint(reflectance: Spectrum) -> [f64; 3] {
    // Nothing survives where σ = 0.
    let survival = reflectance.max();
    reflectance.channels().map(|channel| if survival > 0.0 { channel / survival } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cells::{EDGE, grid_step};
    use crate::random::rng::unit_32;

    fn triangle(rows: u32) -> Surface {
        let shape = Shape::Triangle { a: DVec3::ZERO, b: DVec3::X, c: DVec3::Y, rows };
        Surface::new(
            &SurfaceSpec {
                name: None,
                shape,
                sides: Sides::Front,
                reflectance: 0.5.into(),
                emittance: Spectrum::BLACK,
                cell_emittance: vec![],
                transmittance: Default::default(),
            },
            0,
            None,
            DVec3::ZERO,
        )
    }

    #[test]
    fn points_drawn_in_a_triangle_cell_lie_in_it() {
        for k in 1..=9 {
            let surface = triangle(k);
            for cell in 0..k * k {
                for step in 0..400 {
                    let r = [(f64::from(step % 20) + 0.4) / 20.0, (f64::from(step / 20) + 0.7) / 20.0];
                    let uv = surface.point_in_cell(cell, r);
                    assert_eq!(surface.cell_at(uv), cell, "k {k} uv {uv:?}");
                }
            }
        }
    }

    /// Over a grid of the two uniforms, the points of a cell have the moments of a triangle: in the coordinates
    /// of its first corner and edges, E[s] = E[t] = 1/3, E[s²] = E[t²] = 1/6, E[st] = 1/12. The grid is exact but
    /// for its cells on the fold, a part 1/n of them.
    #[test]
    fn points_drawn_in_a_triangle_cell_are_uniform() {
        const N: u32 = 1000;
        // Row 2 of 3, the inverted cell beside ab: its corners are (2, 1)/3, (1, 1)/3 and (2, 0)/3.
        for (cell, [u, v], sign) in [(0, [0.0, 0.0], 1.0), (5, [2.0, 1.0], -1.0)] {
            let mut sums = [0.0; 5];
            for step in 0..N * N {
                let r = [step % N, step / N].map(|i| (f64::from(i) + 0.5) / f64::from(N));
                let [x, y] = triangle(3).point_in_cell(cell, r);
                let (s, t) = (sign * (3.0 * x - u), sign * (3.0 * y - v));
                for (sum, value) in sums.iter_mut().zip([s, t, s * s, t * t, s * t]) {
                    *sum += value / f64::from(N * N);
                }
            }
            for (mean, expected) in
                sums.into_iter().zip([1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0, 1.0 / 12.0])
            {
                assert!((mean - expected).abs() < 1e-3, "cell {cell}: {sums:?}");
            }
        }
    }

    #[test]
    fn triangle_cells_are_numbered_as_the_format_says() {
        // k = 2: row 0 is the cell at a; row 1 begins at the ab side: upright, inverted, upright.
        let surface = triangle(2);
        assert_eq!(surface.cell_at([0.1, 0.1]), 0);
        assert_eq!(surface.cell_at([0.6, 0.1]), 1);
        assert_eq!(surface.cell_at([0.4, 0.4]), 2);
        assert_eq!(surface.cell_at([0.1, 0.6]), 3);
    }

    #[test]
    fn hits_on_or_just_beyond_the_outline_get_a_cell_of_the_surface() {
        for k in [1, 2, 3, 7] {
            let surface = triangle(k);
            for [u, v] in
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [1.0 + 1e-15, -1e-15], [0.7, 0.3 + 1e-15]]
            {
                assert!(surface.cell_at([u, v]) < k * k);
                let [u, v] = surface.inside([u, v]);
                assert!(u > 0.0 && v > 0.0 && u + v < 1.0);
            }
        }
        for x in [1.0, 1.0 + 1e-15, -1e-16, 0.0, 1.0 / 3.0, 2.0 / 3.0, 0.999] {
            assert_eq!(f64::from(grid_step_of(x, 3)), grid_step(x, 3.0));
        }
        assert_eq!([grid_step_of(1.0, 3), grid_step_of(-1e-16, 3)], [2, 0]);
    }

    #[test]
    fn sampled_points_keep_the_distance_that_inside_keeps() {
        assert_eq!(unit_32(0), EDGE);
        assert_eq!(unit_32(u32::MAX), 1.0 - EDGE);
    }
}
