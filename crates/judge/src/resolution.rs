//! Whether patches are fine enough for the light on them.

use job::Forecast;
use radiosity::{Estimates, linear::Accuracy};
use report::words::percent;
use report::{Verdict, face_words};

/// Discretisation below this part of the light is not worth a word.
const WORTH_A_WORD: f64 = 0.02;

/// Patches that are named.
const NAMED: usize = 5;

/// An energy counts as seen where it exceeds this number of its standard errors.
const SEEN: f64 = 2.0;

/// Whether patches are fine enough that more walks help more than finer patches, and why.
pub(crate) fn resolution(estimates: &Estimates) -> (Verdict, String) {
    if !estimates.experiment().method().is_linear() {
        return (
            Verdict::NotExamined,
            "how light is spread over patches was not asked for; basis = \"linear\" tells it".into(),
        );
    }
    let Some(Accuracy { noise, discretisation, .. }) = estimates.accuracy() else {
        return (
            Verdict::NotExamined,
            "too little light was found to tell how it is spread over patches".into(),
        );
    };
    let found = format!(
        "the means of patches err by {} of the light for want of walks, and by {} for want of finer patches",
        percent(noise),
        percent(discretisation)
    );
    if discretisation <= noise.max(WORTH_A_WORD) {
        return (Verdict::Passed, found);
    }
    let remedy = format!(
        "cut the patches finer, or take the gradients into account; most is lost on {}",
        coarsest(estimates)
    );
    (Verdict::Failed, format!("{found}: {remedy}"))
}

/// Patches that a pilot chose for linear fits balance both errors, at the edges of shadows with twice the noise's energy: discretisation
/// beyond this part of the noise is that of other walks than the patches were chosen for, or of patches that the choice could not cut.
const BALANCED: f64 = 2.0;

/// Whether linear fits on chosen patches lose less than walks leave unknown, as far as the pilot has predicted it.
pub(crate) fn resolution_of_fits(estimates: &Estimates, chosen: &Forecast) -> (Verdict, String) {
    let Some(Accuracy { linear_noise, .. }) = estimates.accuracy() else {
        return (
            Verdict::NotExamined,
            "too little light was found to tell how it is spread over patches".into(),
        );
    };
    let found = format!(
        "linear fits err by {} of the light for want of walks, and by {}, as predicted, for want of finer patches",
        percent(linear_noise),
        percent(chosen.discretisation)
    );
    if chosen.discretisation <= (BALANCED * linear_noise).max(WORTH_A_WORD) {
        return (Verdict::Passed, found);
    }
    let walked = estimates.tally().counts.walks * estimates.experiment().unit().paths();
    let remedy = match walked > chosen.for_paths.saturating_mul(2) {
        true => "choose patches anew for this number of paths",
        false => "more paths cut them finer, and scene.patches = \"auto\" those that a scene file states",
    };
    (Verdict::Failed, format!("{found}: {remedy}"))
}

/// The faces that most is lost on, in words.
fn coarsest(estimates: &Estimates) -> String {
    let mut lost: Vec<(f64, usize)> = estimates
        .known()
        .filter_map(|(i, face, _)| {
            let slopes = estimates.slopes(i)?;
            let energy: f64 = slopes.iter().map(|s| s.energy).sum();
            let error: f64 = slopes.iter().filter_map(|s| s.energy_error).sum();
            (energy > SEEN * error).then_some((face.area * energy, i))
        })
        .collect();
    lost.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let named = lost.iter().take(NAMED).map(|&(_, i)| face_words(estimates.scene(), i));
    let named: Vec<String> = named.collect();
    match named.len() {
        0 => "no patch that stands out".into(),
        _ => named.join("; "),
    }
}
