//! Net heat by radiation between groups of grey, diffuse faces, by Gebhart's factors.
//!
//! Group i emits E_i·σT_i⁴, E_i = Σ ε·A over its faces [m²], ε = 1 − R. Since E_i·B_ij = E_j·B_ji, its net flux is
//!
//! Q_i = E_i Σ_j B_ij (σT_i⁴ − σT_j⁴) [W],
//!
//! the sum over all groups and the environment, which what escapes meets (B. Gebhart, *Heat Transfer*, 2nd ed. 1971, §5.10). Every
//! walk of group i is a sample of the sum. Groups whose flux is given have unknown T⁴; the equations are linear in these.
//!
//! Rows are independent. To first order the error of row i is r_i = E_i Σ_j δB_ij (σT_i⁴ − σT_j⁴), of the variance that its walks
//! show. With M the matrix of the unknown T⁴, they err by −M⁻¹r, and every flux by its own r_i and by the part of these that its group
//! sees.

use serde::{Deserialize, Serialize};
use stats::normal_quantile;

use crate::counts::Counts;
use crate::linear::{inverse, times};

/// σ: Stefan and Boltzmann's constant [W/(m²K⁴)] (CODATA 2018, exact).
pub const SIGMA: f64 = 5.670374419e-8;

/// What is given of a group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum BoundaryCondition {
    /// The temperature of the group [K], at least 0.
    Temperature(f64),
    /// The net flux of the group [W]: what it emits less what it absorbs; 0 of an insulated group.
    Flux(f64),
}

/// An estimate with its interval; a number that was given has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number that is estimated or given.
    pub value: f64,
    /// The standard error of the number, to first order; `None` of a number that was given.
    pub std_error: Option<f64>,
    /// The lower end of its interval.
    pub low: f64,
    /// The upper end of its interval.
    pub high: f64,
}

impl Estimate {
    fn given(value: f64) -> Self {
        Estimate { value, std_error: None, low: value, high: value }
    }

    fn normal(value: f64, error: f64, z: f64) -> Self {
        Estimate { value, std_error: Some(error), low: value - z * error, high: value + z * error }
    }
}

/// Temperatures and net fluxes of groups.
#[derive(Clone, Debug, PartialEq)]
pub struct Thermal {
    /// T of each group [K].
    pub temperatures: Vec<Estimate>,
    /// Q of each group [W].
    pub fluxes: Vec<Estimate>,
}

/// Why there is no balance.
#[derive(Clone, Debug, PartialEq)]
pub enum ThermalFault {
    /// Walks of a group end on backs, which have no temperature.
    Backs {
        /// The number of the group.
        group: usize,
    },
    /// Some temperatures follow from nothing: they exchange with groups of given flux only.
    Undetermined,
    /// The given fluxes would take a group below 0 K.
    BelowZero {
        /// The number of the group.
        group: usize,
    },
}

/// What is known of an enclosure.
#[derive(Clone, Debug)]
pub struct Balance<'a> {
    /// Walks of Gebhart's factors.
    pub counts: &'a Counts,
    /// E of each group: area times emissivity [m²].
    pub emitting_areas: &'a [f64],
    /// What is given of each group.
    pub given: &'a [BoundaryCondition],
    /// The temperature of the environment that what escapes meets [K].
    pub environment: f64,
    /// The level of the intervals.
    pub level: f64,
}

