//! Noise and discretisation together, held against the total error that a job asks for.

use job::TotalTarget;
use radiosity::{Estimates, linear::AnswerError};
use stats::foresight;

/// Whether noise and discretisation keep within a total, and whether twice these walks will: they make the noise less, and the
/// patches no finer. `predicted` is the discretisation that a pilot predicted of the answer.
pub(super) fn meets(target: &TotalTarget, predicted: Option<f64>, estimates: &Estimates) -> [bool; 2] {
    let Some(AnswerError { noise, discretisation, .. }) = estimates.answer_error(predicted) else {
        return [false; 2];
    };
    let left = (target.total_error * target.total_error - discretisation * discretisation).max(0.0).sqrt();
    [left, foresight(left)].map(|left| left > 0.0 && noise <= left)
}

/// Whether a tally meets a total error, after `paths` paths, where a pilot predicted the discretisation of the answer or there was none.
pub fn total_is_met(target: &TotalTarget, predicted: Option<f64>, estimates: &Estimates, paths: u64) -> bool {
    paths >= target.min_paths && meets(target, predicted, estimates)[0]
}
