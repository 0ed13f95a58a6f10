//! Noise and discretisation, as `summary.json` shows them.

use radiosity::Accuracy;
use serde::Serialize;

/// [`Accuracy`] as the summary shows it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AccuracySummary {
    /// What walks leave unknown of the means of patches.
    pub noise: f64,
    /// What these means leave out of the light's spread over the patches.
    pub discretisation: f64,
    /// The root of the sum of both squares.
    pub total: f64,
    /// The noise of the linear fits.
    pub linear_noise: f64,
    /// What is asked of the total; absent where nothing is.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub asked: Option<TotalSummary>,
}

/// A total error that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TotalSummary {
    /// The relative error that is asked for.
    pub target: f64,
    /// Whether noise and discretisation together keep within it.
    pub reached: bool,
}

impl AccuracySummary {
    pub(crate) fn new(accuracy: Accuracy, asked: Option<TotalSummary>) -> Self {
        let Accuracy { noise, discretisation, total, linear_noise } = accuracy;
        AccuracySummary { noise, discretisation, total, linear_noise, asked }
    }
}
