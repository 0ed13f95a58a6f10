//! The estimators: what a walk scores, where, and what that is worth. All differences between estimators are here:
//! the [`Event`] that scores, and the [`AbsorptionMode`] of its walks. Predictions of variances (the crate `exact`) go by these two.
//!
//! A shooting walk carries Φ_T, a gathering walk looks for E. Each scores at one kind of [`Event`], whose probability after
//! an arrival on face j is p_j; a score is worth 1/p_j of what the walk carries, so that its expectation does not depend on
//! the kind of event (S97 propositions 2.1, 2.9, 2.14 for shooting; 3.1, 3.5, 3.6 for gathering):
//!
//! | estimator | event | p_j | shooting: φ_j += | its variance | gathering: b_i += (weight 1) | its variance |
//! |---|---|---|---|---|---|---|
//! | absorption | the walk dies | 1 − R_j | Φ_T/(1 − R_j) | S97 corollary 2.3 | R_i E_j/(p_i (1 − R_j)) | S97 eq. (10) |
//! | survival | it survives | R_j | Φ_T/R_j | S97 corollary 2.11 | R_i E_j/(p_i R_j) | S97 eq. (13) |
//! | collision | it arrives | 1 | Φ_T | S97 corollary 2.16, BS eq. (19) | R_i E_j/p_i | S97 eq. (14) |
//! | infinite | it arrives, with weight ΠR | 1 | Φ_T·ΠR | SInf eq. (2) | R_i ΠR E_j/p_i | SInf eq. (3) |
//! | direct | it arrives for the first time | 1 | Φ_T | collision's without 2R_iξ_i | R_i E_j/p_i | collision's without 2b_s |
//!
//! These five pairs of an event and an absorption mode are all that there are. A walk by weights survives surely until it ends, and a walk
//! that ends with its first arrival never survives: 1/p_j with the p_j above would be the wrong worth of their survivals and
//! absorptions.

use serde::{Deserialize, Serialize};

use super::collision::InfiniteEnd;
use crate::simd::batch::{Decisions, Lanes};

/// Which events of a walk score (S97 §2, §3).
///
/// ```
/// use radiosity::EstimatorKind;
///
/// assert_eq!(EstimatorKind::default().word(), "collision");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EstimatorKind {
    /// The absorption at its end.
    Absorption,
    /// Every hit that it survives.
    Survival,
    /// Every hit of a walk.
    #[default]
    Collision,
    /// Every hit of a walk that is never absorbed, by weight (SInf).
    Infinite,
    /// The first hit alone: direct light (Sh91's first stage).
    Direct,
}

/// An estimator with all that it needs to know.
///
/// ```
/// use radiosity::{Estimator, EstimatorKind, methods::InfiniteEnd};
///
/// let infinite = EstimatorKind::Infinite.ending(InfiniteEnd::default());
/// assert_eq!((infinite.kind(), Estimator::Direct.kind()), (EstimatorKind::Infinite, EstimatorKind::Direct));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimator {
    /// The absorption at the end of a walk scores.
    Absorption,
    /// Every hit that a walk survives scores.
    Survival,
    /// Every hit of a walk scores.
    Collision,
    /// Every hit scores, by weight, of a walk that is never absorbed (SInf) until this end.
    Infinite(InfiniteEnd),
    /// The first hit alone scores: direct light.
    Direct,
}

/// What happens to a walk where it has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The walk has arrived.
    Arrival,
    /// The walk survives the hit.
    Survival,
    /// The walk is absorbed.
    Absorption,
}

/// The treatment of absorption at a hit, which decides how the walk goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbsorptionMode {
    /// The walk survives by chance.
    Analog,
    /// The walk always survives, and loses weight.
    Implicit,
    /// The walk ends with its first arrival.
    DirectOnly,
}

/// How often one walk may score on the same face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Repeats {
    /// Once at most per walk.
    Never,
    /// At every visit, and each score has the same value.
    Equal,
    /// At every visit, each worth less by the reflectances between.
    Weakening,
}

impl EstimatorKind {
    /// All estimators, in the order in which messages list them.
    pub const ALL: &'static [Self] =
        &[Self::Absorption, Self::Survival, Self::Collision, Self::Infinite, Self::Direct];

