//! Who walks what is counted round by round: worker processes of this machine, or those that are started elsewhere and stay from round to round.

use job::Job;
use protocol::{Coordinator, Look, Past};
use radiosity::{Experiment, Scene, Tally, Unfit};
use report::OutputFolder;
use results::{Identity, Round, RoundResult, Settings};

use crate::args::RoundArgs;
use crate::build::BUILD;
use crate::fault::Fault;
use crate::keeping::Keeping;
use crate::lead::{Executor, Remote, WalkJob, walk};

/// The processes that walk in a scene.
///
/// # Errors
/// Where the system refuses to let workers in.
pub(crate) fn open_executor(
    args: &RoundArgs,
    scene: &Scene,
    folder: &OutputFolder,
) -> Result<Executor, Fault> {
    let Some(address) = &args.listen else { return Ok(Executor::Local(args.team.team())) };
    let file = args.access.clone().unwrap_or_else(|| folder.path().join("access.json"));
    let address = (&**address, args.advertise.as_deref());
    Ok(Executor::Remote(Remote::open(scene.hash(), address, file)?))
}

/// Walks a round on worker processes; `None` where a signal ended it.
///
/// # Errors
/// Where the cluster fails.
pub(crate) fn walk_round(executor: &Executor, round: Round<'_>) -> Result<Option<RoundResult>, Fault> {
    let Round { identity, experiment, budget, walks, past, keep, watch } = round;
    let judge = |prefix: &Tally, _: &[Look]| {
        let counts = prefix.counts;
        Look { walks: counts.walks, rays: counts.rays, ..Look::default() }
    };
    let mut keeping = Keeping::new(walks, past.counts.walks);
    let past = Past::none(past);
    let mut watch = |coordinator: &Coordinator| {
        watch(coordinator.progress().walks);
        let prefix = coordinator.prefix();
        // A round that is over is kept with the counts of all.
        if prefix.counts.walks < walks {
            keeping.keep(prefix.counts.walks, || keep(prefix));
        }
    };
    let job = WalkJob { identity: &identity, budget, experiment: &experiment };
    match walk(executor, job, past, (vec![walks], Box::new(judge)), &mut watch) {
        Ok(walked) => Ok(Some(RoundResult { tally: walked.tally, cpu_seconds: walked.cpu_seconds })),
        Err(Fault::Interrupted) => Ok(None),
        Err(fault) => Err(fault),
    }
}

/// Tells workers that are started elsewhere that there are no more walks, of an experiment in their scene.
///
/// # Errors
/// Where the system refuses.
pub(crate) fn dismiss(
    executor: Executor,
    job: &Job,
    experiment: impl FnOnce() -> Result<Experiment, Unfit>,
) -> Result<(), Fault> {
    let Executor::Remote(remote) = executor else { return Ok(()) };
    let experiment = experiment()?;
    let identity = Identity::new(job, &Settings::of(job), &experiment, BUILD)?;
    remote.dismiss(&identity, &job.budget, &experiment)
}
