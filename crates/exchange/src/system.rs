//! The linear equations of a balance, M e = q with M_ij = E_i(δ_ij − B_ij) over the groups whose temperature is not given: by the inverse of
//! M, or by iteration where M is too large for that.
//!
//! Iterations are those of the stabilised bi-conjugate gradients (H. A. van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992) 631–644) for
//! (I − B) e = q/E, several right-hand sides side by side.
//!
//! Errors. The unknown e err by M⁻¹r, r_k being independent with the variance that row k shows. The inverse gives Var(e_i) =
//! Σ_k (M⁻¹)_ik² Var(r_k). Without it, the same sum is the mean of (M⁻¹s)_i² over right-hand sides s_k = ±√Var(r_k) of random signs (M. F.
//! Hutchinson, Commun. Statist. Simula. 19 (1990) 433–450): P such probes estimate it as P normal numbers do their variance, so intervals
//! are those of Student's t with P degrees of freedom.

use radiosity::Sequence;

use crate::linear::{inverse, times};
use crate::pairs::PairFactors;
use crate::thermal::Balance;

/// Right-hand sides that are solved side by side.
const LANES: usize = 8;

/// Probes of errors.
pub(crate) const PROBES: usize = 64;

/// Iterations at most.
const MOST_ITERATIONS: usize = 2000;

/// The residual at which iterations end, relative to the right-hand side.
const RESIDUAL: f64 = 1e-13;

/// The residual beyond which they have failed.
const FAILURE: f64 = 1e-9;

/// The equations for some groups.
pub(crate) struct HeatSystem<'a> {
    /// B.
    pub(crate) pairs: &'a PairFactors,
    /// The groups whose temperature is not given.
    free: &'a [usize],
    /// M⁻¹; `None` where it is not used.
    inverse: Option<Vec<Vec<f64>>>,
    /// The number of each group among the free ones.
    number: Vec<Option<u32>>,
}

/// The errors of what was solved for.
pub(crate) struct HeatErrors {
    /// The variance of σT⁴ of each free group.
    pub(crate) of_free: Vec<f64>,
    /// The variance of each group's flux by that of what it sees.
    pub(crate) carried: Vec<f64>,
}

/// Numbers of one unknown, of right-hand sides side by side.
type SideBySide = [f64; LANES];

impl<'a> HeatSystem<'a> {
    /// The equations of a balance; `None` where they are singular.
    pub(crate) fn new(
        balance: &Balance<'_>,
        (pairs, free): (&'a PairFactors, &'a [usize]),
        by_inverse: bool,
    ) -> Option<Self> {
        let mut number = vec![None; balance.factors.groups() + 1];
        (0..).zip(free).for_each(|(place, &group)| number[group] = Some(place));
        let mut system = HeatSystem { pairs, free, inverse: None, number };
        if by_inverse {
            system.inverse = Some(system.inverted(balance)?);
        }
        Some(system)
    }

    /// M⁻¹, by the inverse of I − B, whose rows are alike in size where groups are not.
    fn inverted(&self, balance: &Balance<'_>) -> Option<Vec<Vec<f64>>> {
        if self.free.iter().any(|&i| balance.emitting_areas[i] <= 0.0) {
            return None;
        }
        let row = |(place, &i): (usize, &usize)| {
            let mut row = vec![0.0; self.free.len()];
            row[place] = 1.0;
            self.seen(i).for_each(|(j, factor)| row[j] -= factor);
            row
        };
        let mut inverse = inverse(self.free.iter().enumerate().map(row).collect())?;
        for row in &mut inverse {
            row.iter_mut().zip(self.free).for_each(|(x, &i)| *x /= balance.emitting_areas[i]);
        }
        Some(inverse)
    }

    /// The factors from a group to the free ones, by the numbers of these.
    fn seen(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.pairs.row(i).iter().filter_map(|pair| Some((self.number[pair.to]? as usize, pair.factor)))
    }

