//! How surfaces are cut into cells: from a point to its cell, and back.

use super::spec::Shape;

/// The step of an n-step division of [0, 1] that holds x; x may exceed the interval by a rounding error.
#[inline(always)]
pub(crate) fn grid_step(x: f64, n: u32) -> u32 {
    // A float-to-integer cast saturates: x < 0 gives 0.
    ((x * f64::from(n)) as u32).min(n - 1)
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
    let (s, t) = if r1 + r2 < 1.0 { (r1, r2) } else { (1.0 - r1, 1.0 - r2) };
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

/// The centroid of a cell in local coordinates.
pub(crate) fn cell_centroid(shape: &Shape, cell: u32) -> [f64; 2] {
    match *shape {
        Shape::Parallelogram { cells: [nu, nv], .. } => {
            [(f64::from(cell / nv) + 0.5) / f64::from(nu), (f64::from(cell % nv) + 0.5) / f64::from(nv)]
        }
        Shape::Triangle { rows, .. } => point_in_triangle_cell(cell, rows, [1.0 / 3.0, 1.0 / 3.0]),
    }
}
