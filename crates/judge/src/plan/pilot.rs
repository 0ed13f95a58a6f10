//! The pilot: the first walks of a job, and what they predict of the rest.

use job::Target;
use protocol::Look;
use radiosity::{Estimates, Experiment, Sequence, Tally};

use crate::target::{Observer, Prospect, SensorGoal, looks};

/// A pilot of more than [`FREE_RAYS`] rays takes at most one of this many parts of the run that it predicts.
const SHARE: u64 = 8;

/// The rays that any pilot may take: a fraction of a second.
const FREE_RAYS: u64 = 1 << 20;

/// The most rays of a pilot (for chains: at least one chain).
const MOST_RAYS: u64 = 1 << 26;

/// The number of standard errors above and below the pilot's errors for which ends are predicted.
const MARGIN: f64 = 2.0;

/// Walks that were shot to see what all of them will take.
pub struct PlanPilot {
    /// The tally of the pilot's walks.
    pub tally: Tally,
    /// The processor time that the pilot took [s].
    pub seconds: f64,
    /// The end of the run; `None` without a target, or if the walks cannot tell.
    pub ending: Option<StopCounts>,
}

/// The walk counts at which a run may end, by its rule of stopping (`stats::DoubleSampling`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StopCounts {
    /// The walk count if errors turn out smaller than the pilot shows.
    pub least: u64,
    /// The walk count if errors turn out larger than the pilot shows.
    pub most: u64,
}

impl StopCounts {
    /// One number for both ends: their harmonic mean, from which both differ by the same part; for two neighbouring
    /// steps, by 1/7 or 1/5.
    pub fn walks(self) -> u64 {
        let [least, most] = [self.least, self.most].map(|walks| walks as f64);
        (2.0 / (1.0 / least + 1.0 / most)).round() as u64
    }
}

impl PlanPilot {
    /// Shoots walks from the first on, look by look, until the end is plain, or as many as a pilot may take. The result
    /// depends on the job alone, but for the processor time that `clock` reads [s].
    pub fn shoot(
        experiment: &Experiment,
        seed: u64,
        first: u64,
        walks: u64,
        (target, sensors): (Option<&Target>, Option<&SensorGoal>),
        level: f64,
        clock: fn() -> f64,
    ) -> Self {
        let began = clock();
        let sequence = Sequence::new(seed);
        let (mut board, mut tally) = (experiment.board(), experiment.tally());
        let mut observer =
            Observer::new(experiment.clone(), level, target.cloned()).with_sensors(sensors.cloned());
        let mut seen: Vec<Look> = Vec::new();
        let mut ending = None;
        for look in affordable(experiment, walks) {
            let mut next = tally.counts.walks;
            while next < look {
                let end = look.min(next + (1 << 20));
                experiment.walk(&sequence, first + next..first + end, &mut board);
                board.add_to(&mut tally).expect("a pilot is short");
                next = end;
            }
            if target.is_none() && sensors.is_none() {
                continue;
            }
            seen.push(observer.look(&tally, &seen));
            let estimates = Estimates::new(experiment, &tally, level);
            let prospects = Prospect::all(target, sensors, &estimates, (level, usize::MAX));
            ending = predict_stop(experiment, &prospects, &seen);
            let dear = tally.counts.rays > FREE_RAYS;
            let enough = |e: &StopCounts| e.least == e.most || dear && SHARE * look >= e.least;
            if ending.as_ref().is_some_and(enough) || seen.last().is_some_and(|look| look.promising) {
                break;
            }
        }
        PlanPilot { tally, seconds: clock() - began, ending }
    }

    /// The mean number of rays of a walk (or chain).
    pub fn rays_per_walk(&self) -> f64 {
        self.tally.counts.rays as f64 / self.tally.counts.walks as f64
    }
}

/// The looks of a run of `walks` walks that a pilot can afford: at least the first one; for chains at least one chain,
/// whose cost it measures.
fn affordable(experiment: &Experiment, walks: u64) -> Vec<u64> {
    let ladder = looks(experiment, walks);
    if experiment.unit().batch().is_some_and(|batch| batch.saturating_mul(ladder[0]) > MOST_RAYS) {
        return vec![1];
    }
    let most = MOST_RAYS / experiment.unit().paths();
    let first = ladder[0].min(most);
    std::iter::once(first).chain(ladder.into_iter().filter(|&look| look > first && look <= most)).collect()
}

/// The end of the run, by the looks that were taken and those that the last of them predicts: all prospects must meet their
/// targets there.
pub fn predict_stop(experiment: &Experiment, prospects: &[Prospect], seen: &[Look]) -> Option<StopCounts> {
    let last = seen.last().map_or(0, |look| look.walks);
    let ladder = looks(experiment, u64::MAX);
    // Errors are off by some of their own standard errors.
    let end = |margin: f64| {
        let all = |holds: fn(&Prospect, u64, f64) -> bool, walks: u64| {
            prospects.iter().all(|prospect| holds(prospect, walks, (margin * prospect.noise()).max(-0.9)))
        };
        let promising = seen.iter().find(|look| look.promising).map(|look| look.walks);
        let promising = promising.or_else(|| {
            ladder.iter().copied().find(|&walks| walks > last && all(Prospect::is_promising, walks))
        })?;
        ladder
            .iter()
            .copied()
            .find(|&walks| walks >= promising.saturating_mul(2) && all(Prospect::is_met, walks))
    };
    Some(StopCounts { least: end(-MARGIN)?, most: end(MARGIN)? })
}
