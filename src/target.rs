//! When a job is accurate enough, and what it still takes.
//!
//! The moment to stop is that of `stats::DoubleSampling`, which keeps intervals true. Looks happen at numbers of walks
//! that the job fixes.

use cluster::checkpoint::Look;
use job::{Target, Unhit};
use radiosity::{Estimate, Experiment, Scene, Solution, Tally};
use report::WorstPatch;
use stats::{DoubleSampling, foresight};

use crate::drift::drift;

/// The first look at a run. Few walks say little, also about how little they say.
const FIRST_LOOK: u64 = 1 << 10;

/// The first look at chains: what fewer differ by says nothing.
const FIRST_LOOK_AT_CHAINS: u64 = 8;

/// So many of the patches that are furthest from a target are named.
const NAMED: usize = 5;

/// How far one patch is from being known.
#[derive(Clone, Copy, Debug)]
struct Standing {
    patch: usize,
    area: f64,
    /// The largest of its channels; infinite where no walk has hit it.
    error: f64,
    /// The fewest effective scores of its channels; infinite where it is known without any.
    scores: f64,
    hits: u128,
}

/// Every patch that a target is about: those that do not emit and that walks could tell of.
fn standings(scene: &Scene, solution: &Solution, unhit: Unhit) -> Vec<Standing> {
    let patches = scene.patches().iter().zip(solution.estimates.chunks_exact(solution.channels)).enumerate();
    let standing = |(i, (patch, channels)): (usize, (radiosity::Patch, &[Option<Estimate>]))| {
        if patch.emittance.is_lit() {
            return None;
        }
        let known: Option<Vec<Estimate>> = channels.iter().copied().collect();
        let unknown: Vec<Estimate> = known?.into_iter().filter(|e| e.ci_high > e.ci_low).collect();
        let error = unknown.iter().map(Estimate::relative_error).fold(0.0, f64::max);
        let scores = unknown.iter().map(|e| e.effective_scores).fold(f64::INFINITY, f64::min);
        let hits = channels[0].map_or(0, |estimate| estimate.hits);
        let left_out = unhit == Unhit::Ignore && scores == 0.0;
        (!left_out).then_some(Standing { patch: i, area: patch.area, error, scores, hits })
    };
    patches.filter_map(standing).collect()
}

/// The part of the area that has at most this relative error, from this many scores at least.
fn part_within(standings: &[Standing], relative_error: f64, scores: f64) -> f64 {
    let area = |of: &mut dyn Iterator<Item = &Standing>| of.map(|standing| standing.area).sum::<f64>();
    let all = area(&mut standings.iter());
    let is_within = |s: &&Standing| s.error <= relative_error && s.scores >= scores;
    if all > 0.0 { area(&mut standings.iter().filter(is_within)) / all } else { 1.0 }
}

/// How a solution does on a target, after so many paths.
pub fn judge(target: &Target, scene: &Scene, solution: &Solution, paths: u64) -> report::Target {
    let mut standings = standings(scene, solution, target.unhit);
    let Target { relative_error, fraction, .. } = *target;
    let achieved = part_within(&standings, relative_error, target.min_hits as f64);
    let reached = achieved >= fraction && paths >= target.min_paths;
    standings.sort_by(|a, b| b.error.total_cmp(&a.error).then(a.patch.cmp(&b.patch)));
    let needed = |error: f64, scores: f64| {
        let by_error = (error / relative_error).powi(2);
        paths as f64 * by_error.max(target.min_hits as f64 / scores)
    };
    let missing = |s: &&Standing| s.error > relative_error || s.scores < target.min_hits as f64;
    let named = standings.iter().filter(missing).take(NAMED).map(|s| WorstPatch {
        patch: s.patch,
        surface: scene.surface_name(scene.patches().get(s.patch).surface).into(),
        relative_error: s.error,
        hits: u64::try_from(s.hits).unwrap_or(u64::MAX),
        paths_needed: needed(s.error, s.scores),
    });
    let worst = named.collect();
    let total: f64 = standings.iter().map(|standing| standing.area).sum();
    let mut spared = (1.0 - fraction) * total;
    // The worst may stay as they are, as long as the rest makes up the fraction.
    let decisive = standings.iter().find(|standing| {
        spared -= standing.area;
        spared < -1e-9 * total
    });
    let paths_needed = match decisive {
        _ if reached => None,
        Some(standing) => Some(needed(standing.error, standing.scores)).filter(|paths| paths.is_finite()),
        None => None,
    };
    report::Target { reached, relative_error, fraction, achieved, paths_needed, worst }
}

