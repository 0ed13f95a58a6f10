//! How the rays of a job are cut into chains for a number of workers.
//!
//! The model: a chain's squared error falls with its length n as 1/n or faster, and the mean of K chains has a K-th of that.
//! At a given time long chains then win as long as every worker has one, and the chains of all workers end together. Runs of
//! many workers have not been held against it.

use job::fewest_chain_rays;
use radiosity::{Experiment, Method};
use serde::Serialize;

/// Chains below which intervals tell too little.
const FEWEST_CHAINS: u64 = 8;

/// The rays of a job, cut into chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ChainSplit {
    /// The workers that shoot the chains.
    pub workers: u64,
    /// The chains of the job.
    pub chains: u64,
    /// The rays of a chain.
    pub batch_paths: u64,
}

impl ChainSplit {
    /// The cut with the least error at a given time: equal numbers of chains for all workers, and as few as make an interval. Where
    /// chains of `fewest` rays are fewer than the workers, some workers have none.
    fn best(rays: u64, fewest: u64, workers: u64) -> Self {
        let workers = workers.max(1);
        let wanted = workers * FEWEST_CHAINS.div_ceil(workers);
        let chains = wanted.min(rays / fewest.max(1)).max(FEWEST_CHAINS);
        ChainSplit { workers, chains, batch_paths: rays / chains }
    }
}

/// The chains of a job on some workers, as they are and as they would err least at the same time; `None` where the job is not
/// of chains.
pub fn cuts(experiment: &Experiment, budget_paths: u64, workers: u64) -> Option<[ChainSplit; 2]> {
    let Method::Chains(chains) = experiment.method() else { return None };
    let patches = experiment.scene().faces().patch_count() as u64;
    let fewest = fewest_chain_rays(chains.solve, patches);
    let now =
        ChainSplit { workers: workers.max(1), chains: budget_paths / chains.rays, batch_paths: chains.rays };
    Some([now, ChainSplit::best(budget_paths, fewest, workers)])
}

/// Says that workers will have no chain, and what would give them one; `None` where all have.
pub fn idle_workers(experiment: &Experiment, budget_paths: u64, workers: u64) -> Option<String> {
    let [now, best] = cuts(experiment, budget_paths, workers)?;
    let idle = now.workers.checked_sub(now.chains).filter(|idle| *idle > 0)?;
    let remedy = if best.chains > now.chains {
        format!(
            "with batch_paths = {} in [method] {} workers would have one (the chains are part of the job: its result \
             would differ within its error)",
            best.batch_paths,
            best.chains.min(best.workers)
        )
    } else {
        "its rays are too few for more chains; give it more paths, or fewer workers with more threads".into()
    };
    Some(format!(
        "{idle} of {} workers will have nothing to do: the job has {} chains; {remedy}",
        now.workers, now.chains
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn best(rays: u64, fewest: u64, workers: u64) -> (u64, u64) {
        let ChainSplit { chains, batch_paths, .. } = ChainSplit::best(rays, fewest, workers);
        (chains, batch_paths)
    }

    #[test]
    fn every_worker_has_as_many_chains_as_every_other() {
        assert_eq!(best(10_000_000, 1_728, 1), (8, 1_250_000));
        assert_eq!(best(10_000_000, 1_728, 2), (8, 1_250_000));
        assert_eq!(best(10_000_000, 1_728, 3), (9, 1_111_111));
        assert_eq!(best(10_000_000, 1_728, 5), (10, 1_000_000));
        assert_eq!(best(10_000_000, 1_728, 64), (64, 156_250));
    }

    #[test]
    fn chains_are_never_too_short() {
        // 100 chains of 1,000 rays at most.
        assert_eq!(best(100_000, 1_000, 64), (64, 1_562));
        assert_eq!(best(100_000, 1_000, 640), (100, 1_000));
    }
}
