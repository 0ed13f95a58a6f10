//! How many walks each group is given: where the variance is.
//!
//! Plans follow from counts and from nothing else, so that the answer is a function of the job. The first plan is a pilot. What it
//! has found says how many walks each group needs; at the next look that is known better.

use crate::counts::ExchangeCounts;
use crate::factors::Factors;

/// Walks of each group in a pilot, where the budget has room.
const PILOT: u64 = 1 << 12;

/// The part of the budget that a pilot may take.
const PILOT_PART: u64 = 8;

/// By how many times the walks of a group grow at most from one look to the next where no walk has told of a factor yet.
const GROWTH: u64 = 16;

/// More walks are given than a look says are needed, by this factor: the next look should be the last.
const MARGIN: f64 = 1.1;

/// The accuracy that is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// The half-width of intervals over their factors.
    pub relative: f64,
    /// The pairs that it is asked of, each of them; `None`: of every row in the mean square ([`Factors::row_error`]).
    pub pairs: Option<Vec<(usize, usize)>>,
    /// The level of the intervals.
    pub level: f64,
}

impl Tolerance {
    /// Whether the factors are known so well.
    pub fn is_met(&self, counts: &ExchangeCounts) -> bool {
        let factors = Factors::new(counts, self.level);
        (0..counts.groups()).all(|i| self.excess(i, &factors) <= 1.0)
    }

    /// By what factor the errors of group i are above what is asked of them; infinite where nothing is known.
    fn excess(&self, i: usize, factors: &Factors<'_>) -> f64 {
        let error = match &self.pairs {
            None => factors.row_error(i),
            Some(pairs) => {
                let of_row = pairs.iter().filter(|(from, _)| *from == i);
                of_row.map(|&(from, to)| factors.pair_error(from, to)).fold(0.0, f64::max)
            }
        };
        error / self.relative
    }
}

/// The number of walks of each group at a look, a power of two.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WalkPlan {
    walks: Vec<u64>,
}

impl WalkPlan {
    /// The first plan: as many walks for each of `groups` groups. `None` where `budget` has none for each.
    pub fn pilot(groups: usize, budget: u64) -> Option<Self> {
        let each = budget / groups as u64;
        let walks = floor_power_of_two(each)?.min(PILOT).min((each / PILOT_PART).max(1).next_power_of_two());
        Some(WalkPlan { walks: vec![walks; groups] })
    }

    /// The plan that follows from what is counted, within `budget` walks in all; `None` where there is nothing more to do.
    pub fn next(counts: &ExchangeCounts, budget: u64, tolerance: Option<&Tolerance>) -> Option<Self> {
        let have: Vec<u64> = (0..counts.groups()).map(|i| counts.walks(i)).collect();
        let walks = match tolerance {
            None => spread(counts, &have, budget),
            Some(tolerance) => {
                let factors = Factors::new(counts, tolerance.level);
                let needed = |(i, &have): (usize, &u64)| needed(have, tolerance.excess(i, &factors));
                within(have.iter().enumerate().map(needed).collect(), &have, budget)
            }
        };
        (walks != have).then_some(WalkPlan { walks })
    }

    /// The walks of each group.
    pub fn walks(&self) -> &[u64] {
        &self.walks
    }
}

fn floor_power_of_two(n: u64) -> Option<u64> {
    n.checked_ilog2().map(|log| 1 << log)
}

/// The walks of all rows that leave the least sum of variances Σ_i V_i/N_i, V_i = 1 − Σ_j p_ij²: while the budget has room, the
/// row is doubled that loses most for each walk it takes, V_i/(2N_i²).
fn spread(counts: &ExchangeCounts, have: &[u64], budget: u64) -> Vec<u64> {
    let variance = |i: usize| {
        let walks = counts.walks(i) as f64;
        // As if one walk more had gone elsewhere: a row that seems certain is not left out for ever.
        let squares: f64 = counts.row(i).iter().map(|&n| (n as f64 / (walks + 1.0)).powi(2)).sum();
        1.0 - squares
    };
    let variances: Vec<f64> = (0..have.len()).map(variance).collect();
    let (mut walks, mut left) = (have.to_vec(), budget.saturating_sub(have.iter().sum()));
    loop {
        let gain = |i: usize, walks: &[u64]| variances[i] / (walks[i] as f64).powi(2);
        let fits = (0..walks.len()).filter(|&i| walks[i] <= left);
        let best = fits.max_by(|&a, &b| gain(a, &walks).total_cmp(&gain(b, &walks)).then(b.cmp(&a)));
        let Some(best) = best else { return walks };
        left -= walks[best];
        walks[best] *= 2;
    }
}