    /// The name of the estimator in job files and outputs.
    pub fn word(self) -> &'static str {
        match self {
            EstimatorKind::Absorption => "absorption",
            EstimatorKind::Survival => "survival",
            EstimatorKind::Collision => "collision",
            EstimatorKind::Infinite => "infinite",
            EstimatorKind::Direct => "direct",
        }
    }

    /// The estimator, whose walks, where they are infinite, end so.
    pub fn ending(self, end: InfiniteEnd) -> Estimator {
        match self {
            EstimatorKind::Absorption => Estimator::Absorption,
            EstimatorKind::Survival => Estimator::Survival,
            EstimatorKind::Collision => Estimator::Collision,
            EstimatorKind::Infinite => Estimator::Infinite(end),
            EstimatorKind::Direct => Estimator::Direct,
        }
    }

    /// The event that scores.
    pub fn event(self) -> Event {
        match self {
            EstimatorKind::Absorption => Event::Absorption,
            EstimatorKind::Survival => Event::Survival,
            EstimatorKind::Collision | EstimatorKind::Infinite | EstimatorKind::Direct => Event::Arrival,
        }
    }

    /// How its walks go on.
    pub fn absorption(self) -> AbsorptionMode {
        match self {
            EstimatorKind::Absorption | EstimatorKind::Survival | EstimatorKind::Collision => {
                AbsorptionMode::Analog
            }
            EstimatorKind::Infinite => AbsorptionMode::Implicit,
            EstimatorKind::Direct => AbsorptionMode::DirectOnly,
        }
    }

    pub(crate) fn repeats(self) -> Repeats {
        match (self.absorption(), self.event()) {
            (AbsorptionMode::DirectOnly, _) | (AbsorptionMode::Analog, Event::Absorption) => Repeats::Never,
            (AbsorptionMode::Analog, Event::Arrival | Event::Survival) => Repeats::Equal,
            (AbsorptionMode::Implicit, _) => Repeats::Weakening,
        }
    }

    /// Whether one walk may score several times on the same face.
    pub fn scores_again(self) -> bool {
        self.repeats() != Repeats::Never
    }

    /// Whether walks may go on after their first hit.
    pub fn goes_on(self) -> bool {
        self.absorption() != AbsorptionMode::DirectOnly
    }

    /// The probability that a walk scores where it has arrived, on a surface that walks survive with probability σ.
    pub fn probability(self, survival: f64) -> f64 {
        self.event().probability(survival)
    }
}

impl Event {
    /// The walks of a batch that score.
    #[inline(always)]
    pub(crate) fn scoring(self, decided: &Decisions) -> Lanes {
        match self {
            Event::Arrival => decided.arrived,
            Event::Survival => decided.survived,
            Event::Absorption => decided.died,
        }
    }

    /// The probability of the event after an arrival, on a surface that walks survive with probability σ.
    pub fn probability(self, survival: f64) -> f64 {
        match self {
            Event::Arrival => 1.0,
            Event::Survival => survival,
            Event::Absorption => 1.0 - survival,
        }
    }
}

impl Estimator {
    /// The event that scores.
    pub(crate) fn event(self) -> Event {
        self.kind().event()
    }

    /// The kind of the estimator, without its parameters.
    pub fn kind(self) -> EstimatorKind {
        match self {
            Estimator::Absorption => EstimatorKind::Absorption,
            Estimator::Survival => EstimatorKind::Survival,
            Estimator::Collision => EstimatorKind::Collision,
            Estimator::Infinite(_) => EstimatorKind::Infinite,
            Estimator::Direct => EstimatorKind::Direct,
        }
    }

    /// How walks end that are never absorbed by chance; `None` for all others.
    pub fn infinite_end(self) -> Option<InfiniteEnd> {
        match self {
            Estimator::Infinite(end) => Some(end),
            Estimator::Absorption | Estimator::Survival | Estimator::Collision | Estimator::Direct => None,
        }
    }
}

impl From<EstimatorKind> for Estimator {
    /// Infinite walks end as by default in a job.
    fn from(kind: EstimatorKind) -> Self {
        kind.ending(InfiniteEnd::default())
    }
}

/// Runs `$body` with the collision model of the walks of an estimator: `Analog` or `Coloured` where chance alone absorbs them.
macro_rules! with_collision_model {
    ($Chance:ident, $estimator:expr, |$model:ident| $body:expr) => {
        match $estimator {
            $crate::walk::estimator::Estimator::Infinite(end) => {
                let $model = $crate::walk::collision::Infinite::new(end);
                $body
            }
            estimator => {
                let $model = $crate::walk::collision::$Chance::of(estimator.kind().goes_on());
                $body
            }
        }
    };
}

pub(crate) use with_collision_model;