    /// The solution e of M e = `right`; `None` where iterations do not find it.
    pub(crate) fn solve(&self, balance: &Balance<'_>, right: &[f64]) -> Option<Vec<f64>> {
        if let Some(inverse) = &self.inverse {
            return Some(times(inverse, right));
        }
        let alone =
            |(x, &i): (&f64, &usize)| [x / balance.emitting_areas[i], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let right: Vec<SideBySide> = right.iter().zip(self.free).map(alone).collect();
        Some(self.iterate(&right)?.into_iter().map(|lanes| lanes[0]).collect())
    }

    /// The errors by rows of these standard errors, those of the free groups.
    pub(crate) fn errors(&self, balance: &Balance<'_>, of_rows: &[f64]) -> Option<HeatErrors> {
        let groups = balance.factors.groups();
        let mut errors = HeatErrors { of_free: vec![0.0; self.free.len()], carried: vec![0.0; groups] };
        let blocks = match &self.inverse {
            Some(_) => self.free.len().div_ceil(LANES),
            None => PROBES / LANES,
        };
        for block in 0..blocks {
            let moved = match &self.inverse {
                Some(inverse) => columns(inverse, of_rows, block),
                None => self.iterate(&self.probes(balance, of_rows, block))?,
            };
            for (sum, lanes) in errors.of_free.iter_mut().zip(&moved) {
                *sum += square(lanes);
            }
            for (i, sum) in errors.carried.iter_mut().enumerate().filter(|&(i, _)| self.number[i].is_none()) {
                let flux = self.weighted(i, &moved);
                *sum += balance.emitting_areas[i].powi(2) * square(&flux);
            }
        }
        if self.inverse.is_none() {
            errors.of_free.iter_mut().chain(&mut errors.carried).for_each(|sum| *sum /= PROBES as f64);
        }
        Some(errors)
    }

    /// Right-hand sides of random signs, over E. The signs are fixed, so that the answer is.
    fn probes(&self, balance: &Balance<'_>, of_rows: &[f64], block: usize) -> Vec<SideBySide> {
        let sequence = Sequence::new(block as u64);
        let rows = self.free.iter().zip(of_rows).zip(sequence.walks_from(0));
        rows.map(|((&i, error), mut rng)| {
            let bits = rng.bits();
            std::array::from_fn(|lane| {
                let sign = if bits >> (8 * lane) & 1 == 1 { 1.0 } else { -1.0 };
                sign * error / balance.emitting_areas[i]
            })
        })
        .collect()
    }

    /// Σ_j B_ij x_j over the free groups.
    fn weighted(&self, i: usize, x: &[SideBySide]) -> SideBySide {
        self.seen(i).fold([0.0; LANES], |sum, (j, factor)| axpy(sum, [factor; LANES], &x[j]))
    }

    /// (I − B) x.
    fn apply(&self, x: &[SideBySide]) -> Vec<SideBySide> {
        let row = |(own, &i): (&SideBySide, &usize)| axpy(*own, [-1.0; LANES], &self.weighted(i, x));
        x.iter().zip(self.free).map(row).collect()
    }

    /// The solutions of (I − B) x = `right`; `None` where they are not found.
    fn iterate(&self, right: &[SideBySide]) -> Option<Vec<SideBySide>> {
        let size = dot(right, right).map(f64::sqrt);
        let mut x = vec![[0.0; LANES]; right.len()];
        let (mut residual, mut direction) = (right.to_vec(), right.to_vec());
        let mut rho = dot(right, right);
        for _ in 0..MOST_ITERATIONS {
            if is_below(&residual, size, RESIDUAL) {
                break;
            }
            let applied = self.apply(&direction);
            let alpha = ratio(rho, dot(right, &applied));
            let halfway = moved(&residual, alpha.map(|alpha| -alpha), &applied);
            let again = self.apply(&halfway);
            let omega = ratio(dot(&again, &halfway), dot(&again, &again));
            x = moved(&moved(&x, alpha, &direction), omega, &halfway);
            residual = moved(&halfway, omega.map(|omega| -omega), &again);
            let next = dot(right, &residual);
            let ahead = ratio(next, rho);
            let beta = std::array::from_fn(|lane| ahead[lane] * ratio(alpha, omega)[lane]);
            let back = moved(&direction, omega.map(|omega| -omega), &applied);
            direction = moved(&residual, beta, &back);
            rho = next;
        }
        let left = moved(right, [-1.0; LANES], &self.apply(&x));
        is_below(&left, size, FAILURE).then_some(x)
    }
}

/// Columns of the inverse, as many as there are lanes, each times the error of its row.
fn columns(inverse: &[Vec<f64>], of_rows: &[f64], block: usize) -> Vec<SideBySide> {
    let lane = |row: &[f64], lane: usize| {
        let column = block * LANES + lane;
        of_rows.get(column).map_or(0.0, |error| row[column] * error)
    };
    inverse.iter().map(|row| std::array::from_fn(|at| lane(row, at))).collect()
}

fn axpy(y: SideBySide, a: SideBySide, x: &SideBySide) -> SideBySide {
    std::array::from_fn(|lane| y[lane] + a[lane] * x[lane])
}

fn moved(y: &[SideBySide], a: SideBySide, x: &[SideBySide]) -> Vec<SideBySide> {
    y.iter().zip(x).map(|(y, x)| axpy(*y, a, x)).collect()
}

fn dot(x: &[SideBySide], y: &[SideBySide]) -> SideBySide {
    x.iter().zip(y).fold([0.0; LANES], |sum, (x, y)| axpy(sum, *x, y))
}

fn square(x: &SideBySide) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Quotients; 0 where there is nothing to divide by, for lanes that are done.
fn ratio(x: SideBySide, y: SideBySide) -> SideBySide {
    std::array::from_fn(|lane| if y[lane] == 0.0 { 0.0 } else { x[lane] / y[lane] })
}

/// Whether the residuals of all lanes are below this part of the sizes.
fn is_below(residual: &[SideBySide], size: SideBySide, part: f64) -> bool {
    dot(residual, residual).iter().zip(size).all(|(square, size)| square.sqrt() <= part * size)
}
