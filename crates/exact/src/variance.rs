//! The exact variance of B_i for one walk, estimator by estimator: S97 table 3, BS eq. (19), SInf eqs. (2), (3).
//!
//! Discrete walks, source-term suppression: the estimate is of b_i. Divide by the number of walks. A walk
//! contributes the square of its whole score on a face.

use crate::answer::Exact;
use crate::system::{RadiositySystem, Solution};

/// An unbiased way to score a shooting walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WalkEstimator {
    /// Shooting, φ_i += Φ_T/(1 − R_i) where the walk dies.
    ShootAbsorption,
    /// Shooting, φ_i += Φ_T/R_i at every hit but the last.
    ShootSurvival,
    /// Shooting, φ_i += Φ_T at every hit.
    ShootCollision,
    /// Shooting, φ_i += Φ_T·ΠR over the earlier hits, at every hit of a walk that never ends.
    ShootInfinite,
}

/// An unbiased way to score a gathering walk, born on face i with probability p_i.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GatherEstimator {
    /// b_i += R_iE_s/(p_i(1 − R_s)) where the walk dies.
    Absorption,
    /// b_i += R_iE_s/(p_iR_s) at every hit but the last.
    Survival,
    /// b_i += R_iE_s/p_i at every hit.
    Collision,
    /// b_i += R_iE_s/p_i·ΠR over the earlier hits, at every hit of a walk that never ends.
    Infinite,
}

/// What the variance of shooting on one face is made of.
struct Terms {
    /// b_i [W/m²], or β_i for the infinite walk.
    b: f64,
    /// R_i.
    r: f64,
    /// ξ_i.
    xi: f64,
    /// Φ_T/A_i [W/m²].
    power_density: f64,
}

impl WalkEstimator {
    /// Every estimator of shooting, in the order of tables.
    pub const ALL: [WalkEstimator; 4] = [
        WalkEstimator::ShootAbsorption,
        WalkEstimator::ShootSurvival,
        WalkEstimator::ShootCollision,
        WalkEstimator::ShootInfinite,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            WalkEstimator::ShootAbsorption => "shoot_absorption",
            WalkEstimator::ShootSurvival => "shoot_survival",
            WalkEstimator::ShootCollision => "shoot_collision",
            WalkEstimator::ShootInfinite => "shoot_infinite",
        }
    }

    /// The variance of B_i [W²/m⁴] for one walk, face by face; 0 where R_i = 0.
    pub fn variances(self, exact: &Exact) -> Vec<f64> {
        let terms = match self {
            WalkEstimator::ShootInfinite => Terms::of(exact, exact.squared_solution()),
            _ => Terms::of(exact, exact.solution()),
        };
        let variance = |(terms, b): (Terms, &f64)| self.second_moment(&terms) - b * b;
        terms.into_iter().zip(&exact.solution().reflected).map(variance).collect()
    }

    /// The expected square of a walk's whole score on a face [W²/m⁴]; the expected score is b_i.
    fn second_moment(self, &Terms { b, r, xi, power_density }: &Terms) -> f64 {
        match self {
            // S97 corollary 2.3
            WalkEstimator::ShootAbsorption => b * r * power_density / (1.0 - r),
            // S97 corollary 2.11; R_i (1/R_i + 2ξ_i) written so as to be finite at R_i = 0
            WalkEstimator::ShootSurvival => b * power_density * (1.0 + 2.0 * r * xi),
            // BS eq. (19)
            WalkEstimator::ShootCollision => b * r * power_density * (1.0 + 2.0 * r * xi),
            // SInf eq. (2), b being β
            WalkEstimator::ShootInfinite => b * power_density * (1.0 + 2.0 * r * xi),
        }
    }
}

impl Terms {
    /// The terms of every face where b is that of `solution`.
    fn of(exact: &Exact, solution: &Solution) -> Vec<Self> {
        let face = |i: usize| Terms {
            b: solution.reflected[i],
            r: exact.reflectance()[i],
            xi: exact.xi()[i],
            power_density: exact.total_power() / exact.areas()[i],
        };
        (0..exact.face_count()).map(face).collect()
    }
}

