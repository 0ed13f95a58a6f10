//! Smoothed factors of rows that are counted one by one: the equations of [`smooth`](crate::smooth) without matrices of all pairs.
//!
//! A pair is kept as its sum of counts m_ij = n_ij + n_ji, in both rows. With the densities d = N/A and multipliers λ the adjusted area
//! is x_ij = m_ij/(d_i + d_j)·(1 + (λ_i + λ_j)/(d_i + d_j)); without a partner x_ij = n_ij/d_i·(1 + λ_i/d_i). The equations
//! C·V·Cᵀ λ = A − C·x̂ are symmetric and not negative: conjugate gradients solve them, with the diagonal for preconditioning (M. R. Hestenes &
//! E. Stiefel, J. Res. Nat. Bur. Standards 49 (1952) 409–436).

use crate::row::SparseRow;
use crate::smooth::FAILURE;

/// The pairs of counted rows. Every row is given twice: [`measure`](PairedRows::measure) says where its pairs go,
/// [`add`](PairedRows::add) puts them there.
#[derive(Clone, Debug)]
pub struct PairedRows {
    areas: Vec<f64>,
    /// d of each group.
    densities: Vec<f64>,
    /// Where the entries of each row begin; of all entries behind the last.
    begins: Vec<usize>,
    /// How many entries each row has.
    lengths: Vec<usize>,
    columns: Vec<u32>,
    counts: Vec<u32>,
}

/// Smoothed factors: reciprocal, with rows that sum to 1, made from rows that were counted one by one.
#[derive(Clone, Debug)]
pub struct SmoothedRows {
    pairs: PairedRows,
    multipliers: Vec<f64>,
}

/// Rounds in which factors that would become negative are held at 0.
const ROUNDS: usize = 64;

/// Iterations of a round, at most.
const MOST_ITERATIONS: usize = 4000;

/// The most by which a row may miss its sum of 1.
const DEFECT: f64 = 1e-13;

impl PairedRows {
    /// No pairs yet, of groups with these areas [m²].
    pub fn new(areas: Vec<f64>) -> Self {
        let groups = areas.len();
        PairedRows {
            areas,
            densities: vec![0.0; groups],
            begins: Vec::new(),
            lengths: vec![0; groups],
            columns: Vec::new(),
            counts: Vec::new(),
        }
    }

    fn groups(&self) -> usize {
        self.areas.len()
    }

    /// The partner of group i that a column is, if it is one.
    fn partner(&self, i: usize, column: u32) -> Option<usize> {
        Some(column as usize).filter(|&j| j < self.groups() && j != i)
    }

    /// Counts the pairs of a row.
    pub fn measure(&mut self, i: usize, row: &SparseRow) {
        self.densities[i] = row.walks() as f64 / self.areas[i];
        self.lengths[i] += row.entries().len();
        for &(column, _) in row.entries() {
            if let Some(j) = self.partner(i, column) {
                self.lengths[j] += 1;
            }
        }
    }

    /// Adds the counts of a row, once all rows are measured.
    ///
    /// # Panics
    /// Where more is added than was measured.
    pub fn add(&mut self, i: usize, row: &SparseRow) {
        if self.begins.is_empty() {
            let mut end = 0;
            for length in &mut self.lengths {
                self.begins.push(end);
                end += std::mem::take(length);
            }
            self.begins.push(end);
            (self.columns, self.counts) = (vec![0; end], vec![0; end]);
        }
        for &(column, count) in row.entries() {
            self.put(i, column, count);
            if let Some(j) = self.partner(i, column) {
                self.put(j, i as u32, count);
            }
        }
    }

    fn put(&mut self, i: usize, column: u32, count: u32) {
        let place = self.begins[i] + self.lengths[i];
        assert!(place < self.begins[i + 1], "rows are added as they were measured");
        (self.columns[place], self.counts[place]) = (column, count);
        self.lengths[i] += 1;
    }

