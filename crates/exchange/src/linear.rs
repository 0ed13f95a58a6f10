//! Dense systems of linear equations.

/// The inverse of a square matrix, by Gauss and Jordan with the largest pivot of each column; `None` where it is singular to
/// working precision.
pub(crate) fn inverse(mut matrix: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    let n = matrix.len();
    let largest = matrix.iter().flatten().fold(0.0, |max: f64, x| max.max(x.abs()));
    let mut inverse: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect();
    for column in 0..n {
        let size = |row: usize| matrix[row][column].abs();
        let pivot = (column..n).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
        if size(pivot) <= 1e-14 * largest {
            return None;
        }
        matrix.swap(column, pivot);
        inverse.swap(column, pivot);
        let scale = 1.0 / matrix[column][column];
        for row in [&mut matrix[column], &mut inverse[column]] {
            row.iter_mut().for_each(|x| *x *= scale);
        }
        let [pivot_row, pivot_inverse] = [matrix[column].clone(), inverse[column].clone()];
        for row in (0..n).filter(|&row| row != column) {
            let factor = matrix[row][column];
            if factor != 0.0 {
                subtract(&mut matrix[row], factor, &pivot_row);
                subtract(&mut inverse[row], factor, &pivot_inverse);
            }
        }
    }
    Some(inverse)
}

fn subtract(row: &mut [f64], factor: f64, other: &[f64]) {
    row.iter_mut().zip(other).for_each(|(x, y)| *x -= factor * y);
}

/// The product of a matrix and a vector.
pub(crate) fn times(matrix: &[Vec<f64>], vector: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| row.iter().zip(vector).map(|(a, x)| a * x).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_the_identity() {
        let matrix = vec![vec![0.0, 2.0, 1.0], vec![1.0, -1.0, 3.0], vec![4.0, 0.5, 0.25]];
        let inverse = inverse(matrix.clone()).unwrap();
        for column in 0..3 {
            let of = inverse.iter().map(|row| row[column]).collect::<Vec<_>>();
            for (row, x) in times(&matrix, &of).into_iter().enumerate() {
                assert!((x - if row == column { 1.0 } else { 0.0 }).abs() < 1e-14);
            }
        }
        assert_eq!(super::inverse(vec![vec![1.0, 2.0], vec![2.0, 4.0]]), None);
    }
}
