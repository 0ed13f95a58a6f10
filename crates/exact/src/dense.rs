//! Dense matrices by columns, and Cholesky's factor of symmetric ones.
//!
//! Both the factor and the solves go block by block (LAPACK's dpotrf and dtrsm), so that nearly all of the work is
//! a product of matrices. The products are `matrixmultiply`'s.

use std::ops::{Index, IndexMut, Range};

/// Columns of a block: wide enough that products dominate, narrow enough that a block's own triangle is little.
const BLOCK: usize = 64;

/// A dense rows × columns matrix, stored column by column.
#[derive(Clone, Debug)]
pub(crate) struct DenseMatrix {
    rows: usize,
    values: Vec<f64>,
}

impl DenseMatrix {
    /// The matrix whose element (i, j) is `element(i, j)`.
    pub(crate) fn from_fn(rows: usize, columns: usize, element: impl Fn(usize, usize) -> f64) -> Self {
        let mut values = Vec::with_capacity(rows * columns);
        for j in 0..columns {
            values.extend((0..rows).map(|i| element(i, j)));
        }
        DenseMatrix { rows, values }
    }

    /// The rows × columns matrix of zeros.
    pub(crate) fn zeros(rows: usize, columns: usize) -> Self {
        DenseMatrix { rows, values: vec![0.0; rows * columns] }
    }

    /// Column j, from its first row on.
    pub(crate) fn column(&self, j: usize) -> &[f64] {
        &self.values[j * self.rows..][..self.rows]
    }

    /// How many columns it has.
    fn columns(&self) -> usize {
        self.values.len().checked_div(self.rows).unwrap_or(0)
    }

    /// Columns `j < k`, to read and to write.
    fn column_pair(&mut self, j: usize, k: usize) -> (&[f64], &mut [f64]) {
        let (left, right) = self.values.split_at_mut(k * self.rows);
        (&left[j * self.rows..][..self.rows], &mut right[..self.rows])
    }
}

impl Index<(usize, usize)> for DenseMatrix {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.column(j)[i]
    }
}

impl IndexMut<(usize, usize)> for DenseMatrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.values[j * self.rows..][..self.rows][i]
    }
}

/// Cholesky's factor L with L Lᵀ = A, in the lower triangle; what is above it has no meaning.
#[derive(Clone, Debug)]
pub(crate) struct Cholesky(DenseMatrix);

impl Cholesky {
    /// The factor of a symmetric n × n matrix, of which only the lower triangle is read. None unless it is positive
    /// definite to working precision.
    pub(crate) fn new(mut a: DenseMatrix) -> Option<Self> {
        let n = a.rows;
        for start in (0..n).step_by(BLOCK) {
            let block = start..n.min(start + BLOCK);
            factor_columns(&mut a, block.clone())?;
            for next in (block.end..n).step_by(BLOCK) {
                let columns = next..n.min(next + BLOCK);
                subtract_outer(&mut a, columns, block.clone());
            }
        }
        Some(Cholesky(a))
    }

    /// Replaces every column x of a matrix by L⁻¹x.
    pub(crate) fn solve_lower(&self, x: &mut DenseMatrix) {
        let n = self.0.rows;
        for start in (0..n).step_by(BLOCK) {
            let block = start..n.min(start + BLOCK);
            for column in 0..x.columns() {
                let rows = &mut x.values[column * n..][block.clone()];
                for j in 0..rows.len() {
                    rows[j] /= self.0[(start + j, start + j)];
                    let below = &self.0.column(start + j)[block.clone()][j + 1..];
                    let (solved, rest) = rows.split_at_mut(j + 1);
                    subtract(rest, solved[j], below);
                }
            }
            subtract_product(&self.0, x, block);
        }
    }

    /// Replaces a vector x by L⁻ᵀx.
    pub(crate) fn solve_transposed(&self, x: &mut [f64]) {
        for j in (0..x.len()).rev() {
            let (head, below) = x.split_at_mut(j + 1);
            let column = self.0.column(j);
            let known: f64 = column[j + 1..].iter().zip(&*below).map(|(l, x)| l * x).sum();
            head[j] = (head[j] - known) / column[j];
        }
    }
}

/// Factors the columns of a block that owes nothing to earlier ones any more, down to the last row.
fn factor_columns(a: &mut DenseMatrix, block: Range<usize>) -> Option<()> {
    for k in block.clone() {
        for j in block.start..k {
            let (left, column) = a.column_pair(j, k);
            subtract(&mut column[k..], left[k], &left[k..]);
        }
        let column = &mut a.values[k * a.rows..][k..a.rows];
        let pivot = column[0];
        // A pivot of rounding errors alone: 1 − K's diagonal is at most 1.
        if pivot.is_nan() || pivot <= f64::EPSILON {
            return None;
        }
        let root = pivot.sqrt();
        column.iter_mut().for_each(|value| *value /= root);
    }
    Some(())
}

