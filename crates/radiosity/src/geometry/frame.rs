//! Frames of surfaces: from local coordinates to the scene, for N surfaces side by side.

use glam::DVec3;

use crate::simd::real::Real;
use crate::simd::table::Table;

/// Numbers of a frame in a table: five vectors and a zero.
const FRAME_NUMBERS: usize = 16;

/// The frames of surfaces.
#[derive(Clone, Debug)]
pub(crate) struct Frames(Table<FRAME_NUMBERS>);

impl Frames {
    /// What the frames take of memory [bytes].
    pub(crate) fn bytes(&self) -> usize {
        self.0.bytes()
    }

    /// The frames of surfaces, in the order of the surfaces.
    pub(crate) fn new(frames: impl Iterator<Item = SurfaceFrame<f64>>) -> Self {
        let numbers = |SurfaceFrame { corner, edges: [edge_u, edge_v], tangent, normal }| {
            let components = [corner, edge_u, edge_v, tangent, normal];
            std::array::from_fn(|i| components.as_flattened().get(i).copied().unwrap_or(0.0))
        };
        Frames(Table::new(frames.map(numbers).collect()))
    }

    /// Rays will soon leave these surfaces.
    #[inline(always)]
    pub(crate) fn expect(&self, surfaces: &[u32]) {
        self.0.expect(surfaces);
    }
}

/// What a departure needs of N surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceFrame<R> {
    pub(super) corner: [R; 3],
    pub(super) edges: [[R; 3]; 2],
    /// Unit vector along the first edge.
    pub(super) tangent: [R; 3],
    /// Unit normal of the front.
    pub(super) normal: [R; 3],
}

impl<R: Real> SurfaceFrame<R> {
    /// Looks up the frame of each surface.
    #[inline(always)]
    pub(crate) fn each(frames: &Frames, surfaces: &[u32]) -> Self {
        let [c0, c1, c2, u0, u1, u2, v0, v1, v2, t0, t1, t2, n0, n1, n2, _] = R::rows(&frames.0, surfaces);
        SurfaceFrame {
            corner: [c0, c1, c2],
            edges: [[u0, u1, u2], [v0, v1, v2]],
            tangent: [t0, t1, t2],
            normal: [n0, n1, n2],
        }
    }

    /// The points with local coordinates (u, v) [m].
    #[inline(always)]
    pub(crate) fn point(&self, [u, v]: [R; 2]) -> [R; 3] {
        let [edge_u, edge_v] = &self.edges;
        let mut point = self.corner;
        for axis in 0..3 {
            point[axis] = point[axis] + edge_u[axis] * u + edge_v[axis] * v;
        }
        point
    }

    /// Directions about the normal, in the scene; `facing` is 1 where they are about that of the front, −1 of the back.
    #[inline(always)]
    pub(crate) fn direction(&self, facing: R, [x, y, z]: [R; 3]) -> [R; 3] {
        let (bitangent, z) = (cross(self.normal, self.tangent), z * facing);
        let mut direction = self.normal;
        for axis in 0..3 {
            direction[axis] = self.tangent[axis] * x + bitangent[axis] * y + self.normal[axis] * z;
        }
        direction
    }
}

#[inline(always)]
fn cross<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

impl SurfaceFrame<f64> {
    pub(super) fn new(corner: DVec3, edges: [DVec3; 2], tangent: DVec3, normal: DVec3) -> Self {
        let [corner, tangent, normal] = [corner, tangent, normal].map(|vector| vector.to_array());
        SurfaceFrame { corner, edges: edges.map(|edge| edge.to_array()), tangent, normal }
    }

    /// Unit normal of the front.
    pub(crate) fn normal(&self) -> DVec3 {
        self.normal.into()
    }
}
