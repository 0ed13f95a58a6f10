//! Runs on worker processes. All runs of one method and size are one job of the cluster, one after the other along its
//! walks: so workers are started and the scene is sent once, and what a run comes to depends on the job alone.

use std::sync::mpsc::channel;

use judge::MOMENTS;
use protocol::Look;
use radiosity::Tally;
use results::{Identity, Settings};
use studies::compare::{Shot, Team, Trial};

use crate::build::BUILD;
use crate::fault::Fault;
use crate::team::walk;

/// Walks a trial, in a number of runs.
///
/// # Errors
/// Where the cluster fails, and where a signal ends it.
pub(crate) fn shoot(team: Team, trial: &Trial, runs: usize) -> Result<Shot, Fault> {
    let Trial { job, experiment } = trial;
    let identity = Identity::new(job, &Settings::of(job), experiment, BUILD)?;
    let ends = (1..=runs as u64).map(|run| run * trial.walks()).collect();
    let (out, prefixes) = channel();
    let judge = move |prefix: &Tally, _: &[Look]| {
        // The other end of the channel is read when the job has ended.
        let _ = out.send(prefix.clone());
        Look { walks: prefix.counts.walks, rays: prefix.counts.rays, ..Look::default() }
    };
    let walked = walk(team, &identity, &job.budget, experiment, (ends, Box::new(judge)), &|_| ())?;
    Ok(Shot {
        tallies: Shot::runs(experiment.tally::<MOMENTS>(), prefixes.iter()),
        seconds: walked.cpu_seconds / runs as f64,
        memory: walked.memory,
        traffic: walked.received / runs as u64,
    })
}