    /// Makes one entry of both counts of a pair, in ascending columns.
    fn unite(&mut self) {
        let (mut row, mut end) = (Vec::new(), 0);
        for i in 0..self.groups() {
            let entries = self.begins[i]..self.begins[i] + self.lengths[i];
            row.clear();
            row.extend(entries.map(|place| (self.columns[place], self.counts[place])));
            row.sort_unstable_by_key(|&(column, _)| column);
            self.begins[i] = end;
            for &(column, count) in &row {
                if end > self.begins[i] && self.columns[end - 1] == column {
                    self.counts[end - 1] += count;
                } else {
                    (self.columns[end], self.counts[end]) = (column, count);
                    end += 1;
                }
            }
            self.lengths[i] = end - self.begins[i];
        }
        self.begins[self.areas.len()] = end;
        self.columns.truncate(end);
        self.counts.truncate(end);
    }

    /// The factors nearest to the counts that are reciprocal and add up; `None` where none were found.
    ///
    /// # Panics
    /// Where a group has no walks.
    pub fn smooth(mut self) -> Option<SmoothedRows> {
        assert!(self.densities.iter().all(|density| *density > 0.0), "each group has walks");
        self.unite();
        let mut multipliers = vec![0.0; self.groups()];
        for _ in 0..ROUNDS {
            multipliers = self.solve(multipliers);
            if !self.hold_negative(&multipliers) {
                let smoothed = SmoothedRows { pairs: self, multipliers };
                return smoothed.adds_up().then_some(smoothed);
            }
        }
        None
    }

    /// The partner of each entry of a row (`None`: it has none), the entry's count, and the densities that its count is seen with.
    fn row(&self, i: usize) -> impl Iterator<Item = (Option<usize>, f64, f64)> + '_ {
        let entries = self.begins[i]..self.begins[i + 1];
        entries.map(move |place| {
            let partner = self.partner(i, self.columns[place]);
            let seen = self.densities[i] + partner.map_or(0.0, |j| self.densities[j]);
            (partner, f64::from(self.counts[place]), seen)
        })
    }

    /// C·V·Cᵀ times a vector.
    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let row = |i: usize| {
            self.row(i).map(|(j, m, seen)| m / (seen * seen) * (x[i] + j.map_or(0.0, |j| x[j]))).sum()
        };
        (0..self.groups()).map(row).collect()
    }

    /// The multipliers whose rows add up, from others on.
    fn solve(&self, mut x: Vec<f64>) -> Vec<f64> {
        let groups = self.groups();
        let diagonal: Vec<f64> = (0..groups)
            .map(|i| self.row(i).map(|(_, m, seen)| m / (seen * seen)).sum::<f64>().max(f64::MIN_POSITIVE))
            .collect();
        let applied = self.apply(&x);
        let defect = |i: usize| self.areas[i] - self.row(i).map(|(_, m, seen)| m / seen).sum::<f64>();
        let mut residual: Vec<f64> = (0..groups).map(|i| defect(i) - applied[i]).collect();
        let scaled = |residual: &[f64]| -> Vec<f64> {
            residual.iter().zip(&diagonal).map(|(residual, diagonal)| residual / diagonal).collect()
        };
        let mut direction = scaled(&residual);
        let mut rho = dot(&residual, &direction);
        for _ in 0..MOST_ITERATIONS {
            let is_small = residual.iter().zip(&self.areas).all(|(left, area)| left.abs() <= DEFECT * area);
            if is_small || rho <= 0.0 {
                break;
            }
            let applied = self.apply(&direction);
            let alpha = rho / dot(&direction, &applied);
            add_times(&mut x, alpha, &direction);
            add_times(&mut residual, -alpha, &applied);
            let next = scaled(&residual);
            let ahead = dot(&residual, &next);
            let beta = ahead / rho;
            direction
                .iter_mut()
                .zip(&next)
                .for_each(|(direction, next)| *direction = next + beta * *direction);
            rho = ahead;
        }
        x
    }

    /// By what the multipliers scale the counted area of an entry.
    fn scale(multipliers: &[f64], i: usize, (partner, seen): (Option<usize>, f64)) -> f64 {
        1.0 + (multipliers[i] + partner.map_or(0.0, |j| multipliers[j])) / seen
    }

    /// Holds at 0 what would be below. Returns whether there is any.
    fn hold_negative(&mut self, multipliers: &[f64]) -> bool {
        let mut any = false;
        for i in 0..self.groups() {
            for place in self.begins[i]..self.begins[i + 1] {
                let partner = self.partner(i, self.columns[place]);
                let seen = self.densities[i] + partner.map_or(0.0, |j| self.densities[j]);
                let scale = PairedRows::scale(multipliers, i, (partner, seen));
                if self.counts[place] > 0 && scale < 0.0 {
                    self.counts[place] = 0;
                    any = true;
                }
            }
        }
        any
    }
}

