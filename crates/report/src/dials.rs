//! What the sliders of a page need: the scores of each source, from which the page makes the light of any mixture of them.

use std::io::{self, Write};

use radiosity::{
    Estimates,
    groups::{Groups, SourceScores},
};
use serde::Serialize;

/// The sources of a result, and what makes intervals of their scores.
#[derive(Serialize)]
pub(crate) struct Dials<'a> {
    /// In the order of the job.
    names: &'a [String],
    /// What the emittance of each is multiplied by in what the page shows.
    factors: Vec<f64>,
    /// N, the number of walks.
    walks: u64,
    /// One unit of score, in hits.
    unit: f64,
    /// The chance of an interval to lie above the truth.
    tail: f64,
    /// The normal deviate that is exceeded with this chance.
    deviate: f64,
    /// By channel, whether each source emits in it.
    lit: Vec<Vec<bool>>,
    /// The sizes of scores, channel by channel ([`stats::Sizes::classes`]). Empty: all are worth the same.
    sizes: Vec<Vec<[f64; 3]>>,
}

impl<'a> Dials<'a> {
    /// The sources of a result whose intervals have the level `confidence`; `None` where they are not distinguished.
    pub(crate) fn of(estimates: &Estimates<'a>, confidence: f64) -> Option<Self> {
        let experiment = estimates.experiment();
        let names = experiment.groups().map(Groups::sources).filter(|names| !names.is_empty())?;
        let tail = 0.5 * (1.0 - confidence);
        let groups = experiment.groups()?;
        let channels = || 0..estimates.scene().channels();
        let lit = |channel: usize| (0..names.len()).map(|source| groups.is_lit(source, channel)).collect();
        Some(Dials {
            names,
            lit: channels().map(lit).collect(),
            factors: experiment.mixture().map_or_else(|| vec![1.0; names.len()], <[f64]>::to_vec),
            walks: estimates.tally().counts.walks,
            unit: estimates.by_source(0, 0)?.meaning.unit,
            tail,
            deviate: -stats::normal_quantile(tail),
            sizes: channels()
                .map(|channel| {
                    estimates.sizes_of_scores(channel).into_iter().flat_map(|of| of.classes()).collect()
                })
                .collect(),
        })
    }
}

/// Writes the scores of all sources as planes of little-endian 64-bit floats, a number for each row of the page's table: the number of
/// the source that the row is an emitter of, or −1; what the probabilities of sizes are multiplied by; then for each channel E [W/m²], H for each hit [W/m²] (NaN where the
/// estimator does not give it), the bound on E[x²]/E[x], and of each source Σx and Σx².
///
/// # Errors
/// Those of `writer`.
pub(crate) fn write_scores(writer: &mut impl Write, estimates: &Estimates) -> io::Result<()> {
    let walked = estimates.experiment().scene().faces();
    let rows: Vec<Vec<f64>> = walked.pieces_by_patch().map(|(face, _)| row(estimates, face)).collect();
    for plane in 0..rows[0].len() {
        rows.iter().try_for_each(|row| writer.write_all(&row[plane].to_le_bytes()))?;
    }
    Ok(())
}

/// The numbers of one face, a plane each.
fn row(estimates: &Estimates, face: usize) -> Vec<f64> {
    let emittance = estimates.experiment().scene().faces().get(face).emittance;
    let mut row = vec![estimates.source_of(face).map_or(-1.0, |source| source as f64)];
    for channel in 0..estimates.scene().channels() {
        let SourceScores { sums, meaning, scale } =
            estimates.by_source(face, channel).expect("shooting walks tell of every face");
        if channel == 0 {
            row.push(scale);
        }
        row.extend([
            emittance[channel],
            meaning.irradiance_per_event.unwrap_or(f64::NAN),
            meaning.ratio_bound,
        ]);
        row.extend(sums.into_iter().flatten());
    }
    row
}