/// The walks that a group needs which has some, and errors in excess: they fall as the square root of the number of walks.
fn needed(have: u64, excess: f64) -> u64 {
    if excess <= 1.0 {
        return have;
    }
    let growth = (MARGIN * excess * excess).clamp(2.0, 1e12);
    let growth = if excess.is_finite() { growth as u64 } else { GROWTH };
    have.saturating_mul(growth).checked_next_power_of_two().unwrap_or(1 << 62)
}

/// What the budget has room for: the largest rows are halved, which stay above what they have.
fn within(mut walks: Vec<u64>, have: &[u64], budget: u64) -> Vec<u64> {
    let total = |walks: &[u64]| walks.iter().fold(0_u64, |sum, &walks| sum.saturating_add(walks));
    while total(&walks) > budget {
        let grown = (0..walks.len()).filter(|&i| walks[i] > have[i]);
        let Some(largest) = grown.max_by_key(|&i| (walks[i], i)) else { break };
        walks[largest] /= 2;
    }
    walks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pilots_keep_an_eighth_of_the_budget() {
        assert_eq!(WalkPlan::pilot(3, 2), None);
        assert_eq!(WalkPlan::pilot(3, 3).unwrap().walks(), [1, 1, 1]);
        assert_eq!(WalkPlan::pilot(2, 2048).unwrap().walks(), [128, 128]);
        assert_eq!(WalkPlan::pilot(2, 1 << 40).unwrap().walks(), [PILOT, PILOT]);
    }

    /// A row that is certain gets nothing, the others all there is: powers of two that the budget holds.
    #[test]
    fn the_budget_goes_where_the_variance_is() {
        let known =
            ExchangeCounts::of(&[vec![0, 64, 0, 0, 0], vec![32, 0, 32, 0, 0], vec![8, 8, 16, 16, 16]]);
        let plan = WalkPlan::next(&known, 10_000, None).unwrap();
        let walks = plan.walks();
        assert!(walks.iter().all(|walks| walks.is_power_of_two()), "{walks:?}");
        let total: u64 = walks.iter().sum();
        assert!((5_000..=10_000).contains(&total), "{walks:?}");
        assert!(4 * walks[0] <= walks[1] && walks[1] <= walks[2], "{walks:?}");
        assert_eq!(WalkPlan::next(&known, 200, None), None);
    }

    /// A pair of p = 1/4 at 1 %: z²·(1 − p)/p/T² = 115,000 walks, a row of 2 cells: 38,400.
    #[test]
    fn tolerances_say_how_many_walks_are_needed() {
        let known = ExchangeCounts::of(&[vec![0, 1024, 3072, 0], vec![4096, 0, 0, 0]]);
        let tolerance = |pairs| Tolerance { relative: 0.01, pairs, level: 0.95 };
        let next = |pairs| WalkPlan::next(&known, 1 << 40, Some(&tolerance(pairs)));
        assert_eq!(next(Some(vec![(0, 1)])).unwrap().walks(), [1 << 17, 4096]);
        assert_eq!(next(None).unwrap().walks(), [1 << 16, 4096]);
        // Nothing is known of this pair yet.
        assert_eq!(next(Some(vec![(1, 1)])).unwrap().walks(), [4096, 4096 * GROWTH]);
        assert_eq!(next(Some(vec![])), None);
        let poor = WalkPlan::next(&known, 70_000, Some(&tolerance(Some(vec![(0, 1)])))).unwrap();
        assert_eq!(poor.walks(), [1 << 16, 4096]);
        assert!(tolerance(Some(vec![(1, 0)])).is_met(&known) && !tolerance(None).is_met(&known));
    }
}
