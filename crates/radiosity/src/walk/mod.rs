//! Walks: one as the papers write it ([`plain`]), and many side by side through the same verbs ([`batch`]): leave, trace,
//! arrive, survive or die, score.

pub(crate) mod arrive;
pub(crate) mod batch;
pub(crate) mod collision;
pub(crate) mod depart;
pub(crate) mod estimator;
pub(crate) mod exchanged;
pub(crate) mod light_groups;
mod linear;
pub(crate) mod marks;
mod newborns;
pub(crate) mod plain;
pub(crate) mod score;
pub(crate) mod skies;
pub(crate) mod spots;
mod visits;
pub(crate) mod weighted;

use serde::{Deserialize, Serialize};

/// Where a surviving walk goes on from (BS §2).
///
/// ```
/// use radiosity::{EstimatorKind, Method, Space};
///
/// assert_eq!(Method::shooting(EstimatorKind::Collision).space(), Space::Discrete);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Space {
    /// A fresh uniform point of the patch that was hit: the expectation solves the radiosity system.
    #[default]
    Discrete,
    /// The hit point: the expectation is the average of the integral equation's solution.
    Continuous,
}