impl Balance<'_> {
    /// Solves for what is not given.
    ///
    /// # Errors
    /// Where the enclosure has no solution.
    ///
    /// # Panics
    /// Where there are other numbers than groups, or a group without walks.
    pub fn solve(&self) -> Result<Thermal, ThermalFault> {
        let groups = self.counts.groups();
        assert_eq!((self.emitting_areas.len(), self.given.len()), (groups, groups), "one for each group");
        if let Some(group) = (0..groups).find(|&i| self.counts.row(i)[groups] > 0) {
            return Err(ThermalFault::Backs { group });
        }
        let free: Vec<usize> =
            (0..groups).filter(|&i| matches!(self.given[i], BoundaryCondition::Flux(_))).collect();
        let inverse = inverse(self.matrix(&free)).ok_or(ThermalFault::Undetermined)?;
        let emitted = self.emitted(&free, &inverse)?;
        let noise: Vec<f64> = (0..groups).map(|i| self.noise(i, &emitted)).collect();
        Ok(self.thermal(&free, &inverse, &emitted, &noise))
    }

    /// B_ij: the estimated exchange factor from group i to group j.
    fn factor(&self, i: usize, j: usize) -> f64 {
        self.counts.row(i)[j] as f64 / self.counts.walks(i) as f64
    }

    /// M of the groups whose temperature is not given.
    fn matrix(&self, free: &[usize]) -> Vec<Vec<f64>> {
        let entry = |i: usize, j: usize| {
            let identity = if i == j { 1.0 } else { 0.0 };
            self.emitting_areas[i] * (identity - self.factor(i, j))
        };
        free.iter().map(|&i| free.iter().map(|&j| entry(i, j)).collect()).collect()
    }

    /// σT⁴ of every group, and of the environment last [W/m²].
    fn emitted(&self, free: &[usize], inverse: &[Vec<f64>]) -> Result<Vec<f64>, ThermalFault> {
        let known = self.given.iter().map(|given| match given {
            BoundaryCondition::Temperature(t) => SIGMA * t.powi(4),
            BoundaryCondition::Flux(_) => 0.0,
        });
        let mut emitted: Vec<f64> = known.chain([SIGMA * self.environment.powi(4)]).collect();
        let right = free.iter().map(|&i| {
            let BoundaryCondition::Flux(flux) = self.given[i] else { unreachable!("a free group") };
            flux + self.emitting_areas[i] * self.seen(i, &emitted)
        });
        let found = times(inverse, &right.collect::<Vec<_>>());
        for (&group, found) in free.iter().zip(found) {
            if found < 0.0 {
                return Err(ThermalFault::BelowZero { group });
            }
            emitted[group] = found;
        }
        Ok(emitted)
    }

    /// Σ_j B_ij σT_j⁴ [W/m²].
    fn seen(&self, i: usize, emitted: &[f64]) -> f64 {
        self.columns().map(|(j, place)| self.factor(i, j) * emitted[place]).sum()
    }

    /// The columns of a row in which walks may be, each with the place of its σT⁴.
    fn columns(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let groups = self.counts.groups();
        (0..groups).map(|j| (j, j)).chain([(groups + 1, groups)])
    }

    /// The variance of r_i [W²].
    fn noise(&self, i: usize, emitted: &[f64]) -> f64 {
        let of = |power| {
            let term =
                |(j, place): (usize, usize)| self.factor(i, j) * (emitted[i] - emitted[place]).powi(power);
            self.columns().map(term).sum::<f64>()
        };
        let walks = self.counts.walks(i) as f64;
        let variance = (of(2) - of(1).powi(2)).max(0.0) / (walks - 1.0).max(1.0);
        self.emitting_areas[i].powi(2) * variance
    }

    fn thermal(&self, free: &[usize], inverse: &[Vec<f64>], emitted: &[f64], noise: &[f64]) -> Thermal {
        let z = normal_quantile(0.5 + 0.5 * self.level);
        let mut temperatures: Vec<Estimate> = (0..self.given.len())
            .map(|i| match self.given[i] {
                BoundaryCondition::Temperature(t) => Estimate::given(t),
                BoundaryCondition::Flux(_) => Estimate::given(0.0),
            })
            .collect();
        for (&group, row) in free.iter().zip(inverse) {
            let variance: f64 = free.iter().zip(row).map(|(&k, m)| m * m * noise[k]).sum();
            temperatures[group] = temperature(emitted[group], variance.sqrt(), z);
        }
        let fluxes = (0..self.given.len()).map(|i| match self.given[i] {
            BoundaryCondition::Flux(flux) => Estimate::given(flux),
            BoundaryCondition::Temperature(_) => {
                let flux = self.emitting_areas[i] * (emitted[i] - self.seen(i, emitted));
                Estimate::normal(flux, (noise[i] + self.carried(i, free, inverse, noise)).sqrt(), z)
            }
        });
        Thermal { fluxes: fluxes.collect(), temperatures }
    }

    /// The variance of the flux of group i by the temperatures that were solved for [W²].
    fn carried(&self, i: usize, free: &[usize], inverse: &[Vec<f64>], noise: &[f64]) -> f64 {
        let part = |l: usize| {
            let by = free.iter().zip(inverse).map(|(&j, row)| self.factor(i, j) * row[l]);
            self.emitting_areas[i] * by.sum::<f64>()
        };
        free.iter().enumerate().map(|(l, &k)| part(l).powi(2) * noise[k]).sum()
    }
}

