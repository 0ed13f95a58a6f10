//! The exact variance of B_i for one walk, estimator by estimator: S97 table 3, BS eq. (19), SInf eqs. (2), (3).
//!
//! Discrete walks, source-term suppression: the estimate is of b_i. Divide by the number of walks. A walk
//! contributes the square of its whole score on a face.

use radiosity::{
    EstimatorKind,
    methods::{AbsorptionMode, Event},
};

use crate::answer::Exact;
use crate::system::RadiositySystem;

/// The estimators of S97's tables 3 and 4, in their order.
pub const ESTIMATORS: [EstimatorKind; 4] =
    [EstimatorKind::Absorption, EstimatorKind::Survival, EstimatorKind::Collision, EstimatorKind::Infinite];

/// What the variance of shooting on one face is made of.
struct VarianceTerms {
    /// b_i [W/m²]; β_i for the infinite walk, that of one bounce for direct light.
    b: f64,
    /// R_i: the reflectance of the face.
    r: f64,
    /// ξ_i: the incoming power on the face when it alone emits unit power.
    xi: f64,
    /// Φ_T/A_i: the emitted power of the scene per area of the face [W/m²].
    power_density: f64,
}

impl Exact {
    /// The variance of B_i [W²/m⁴] for one shooting walk, face by face; 0 where R_i = 0.
    pub fn shooting_variances(&self, estimator: EstimatorKind) -> Vec<f64> {
        let terms = match estimator.absorption() {
            AbsorptionMode::Analog => VarianceTerms::of(self, &self.solution().reflected),
            AbsorptionMode::Implicit => VarianceTerms::of(self, &self.squared_solution().reflected),
            AbsorptionMode::DirectOnly => VarianceTerms::of(self, &self.direct()),
        };
        let variance = |(terms, b): (VarianceTerms, f64)| shooting_second_moment(estimator, &terms) - b * b;
        terms.into_iter().zip(self.scored(estimator)).map(variance).collect()
    }

    /// The variance of B_i [W²/m⁴] for one walk that is born on face i with probability `birth[i]`. `None` where no walk
    /// is born; and everywhere, for survival, if a source does not reflect: its light would be lost.
    ///
    /// # Panics
    /// Unless there is one probability per face.
    pub fn gathering_variances(&self, estimator: EstimatorKind, birth: &[f64]) -> Vec<Option<f64>> {
        if estimator.event() == Event::Survival && has_black_source(self) {
            return vec![None; birth.len()];
        }
        per_birth(birth, gathering_second_moments(estimator, self), &self.scored(estimator))
    }

    /// b_i [W/m²] of light that was reflected once: R_i/A_i times what arrives from emitters and lamps.
    pub fn direct(&self) -> Vec<f64> {
        let mut direct = once(self, self.emittance());
        for (i, met) in self.lamps().incoming.iter().enumerate() {
            direct[i] += self.reflectance()[i] * met / self.areas()[i];
        }
        direct
    }

    /// What an estimator tells of every face: b_i [W/m²], or that of direct light.
    pub(crate) fn scored(&self, estimator: EstimatorKind) -> Vec<f64> {
        match estimator.absorption() {
            AbsorptionMode::DirectOnly => self.direct(),
            AbsorptionMode::Analog | AbsorptionMode::Implicit => self.solution().reflected.clone(),
        }
    }
}

/// The expected square of a shooting walk's whole score on a face [W²/m⁴]: that of one score, times 1 + 2R_iξ_i where the walk
/// may come back and score again.
fn shooting_second_moment(
    estimator: EstimatorKind,
    &VarianceTerms { b, r, xi, power_density }: &VarianceTerms,
) -> f64 {
    let once = match (estimator.absorption(), estimator.event()) {
        // φ_i += Φ_T·ΠR over the earlier hits, at every hit of a walk that never ends: SInf eq. (2), b being β
        (AbsorptionMode::Implicit, _) => b * power_density,
        // φ_i += Φ_T/(1 − R_i) where the walk dies: S97 corollary 2.3
        (_, Event::Absorption) => b * r * power_density / (1.0 - r),
        // φ_i += Φ_T/R_i at every hit but the last: S97 corollary 2.11, R_i (1/R_i + 2ξ_i) written so as to be finite at
        // R_i = 0
        (_, Event::Survival) => b * power_density,
        // φ_i += Φ_T at every hit: S97 corollary 2.16, BS eq. (19); at the first one, b being that of one bounce
        (_, Event::Arrival) => b * r * power_density,
    };
    if estimator.scores_again() { once * (1.0 + 2.0 * r * xi) } else { once }
}

