//! Randomised quasi-Monte Carlo: the Sobol sequence in four dimensions, scrambled as Owen does.
//!
//! Four numbers are a ray: two place its origin, two its direction. The first 2^k points from any multiple of 2^k on
//! are spread evenly in every elementary interval of their size, whatever the scrambling, and each scrambled point
//! alone is uniform: estimates stay unbiased, and their variance falls faster than 1/n where the integrand is tame
//! (A. B. Owen, *Scrambled net variance for integrals of smooth functions*, Ann. Statist. 25 (1997)).

use crate::simd::batch::WIDTH;

/// Numbers of a ray.
pub(crate) const DIMENSIONS: usize = 4;

/// All dimensions there are: those of a ray and two more.
pub(crate) const AXES: usize = 6;

/// Direction numbers with their bits reversed: `MATRICES[d][k]` is what bit k of the (Gray-coded) index adds to
/// dimension d. S. Joe & F. Y. Kuo, *Constructing Sobol sequences with better two-dimensional projections*, SIAM J.
/// Sci. Comput. 30 (2008), dimensions 1 … 6.
const MATRICES: [[u32; 32]; AXES] = [
    van_der_corput(),
    matrix(0, &[1]),
    matrix(1, &[1, 3]),
    matrix(1, &[1, 3, 1]),
    matrix(2, &[1, 1, 1]),
    matrix(1, &[1, 1, 3, 3]),
];

/// The columns of all matrices, by bits of the index.
const COLUMNS: [[u32; AXES]; 32] = {
    let mut columns = [[0; AXES]; 32];
    let mut k = 0;
    while k < 32 {
        let mut axis = 0;
        while axis < AXES {
            columns[k][axis] = MATRICES[axis][k];
            axis += 1;
        }
        k += 1;
    }
    columns
};

/// What bit k of the index adds to each number, its bits reversed.
#[inline(always)]
pub(crate) fn column(k: u32) -> &'static [u32; AXES] {
    &COLUMNS[k as usize]
}

const fn van_der_corput() -> [u32; 32] {
    let mut columns = [0; 32];
    let mut k = 0;
    while k < 32 {
        columns[k] = 1 << k;
        k += 1;
    }
    columns
}

/// Columns of a dimension from the coefficients a of its primitive polynomial and its first numbers m, whose count is
/// the degree.
const fn matrix(a: u32, m: &[u32]) -> [u32; 32] {
    let degree = m.len();
    let mut columns = [0_u32; 32];
    let mut k = 0;
    while k < 32 {
        columns[k] = if k < degree {
            m[k] << (31 - k)
        } else {
            let mut column = columns[k - degree] ^ (columns[k - degree] >> degree);
            let mut term = 1;
            while term < degree {
                if a >> (degree - 1 - term) & 1 == 1 {
                    column ^= columns[k - term];
                }
                term += 1;
            }
            column
        };
        k += 1;
    }
    let mut k = 0;
    while k < 32 {
        columns[k] = columns[k].reverse_bits();
        k += 1;
    }
    columns
}

/// A place in the sequence, its bits reversed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sobol {
    index: u32,
    reversed: [u32; DIMENSIONS],
}

impl Sobol {
    /// The place of point `index`, in the order of Gray codes.
    pub(crate) fn at(index: u32) -> Self {
        let gray = index ^ (index >> 1);
        let number =
            |axis: usize| (0..32).filter(|k| gray >> k & 1 == 1).fold(0, |sum, k| sum ^ MATRICES[axis][k]);
        let reversed = std::array::from_fn(number);
        Sobol { index, reversed }
    }

    /// The bits of this point, reversed; then on to the next.
    #[inline(always)]
    pub(crate) fn next(&mut self) -> [u32; DIMENSIONS] {
        let point = self.reversed;
        self.index = self.index.wrapping_add(1);
        // After the last index every column has had its turn; the sequence begins anew.
        let k = self.index.trailing_zeros().min(31) as usize;
        for (number, columns) in self.reversed.iter_mut().zip(&MATRICES) {
            *number ^= columns[k];
        }
        point
    }
}

/// Scrambles a number whose bits are reversed: each bit is flipped by a hash of the bits above it and the seed (S.
/// Laine & T. Karras, *Stratified sampling for stochastic transparency*, EGSR 2011; constants of N. Vegdahl), and
/// turns its bits round.
#[inline(always)]
pub(crate) fn owen_scrambled(reversed: u32, seed: u32) -> u32 {
    owen_scrambled_reversed(reversed, seed).reverse_bits()
}

/// The same, its bits left reversed.
#[inline(always)]
pub(crate) fn owen_scrambled_reversed(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3D20_ADEA);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6C56);
    x ^ x.wrapping_mul(0x53A2_2864)
}

/// Points of a batch, a row for each dimension.
pub(crate) type Points = [[u32; WIDTH]; DIMENSIONS];

/// Scrambles the points of a batch, each number by its own seed.
#[expect(clippy::extra_unused_type_parameters, reason = "R names the instruction set to compile for")]
#[inline(always)]
pub(crate) fn scramble<R>(points: &mut Points, seeds: &Points) {
    for (row, seeds) in points.iter_mut().zip(seeds) {
        for (number, &seed) in row.iter_mut().zip(seeds) {
            *number = owen_scrambled(*number, seed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every 2^k points from a multiple of 2^k on hit each interval of 2^-k once in every dimension, and pairs of
    /// dimensions (0, 1), (2, 3) each box of 2^-j × 2^-(k-j) nearly so: (0, 1) is a (0, 2)-sequence.
    #[test]
    fn scrambled_points_are_a_net() {
        let k = 8;
        for (block, seed) in [(0_u32, 1_u32), (5, 0xDEAD_BEEF), (1000, 77)] {
            let mut sobol = Sobol::at(block << k);
            let points: Vec<[u32; 4]> =
                (0..1 << k).map(|_| sobol.next().map(|number| owen_scrambled(number, seed))).collect();
            for d in 0..DIMENSIONS {
                let strata: std::collections::HashSet<u32> =
                    points.iter().map(|p| p[d] >> (32 - k)).collect();
                assert_eq!(strata.len(), 1 << k, "dimension {d}");
            }
            for j in 0..=k {
                let cell = |p: &[u32; 4]| (u64::from(p[0]) >> (32 - j), u64::from(p[1]) >> (32 - (k - j)));
                let cells: std::collections::HashSet<_> = points.iter().map(cell).collect();
                assert_eq!(cells.len(), 1 << k, "boxes of 2^-{j}");
            }
        }
    }

    #[test]
    fn any_place_is_reached_by_steps() {
        let mut walker = Sobol::at(0);
        for index in 0..3000 {
            assert_eq!(walker.reversed, Sobol::at(index).reversed);
            walker.next();
        }
    }
}
