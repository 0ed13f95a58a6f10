//! How surfaces are cut into cells: from a point to its cell, and back.

use super::leaves::CutCell;
use super::spec::{Corners, Shape};
use crate::simd::real::Real;

/// The nearest that a point may come to the edge of a surface, in local coordinates: half the spacing of the
/// sampled points. Points on an edge could lie behind a neighbour.
pub(crate) const EDGE: f64 = 0.5 / 4_294_967_296.0;

/// The step of an n-step division of [0, 1] that holds x; x may exceed the interval by a rounding error.
#[inline(always)]
pub(crate) fn grid_step<R: Real>(x: R, n: R) -> R {
    let step = (x * n).floor();
    R::select(step.lt(n), step, n - R::splat(1.0)).max(R::splat(0.0))
}

/// [`grid_step`] of one number: conversions of numbers round to 0 and stay in range.
#[inline(always)]
pub(crate) fn grid_step_of(x: f64, n: u32) -> u32 {
    ((x * f64::from(n)) as u32).min(n - 1)
}

/// A uniform point of the step, from a uniform in (0, 1) and the inverse of the number of steps.
#[inline(always)]
pub(crate) fn in_grid_step<R: Real>(step: R, r: R, inverse: R) -> R {
    (step + r) * inverse
}

/// The unit square folded on its diagonal: a uniform point of it becomes one of the triangle u + v < 1.
#[inline(always)]
pub(crate) fn folded<R: Real>([r, s]: [R; 2], fold: R::Mask) -> [R; 2] {
    let one = R::splat(1.0);
    let beyond = fold & one.le(r + s);
    [R::select(beyond, one - r, r), R::select(beyond, one - s, s)]
}

/// The nearest local coordinates strictly inside a surface: where a continuous walk leaves from.
#[inline(always)]
pub(crate) fn inside<R: Real>([u, v]: [R; 2], triangle: R::Mask) -> [R; 2] {
    let (least, most, zero) = (R::splat(EDGE), R::splat(1.0 - EDGE), R::splat(0.0));
    let (u, v) = (u.max(least), v.max(least));
    let (u, v) = (R::select(most.lt(u), most, u), R::select(most.lt(v), most, v));
    let excess = u + v - most;
    let step = R::select(triangle & zero.lt(excess), excess, zero);
    // The larger coordinate has room for the step: it is at least (1 − EDGE)/2.
    let in_u = v.lt(u);
    [R::select(in_u, u - step, u), R::select(in_u, v, v - step)]
}

/// The cell of a triangle in k rows that holds a + u·(b − a) + v·(c − a). The lines of constant u, v and
/// u + v (in steps of 1/k) cut it: with i = ⌊ku⌋, j = ⌊kv⌋, an upright cell of row i + j is followed by the
/// inverted one of row i + j + 1.
#[inline(always)]
pub(crate) fn triangle_cell([u, v]: [f64; 2], k: u32) -> u32 {
    let (u, v) = (u * f64::from(k), v * f64::from(k));
    let (mut i, mut j) = (u as u32, v as u32);
    let inverted = (u - f64::from(i)) + (v - f64::from(j)) >= 1.0;
    if i + j + u32::from(inverted) < k {
        let row = i + j + u32::from(inverted);
        return row * row + 2 * j + u32::from(inverted);
    }
    // On or a rounding error beyond the edge bc: the upright cell of the last row.
    while i + j > k - 1 {
        if i > j { i -= 1 } else { j -= 1 }
    }
    (k - 1) * (k - 1) + 2 * j
}

/// The inverse: a uniform point of a cell, by folding the unit square on its diagonal.
#[inline(always)]
pub(crate) fn point_in_triangle_cell(cell: u32, k: u32, [r1, r2]: [f64; 2]) -> [f64; 2] {
    let [s, t] = folded([r1, r2], true);
    let row = cell.isqrt();
    let position = cell - row * row;
    let (j, scale) = (position / 2, 1.0 / f64::from(k));
    let i = row - j;
    if position.is_multiple_of(2) {
        [(f64::from(i) + s) * scale, (f64::from(j) + t) * scale]
    } else {
        [(f64::from(i) - s) * scale, (f64::from(j + 1) - t) * scale]
    }
}

/// Where a point with local coordinates (u, v) lies in a cell of a grid of n_u × n_v: 0 … 1 along its edges.
pub(crate) fn place_in_grid_cell([u, v]: [f64; 2], cell: u32, [nu, nv]: [u32; 2]) -> [f64; 2] {
    [u * f64::from(nu) - f64::from(cell / nv), v * f64::from(nv) - f64::from(cell % nv)]
}

/// Where a point with local coordinates (u, v) lies in a cell of a triangle in k rows: 0 … 1 along the edges of the cell from
/// its first corner, which for an inverted one run against the triangle's.
pub(crate) fn place_in_triangle_cell([u, v]: [f64; 2], cell: u32, k: u32) -> [f64; 2] {
    let row = cell.isqrt();
    let position = cell - row * row;
    let (i, j) = (row - position / 2, position / 2);
    let (s, t) = (u * f64::from(k) - f64::from(i), v * f64::from(k) - f64::from(j));
    if position.is_multiple_of(2) { [s, t] } else { [-s, 1.0 - t] }
}

