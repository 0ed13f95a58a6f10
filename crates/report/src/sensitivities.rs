//! `sensitivities.csv`: the derivatives of every radiosity by the reflectances and emittances of materials.

use std::io::{self, Write};

use radiosity::sensitivity::{Derivative, Influences, Property};
use serde::Serialize;

use crate::patches::{per_channel, side_columns, side_heads};

/// How much one material matters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensitivitySummary {
    /// The name of the material.
    pub material: String,
    /// ∂B/∂R in the mean over the area and the channels [W/m²]. Not a number, `null` in JSON, where it is unknown in some channel: no walk tells what
    /// a black material would reflect.
    pub mean_derivative: f64,
    /// No less than the standard error of that mean: patches may err together.
    pub std_error_bound: f64,
    /// By which part the mean radiosity grows where the reflectance grows by 0.01.
    pub relative_change: f64,
}

impl SensitivitySummary {
    /// Whether it is known how much the material matters.
    pub fn is_known(&self) -> bool {
        self.mean_derivative.is_finite()
    }
}

/// How much each material matters, the one that matters most first; those of which it is unknown are the last.
pub fn sensitivity_summaries(influences: &Influences) -> Vec<SensitivitySummary> {
    let scene = influences.estimates().scene();
    let channels = scene.channels() as f64;
    let (mut area, mut light) = (0.0, 0.0);
    for (_, face, known) in influences.estimates().known() {
        area += face.area;
        light += face.area * known.iter().map(|estimate| estimate.radiosity).sum::<f64>() / channels;
    }
    let summary = |(number, material): (usize, &radiosity::sensitivity::SensitivityMaterial)| {
        let (mut change, mut error) = (0.0, 0.0);
        for (i, face) in scene.faces().iter().enumerate() {
            for by in influences.of(number, Property::Reflectance, i) {
                let (value, std_error) = match by {
                    Some(by) => (by.value, by.std_error.unwrap_or(f64::INFINITY)),
                    None => (f64::NAN, f64::NAN),
                };
                change += face.area * value / channels;
                error += face.area * std_error / channels;
            }
        }
        SensitivitySummary {
            material: material.name.clone(),
            mean_derivative: change / area,
            std_error_bound: error / area,
            relative_change: 0.01 * change / light,
        }
    };
    let mut summaries: Vec<SensitivitySummary> =
        influences.materials().iter().enumerate().map(summary).collect();
    summaries.sort_by(|a, b| {
        b.is_known().cmp(&a.is_known()).then(b.mean_derivative.total_cmp(&a.mean_derivative))
    });
    summaries
}

/// A column that each channel has, and where its values are from.
type DerivativeColumn = (&'static str, fn(&Derivative) -> Option<f64>);

/// Writes the derivatives: of each material those by its reflectance, then, where all its emitters are alike, those by its
/// emittance.
///
/// # Errors
/// Those of `writer`.
pub fn write_sensitivities(writer: impl Write, influences: &Influences) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let scene = influences.estimates().scene();
    let columns: [DerivativeColumn; 4] = [
        ("derivative", |d| Some(d.value).filter(|_| !d.is_unsampled())),
        ("std_error", |d| d.std_error.filter(|_| !d.is_unsampled())),
        ("ci_low", |d| Some(d.ci_low)),
        ("ci_high", |d| Some(d.ci_high)),
    ];
    let heads = ["material", "property", "patch"].into_iter().chain(side_heads(scene)).map(String::from);
    let light = columns.iter().flat_map(|(name, _)| per_channel(name, scene.channels()));
    table.write_record(heads.chain(light))?;
    for (number, material) in influences.materials().iter().enumerate() {
        let by_emittance = material.emittance.map(|_| (Property::Emittance, "emittance"));
        for (property, word) in [(Property::Reflectance, "reflectance")].into_iter().chain(by_emittance) {
            for i in scene.faces().by_patch() {
                let face = scene.faces().get(i);
                let known = influences.of(number, property, i);
                let values: Vec<Option<f64>> = columns
                    .iter()
                    .flat_map(|(_, of)| known.iter().map(move |d| d.as_ref().and_then(of)))
                    .collect();
                table.serialize((&material.name, word, face.patch, side_columns(scene, &face), values))?;
            }
        }
    }
    table.flush()
}