/// T from σT⁴ and its standard error [W/m²]; the ends of the interval are those of T⁴.
fn temperature(emitted: f64, error: f64, z: f64) -> Estimate {
    let kelvin = |emitted: f64| (emitted.max(0.0) / SIGMA).sqrt().sqrt();
    let value = kelvin(emitted);
    let std_error = if emitted > 0.0 { 0.25 * value * error / emitted } else { 0.0 };
    let [low, high] = [-z, z].map(|z| kelvin(emitted + z * error));
    Estimate { value, std_error: Some(std_error), low, high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use BoundaryCondition::{Flux, Temperature};

    fn solve(rows: &[Vec<u64>], areas: &[f64], given: &[BoundaryCondition]) -> Result<Thermal, ThermalFault> {
        let mut counts = Counts::none(rows.len());
        counts.add(rows);
        Balance { counts: &counts, emitting_areas: areas, given, environment: 3.0, level: 0.95 }.solve()
    }

    /// Two black plates that see half of each other, a third that is insulated: its T⁴ is the mean.
    #[test]
    fn an_insulated_group_takes_the_mean() {
        let rows = [vec![0, 64, 64, 0, 0], vec![64, 0, 64, 0, 0], vec![64, 64, 0, 0, 0]];
        let given = [Temperature(400.0), Temperature(300.0), Flux(0.0)];
        let Thermal { temperatures, fluxes } = solve(&rows, &[2.0; 3], &given).unwrap();
        let [hot, cold] = [400.0_f64, 300.0].map(|t| SIGMA * t.powi(4));
        let mean = (0.5 * (hot + cold) / SIGMA).powf(0.25);
        assert!((temperatures[2].value - mean).abs() < 1e-9, "{temperatures:?}");
        assert!(temperatures[2].low < mean && mean < temperatures[2].high);
        assert!((fluxes[0].value - 2.0 * 0.75 * (hot - cold)).abs() < 1e-9, "{fluxes:?}");
        assert!((fluxes[0].value + fluxes[1].value).abs() < 1e-9);
        assert_eq!((fluxes[2], temperatures[0].std_error), (Estimate::given(0.0), None));
    }

    #[test]
    fn what_cannot_be_solved_is_told() {
        let pair = |back, escape| [vec![0, 64 - back, back, 0], vec![64 - escape, 0, 0, escape]];
        assert_eq!(
            solve(&pair(1, 0), &[1.0; 2], &[Temperature(1.0); 2]),
            Err(ThermalFault::Backs { group: 0 })
        );
        assert_eq!(solve(&pair(0, 0), &[1.0; 2], &[Flux(1.0), Flux(-1.0)]), Err(ThermalFault::Undetermined));
        assert_eq!(
            solve(&pair(0, 0), &[1.0; 2], &[Temperature(10.0), Flux(-1.0)]),
            Err(ThermalFault::BelowZero { group: 1 })
        );
        // What escapes leaves for the environment: both fluxes determine both temperatures.
        assert!(solve(&pair(0, 1), &[1.0; 2], &[Flux(1.0), Flux(0.0)]).is_ok());
    }
}
