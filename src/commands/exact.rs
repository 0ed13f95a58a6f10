//! `radwalk exact`: the radiosity system itself, without any randomness.

use exact::Exact;
use job::{Grouping, Groups};
use report::{ExactSummary, OutputFolder};
use results::ExactAnswer;
use tracing::warn;
use voice::{Phase, say};

use crate::args::ExactArgs;
use crate::choose::load_anew;
use crate::commands::coordinate::default_folder;
use crate::fault::{Fault, Outcome};

/// Solves a job's scene and writes `exact.csv` and `exact.json`; in colour, a pair for each channel.
pub(crate) fn exact(args: &ExactArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let job = load_anew(&args.job, &phase)?;
    // The job's own error messages know the line of the file that is at fault.
    let scene = job.build_scene()?;
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&job));
    let files: &[[&str; 3]] = if scene.channels() == 1 { &GREY_FILES } else { &CHANNEL_FILES };
    let folder = OutputFolder::claim(&path, files.as_flattened(), args.out.force)?;
    let answers = results::solve(&job, &scene, &|doing| phase.now(doing), &|part| phase.done(part))?;
    let names = (scene.faces().len() <= MOST_FACTORS)
        .then(|| Groups::of(&Grouping::ByPatch, &job.scene, &scene).map(|groups| groups.names))
        .transpose()?;
    for (ExactAnswer { exact, columns, summary }, [table, page, factors]) in answers.iter().zip(files) {
        folder.write(table, |file| report::write_exact(file, scene.faces(), columns))?;
        folder.write(page, |file| summary.write(file))?;
        if let Some(names) = &names {
            folder
                .write(factors, |file| report::write_exact_factors(file, names, |i| factors_of(exact, i)))?;
        }
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

/// The most faces whose factors are written: every pair of them is a row.
const MOST_FACTORS: usize = 512;

const GREY_FILES: [[&str; 3]; 1] = [["exact.csv", "exact.json", "exact-factors.csv"]];

const CHANNEL_FILES: [[&str; 3]; 3] = [
    ["exact_r.csv", "exact_r.json", "exact-factors_r.csv"],
    ["exact_g.csv", "exact_g.json", "exact-factors_g.csv"],
    ["exact_b.csv", "exact_b.json", "exact-factors_b.csv"],
];

/// F_ij and B_ij from face i to every face: what meets it first, and what it absorbs of what face i alone emits.
fn factors_of(exact: &Exact, i: usize) -> Vec<[f64; 2]> {
    let mut emittance = vec![0.0; exact.face_count()];
    emittance[i] = 1.0 / exact.areas()[i];
    let incoming = exact.system().solve(&emittance).incoming;
    let absorbed =
        incoming.iter().zip(exact.reflectance()).map(|(phi, reflectance)| (1.0 - reflectance) * phi);
    absorbed.enumerate().map(|(j, absorbed)| [exact.exchange().form_factor(i, j), absorbed]).collect()
}

/// A few lines for people.
fn describe(summary: &ExactSummary) {
    say(&format!("{} patches solved to a residual of {:.1e}", summary.patches, summary.residual));
    say(&format!("form factors found {}", summary.form_factors));
    say(&format!(
        "their rows sum to {:.6} … {:.6} (1: no light is lost), with an error of at most {:.1e}",
        summary.row_sum_min, summary.row_sum_max, summary.row_error
    ));
    if let (Some(error), Some(face)) = (summary.max_relative_error, summary.worst_face()) {
        say(&format!("so the relative error of radiosities is at most {error:.1e} ({face})"));
    }
    if summary.undetermined > 0 {
        say(&format!("{} faces are too dark: their errors exceed their radiosities", summary.undetermined));
    }
    for check in summary.checks.iter().filter(|check| !check.ok) {
        warn!("{}", check.message);
    }
}
