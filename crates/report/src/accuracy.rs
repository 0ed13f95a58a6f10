//! The errors of the answer, as `summary.json` shows them before a run and after it.

use radiosity::linear::{AnswerError, ReportedAnswer};
use serde::Serialize;

/// The relative errors over the area of what tables and pictures show, predicted by a pilot or found by a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AccuracySummary {
    /// `means` or `linear`: whether patches are described by the mean of their light or by a linear fit.
    pub answer: &'static str,
    /// What walks leave unknown.
    pub noise: f64,
    /// What patches are too coarse for.
    pub discretisation: f64,
    /// The root of the sum of both squares.
    pub total: f64,
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
    /// The errors of an answer.
    pub fn new(error: AnswerError, asked: Option<TotalSummary>) -> Self {
        let AnswerError { answer, noise, discretisation, total } = error;
        let answer = match answer {
            ReportedAnswer::Means => "means",
            ReportedAnswer::Linear => "linear",
        };
        AccuracySummary { answer, noise, discretisation, total, asked }
    }
}