impl GatherEstimator {
    /// Every estimator of gathering, in the order of tables.
    pub const ALL: [GatherEstimator; 4] = [
        GatherEstimator::Absorption,
        GatherEstimator::Survival,
        GatherEstimator::Collision,
        GatherEstimator::Infinite,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            GatherEstimator::Absorption => "gather_absorption",
            GatherEstimator::Survival => "gather_survival",
            GatherEstimator::Collision => "gather_collision",
            GatherEstimator::Infinite => "gather_infinite",
        }
    }

    /// The variance of B_i [W²/m⁴] for one walk that is born on face i with probability `birth[i]`. `None` where no walk is born; and everywhere, for survival, if a
    /// source does not reflect: its light would be lost.
    ///
    /// # Panics
    /// Unless there is one probability per face.
    pub fn variances(self, exact: &Exact, birth: &[f64]) -> Vec<Option<f64>> {
        if self == GatherEstimator::Survival && has_black_source(exact) {
            return vec![None; birth.len()];
        }
        per_birth(exact, birth, self.second_moments(exact))
    }

    /// p_i times the expected square of a walk's whole score for each face [W²/m⁴]. The sum over sources
    /// Σ_s c_s b_is is the radiosity b_i that emittances c_sE_s would cause, as b_is is linear in E_s.
    fn second_moments(self, exact: &Exact) -> Vec<f64> {
        match self {
            // S97 eq. (10)
            GatherEstimator::Absorption => reflected(exact, exact.system(), |s| s.e / (1.0 - s.r)),
            // S97 table 3
            GatherEstimator::Survival => reflected(exact, exact.system(), |s| (s.e + 2.0 * s.b) / s.r),
            GatherEstimator::Collision => reflected(exact, exact.system(), |s| s.e + 2.0 * s.b),
            // SInf eq. (3): β_is instead of R_ib_is
            GatherEstimator::Infinite => {
                let squared = &exact.squared().system;
                squared.solve(&weighted_emittance(exact, |s| s.e + 2.0 * s.b)).reflected
            }
        }
    }
}

/// A source face s: R_s, E_s > 0, b_s [W/m²].
struct Source {
    r: f64,
    e: f64,
    b: f64,
}

/// c_sE_s of every face.
fn weighted_emittance(exact: &Exact, c: impl Fn(Source) -> f64) -> Vec<f64> {
    let weighted = |(face, &e): (usize, &f64)| {
        let (r, b) = (exact.reflectance()[face], exact.solution().reflected[face]);
        if e > 0.0 { c(Source { r, e, b }) * e } else { 0.0 }
    };
    exact.emittance().iter().enumerate().map(weighted).collect()
}

/// R_i Σ_s c_s b_is of every face.
fn reflected(exact: &Exact, system: &RadiositySystem, c: impl Fn(Source) -> f64) -> Vec<f64> {
    let sums = system.solve(&weighted_emittance(exact, c)).reflected;
    sums.iter().zip(exact.reflectance()).map(|(sum, r)| r * sum).collect()
}

/// A second moment over p_i, less b_i²; `None` where p_i = 0.
fn per_birth(exact: &Exact, birth: &[f64], moments: Vec<f64>) -> Vec<Option<f64>> {
    assert_eq!(birth.len(), exact.face_count(), "one probability per face");
    let central = |((moment, &b), &p): ((f64, &f64), &f64)| (p > 0.0).then(|| moment / p - b * b);
    moments.into_iter().zip(&exact.solution().reflected).zip(birth).map(central).collect()
}

fn has_black_source(exact: &Exact) -> bool {
    exact.emittance().iter().zip(exact.reflectance()).any(|(&e, &r)| e > 0.0 && r == 0.0)
}

/// The covariance of B_i [W²/m⁴] by absorption and by survival of one shooting walk (S97 proposition 2.19):
/// (R_i/A_i)² (Φ_Tξ_iφ_i − φ_i²).
pub fn shooting_covariance(exact: &Exact) -> Vec<f64> {
    let covariance = |Terms { b, r, xi, power_density }| r * power_density * xi * b - b * b;
    Terms::of(exact, exact.solution()).into_iter().map(covariance).collect()
}

