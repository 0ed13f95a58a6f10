//! Bounds on the error that hold before anything is solved (S97 §§2.2–2.5, 3.3–3.8, table 4).

use radiosity::{
    EstimatorKind, Scene,
    methods::{AbsorptionMode, Event},
};

use crate::answer::Exact;

/// The few numbers of a scene that S97's bounds depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct VarianceBounds {
    /// R_max: the largest reflectance.
    pub max_reflectance: f64,
    /// A_min: the area of the smallest patch [m²].
    pub min_area: f64,
    /// A_T: the area of all patches [m²].
    pub total_area: f64,
    /// Φ_T: the emitted power of all patches [W].
    pub total_power: f64,
    /// B̄ = max_s E_s/(1 − R_s) [W/m²]: no radiosity is higher, and b_i ≤ R_iB̄.
    pub max_radiosity: f64,
    /// Φ_s [W], R_s, E_s [W/m²] of every source.
    sources: Vec<[f64; 3]>,
}

impl VarianceBounds {
    /// The bounds of a scene; only areas, reflectances and emittances are looked at.
    pub fn of(exact: &Exact) -> Self {
        let faces = exact.areas().iter().zip(exact.reflectance()).zip(exact.emittance());
        Self::of_faces(faces.map(|((&area, &r), &e)| [area, r, e]))
    }

    /// The bounds of a scene that need not be solved, as one channel sees it.
    pub fn of_scene(scene: &Scene, channel: usize) -> Self {
        let face = |f: radiosity::surfaces::Face| [f.area, f.reflectance[channel], f.emittance[channel]];
        Self::of_faces(scene.faces().iter().map(face))
    }

    /// The bounds that A_i, R_i, E_i of every face imply.
    fn of_faces(faces: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut bounds = VarianceBounds {
            max_reflectance: 0.0,
            min_area: f64::INFINITY,
            total_area: 0.0,
            total_power: 0.0,
            max_radiosity: 0.0,
            sources: Vec::new(),
        };
        for [area, r, e] in faces {
            bounds.max_reflectance = bounds.max_reflectance.max(r);
            bounds.min_area = bounds.min_area.min(area);
            bounds.total_area += area;
            if e > 0.0 {
                bounds.total_power += area * e;
                bounds.max_radiosity = bounds.max_radiosity.max(e / (1.0 - r));
                bounds.sources.push([area * e, r, e]);
            }
        }
        bounds
    }

    /// No face has a higher variance of B_i [W²/m⁴] for one shooting walk: the closed forms with b_i ≤ R_iB̄, ξ_i ≤
    /// 1/(1 − R_i) and, of infinite walks, β_i ≤ R_i²B̄, all of the brightest and the smallest face there could be (as
    /// S97 §§2.2, 2.5). Direct light alone scores no more than collision.
    pub fn shooting_variance_of(&self, estimator: EstimatorKind) -> f64 {
        let r = self.max_reflectance;
        let factor = match estimator.event() {
            Event::Absorption => r * r,
            Event::Survival => r * (1.0 + r),
            Event::Arrival => r * r * (1.0 + r),
        };
        factor * self.total_power * self.max_radiosity / (self.min_area * (1.0 - r))
    }

    /// The bound on the variance of one gathering walk that is born on every face of interest with a probability of at least `least_birth`
    /// (as S97 §§3.3, 3.6); infinite for survival if a source does not reflect.
    pub fn gathering_variance_of(&self, estimator: EstimatorKind, least_birth: f64) -> f64 {
        let (r, b) = (self.max_reflectance, self.max_radiosity);
        let most = |c: fn(f64) -> f64| {
            self.sources.iter().map(|&[_, r_s, e]| (e + 2.0 * r_s * b) * c(r_s)).fold(0.0, f64::max)
        };
        let per_source = match estimator.event() {
            Event::Absorption => b,
            Event::Survival => most(f64::recip),
            Event::Arrival => most(|_| 1.0),
        };
        r * r * b * per_source / least_birth
    }

    /// No face has a higher variance of B_i [W²/m⁴] for one shooting walk scored by absorption (S97
    /// proposition 2.4): Φ_TB̄R_max²/(A_min(1 − R_max)).
    pub fn shooting_variance(&self) -> f64 {
        self.shooting_variance_of(EstimatorKind::Absorption)
    }

    /// No face has a higher variance of B_i [W²/m⁴] for one gathering walk, born with p_i = A_i/A_T and
    /// scored by absorption (S97 §3.3): A_TR_max²B̄²/A_min.
    pub fn gathering_variance(&self) -> f64 {
        self.gathering_variance_of(EstimatorKind::Absorption, self.min_area / self.total_area)
    }

    /// The number of shooting walks by absorption that brings every variance down to `variance` [W²/m⁴] (S97 §2.3).
    pub fn shooting_walks(&self, variance: f64) -> f64 {
        self.shooting_variance() / variance
    }

    /// The number of gathering walks by absorption, p_i = A_i/A_T, that brings every variance down to `variance` [W²/m⁴].
    pub fn gathering_walks(&self, variance: f64) -> f64 {
        self.gathering_variance() / variance
    }

    /// The area-weighted mean square error of one shooting walk [W²/m⁴] is expected to be below this (S97
    /// table 4).
    pub fn shooting_error(&self, estimator: EstimatorKind) -> f64 {
        let r = self.max_reflectance;
        let scale = self.total_power * self.total_power / (self.total_area * self.min_area);
        let factor = match (estimator.absorption(), estimator.event()) {
            (AbsorptionMode::Implicit, _) => r * r * (1.0 + r) / ((1.0 - r) * (1.0 - r * r)),
            (_, Event::Absorption) => r * r / (1.0 - r).powi(2),
            (_, Event::Survival) => r * (1.0 + r) / (1.0 - r).powi(2),
            (_, Event::Arrival) => r * r * (1.0 + r) / (1.0 - r).powi(2),
        };
        scale * factor
    }

    /// The bound on the mean square error of one gathering walk with p_i = A_i/A_T; infinite for survival if a source does not reflect.
    pub fn gathering_error(&self, estimator: EstimatorKind) -> f64 {
        let (r, b) = (self.max_reflectance, self.max_radiosity);
        let over_sources = |c: fn(f64) -> f64| -> f64 {
            self.sources.iter().map(|&[phi, r_s, e]| phi * (e + 2.0 * r_s * b) * c(r_s)).sum()
        };
        let factor = match (estimator.absorption(), estimator.event()) {
            (AbsorptionMode::Implicit, _) => over_sources(|_| 1.0) / (1.0 - r * r),
            (_, Event::Absorption) => b * self.total_power / (1.0 - r),
            (_, Event::Survival) => over_sources(f64::recip) / (1.0 - r),
            (_, Event::Arrival) => over_sources(|_| 1.0) / (1.0 - r),
        };
        r * r * factor / self.min_area
    }

    /// The number of rays that `walks` shooting walks trace in expectation, at most: N/(1 − R_max).
    pub fn shooting_rays(&self, walks: f64) -> f64 {
        walks / (1.0 - self.max_reflectance)
    }
}
