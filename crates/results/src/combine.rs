//! Mixtures of the sources of a result, from its tally alone.

use std::path::Path;

use radiosity::groups::Groups;

use crate::error::Error;
use crate::replica::{repack, unpack};
use crate::stored_run::StoredRun;

/// The result of a run with other factors of its sources: `set` names some, with what their emittances are multiplied by; all
/// others keep theirs, 1 unless the result is a mixture itself.
///
/// # Errors
/// Where the result cannot be read or tells no sources apart, a name is unknown or given twice, a factor cannot be, and where
/// nothing would emit.
pub fn combine(run: &Path, set: &[(String, f64)]) -> Result<StoredRun, Error> {
    mix(StoredRun::open(run)?, run, set)
}

/// [`combine`] for a result that is at hand; messages call it `run`.
///
/// # Errors
/// As [`combine`], but for reading.
pub fn mix(kept: StoredRun, run: &Path, set: &[(String, f64)]) -> Result<StoredRun, Error> {
    let StoredRun { mut checkpoint, settings, experiment } = kept;
    let refused = |problem: String, remedy: String| Error::Mixture { run: run.into(), problem, remedy };
    let names = experiment.groups().map_or(&[][..], Groups::sources);
    if names.is_empty() {
        let remedy = "run its job again with a [[source]] table for each group of emitters";
        return Err(refused("its walks were not told apart by source".into(), remedy.into()));
    }
    let mut factors = match settings.mixture.is_empty() {
        true => vec![1.0; names.len()],
        false => settings.mixture.clone(),
    };
    let mut given = vec![false; names.len()];
    for (name, factor) in set {
        let Some(number) = names.iter().position(|known| known == name) else {
            let problem = format!("it has no source {name:?}");
            return Err(refused(problem, format!("choose from {}", names.join(", "))));
        };
        if std::mem::replace(&mut given[number], true) {
            return Err(refused(format!("source {name:?} is set twice"), "set it once".into()));
        }
        if !(factor.is_finite() && *factor >= 0.0) {
            let problem = format!("{factor} is no factor of source {name:?}, whose light is added");
            return Err(refused(problem, "give a finite number that is 0 or more".into()));
        }
        factors[number] = *factor;
    }
    if factors.iter().all(|&factor| factor == 0.0) {
        let problem = "all sources are set to 0, and nothing emits".into();
        return Err(refused(problem, "leave one of them above 0".into()));
    }
    let job = repack(&checkpoint.book.job, |settings| settings.mixture = factors)
        .map_err(|problem| refused(problem, "choose smaller factors".into()))?;
    let (settings, experiment) =
        unpack(&job).map_err(|problem| refused(problem, "choose other factors".into()))?;
    checkpoint.book.job = job.into();
    Ok(StoredRun { checkpoint, settings, experiment })
}
