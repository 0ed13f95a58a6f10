//! `radwalk exact`: the radiosity system itself, without any randomness.

use exact::{Exact, GatherEstimator, WalkEstimator};
use radiosity::birth_probabilities;
use report::{ExactColumns, OutputFolder};

use crate::args::ExactArgs;
use crate::console::say;
use crate::coordinate::default_folder;
use crate::fault::{Fault, Outcome};

/// Solves a job's scene and writes `exact.csv`.
pub fn exact(args: &ExactArgs) -> Result<Outcome, Fault> {
    let job = job::load(&args.job.job, &args.job.overrides())?;
    // The job's own error messages know the line of the file that is at fault.
    let scene = job.build_scene()?;
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&job));
    let folder = OutputFolder::claim(&path, &["exact.csv"], args.out.force)?;
    let exact = Exact::of_scene(job.scene.spec())?;
    let columns = columns(&exact, &birth_probabilities(&scene, &job.method.birth));
    folder.write("exact.csv", |file| report::write_exact(file, &columns))?;
    if !args.out.quiet {
        say(&format!(
            "{} patches solved to a residual of {:.1e}",
            columns.radiosity.len(),
            exact.solution().residual
        ));
        say(&format!("form factor rows sum to 1 within {:.1e}", exact.exchange().closure_defect()));
        say(&format!("written to {}", folder.file("exact.csv").display()));
    }
    Ok(Outcome::Done)
}

/// The columns of `exact.csv`; `birth` is p_i of every patch.
fn columns(exact: &Exact, birth: &[f64]) -> ExactColumns {
    let solution = exact.solution();
    // What is not defined is no number, and becomes an empty cell.
    let or_none =
        |variances: Vec<Option<f64>>| variances.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect();
    ExactColumns {
        radiosity: solution.radiosity.clone(),
        reflected: solution.reflected.clone(),
        irradiance: solution.irradiance.clone(),
        xi: exact.xi().to_vec(),
        var_shoot: WalkEstimator::ALL.map(|estimator| Some(estimator.variances(exact))),
        var_gather: GatherEstimator::ALL.map(|estimator| Some(or_none(estimator.variances(exact, birth)))),
    }
}
