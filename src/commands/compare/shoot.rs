//! Runs on worker processes. All runs of one method and size are one job of the cluster, one after the other along its
//! walks: so workers are started and the scene is sent once, and what a run comes to depends on the job alone.

use std::sync::mpsc::channel;

use protocol::{Look, Past};
use radiosity::{Counts, Tally};
use results::{Identity, Settings};

use super::contender::Trial;
use crate::build::BUILD;
use crate::fault::Fault;
use crate::lead::{Executor, WalkJob, walk};
use crate::team::Team;

/// The result of some runs of a trial.
pub(super) struct TrialRuns {
    /// The tally of each run.
    pub tallies: Vec<Tally>,
    /// The processor time of one run's walks [s].
    pub seconds: f64,
    /// The most memory that a worker process took [bytes], if the system tells.
    pub memory: Option<u64>,
    /// The bytes that workers sent for one run.
    pub traffic: u64,
}

/// Walks a trial, in a number of runs.
///
/// # Errors
/// Where the cluster fails, and where a signal ends it.
pub(super) fn shoot(team: Team, trial: &Trial, runs: usize) -> Result<TrialRuns, Fault> {
    let Trial { job, experiment } = trial;
    let identity = Identity::new(job, &Settings::of_patches(job), experiment, BUILD)?;
    let ends = (1..=runs as u64).map(|run| run * trial.walks()).collect();
    let (out, prefixes) = channel();
    let judge = move |prefix: &Tally, _: &[Look]| {
        // The other end of the channel is read when the job has ended.
        let _ = out.send(prefix.clone());
        Look { walks: prefix.counts.walks, rays: prefix.counts.rays, ..Look::default() }
    };
    let past = Past::none(experiment.tally());
    let job = WalkJob { identity: &identity, budget: &job.budget, experiment };
    let walked = walk(&Executor::Local(team), job, past, (ends, Box::new(judge)), &mut |_| ())?;
    let mut before = experiment.tally();
    let run = |prefix: Tally| {
        let run = since(&before, &prefix);
        before = prefix;
        run
    };
    Ok(TrialRuns {
        tallies: prefixes.iter().map(run).collect(),
        seconds: walked.cpu_seconds / runs as f64,
        memory: walked.memory,
        traffic: walked.received / runs as u64,
    })
}

/// The walks of `now` that are not those of `before`.
fn since(before: &Tally, now: &Tally) -> Tally {
    let (earlier, later) = (before.counts.to_array(), now.counts.to_array());
    let counts = Counts::from_array(std::array::from_fn(|i| later[i] - earlier[i]));
    let sums = now.sums().iter().zip(before.sums()).map(|(now, before)| now - before).collect();
    let counts = counts.expect("fewer walks than before are counted where those were");
    Tally::from_parts(counts, now.patches(), now.layout(), sums).expect("as many sums as before")
}
