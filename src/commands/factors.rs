//! `radwalk factors`: exchange factors between groups of faces, and the heat between them.

use protocol::Look;
use radiosity::{Experiment, Tally};
use report::OutputFolder;
use results::factors::{Answer, Asked, FILES, MatrixFile, Question, Round, Walked, count};
use results::{Identity, Settings};
use tracing::{info, warn};
use voice::{Phase, say};

use crate::args::FactorsArgs;
use crate::build::BUILD;
use crate::choose::load_given;
use crate::commands::coordinate::default_folder;
use crate::fault::{Fault, Outcome};
use crate::lead::{Executor, Remote, walk};
use crate::signals;

/// Counts exchange factors and writes them.
pub(crate) fn factors(args: &FactorsArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let job = load_given(&args.job.job, &args.job.overrides(), "factors")?;
    let asked = Asked {
        groups: args.groups.as_deref(),
        reflections: args.reflections,
        channel: args.channel.map(|channel| channel as usize),
        tolerance: args.tolerance,
        pairs: &args.pairs,
        smooth: args.smooth,
        temperatures: args.temperatures.as_deref(),
    };
    let question = Question::of(job, &asked)?;
    question.job.scene.notes().iter().for_each(|note| info!("note: {note}"));
    let path = args.out.out.clone().unwrap_or_else(|| default_folder(&question.job));
    let folder = OutputFolder::claim(&path, &FILES, args.out.force || args.resume)?;
    if args.out.force {
        folder.remove(&FILES)?;
    }
    drop(phase);
    signals::catch();
    let executor = executor(args, &question, &folder)?;
    let phase = Phase::begin("counting walks between groups");
    let mut walk = |round: Round<'_>| walk_round(&executor, &round);
    let counted = count(&question, BUILD, (&folder, args.resume), &mut walk, &|part| phase.done(part));
    drop(phase);
    if let Executor::Remote(remote) = executor {
        dismiss(remote, &question)?;
    }
    let counted = counted?;
    if counted.interrupted {
        warn!("interrupted; the counts of the last look are kept, go on with --resume");
    }
    if counted.is_empty() {
        return Ok(Outcome::Interrupted);
    }
    let answer = Answer::of(&question, counted).map_err(results::Error::from)?;
    answer.write(&folder, &args.export.iter().map(|&word| word.into()).collect::<Vec<MatrixFile>>())?;
    if !args.out.quiet {
        tell(&answer, &folder);
    }
    Ok(match (answer.interrupted(), answer.reached()) {
        (true, _) => Outcome::Interrupted,
        (false, Some(false)) => Outcome::TargetMissed,
        (false, _) => Outcome::Done,
    })
}

/// Says what was found, and where it is.
pub(crate) fn tell(answer: &Answer, folder: &OutputFolder) {
    answer.warnings().iter().for_each(|warning| warn!("{warning}"));
    answer.lines().iter().for_each(|line| say(line));
    say(&format!("written to {}", folder.path().display()));
}

/// The processes that walk.
fn executor(args: &FactorsArgs, question: &Question, folder: &OutputFolder) -> Result<Executor, Fault> {
    let Some(address) = &args.listen else { return Ok(Executor::Local(args.team.team())) };
    let file = args.access.clone().unwrap_or_else(|| folder.path().join("access.json"));
    let address = (&**address, args.advertise.as_deref());
    Ok(Executor::Remote(Remote::open(question.scene.hash(), address, file)?))
}

/// Tells workers that are started elsewhere that there are no more walks.
fn dismiss(remote: Remote, question: &Question) -> Result<(), Fault> {
    let experiment = Experiment::new(question.scene.clone(), question.job.method.walks())?;
    let identity = Identity::new(&question.job, &Settings::of(&question.job), &experiment, BUILD)?;
    remote.dismiss(&identity, &question.job.budget, &experiment)
}

/// Walks a look on worker processes; `None` where a signal ended it.
fn walk_round(executor: &Executor, round: &Round<'_>) -> Result<Option<Walked>, Fault> {
    let Round { identity, experiment, budget, walks, watch } = round;
    let judge = |prefix: &Tally, _: &[Look]| {
        let counts = prefix.counts;
        Look { walks: counts.walks, rays: counts.rays, ..Look::default() }
    };
    match walk(executor, identity, budget, experiment, (vec![*walks], Box::new(judge)), watch) {
        Ok(walked) => Ok(Some(Walked { tally: walked.tally, cpu_seconds: walked.cpu_seconds })),
        Err(Fault::Interrupted) => Ok(None),
        Err(fault) => Err(fault),
    }
}
