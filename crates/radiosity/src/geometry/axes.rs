//! The principal axes of bodies: eigenvectors of their covariances, by Jacobi's rotations.

use glam::DVec3;

/// The covariance of places, a symmetric matrix row by row [m²].
pub type Covariance = [[f64; 3]; 3];

/// Rounds of rotations, each about all three axes. Convergence is quadratic: four are enough for 64 bits.
const ROUNDS: usize = 8;

/// Off-diagonal numbers below this part of the trace are rounding noise. Bodies that are alike along two axes keep those of the frame.
const NOISE: f64 = 1.0 / (1_u64 << 40) as f64;

/// The outer product of a vector with itself, times a factor.
pub fn outer_square(x: DVec3, factor: f64) -> Covariance {
    let x = x.to_array();
    std::array::from_fn(|i| std::array::from_fn(|j| factor * x[i] * x[j]))
}

/// The variances of a covariance along its principal axes, in descending order, and unit vectors along these. The largest coordinate of
/// each vector is positive.
///
/// Only sums, products, quotients and square roots enter, in a fixed order: the axes are the same on every machine.
pub fn principal_axes(mut a: Covariance) -> [(f64, DVec3); 3] {
    let trace = a[0][0] + a[1][1] + a[2][2];
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..ROUNDS {
        for [p, q] in [[0, 1], [0, 2], [1, 2]] {
            if a[p][q].abs() > NOISE * trace {
                rotate(&mut a, &mut axes, [p, q]);
            }
        }
    }
    let mut found = [0, 1, 2].map(|k| (a[k][k].max(0.0), forward(DVec3::from_array(axes[k]))));
    found.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    found
}

/// Turns axes p and q within their plane so that the covariance along them becomes 0; `axes` holds the axes as rows.
fn rotate(a: &mut Covariance, axes: &mut Covariance, [p, q]: [usize; 2]) {
    // tan of the angle: the smaller root of t² + 2θt − 1 = 0.
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let root = (theta * theta + 1.0).sqrt();
    let tan = if theta < 0.0 { -1.0 / (root - theta) } else { 1.0 / (root + theta) };
    let cos = 1.0 / (tan * tan + 1.0).sqrt();
    let sin = tan * cos;
    for row in a.iter_mut() {
        (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
    }
    for rows in [a, axes] {
        let (of_p, of_q) = (rows[p], rows[q]);
        rows[p] = std::array::from_fn(|k| cos * of_p[k] - sin * of_q[k]);
        rows[q] = std::array::from_fn(|k| sin * of_p[k] + cos * of_q[k]);
    }
}

/// The vector or its opposite, whichever has a positive largest coordinate.
fn forward(axis: DVec3) -> DVec3 {
    let [x, y, z] = axis.abs().to_array();
    let largest = if x >= y && x >= z {
        axis.x
    } else if y >= z {
        axis.y
    } else {
        axis.z
    };
    if largest < 0.0 { -axis } else { axis }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    fn sum(squares: &[Covariance]) -> Covariance {
        std::array::from_fn(|i| std::array::from_fn(|j| squares.iter().map(|square| square[i][j]).sum()))
    }

    #[test]
    fn axes_of_a_turned_body_are_found() {
        let turn = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(1.1) * DMat3::from_rotation_y(-0.4);
        for variances in [[3.0, 2.0, 1.0], [5.0, 1e-3, 0.0], [1.0, 0.0, 0.0], [2.0, 2.0, 1e-9]] {
            let own = [turn.x_axis, turn.y_axis, turn.z_axis];
            let covariance = sum(&[0, 1, 2].map(|k| outer_square(own[k], variances[k])));
            let found = principal_axes(covariance);
            for (k, (variance, axis)) in found.into_iter().enumerate() {
                assert!((variance - variances[k]).abs() < 1e-11, "{variances:?}: {found:?}");
                assert!((axis.length() - 1.0).abs() < 1e-14);
                for &(_, other) in &found[..k] {
                    assert!(axis.dot(other).abs() < 1e-14, "{found:?}");
                }
            }
            let back = sum(&found.map(|(variance, axis)| outer_square(axis, variance)));
            for (row, expected) in back.as_flattened().iter().zip(covariance.as_flattened()) {
                assert!((row - expected).abs() < 1e-11, "{variances:?}");
            }
        }
    }

    /// A square has no axes of its own, and gets those of the frame.
    #[test]
    fn squares_keep_the_axes_of_the_frame() {
        let covariance = sum(&[
            outer_square(DVec3::X, 0.1 + 0.2),
            outer_square(DVec3::Z, 0.3),
            outer_square(DVec3::ONE, 1e-14),
        ]);
        let [(_, first), (_, second), _] = principal_axes(covariance);
        let mut axes = [first, second];
        axes.sort_by(|a, b| b.x.total_cmp(&a.x));
        assert_eq!(axes, [DVec3::X, DVec3::Z]);
    }
}
