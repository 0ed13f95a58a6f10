//! Walks that are counted round by round: each round is a job of the cluster, its counts are kept in the output folder, and what the next one walks
//! follows from all counts so far. The walks of the round under way are kept in `round.bin`.

use std::cell::Cell;
use std::io;
use std::sync::Arc;
use std::time::Instant;

use job::{Budget, Job};
use radiosity::{Experiment, Tally};
use report::OutputFolder;
use serde::{Deserialize, Serialize};

use crate::checkpoints::Identity;
use crate::error::Error;
use crate::packed_tally::{PackedTally, sealed, unsealed};
use crate::settings::Settings;

/// The file of a round that is under way.
pub(crate) const ROUND: &str = "round.bin";

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
    /// The walks of it that are taken already, the first ones.
    pub past: Tally,
    /// Keeps the first walks, so that a round that is stopped goes on from there.
    pub keep: &'a dyn Fn(&Tally) -> Result<(), Error>,
    /// Is told how many walks are in.
    pub watch: &'a dyn Fn(u64),
}

/// A round as it is kept.
#[derive(Serialize, Deserialize)]
struct StoredRound {
    /// The digest of the walks, their number included.
    walks: [u8; 32],
    /// The first of them.
    prefix: PackedTally,
    /// What they have cost, but for the rays, which the tally counts.
    cost: Cost,
}

impl StoredRound {
    /// What is kept of a round in a folder; nothing where that is not readable.
    fn read(folder: &OutputFolder, walks: [u8; 32], experiment: &Experiment) -> Option<(Tally, Cost)> {
        let kept: StoredRound =
            unsealed(&folder.file(ROUND)).filter(|kept: &StoredRound| kept.walks == walks)?;
        Some((kept.prefix.unpack(experiment.rows(), experiment.layout())?, kept.cost))
    }

    /// Writes it. A loss of power may take it back.
    fn write(&self, folder: &OutputFolder) -> Result<(), Error> {
        let failed = |source| Error::System { doing: "keeping the walks of a round", source };
        let content = sealed(self).map_err(|error| failed(io::Error::other(error)))?;
        report::write_soon(&folder.file(ROUND), &content).map_err(failed)
    }
}

/// The digest of the walks of a round.
fn digest(identity: &Identity, walks: u64) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&identity.scene_hash).update(&identity.job).update(&walks.to_le_bytes());
    hasher.finalize().into()
}

/// The tally and the processor time of the walks of a round.
pub struct RoundResult {
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
/// it; `watch` is told what part of the walks is done. The files `replaced` of an earlier result are removed before anything is kept.
///
/// # Errors
/// Those of `walk`, and where counts cannot be written.
pub(crate) fn walk_rounds<E: From<Error>>(
    counts: &mut impl RoundCounts,
    (job, build): (&Job, &str),
    (folder, replaced): (&OutputFolder, &[&str]),
    walk: &mut dyn FnMut(Round<'_>) -> Result<Option<RoundResult>, E>,
    watch: &dyn Fn(f64),
) -> Result<bool, E> {
    let replaced = Cell::new(replaced);
    let remove_replaced = || folder.remove(replaced.take());
    while let Some(RoundPlan { experiment, settings, walks, parts: [before, behind] }) = counts.next()? {
        let identity = Identity::new(job, &settings, &experiment, build)?;
        let watch = |done| watch(before + (behind - before) * done as f64 / walks as f64);
        let began = Instant::now();
        let digest = digest(&identity, walks);
        let (past, before) = match StoredRound::read(folder, digest, &experiment) {
            Some((tally, cost)) => (tally, cost),
            None => (experiment.tally(), Cost::default()),
        };
        let cost = |rays, cpu_seconds| {
            let mut cost = before;
            cost.add(Cost { rays, seconds: began.elapsed().as_secs_f64(), cpu_seconds });
            cost
        };
        let keep = |prefix: &Tally| {
            let prefix = PackedTally::of(prefix);
            remove_replaced()?;
            StoredRound { walks: digest, prefix, cost: cost(0, 0.0) }.write(folder)
        };
        let budget = &job.budget;
        let round = Round { identity, experiment, budget, walks, past, keep: &keep, watch: &watch };
        let Some(RoundResult { tally, cpu_seconds }) = walk(round)? else { return Ok(false) };
        counts.add(&tally, cost(tally.counts.rays, cpu_seconds));
        remove_replaced().map_err(Error::from)?;
        counts.keep(folder)?;
        folder.remove(&[ROUND]).map_err(Error::from)?;
    }
    Ok(true)
}
