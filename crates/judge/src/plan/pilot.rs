//! The first walks of a job, and what they foretell of the rest.

use job::Target;
use protocol::checkpoint::Look;
use radiosity::{Estimates, Experiment, Sequence, Tally};

use crate::MOMENTS;
use crate::target::{Observer, Prospect, looks};

/// A pilot takes no more than this part of the run that it foretells, where that is more than …
const SHARE: u64 = 8;

/// … so many rays, which are a fraction of a second …
const FREE_RAYS: u64 = 1 << 20;

/// … nor more rays than this (of chains: one chain).
const MOST_RAYS: u64 = 1 << 26;

/// Ends are foretold for errors this many standard errors above and below what the pilot shows.
const MARGIN: f64 = 2.0;

/// Walks that were shot to see what all of them will take.
pub struct Pilot {
    /// What they came to.
    pub tally: Tally,
    /// Processor time that they took [s].
    pub seconds: f64,
    /// Where the run will end; `None` without a target, or where the walks cannot tell.
    pub ending: Option<Ending>,
}

/// After how many walks a run will end, as its rule of stopping has it (`stats::DoubleSampling`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ending {
    /// If errors turn out smaller than the pilot shows.
    pub least: u64,
    /// If they turn out larger.
    pub most: u64,
}

impl Ending {
    /// One number for both ends: their harmonic mean, of which neither differs by a larger part than the other; of two
    /// neighbouring steps, by 1/7 or 1/5.
    pub fn walks(self) -> u64 {
        let [least, most] = [self.least, self.most].map(|walks| walks as f64);
        (2.0 / (1.0 / least + 1.0 / most)).round() as u64
    }
}

impl Pilot {
    /// Shoots walks from the first on, look by look, until the end is plain, or as many as a pilot may take. Depends on
    /// the job alone, but for the processor time that `clock` reads [s].
    pub fn shoot(
        experiment: &Experiment,
        seed: u64,
        first: u64,
        walks: u64,
        target: Option<&Target>,
        level: f64,
        clock: fn() -> f64,
    ) -> Self {
        let began = clock();
        let sequence = Sequence::new(seed);
        let (mut board, mut tally) = (experiment.board::<MOMENTS>(), experiment.tally::<MOMENTS>());
        let mut observer = Observer::new(experiment.clone(), level, target.cloned());
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
            let Some(target) = target else { continue };
            seen.push(observer.look(&tally, &seen));
            let prospect = Prospect::new(target, &Estimates::new(experiment, &tally, level), level);
            ending = foretell(experiment, &prospect, &seen);
            let dear = tally.counts.rays > FREE_RAYS;
            let enough = |e: &Ending| e.least == e.most || dear && SHARE * look >= e.least;
            if ending.as_ref().is_some_and(enough) || seen.last().is_some_and(|look| look.promising) {
                break;
            }
        }
        Pilot { tally, seconds: clock() - began, ending }
    }

    /// Rays of a walk (or chain).
    pub fn rays_per_walk(&self) -> f64 {
        self.tally.counts.rays as f64 / self.tally.counts.walks as f64
    }
}

/// The looks of a run of so many walks that a pilot may go to; the first at least, and of chains one, which tells what
/// they cost.
fn affordable(experiment: &Experiment, walks: u64) -> Vec<u64> {
    let ladder = looks(experiment, walks);
    if experiment.unit().batch().is_some_and(|batch| batch.saturating_mul(ladder[0]) > MOST_RAYS) {
        return vec![1];
    }
    let most = MOST_RAYS / experiment.unit().paths();
    let first = ladder[0].min(most);
    std::iter::once(first).chain(ladder.into_iter().filter(|&look| look > first && look <= most)).collect()
}

/// Where the run will end, by the looks that were taken and those that the last of them foretells.
pub fn foretell(experiment: &Experiment, prospect: &Prospect, seen: &[Look]) -> Option<Ending> {
    let last = seen.last().map_or(0, |look| look.walks);
    let ladder = looks(experiment, u64::MAX);
    let end = |noise: f64| {
        let promising = seen.iter().find(|look| look.promising).map(|look| look.walks);
        let promising = promising.or_else(|| {
            ladder.iter().copied().find(|&walks| walks > last && prospect.is_promising(walks, noise))
        })?;
        ladder
            .iter()
            .copied()
            .find(|&walks| walks >= promising.saturating_mul(2) && prospect.is_met(walks, noise))
    };
    let noise = MARGIN * prospect.noise();
    Some(Ending { least: end(-noise.min(0.9))?, most: end(noise)? })
}
