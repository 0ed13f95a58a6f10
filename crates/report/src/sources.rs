//! `sources.csv`: what each source does to each patch, in the order of the job and of `patches.csv`.

use parallel::run_on_all_cores;
use std::io::{self, Write};

use radiosity::{Estimate, Estimates, Experiment, Tally, precision::Quantity};
use serde::Serialize;

use crate::patches::{known_error, per_channel, side_columns, side_heads};

/// What is reported of one source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SourceSummary {
    /// The name of the source.
    pub name: String,
    /// Faces and lamps without area that are emitters of it.
    pub emitters: usize,
    /// What they emit, all channels together [W].
    pub power: f64,
    /// What its emittances are multiplied by; absent where no mixture is reported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Half-width over estimate of its light alone, which half of the area does not exceed; `null` where it gives no light.
    pub relative_error: f64,
}

/// What is reported of the sources of an experiment; nothing where it has none.
pub fn source_summaries(experiment: &Experiment, tally: &Tally, confidence: f64) -> Vec<SourceSummary> {
    let names = experiment.groups().map_or(&[][..], |groups| groups.sources());
    let summary = |(number, name): (usize, &String)| {
        let estimates = Estimates::of_source(experiment, tally, confidence, number)?;
        let lit = || estimates.iter().map(|(_, face, _)| face).filter(|face| face.emittance.is_lit());
        let channels = estimates.scene().channels();
        let power = |face: &radiosity::surfaces::Face| (0..channels).map(|c| face.power(c)).sum::<f64>();
        let is_own =
            |&lamp: &usize| experiment.groups().is_some_and(|groups| groups.source_of_lamp(lamp) == number);
        let lamps = || (0..estimates.scene().lamp_count()).filter(is_own);
        let of_lamp = |lamp: usize| -> f64 {
            (0..channels).map(|channel| estimates.scene().lamp_power(lamp, channel)).sum()
        };
        Some(SourceSummary {
            name: name.clone(),
            emitters: lit().count() + lamps().filter(|&lamp| of_lamp(lamp) > 0.0).count(),
            // Not by `sum`, which says −0 of no emitters.
            power: lit().map(|face| power(&face)).chain(lamps().map(of_lamp)).fold(0.0, |sum, own| sum + own),
            factor: experiment.mixture().map(|factors| factors[number]),
            relative_error: estimates.precision(Quantity::Irradiance, &run_on_all_cores).headline.quantiles
                [0],
        })
    };
    names.iter().enumerate().filter_map(summary).collect()
}

/// Columns that each channel has, and where their values are from.
type SourceColumn = (&'static str, fn(f64, &Estimate) -> Option<f64>);
const LIGHT: [SourceColumn; 9] = [
    ("emittance", |emittance, _| Some(emittance)),
    ("radiosity", |_, e| e.known_radiosity()),
    ("std_error", |_, e| known_error(e)),
    ("ci_low", |_, e| Some(e.ci_low)),
    ("ci_high", |_, e| Some(e.ci_high)),
    ("irradiance", |_, e| e.irradiance),
    ("irradiance_error", |_, e| e.irradiance_error),
    ("irradiance_low", |_, e| e.irradiance_interval.map(|[low, _]| low)),
    ("irradiance_high", |_, e| e.irradiance_interval.map(|[_, high]| high)),
];

/// Writes what each source does to each patch; every interval has the level `confidence`.
///
/// # Errors
/// Those of `writer`.
pub fn write_sources(
    writer: impl Write,
    experiment: &Experiment,
    tally: &Tally,
    confidence: f64,
) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let names = experiment.groups().map_or(&[][..], |groups| groups.sources());
    let scene = Estimates::new(experiment, tally, confidence).scene();
    let (faces, channels) = (scene.faces(), scene.channels());
    let light = LIGHT.iter().flat_map(|(name, _)| per_channel(name, channels));
    let heads = ["source", "patch"].into_iter().chain(side_heads(scene)).map(String::from);
    table.write_record(heads.chain(light).chain(["hits".into()]))?;
    for (number, name) in names.iter().enumerate() {
        let Some(estimates) = Estimates::of_source(experiment, tally, confidence, number) else { continue };
        for i in faces.by_patch() {
            let (face, known) = estimates.face_estimate(i);
            let known = known.as_deref();
            let light: Vec<Option<f64>> = LIGHT
                .iter()
                .flat_map(|(_, of)| (0..channels).map(move |c| of(face.emittance[c], &known?[c])))
                .collect();
            let hits = known.map(|channels| channels[0].hits);
            table.serialize((name, face.patch, side_columns(scene, &face), light, hits))?;
        }
    }
    table.flush()
}