/// The weight α of survival at which α·survival + (1 − α)·absorption has the least variance for shooting
/// walks (S97 §2.6): R_i (1 − ξ_i(1 − R_i)). At α = R_i the sum is the collision estimator.
pub fn best_shooting_weights(exact: &Exact) -> Vec<f64> {
    exact.reflectance().iter().zip(exact.xi()).map(|(r, xi)| r * (1.0 - xi * (1.0 - r))).collect()
}

/// The covariance of B_i [W²/m⁴] by absorption and by survival of one gathering walk (S97 §3.7):
/// (R_i/p_i) Σ_s b_sb_is/R_s − b_i². `None` as in [`GatherEstimator::variances`] for survival.
///
/// # Panics
/// Unless there is one probability per face.
pub fn gathering_covariance(exact: &Exact, birth: &[f64]) -> Vec<Option<f64>> {
    if has_black_source(exact) {
        return vec![None; birth.len()];
    }
    per_birth(exact, birth, reflected(exact, exact.system(), |s| s.b / s.r))
}

/// The weight α of survival at which α·survival + (1 − α)·absorption has the least variance for gathering
/// walks (S97 §3.7), face by face: R − (1 − R) Σ_s b_sb_is/Σ_s E_sb_is, and R where no light arrives.
/// `None` unless all sources share one reflectance R > 0.
pub fn best_gathering_weights(exact: &Exact) -> Option<Vec<f64>> {
    let r = shared_source_reflectance(exact)?;
    let later = reflected(exact, exact.system(), |s| s.b);
    let first = reflected(exact, exact.system(), |s| s.e);
    let weight = |(later, &first): (f64, &f64)| if first > 0.0 { r - (1.0 - r) * later / first } else { r };
    Some(later.into_iter().zip(&first).map(weight).collect())
}

fn shared_source_reflectance(exact: &Exact) -> Option<f64> {
    let emitters = exact.emittance().iter().zip(exact.reflectance()).filter(|&(&e, _)| e > 0.0);
    let mut reflectances = emitters.map(|(_, &r)| r);
    let first = reflectances.next().filter(|&r| r > 0.0)?;
    reflectances.all(|r| r == first).then_some(first)
}

/// The variance of B_i [W²/m⁴] for one ray of a stochastic Jacobi iteration whose input is the solution (BS
/// eq. (22)): (R_iP_T/A_i) b_i − b_i² with P_T = Σ_jA_jB_j. Only for one iteration: those of a chain correlate.
pub fn jacobi_variances(exact: &Exact) -> Vec<f64> {
    let total: f64 = exact.areas().iter().zip(&exact.solution().radiosity).map(|(a, b)| a * b).sum();
    let variance = |i: usize| {
        let b = exact.solution().reflected[i];
        exact.reflectance()[i] * total / exact.areas()[i] * b - b * b
    };
    (0..exact.face_count()).map(variance).collect()
}

/// The variance of B_i [W²/m⁴] as in [`jacobi_variances`] for systematic births: face j shoots its share P_j/P_T of the
/// rays, not a random number of them. What is left to chance is where each lands: (R_i/A_i)² P_T Σ_j P_jF_ji(1 − F_ji).
/// Rounding shares to whole rays adds less than a ray's part.
pub fn systematic_jacobi_variances(exact: &Exact) -> Vec<f64> {
    let exchange = exact.exchange();
    let radiosity = exact.solution().radiosity.iter();
    let power: Vec<f64> = exact.areas().iter().zip(radiosity).map(|(area, b)| area * b).collect();
    let total: f64 = power.iter().sum();
    let variance = |i: usize| {
        let landing = |(j, power): (usize, &f64)| {
            let f = exchange.form_factor(j, i);
            power * f * (1.0 - f)
        };
        let spread: f64 = power.iter().enumerate().map(landing).sum();
        (exact.reflectance()[i] / exact.areas()[i]).powi(2) * total * spread
    };
    (0..exact.face_count()).map(variance).collect()
}