/// y ← y − factor · x.
fn subtract(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y -= factor * x;
    }
}

/// A ← A − L Lᵀ in `columns`, from their diagonal down, where L is the `block` of columns left of them.
fn subtract_outer(a: &mut DenseMatrix, columns: Range<usize>, block: Range<usize>) {
    let stride = a.rows;
    let (left, right) = a.values.split_at_mut(columns.start * stride);
    let factor = &left[block.start * stride..block.end * stride];
    let l = &factor[columns.start..];
    let target = &mut right[columns.start..];
    let (m, k, n) = (stride - columns.start, block.len(), columns.len());
    assert!(l.len() >= (k - 1) * stride + m && target.len() >= (n - 1) * stride + m);
    // SAFETY: `l` holds k columns of m rows and `target` n columns of m rows, `stride` apart (asserted above), and n ≤ m,
    // so that Lᵀ (rows by 1, columns by `stride`) is read inside `l`, too. They are disjoint slices.
    unsafe {
        matrixmultiply::dgemm(
            m,
            k,
            n,
            -1.0,
            l.as_ptr(),
            1,
            stride as isize,
            l.as_ptr(),
            stride as isize,
            1,
            1.0,
            target.as_mut_ptr(),
            1,
            stride as isize,
        );
    }
}

/// X ← X − L X_block in the rows below a block, where X_block are the block's own rows.
fn subtract_product(l: &DenseMatrix, x: &mut DenseMatrix, block: Range<usize>) {
    let stride = l.rows;
    let (m, k, n) = (stride - block.end, block.len(), x.columns());
    if m == 0 || n == 0 {
        return;
    }
    assert_eq!(x.rows, stride, "one row of X a row of L");
    let solved: Vec<f64> = (0..n).flat_map(|c| &x.column(c)[block.clone()]).copied().collect();
    let factor = &l.values[block.start * stride + block.end..];
    let target = &mut x.values[block.end..];
    assert!(factor.len() >= (k - 1) * stride + m && target.len() >= (n - 1) * stride + m);
    // SAFETY: `factor` holds k columns and `target` n columns of m rows, `stride` apart (asserted above); `solved` holds n
    // columns of k rows without gaps. `target` is borrowed alone.
    unsafe {
        matrixmultiply::dgemm(
            m,
            k,
            n,
            -1.0,
            factor.as_ptr(),
            1,
            stride as isize,
            solved.as_ptr(),
            1,
            k as isize,
            1.0,
            target.as_mut_ptr(),
            1,
            stride as isize,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A = I + G Gᵀ of fixed numbers without pattern: positive definite.
    fn symmetric(n: usize) -> DenseMatrix {
        let g = DenseMatrix::from_fn(n, n, |i, j| {
            ((i * 7919 + j * 104_729 + i * j * 31) % 1000) as f64 / 1000.0 - 0.5
        });
        DenseMatrix::from_fn(n, n, |i, j| {
            let product: f64 = (0..n).map(|k| g[(i, k)] * g[(j, k)]).sum();
            if i == j { 1.0 + product } else { product }
        })
    }

    #[test]
    fn the_factor_times_its_transpose_is_the_matrix() {
        for n in [1, 2, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 17] {
            let a = symmetric(n);
            let Cholesky(l) = Cholesky::new(a.clone()).unwrap();
            for i in 0..n {
                for j in 0..=i {
                    let product: f64 = (0..=j).map(|k| l[(i, k)] * l[(j, k)]).sum();
                    assert!((product - a[(i, j)]).abs() < 1e-12 * n as f64, "{n}: ({i}, {j})");
                }
            }
        }
    }

    #[test]
    fn both_solves_undo_the_matrix() {
        for n in [1, BLOCK, 2 * BLOCK + 5] {
            let a = symmetric(n);
            let factor = Cholesky::new(a.clone()).unwrap();
            let truth = DenseMatrix::from_fn(n, 3, |i, c| {
                (i + 1) as f64 * if c == 1 { -0.25 } else { c as f64 + 0.5 }
            });
            let mut x = DenseMatrix::from_fn(n, 3, |i, c| (0..n).map(|j| a[(i, j)] * truth[(j, c)]).sum());
            factor.solve_lower(&mut x);
            for c in 0..3 {
                let mut column = x.column(c).to_vec();
                factor.solve_transposed(&mut column);
                for (found, expected) in column.iter().zip(truth.column(c)) {
                    assert!(
                        (found - expected).abs() < 1e-9 * n as f64,
                        "{n}, column {c}: {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_singular_or_indefinite_matrix_has_no_factor() {
        assert!(Cholesky::new(DenseMatrix::from_fn(100, 100, |_, _| 1.0)).is_none());
        assert!(Cholesky::new(DenseMatrix::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 })).is_none());
        assert!(Cholesky::new(DenseMatrix::from_fn(1, 1, |_, _| f64::NAN)).is_none());
    }
}
