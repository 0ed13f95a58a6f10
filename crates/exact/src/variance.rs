//! The exact variance of B_i for one walk (S97 table 3; BS eq. 19), estimator by estimator.
//!
//! Discrete walks, source-term suppression: the estimate is of b_i. Divide by the number of walks.

use crate::answer::Exact;

/// An unbiased way to score a walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WalkEstimator {
    /// Shooting, φ_i += Φ_T/(1 − R_i) where the walk dies.
    ShootAbsorption,
    /// Shooting, φ_i += Φ_T/R_i at every hit but the last.
    ShootSurvival,
    /// Shooting, φ_i += Φ_T at every hit.
    ShootCollision,
}

/// What the variance on one patch is made of.
struct Terms {
    /// b_i [W/m²].
    b: f64,
    /// R_i.
    r: f64,
    /// ξ_i.
    xi: f64,
    /// Φ_T/A_i [W/m²].
    power_density: f64,
}

impl WalkEstimator {
    /// Every estimator, in the order of tables.
    pub const ALL: [WalkEstimator; 3] =
        [WalkEstimator::ShootAbsorption, WalkEstimator::ShootSurvival, WalkEstimator::ShootCollision];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            WalkEstimator::ShootAbsorption => "shoot_absorption",
            WalkEstimator::ShootSurvival => "shoot_survival",
            WalkEstimator::ShootCollision => "shoot_collision",
        }
    }

    /// The variance of B_i [W²/m⁴] for one walk, patch by patch; 0 where R_i = 0.
    pub fn variances(self, exact: &Exact) -> Vec<f64> {
        (0..exact.exchange().patch_count()).map(|i| self.variance(&Terms::of(exact, i))).collect()
    }

    /// Every row of S97 table 3 has the form b (E\[score²\]/b − b), b being the expected score.
    fn variance(self, &Terms { b, r, xi, power_density }: &Terms) -> f64 {
        let second_over_first = match self {
            // S97 corollary 2.3
            WalkEstimator::ShootAbsorption => r * power_density / (1.0 - r),
            // S97 corollary 2.11; R_i (1/R_i + 2ξ_i) written so as to be finite at R_i = 0
            WalkEstimator::ShootSurvival => power_density * (1.0 + 2.0 * r * xi),
            // BS eq. (19)
            WalkEstimator::ShootCollision => r * power_density * (1.0 + 2.0 * r * xi),
        };
        b * (second_over_first - b)
    }
}

impl Terms {
    fn of(exact: &Exact, i: usize) -> Self {
        Terms {
            b: exact.solution().reflected[i],
            r: exact.system().reflectance()[i],
            xi: exact.xi()[i],
            power_density: exact.total_power() / exact.exchange().areas()[i],
        }
    }
}
