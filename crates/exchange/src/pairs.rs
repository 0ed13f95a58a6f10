//! Which row tells of the exchange between two groups: E_i·B_ij = E_j·B_ji, so that both rows count it.
//!
//! A walk of group i stands for E_i/N_i of it. Each row tells of its own exchanges, so that what it knows exactly, all of its walks being
//! somewhere, stays exact; but where walks of the other group stand for far less, as those of a small heater do for a large wall that seldom meets it,
//! these tell.

use crate::matrix::SparseFactors;

/// A row tells its own pairs, unless walks of the other group stand for this many times less.
const FAR_LESS: f64 = 4.0;

/// From this number of walks on a count is about normal, and its standard error tells enough.
const MANY_WALKS: f64 = 30.0;

/// Pairs of groups up to which the largest part of a walk is looked for in all; of more it is bounded.
const FEW_PAIRS: usize = 50_000_000;

/// Gebhart's factor of a group to another, and whose walks tell it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairFactor {
    /// The other group; the number of groups for the environment.
    pub(crate) to: usize,
    /// The factor.
    pub(crate) factor: f64,
    /// The walks that tell it.
    walks: f64,
    /// Whether they are those of the other group.
    pub(crate) by_other: bool,
}

/// The factors of all groups, each told by the row that tells it better.
#[derive(Clone, Debug)]
pub(crate) struct PairFactors {
    /// Where the entries of each row end.
    ends: Vec<usize>,
    entries: Vec<PairFactor>,
    /// E/N of each group [m²].
    parts: Vec<f64>,
    escapes: bool,
}

impl PairFactors {
    /// The factors of counts, given E of each group [m²].
    pub(crate) fn new(factors: &SparseFactors, emitting_areas: &[f64]) -> Self {
        let groups = factors.groups();
        let parts: Vec<f64> = (0..groups).map(|i| emitting_areas[i] / factors.walks(i)).collect();
        let mut rows: Vec<Vec<PairFactor>> = vec![Vec::new(); groups];
        let mut escapes = false;
        for i in 0..groups {
            for (j, factor) in factors.row(i) {
                let (to, walks) = (j.min(groups), factor * factors.walks(i));
                escapes |= to == groups;
                if to == i {
                    continue;
                }
                if to == groups || !tells(&parts, to, i) {
                    rows[i].push(PairFactor { to, factor, walks, by_other: false });
                }
                if to < groups && tells(&parts, i, to) {
                    let factor = factor * emitting_areas[i] / emitting_areas[to];
                    rows[to].push(PairFactor { to: i, factor, walks, by_other: true });
                }
            }
        }
        // What is left comes back to the group, so that no heat is lost where two rows tell of its pairs.
        for (i, row) in rows.iter_mut().enumerate() {
            let own = 1.0 - row.iter().map(|pair| pair.factor).sum::<f64>();
            row.push(PairFactor { to: i, factor: own, walks: f64::INFINITY, by_other: false });
        }
        let ends = rows.iter().scan(0, |end, row: &Vec<PairFactor>| {
            *end += row.len();
            Some(*end)
        });
        PairFactors { ends: ends.collect(), entries: rows.concat(), parts, escapes }
    }

    /// The factors of a row that are not 0.
    pub(crate) fn row(&self, i: usize) -> &[PairFactor] {
        &self.entries[i.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[i]]
    }

    /// The most that one walk more could change the flux of each group [W], given σT⁴ of all groups and of the environment [W/m²], by a pair
    /// that few walks tell, or none; the environment counts where it is said that there is one, or any walk has reached it.
    pub(crate) fn most_of_a_walk(&self, emitted: &[f64], has_environment: bool) -> Vec<f64> {
        let escapes = self.escapes || has_environment;
        let groups = self.parts.len();
        if groups * groups <= FEW_PAIRS {
            return (0..groups).map(|i| self.most_of_pairs(i, emitted, escapes)).collect();
        }
        let known = if escapes { emitted } else { &emitted[..groups] };
        let most = known.iter().copied().fold(0.0, f64::max);
        let least = known.iter().copied().fold(f64::INFINITY, f64::min);
        (0..groups).map(|i| self.parts[i] * (most - emitted[i]).max(emitted[i] - least)).collect()
    }

    fn most_of_pairs(&self, i: usize, emitted: &[f64], escapes: bool) -> f64 {
        let groups = self.parts.len();
        let mut is_open = vec![true; groups + 1];
        is_open[groups] = escapes;
        self.row(i).iter().filter(|pair| pair.walks >= MANY_WALKS).for_each(|pair| is_open[pair.to] = false);
        let part = |j: usize| match j < groups && tells(&self.parts, j, i) {
            true => self.parts[j],
            false => self.parts[i],
        };
        let open = (0..=groups).filter(|&j| is_open[j]);
        open.map(|j| part(j) * (emitted[i] - emitted[j]).abs()).fold(0.0, f64::max)
    }
}

/// Whether walks of a group stand for far less than those of another do.
fn tells(parts: &[f64], group: usize, other: usize) -> bool {
    FAR_LESS * parts[group] < parts[other]
}
