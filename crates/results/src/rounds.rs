//! Walks that are counted round by round: each round is a job of the cluster, its counts are kept in the output folder, and what the next one walks
//! follows from all counts so far.

use std::sync::Arc;
use std::time::Instant;

use job::{Budget, Job};
use radiosity::{Experiment, Tally};
use report::OutputFolder;
use serde::{Deserialize, Serialize};

use crate::checkpoints::Identity;
use crate::error::Error;
use crate::settings::Settings;

/// The walks of one round, for the processes of the caller.
pub struct Round<'a> {
    /// The job of these walks, as it travels.
    pub identity: Identity,
    /// The experiment whose walks they are.
    pub experiment: Experiment,
    /// The budget of the whole job.
    pub budget: &'a Budget,
    /// The number of walks.
    pub walks: u64,
    /// Is told how many walks are in.
    pub watch: &'a dyn Fn(u64),
}

/// What the walks of a round came to.
pub struct Walked {
    /// The tally of all of them.
    pub tally: Arc<Tally>,
    /// The processor time of the walks [s].
    pub cpu_seconds: f64,
}

/// What walks have cost.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Cost {
    pub(crate) rays: u64,
    pub(crate) seconds: f64,
    pub(crate) cpu_seconds: f64,
}

impl Cost {
    /// Adds what other walks have cost.
    pub(crate) fn add(&mut self, other: Cost) {
        self.rays += other.rays;
        self.seconds += other.seconds;
        self.cpu_seconds += other.cpu_seconds;
    }
}

/// What a round walks.
pub(crate) struct RoundPlan {
    /// The experiment.
    pub(crate) experiment: Experiment,
    /// The settings by which it travels.
    pub(crate) settings: Settings,
    /// The number of walks.
    pub(crate) walks: u64,
    /// The part of all walks that is done before, and behind it.
    pub(crate) parts: [f64; 2],
}

/// Counts that choose their walks.
pub(crate) trait RoundCounts {
    /// The next round; `None` where all is counted.
    ///
    /// # Errors
    /// Where its experiment cannot be.
    fn next(&mut self) -> Result<Option<RoundPlan>, Error>;

    /// Adds what the walks of that round came to.
    fn add(&mut self, tally: &Tally, cost: Cost);

    /// Keeps the counts in a folder.
    ///
    /// # Errors
    /// Where they cannot be written.
    fn keep(&self, folder: &OutputFolder) -> Result<(), Error>;
}

/// Walks round after round of a job until all is counted, and says whether that is so: `walk` walks a round, and returns nothing where a signal ended
/// it; `watch` is told what part of the walks is done.
///
/// # Errors
/// Those of `walk`, and where counts cannot be written.
pub(crate) fn walk_rounds<E: From<Error>>(
    counts: &mut impl RoundCounts,
    (job, build): (&Job, &str),
    folder: &OutputFolder,
    walk: &mut dyn FnMut(Round<'_>) -> Result<Option<Walked>, E>,
    watch: &dyn Fn(f64),
) -> Result<bool, E> {
    while let Some(RoundPlan { experiment, settings, walks, parts: [before, behind] }) = counts.next()? {
        let identity = Identity::new(job, &settings, &experiment, build)?;
        let watch = |done| watch(before + (behind - before) * done as f64 / walks as f64);
        let began = Instant::now();
        let round = Round { identity, experiment, budget: &job.budget, walks, watch: &watch };
        let Some(Walked { tally, cpu_seconds }) = walk(round)? else { return Ok(false) };
        let cost = Cost { rays: tally.counts.rays, seconds: began.elapsed().as_secs_f64(), cpu_seconds };
        counts.add(&tally, cost);
        counts.keep(folder)?;
    }
    Ok(true)
}
