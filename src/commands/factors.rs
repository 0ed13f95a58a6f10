//! `radwalk factors`: exchange factors between groups of faces, and the heat between them.

use std::path::{Path, PathBuf};

use radiosity::Experiment;
use report::OutputFolder;
use results::Round;
use results::factors::{
    Asked, FILES, FactorsAnswer, FactorsFault, FactorsQuestion, RowWalks, RowWatcher, SparseAnswer,
    SparseAsked, SparseFile, count, count_rows, sparse_files,
};
use tracing::{info, warn};
use voice::Phase;

use crate::args::FactorsArgs;
use crate::build::BUILD;
use crate::choose::load_surfaces;
use crate::commands::coordinate::default_folder;
use crate::fault::{Fault, Outcome};
use crate::rounds::{dismiss, open_executor, walk_round};
use crate::signals;

/// Counts exchange factors and writes them.
pub(crate) fn factors(args: &FactorsArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    if let Some(asked) = sparse(args) {
        return sparse_factors(args, &asked, phase);
    }
    let exports = args.export.iter().map(|word| word.dense()).collect::<Option<Vec<_>>>();
    let exports = exports.ok_or_else(|| results::Error::from(FactorsFault::SparseExports))?;
    let question = question(args, None)?;
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&question.job));
    let folder = OutputFolder::claim(&path, &FILES, args.out.force || args.rounds.resume)?;
    drop(phase);
    signals::catch();
    let executor = open_executor(&args.rounds, &question.scene, &folder)?;
    let phase = Phase::begin("counting walks between groups");
    let mut walk = |round: Round<'_>| walk_round(&executor, round);
    let counted = count(&question, BUILD, (&folder, args.rounds.resume), &mut walk, &|part| phase.done(part));
    drop(phase);
    let experiment = || Experiment::new(question.scene.clone(), question.job.method.walks());
    dismiss(executor, &question.job, experiment)?;
    let counted = counted?;
    if counted.interrupted {
        warn!("interrupted; what was counted is kept, go on with --resume");
    }
    if counted.is_empty() {
        return Ok(Outcome::Interrupted);
    }
    let answer = FactorsAnswer::of(&question, counted).map_err(results::Error::from)?;
    answer.write(&folder, &exports)?;
    remove_stale(args, &folder, [&sparse_files(), &FILES])?;
    answer.warnings().iter().for_each(|warning| warn!("{warning}"));
    args.out.tell(folder.path(), answer.lines());
    Ok(match (answer.interrupted(), answer.reached()) {
        (true, _) => Outcome::Interrupted,
        (false, Some(false)) => Outcome::TargetMissed,
        (false, _) => Outcome::Done,
    })
}

/// What is asked, by the words of the command.
fn question(args: &FactorsArgs, sparse: Option<SparseAsked>) -> Result<FactorsQuestion, Fault> {
    let job = load_surfaces(&args.job.job, &args.job.overrides()?, "factors")?;
    let asked = Asked {
        groups: args.groups.as_deref(),
        reflections: args.reflections,
        channel: args.channel.map(|channel| channel as usize),
        tolerance: args.tolerance,
        pairs: &args.pairs,
        smooth: args.smooth,
        temperatures: args.temperatures.as_deref(),
        sparse,
    };
    let question = FactorsQuestion::of(job, &asked)?;
    question.job.scene.notes().iter().for_each(|note| info!("note: {note}"));
    Ok(question)
}

/// What is asked of sparse factors; `None` where these are not asked for.
fn sparse(args: &FactorsArgs) -> Option<SparseAsked> {
    args.sparse.then(|| SparseAsked {
        walks: match (args.rays, args.job.paths) {
            (None, Some(paths)) => RowWalks::Shared(paths),
            (rays, _) => RowWalks::Each(rays.unwrap_or(SparseAsked::RAYS)),
        },
        least: args.drop.unwrap_or(0.0),
        sky: args.sky_patches,
        periods: args.periodic,
        part: args.part.unwrap_or([1, 1]),
    })
}

/// Counts rows on threads of this process and writes what they say, once there are all.
fn sparse_factors(args: &FactorsArgs, asked: &SparseAsked, phase: Phase) -> Result<Outcome, Fault> {
    let question = question(args, Some(*asked))?;
    let exports: Vec<SparseFile> = args.export.iter().map(|&word| word.into()).collect();
    question.check_exports(&exports).map_err(results::Error::from)?;
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&question.job));
    check_parts(&args.join, &path)?;
    let folder = OutputFolder::claim(&path, &sparse_files(), args.out.force || args.rounds.resume)?;
    signals::catch();
    phase.now("counting rows");
    let team = args.rounds.team.team();
    let mut watch = |part| {
        phase.done(part);
        !signals::stop_asked()
    };
    let watcher = RowWatcher { threads: team.workers * team.threads as usize, watch: &mut watch };
    let counted = count_rows(&question, asked, &folder, args.rounds.resume, &args.join, watcher)?;
    if counted.interrupted {
        drop(phase);
        warn!("interrupted; the rows that are done are kept, go on with --resume");
        return Ok(Outcome::Interrupted);
    }
    if asked.part[1] > 1 {
        drop(phase);
        info!(
            "part {}/{} of the rows is in {}; put all together with --join",
            asked.part[0],
            asked.part[1],
            path.display()
        );
        return Ok(Outcome::Done);
    }
    phase.now("writing matrices");
    let answer = SparseAnswer::of(&question, asked, counted, &folder)?;
    answer.write(&folder, if exports.is_empty() { &[SparseFile::Mtx] } else { &exports })?;
    remove_stale(args, &folder, [&FILES, &sparse_files()])?;
    drop(phase);
    answer.warnings().iter().for_each(|warning| warn!("{warning}"));
    args.out.tell(folder.path(), answer.lines());
    Ok(if answer.reached() == Some(false) { Outcome::TargetMissed } else { Outcome::Done })
}

/// Removes what factors of the other kind have left, where results may be replaced.
fn remove_stale(
    args: &FactorsArgs,
    folder: &OutputFolder,
    [other, own]: [&[&str]; 2],
) -> Result<(), report::Error> {
    let stale: Vec<&str> = other.iter().filter(|name| !own.contains(name)).copied().collect();
    if args.out.force { folder.remove(&stale) } else { Ok(()) }
}

/// Refuses to write over the rows of a part that they are to be read from.
fn check_parts(parts: &[PathBuf], out: &Path) -> Result<(), results::Error> {
    let place = |path: &Path| path.canonicalize().ok();
    match parts.iter().find(|part| place(part).is_some_and(|part| Some(part) == place(out))) {
        Some(part) => Err(FactorsFault::JoinedIntoPart { part: part.clone() }.into()),
        None => Ok(()),
    }
}