/// Where a point with local coordinates (u, v) lies in a leaf: 0 … 1 along its edges.
#[inline(always)]
pub(crate) fn place_in_leaf([u, v]: [f64; 2], leaf: CutCell) -> [f64; 2] {
    let [nu, nv] = leaf.grid().map(f64::from);
    [u * nu - f64::from(leaf.at[0]), v * nv - f64::from(leaf.at[1])]
}

/// The inverse: local coordinates of a place in a leaf, uniform for uniform places.
#[inline(always)]
pub(crate) fn point_in_leaf(leaf: CutCell, [r, s]: [f64; 2]) -> [f64; 2] {
    let [iu, iv] = leaf.grid().map(|n| 1.0 / f64::from(n));
    [in_grid_step(leaf.at[0].into(), r, iu), in_grid_step(leaf.at[1].into(), s, iv)]
}

/// The centroid of a cell in local coordinates.
pub(crate) fn cell_centroid(shape: &Shape, cell: u32) -> [f64; 2] {
    match *shape {
        Shape::Parallelogram { cells: [nu, nv], .. } => {
            [(f64::from(cell / nv) + 0.5) / f64::from(nu), (f64::from(cell % nv) + 0.5) / f64::from(nv)]
        }
        Shape::Triangle { rows, .. } => point_in_triangle_cell(cell, rows, [1.0 / 3.0, 1.0 / 3.0]),
        Shape::Divided { ref leaves, .. } => point_in_leaf(leaves.get(cell), [0.5, 0.5]),
    }
}

/// The corners of a cell in local coordinates, in the order of [`Shape::cell_corners`].
pub(crate) fn cell_corners(shape: &Shape, cell: u32) -> Corners<[f64; 2]> {
    match *shape {
        Shape::Parallelogram { cells: [nu, nv], .. } => {
            let (i, j) = (cell / nv, cell % nv);
            let point = |(di, dj)| [f64::from(i + di) / f64::from(nu), f64::from(j + dj) / f64::from(nv)];
            [(0, 0), (1, 0), (1, 1), (0, 1)].map(point).into()
        }
        Shape::Triangle { rows, .. } => {
            let row = cell.isqrt();
            let position = cell - row * row;
            let (i, j) = (row - position / 2, position / 2);
            let point = |(i, j)| [f64::from(i) / f64::from(rows), f64::from(j) / f64::from(rows)];
            let upright = position.is_multiple_of(2);
            let corners =
                if upright { [(i, j), (i + 1, j), (i, j + 1)] } else { [(i, j + 1), (i - 1, j + 1), (i, j)] };
            corners.map(point).into_iter().collect()
        }
        Shape::Divided { ref leaves, .. } => {
            let leaf = leaves.get(cell);
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|place| point_in_leaf(leaf, place)).into()
        }
    }
}

impl Shape {
    /// The corners of a cell [m], counter-clockwise as seen from the front: four of a parallelogram's cell, three of a triangle's.
    pub fn cell_corners(&self, cell: u32) -> Corners {
        let (corner, e_u, e_v) = self.edges();
        let point = |[u, v]: [f64; 2]| corner + e_u * u + e_v * v;
        cell_corners(self, cell).into_iter().map(point).collect()
    }
}

/// The weights of the corners of a cell, as [`cell_corners`] has them, at local coordinates in it: bilinear in
/// parallelograms, barycentric in triangles, whose fourth is 0. Their sum is 1.
pub(crate) fn corner_weights(shape: &Shape, cell: u32, uv: [f64; 2]) -> [f64; 4] {
    let bilinear = |[s, t]: [f64; 2]| [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
    match *shape {
        Shape::Parallelogram { cells, .. } => bilinear(place_in_grid_cell(uv, cell, cells)),
        Shape::Divided { ref leaves, .. } => bilinear(place_in_leaf(uv, leaves.get(cell))),
        Shape::Triangle { rows, .. } => {
            let [s, t] = place_in_triangle_cell(uv, cell, rows);
            [1.0 - s - t, s, t, 0.0]
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// A point is the mean of the corners by their weights, and the middle weighs all alike.
    #[test]
    fn weights_of_corners_make_the_point() {
        let parallelogram = Shape::Parallelogram {
            corner: DVec3::ZERO,
            corner_u: DVec3::X,
            corner_v: DVec3::Y,
            cells: [3, 2],
        };
        let triangle = Shape::Triangle { a: DVec3::ZERO, b: DVec3::X, c: DVec3::Y, rows: 4 };
        let divided = Shape::Divided {
            corner: DVec3::ZERO,
            corner_u: DVec3::X,
            corner_v: DVec3::Y,
            leaves: "uv.v..u..".parse().unwrap(),
        };
        for shape in [parallelogram, triangle, divided] {
            for cell in 0..shape.cell_count() as u32 {
                let (corners, middle) = (cell_corners(&shape, cell), cell_centroid(&shape, cell));
                let weights = &corner_weights(&shape, cell, middle)[..corners.len()];
                for axis in 0..2 {
                    let point: f64 =
                        corners.iter().zip(weights).map(|(corner, weight)| corner[axis] * weight).sum();
                    assert!((point - middle[axis]).abs() < 1e-12, "{shape:?} {cell}");
                }
                let alike = 1.0 / corners.len() as f64;
                assert!(weights.iter().all(|weight| (weight - alike).abs() < 1e-12), "{weights:?}");
                // Counter-clockwise from the front.
                let [a, b, c] = [corners[0], corners[1], corners[2]];
                assert!((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0);
            }
        }
    }
}
