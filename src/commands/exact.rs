//! `radwalk exact`: the radiosity system itself, without any randomness.

use report::{ExactSummary, OutputFolder};
use results::ExactAnswer;
use tracing::warn;
use voice::{Phase, say};

use crate::args::ExactArgs;
use crate::commands::coordinate::default_folder;
use crate::fault::{Fault, Outcome};

/// Solves a job's scene and writes `exact.csv` and `exact.json`; in colour, a pair for each channel.
pub(crate) fn exact(args: &ExactArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let job = job::load(&args.job.job, &args.job.overrides())?;
    // The job's own error messages know the line of the file that is at fault.
    let scene = job.build_scene()?;
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&job));
    let files: &[[&str; 2]] = if scene.channels() == 1 { &GREY_FILES } else { &CHANNEL_FILES };
    let folder = OutputFolder::claim(&path, files.as_flattened(), args.out.force)?;
    let answers = results::solve(&job, &scene, &|doing| phase.now(doing), &|part| phase.done(part))?;
    for (ExactAnswer { columns, summary }, [table, page]) in answers.iter().zip(files) {
        folder.write(table, |file| report::write_exact(file, scene.faces(), columns))?;
        folder.write(page, |file| summary.write(file))?;
        if !args.out.quiet {
            describe(summary);
        }
    }
    drop(phase);
    if !args.out.quiet {
        say(&format!("written to {}", folder.path().display()));
    }
    Ok(Outcome::Done)
}

const GREY_FILES: [[&str; 2]; 1] = [["exact.csv", "exact.json"]];

const CHANNEL_FILES: [[&str; 2]; 3] =
    [["exact_r.csv", "exact_r.json"], ["exact_g.csv", "exact_g.json"], ["exact_b.csv", "exact_b.json"]];

/// A few lines for people.
fn describe(summary: &ExactSummary) {
    say(&format!("{} patches solved to a residual of {:.1e}", summary.patches, summary.residual));
    say(&format!("form factors found {}", summary.form_factors));
    say(&format!(
        "their rows sum to {:.6} … {:.6} (1: no light is lost), with an error of at most {:.1e}",
        summary.row_sum_min, summary.row_sum_max, summary.row_error
    ));
    if let (Some(error), Some(face)) = (summary.max_relative_error, summary.worst_face()) {
        say(&format!("so radiosities err by at most {error:.1e} of themselves ({face})"));
    }
    if summary.undetermined > 0 {
        say(&format!("{} faces are too dark to tell: their errors exceed them", summary.undetermined));
    }
    for check in summary.checks.iter().filter(|check| !check.ok) {
        warn!("{}", check.message);
    }
}
