//! `radwalk exact`: the radiosity system itself, without any randomness.

use job::{FaceGroups, Grouping};
use report::{OutputFolder, Verdict};
use results::ExactAnswer;
use tracing::warn;
use voice::Phase;

use crate::args::ExactArgs;
use crate::choose::load_written;
use crate::commands::coordinate::default_folder;
use crate::fault::{Fault, Outcome};

/// Solves a job's scene and writes `exact.csv` and `exact.json`; in colour, a pair for each channel.
pub(crate) fn exact(args: &ExactArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let read = load_written(&args.job, &phase)?;
    // The job's own error messages know the line of the file that is at fault.
    let (scene, job) = read.build()?;
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&job));
    let files: &[[&str; 3]] = if scene.channels() == 1 { &GREY_FILES } else { &CHANNEL_FILES };
    let folder = OutputFolder::claim(&path, files.as_flattened(), args.out.force)?;
    let answers = results::solve(&job, &scene, &|doing| phase.now(doing), &|part| phase.done(part))?;
    let names = (scene.faces().len() <= MOST_FACTORS)
        .then(|| FaceGroups::of(&Grouping::ByPatch, &job.scene, &scene).map(|groups| groups.names))
        .transpose()?;
    let mut lines = Vec::new();
    for (answer, [table, page, factors]) in answers.iter().zip(files) {
        let ExactAnswer { columns, summary, .. } = answer;
        folder.write(table, |file| report::write_exact(file, scene.faces(), columns))?;
        folder.write(page, |file| summary.write(file))?;
        if let Some(names) = &names {
            folder
                .write(factors, |file| report::write_exact_factors(file, names, |i| answer.factors_of(i)))?;
        }
        lines.extend(summary.lines());
        let failed = summary.checks.iter().filter(|check| check.verdict == Verdict::Failed);
        failed.for_each(|check| warn!("{}", check.message));
    }
    if args.out.force {
        // Those of a scene that was grey before and has colours now, or the other way round.
        let stale = if scene.channels() == 1 { &CHANNEL_FILES[..] } else { &GREY_FILES };
        folder.remove(stale.as_flattened())?;
    }
    drop(phase);
    args.out.tell(folder.path(), lines);
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
