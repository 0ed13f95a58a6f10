//! The linear basis of a patch: two functions ψ₁ and ψ₂ that are orthogonal to 1 and to each other over the patch.
//!
//! With (u, v) the coordinates of a point in its cell, 0 … 1 along the cell's edges from its first corner:
//!
//! | cell | ψ₁ | ψ₂ | mean of ψ₁² | mean of ψ₂² |
//! |---|---|---|---|---|
//! | parallelogram | 2u − 1 | 2v − 1 | 1/3 | 1/3 |
//! | triangle | (3u − 1)/2 | 2v + u − 1 | 1/8 | 1/6 |
//!
//! Both lie in [−1, 1], so that no slope of a score exceeds the score. The orthonormal functions are φ_k = ψ_k/√(mean of ψ_k²).
//! Walks take ψ_k as whole numbers, odd multiples of 1/4096: the middle of the step of 1/2048 that holds it. Of a density that
//! is linear in ψ_k, that changes the coefficient by 2⁻²² of itself.

use super::cells::grid_step;
use crate::simd::real::Real;

/// Units of ψ in 1.
pub(crate) const SLOPE_UNITS: i64 = 1 << SLOPE_BITS;

/// The binary logarithm of [`SLOPE_UNITS`].
pub(crate) const SLOPE_BITS: u32 = 12;

/// What a linear fit Σ_k a_k·ψ_k is made of, for one kind of cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LinearBasis {
    /// The mean of ψ_k² over the cell.
    pub(crate) mean_squares: [f64; 2],
    /// What ψ_k grows by, per unit of its own coordinate.
    pub(crate) growth: [f64; 2],
}

impl LinearBasis {
    /// The basis of a triangle, or of a parallelogram.
    pub(crate) fn of(is_triangle: bool) -> Self {
        match is_triangle {
            true => LinearBasis { mean_squares: [1.0 / 8.0, 1.0 / 6.0], growth: [1.5, 2.0] },
            false => LinearBasis { mean_squares: [1.0 / 3.0; 2], growth: [2.0; 2] },
        }
    }
}

/// (ψ + 1)/2 of both functions at a point of a cell.
#[inline(always)]
pub(crate) fn halves<R: Real>([u, v]: [R; 2], triangle: R::Mask) -> [R; 2] {
    let (one, half) = (R::splat(1.0), R::splat(0.5));
    let [first, second] = [(u + u + u + one) * R::splat(0.25), v + u * half];
    [R::select(triangle, first, u), R::select(triangle, second, v)]
}

/// The numbers of the steps that hold (ψ + 1)/2 of both functions: 0 … 4095.
#[inline(always)]
pub(crate) fn steps_of<R: Real>([first, second]: [R; 2]) -> [R; 2] {
    let all = R::splat(SLOPE_UNITS as f64);
    [grid_step(first, all), grid_step(second, all)]
}

/// The numbers of the steps of ψ₁ and ψ₂ that hold a point of a cell: 0 … 4095.
#[inline(always)]
pub(crate) fn steps<R: Real>(place: [R; 2], triangle: R::Mask) -> [R; 2] {
    steps_of(halves(place, triangle))
}

/// ψ of a step, in units.
#[inline(always)]
pub(crate) fn of_step(step: u32) -> i32 {
    2 * step as i32 + 1 - SLOPE_UNITS as i32
}

/// ψ₁ and ψ₂ at a point of a cell, in units.
pub(crate) fn slopes_at(place: [f64; 2], is_triangle: bool) -> [i32; 2] {
    steps(place, is_triangle).map(|step| of_step(step as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The means over a grid of points of a cell: of ψ_k, ψ_k², and ψ₁·ψ₂. The steps are wider than nothing, so that the
    /// means of squares are off by 2⁻²⁴, and the grid ends on the triangle's edge, which weighs 1/n.
    #[test]
    fn the_functions_are_orthogonal_to_1_and_to_each_other() {
        const N: u32 = 2000;
        let place = |i: u32| (f64::from(i) + 0.5) / f64::from(N);
        for is_triangle in [false, true] {
            let (mut sums, mut points) = ([0.0; 5], 0.0);
            for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                if is_triangle && i + j >= N {
                    continue;
                }
                let [a, b] = slopes_at([place(i), place(j)], is_triangle);
                let [a, b] = [a, b].map(|units| f64::from(units) / SLOPE_UNITS as f64);
                assert!(a.abs() < 1.0 && b.abs() < 1.0);
                points += 1.0;
                for (sum, value) in sums.iter_mut().zip([a, b, a * a, b * b, a * b]) {
                    *sum += value;
                }
            }
            let [first, second] = LinearBasis::of(is_triangle).mean_squares;
            for (sum, expected) in sums.into_iter().zip([0.0, 0.0, first, second, 0.0]) {
                assert!((sum / points - expected).abs() < 1e-3, "{is_triangle}: {sums:?} of {points}");
            }
        }
    }
}
