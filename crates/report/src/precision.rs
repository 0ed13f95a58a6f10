//! How well the patches are known, as the summary shows it.

use std::collections::BTreeMap;

use radiosity::{Apart, Precision, Scene};
use serde::Serialize;

use crate::patches::face_words;

/// [`Precision`] as the summary shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrecisionSummary {
    /// Area-weighted root mean square of half-width over estimate.
    pub rms_relative_error: f64,
    /// The largest of them; infinite while a reflecting patch was never hit.
    pub max_relative_error: f64,
    /// The patch that has it.
    pub worst_patch: Option<u32>,
    /// The worst patch as messages name it.
    #[serde(skip)]
    pub worst_place: Option<String>,
    /// What parts of the area of the reflecting patches do not exceed, without those counted separately below.
    pub error_quantiles: BTreeMap<&'static str, f64>,
    /// Reflecting patches that no walk has hit, and their part of the area.
    pub unhit: ApartSummary,
    /// Patches that walks have hit, each below a millionth of the area.
    pub tiny: ApartSummary,
}

/// Patches that are counted separately.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ApartSummary {
    /// The number of these patches.
    pub patches: u64,
    /// Their part of the area of all reflecting patches that do not emit.
    pub area: f64,
}

impl From<Apart> for ApartSummary {
    fn from(Apart { faces, area }: Apart) -> Self {
        ApartSummary { patches: faces, area }
    }
}

impl PrecisionSummary {
    pub(crate) fn new(scene: &Scene, precision: &Precision) -> Self {
        PrecisionSummary {
            rms_relative_error: precision.rms_relative_error,
            max_relative_error: precision.max_relative_error,
            worst_patch: precision.worst_face.map(|face| scene.faces().get(face as usize).patch),
            error_quantiles: ["0.5", "0.9", "0.99"].into_iter().zip(precision.quantiles).collect(),
            unhit: precision.unhit.into(),
            tiny: precision.tiny.into(),
            worst_place: precision.worst_face.map(|face| face_words(scene, face as usize)),
        }
    }
}