/// Looks at prefixes of one job.
pub struct Observer {
    experiment: Experiment,
    level: f64,
    target: Option<Target>,
    /// The tally of the look before.
    before: Option<Tally>,
}

impl Observer {
    /// Of a job whose intervals have this level each.
    pub fn new(experiment: Experiment, level: f64, target: Option<Target>) -> Self {
        Observer { experiment, level, target, before: None }
    }

    /// Looks at the tally of a prefix.
    pub fn look(&mut self, tally: &Tally, looks: &[Look]) -> Look {
        let scene = self.experiment.scene();
        let walks = tally.counts.walks;
        let solution = Solution::new(&self.experiment, tally, self.level);
        let precision = solution.precision(scene);
        let (promising, reached) = match &self.target {
            Some(target) if walks * self.experiment.paths_per_walk() >= target.min_paths => {
                decide(target, scene, &solution, walks, looks)
            }
            _ => (false, false),
        };
        let drift = self.before.as_ref().map_or(f64::NAN, |before| drift(&self.experiment, before, tally));
        self.before = Some(tally.clone());
        Look {
            walks,
            rays: tally.counts.rays,
            rms_relative_error: precision.rms_relative_error,
            max_relative_error: precision.max_relative_error,
            drift,
            promising,
            reached,
        }
    }
}

/// Whether twice these walks will do, and whether the run ends here.
fn decide(target: &Target, scene: &Scene, solution: &Solution, walks: u64, looks: &[Look]) -> (bool, bool) {
    let standings = standings(scene, solution, target.unhit);
    let Target { relative_error, fraction, .. } = *target;
    let scores = target.min_hits as f64;
    let promising = part_within(&standings, foresight(relative_error), 0.5 * scores) >= fraction;
    let met = part_within(&standings, relative_error, scores) >= fraction;
    let mut rule = DoubleSampling::default();
    // What was met at earlier looks did not end the run.
    for look in looks {
        rule.look(look.walks, look.promising, false);
    }
    (promising, rule.look(walks, promising, met))
}

/// The numbers of walks (or chains) at which a run of so many is looked at. Fewer walks than patches tell nothing of most
/// of them, and a look at many patches takes its time; a chain tells of every patch, and takes longer than a look.
pub fn looks(experiment: &Experiment, walks: u64) -> Vec<u64> {
    match experiment.chain_rays() {
        Some(_) => ladder(FIRST_LOOK_AT_CHAINS, walks, 0),
        None => ladder(FIRST_LOOK, walks, experiment.scene().patches().len()),
    }
}

/// 2^k and 3·2^(k−1) from `first` and from `least` on, fixed by the job alone.
fn ladder(first: u64, walks: u64, least: usize) -> Vec<u64> {
    let powers = std::iter::successors(Some(first), |n| n.checked_mul(2));
    let steps = powers.flat_map(|n| [n, n.saturating_add(n / 2)]);
    let telling = steps.skip_while(|&n| n < least as u64);
    telling.take_while(|&n| n < walks).chain([walks]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_ascend_to_the_budget() {
        assert_eq!(ladder(FIRST_LOOK, 5000, 54), [1024, 1536, 2048, 3072, 4096, 5000]);
        assert_eq!(ladder(FIRST_LOOK, 5000, 3000), [3072, 4096, 5000]);
        assert_eq!(ladder(FIRST_LOOK, 1024, 3000), [1024]);
        assert_eq!(ladder(FIRST_LOOK, 1, 54), [1]);
        assert!(ladder(FIRST_LOOK, u64::MAX, 54).is_sorted());
        assert_eq!(ladder(FIRST_LOOK_AT_CHAINS, 20, 0), [8, 12, 16, 20]);
    }

    #[test]
    fn twice_a_look_is_a_look() {
        let looks = ladder(FIRST_LOOK, 1 << 30, 2000);
        assert!(looks.iter().all(|n| 2 * n > 1 << 30 || looks.contains(&(2 * n))));
    }

    fn standing(area: f64, error: f64, scores: f64) -> Standing {
        Standing { patch: 0, area, error, scores, hits: scores as u128 }
    }

    #[test]
    fn a_target_goes_by_area_and_by_scores() {
        let all = [standing(1.0, 0.1, 100.0), standing(2.0, 0.2, 50.0), standing(1.0, f64::INFINITY, 0.0)];
        assert_eq!(part_within(&all, 0.1, 0.0), 0.25);
        assert_eq!(part_within(&all, 0.2, 0.0), 0.75);
        assert_eq!(part_within(&all, 0.2, 60.0), 0.25);
        assert_eq!(part_within(&all, 1e300, 0.0), 0.75, "what no walk has hit is never known");
        assert_eq!(part_within(&[], 0.1, 10.0), 1.0);
    }
}