/// p_i times the expected square of a gathering walk's whole score for each face [W²/m⁴]. The sum over sources
/// Σ_s c_s b_is is the radiosity b_i that emittances c_sE_s would cause, as b_is is linear in E_s.
fn gathering_second_moments(estimator: EstimatorKind, exact: &Exact) -> Vec<f64> {
    // b_i += R_iE_s/(p_ip) at an event of probability p on a source: where the walk dies, S97 eq. (10); at every hit but the
    // last, eq. (13); at every hit, eq. (14). 2b_s is what the walk still gathers.
    let c = |s: EmittingFace| {
        let later = if estimator.scores_again() { 2.0 * s.b } else { 0.0 };
        (s.e + later) / estimator.event().probability(s.r)
    };
    match estimator.absorption() {
        AbsorptionMode::Analog => reflected(exact, exact.system(), c),
        // b_i += R_iE_s/p_i·ΠR over the earlier hits, at every hit of a walk that never ends: SInf eq. (3), β_is instead of
        // R_ib_is
        AbsorptionMode::Implicit => exact.squared().system.solve(&weighted_emittance(exact, c)).reflected,
        // At the first hit alone.
        AbsorptionMode::DirectOnly => {
            let sums = once(exact, &weighted_emittance(exact, c));
            sums.iter().zip(exact.reflectance()).map(|(sum, r)| r * sum).collect()
        }
    }
}

/// What every face reflects of light that comes straight from an emittance [W/m²].
fn once(exact: &Exact, emittance: &[f64]) -> Vec<f64> {
    let incoming = exact.exchange().incoming(emittance);
    let densities = incoming.iter().zip(exact.areas()).map(|(phi, area)| phi / area);
    densities.zip(exact.reflectance()).map(|(h, r)| r * h).collect()
}

impl VarianceTerms {
    /// The terms of every face, b being given.
    fn of(exact: &Exact, b: &[f64]) -> Vec<Self> {
        let face = |i: usize| VarianceTerms {
            b: b[i],
            r: exact.reflectance()[i],
            xi: exact.xi()[i],
            power_density: exact.total_power() / exact.areas()[i],
        };
        (0..exact.face_count()).map(face).collect()
    }
}

/// A source face s: R_s, E_s > 0, b_s [W/m²].
struct EmittingFace {
    r: f64,
    e: f64,
    b: f64,
}

/// c_sE_s of every face.
fn weighted_emittance(exact: &Exact, c: impl Fn(EmittingFace) -> f64) -> Vec<f64> {
    let weighted = |(face, &e): (usize, &f64)| {
        let (r, b) = (exact.reflectance()[face], exact.solution().reflected[face]);
        if e > 0.0 { c(EmittingFace { r, e, b }) * e } else { 0.0 }
    };
    exact.emittance().iter().enumerate().map(weighted).collect()
}

/// R_i Σ_s c_s b_is of every face.
fn reflected(exact: &Exact, system: &RadiositySystem, c: impl Fn(EmittingFace) -> f64) -> Vec<f64> {
    let sums = system.solve(&weighted_emittance(exact, c)).reflected;
    sums.iter().zip(exact.reflectance()).map(|(sum, r)| r * sum).collect()
}

/// A second moment over p_i, less the square of what is expected; `None` where p_i = 0.
fn per_birth(birth: &[f64], moments: Vec<f64>, expected: &[f64]) -> Vec<Option<f64>> {
    assert_eq!(birth.len(), expected.len(), "one probability per face");
    let central = |((moment, &b), &p): ((f64, &f64), &f64)| (p > 0.0).then(|| moment / p - b * b);
    moments.into_iter().zip(expected).zip(birth).map(central).collect()
}

fn has_black_source(exact: &Exact) -> bool {
    exact.emittance().iter().zip(exact.reflectance()).any(|(&e, &r)| e > 0.0 && r == 0.0)
}

/// The covariance of B_i [W²/m⁴] by absorption and by survival of one shooting walk (S97 proposition 2.19):
/// (R_i/A_i)² (Φ_Tξ_iφ_i − φ_i²).
pub fn shooting_covariance(exact: &Exact) -> Vec<f64> {
    let covariance = |VarianceTerms { b, r, xi, power_density }| r * power_density * xi * b - b * b;
    VarianceTerms::of(exact, &exact.solution().reflected).into_iter().map(covariance).collect()
}

/// The weight α of survival at which α·survival + (1 − α)·absorption has the least variance for shooting
/// walks (S97 §2.6): R_i (1 − ξ_i(1 − R_i)). At α = R_i the sum is the collision estimator.
pub fn best_shooting_weights(exact: &Exact) -> Vec<f64> {
    exact.reflectance().iter().zip(exact.xi()).map(|(r, xi)| r * (1.0 - xi * (1.0 - r))).collect()
}

/// The covariance of B_i [W²/m⁴] by absorption and by survival of one gathering walk (S97 §3.7):
/// (R_i/p_i) Σ_s b_sb_is/R_s − b_i². `None` as in [`Exact::gathering_variances`] for survival.
///
/// # Panics
/// Unless there is one probability per face.
pub fn gathering_covariance(exact: &Exact, birth: &[f64]) -> Vec<Option<f64>> {
    if has_black_source(exact) {
        return vec![None; birth.len()];
    }
    per_birth(birth, reflected(exact, exact.system(), |s| s.b / s.r), &exact.solution().reflected)
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