impl SmoothedRows {
    /// How many factors are not 0.
    pub fn entries(&self) -> u64 {
        self.pairs.counts.iter().filter(|&&count| count > 0).count() as u64
    }

    /// The factors of a row that are not 0, each with its column.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let columns = &self.pairs.columns[self.pairs.begins[i]..self.pairs.begins[i + 1]];
        let factor = move |(column, (partner, m, seen)): (&u32, (Option<usize>, f64, f64))| {
            let area = m / seen * PairedRows::scale(&self.multipliers, i, (partner, seen));
            (m > 0.0).then_some((*column, area / self.pairs.areas[i]))
        };
        columns.iter().zip(self.pairs.row(i)).filter_map(factor)
    }

    /// Whether all rows add up to 1; rows of what is not a number do not.
    fn adds_up(&self) -> bool {
        let defect = |i: usize| (self.row(i).map(|(_, factor)| factor).sum::<f64>() - 1.0).abs();
        (0..self.pairs.groups()).all(|i| defect(i) <= FAILURE)
    }
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

fn add_times(x: &mut [f64], a: f64, y: &[f64]) {
    x.iter_mut().zip(y).for_each(|(x, y)| *x += a * y);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ExchangeCounts, smooth};

    fn paired(counts: &ExchangeCounts, areas: &[f64]) -> PairedRows {
        let row = |i: usize| {
            let met = (0..).zip(counts.row(i)).filter(|&(_, &count)| count > 0);
            SparseRow::new(met.map(|(column, &count)| (column, count as u32)).collect())
        };
        let mut pairs = PairedRows::new(areas.to_vec());
        (0..areas.len()).for_each(|i| pairs.measure(i, &row(i)));
        (0..areas.len()).for_each(|i| pairs.add(i, &row(i)));
        pairs
    }

    /// The same numbers as by the inverse, also where some are held at 0, and where rows say the same twice.
    #[test]
    fn rows_are_smoothed_as_matrices_are() {
        let cases = [
            (
                vec![vec![0, 270, 545, 0, 209], vec![90, 98, 57, 0, 11], vec![580, 170, 0, 100, 1198]],
                vec![2.0, 1.5, 4.0],
            ),
            (vec![vec![0, 1, 63, 0, 0], vec![1, 0, 7, 0, 56], vec![64, 0, 0, 0, 0]], vec![1.0; 3]),
            (vec![vec![0, 8, 0, 0], vec![16, 0, 0, 0]], vec![3.0; 2]),
        ];
        for (rows, areas) in cases {
            let counts = ExchangeCounts::of(&rows);
            let dense = smooth(&counts, &areas).unwrap();
            let sparse = paired(&counts, &areas).smooth().unwrap();
            for (i, dense) in dense.factors.iter().enumerate() {
                let mut row = vec![0.0; dense.len()];
                sparse.row(i).for_each(|(column, factor)| row[column as usize] = factor);
                for (found, known) in row.iter().zip(dense) {
                    assert!((found - known).abs() < 1e-9, "{row:?} {dense:?}");
                }
                assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{row:?}");
            }
        }
    }

    /// Two groups that see nothing but each other, of unequal areas: no factors are reciprocal and add up.
    #[test]
    fn what_cannot_be_smoothed_is_reported() {
        let counts = ExchangeCounts::of(&[vec![0, 8, 0, 0], vec![16, 0, 0, 0]]);
        assert!(paired(&counts, &[3.0, 4.0]).smooth().is_none());
    }
}
