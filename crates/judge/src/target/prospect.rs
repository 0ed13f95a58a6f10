//! What a pilot, or the walks so far, foretell of a target.

use job::Target;
use radiosity::Estimates;
use stats::foresight;

use super::standing::{Bar, Standing, parts_within, standings};

/// The errors that a pilot foretells for its run: they fall as 1/√walks (for chains, with Student's t besides).
pub struct Prospect {
    standings: Vec<Standing>,
    spread: Spread,
    walks: u64,
    /// The level of the intervals, in (0, 1).
    level: f64,
    target: Target,
    chains: bool,
    paths_per_walk: u64,
}

/// The spread of the logarithms of errors over patches: a part of it is the pilot's own noise, which fades.
#[derive(Clone, Copy, Debug)]
struct Spread {
    mean: f64,
    /// The variance without the pilot's noise.
    variance: f64,
}

impl Prospect {
    /// The prospect of a job, by the tally of its first walks.
    pub fn new(target: &Target, estimates: &Estimates, level: f64) -> Self {
        let (experiment, walks) = (estimates.experiment(), estimates.tally().counts.walks);
        let mut prospect = Prospect {
            standings: standings(estimates, target).map(|(_, standing)| standing).collect(),
            spread: Spread { mean: 0.0, variance: 0.0 },
            walks,
            level,
            target: target.clone(),
            chains: !experiment.unit().is_walk(),
            paths_per_walk: experiment.unit().paths(),
        };
        let known = prospect.standings.iter().filter(|s| s.error.is_finite() && s.error > 0.0);
        let logs: Vec<[f64; 2]> = known.map(|s| [s.error.ln(), prospect.noise_of(s)]).collect();
        let count = logs.len().max(1) as f64;
        let mean = logs.iter().map(|[log, _]| log).sum::<f64>() / count;
        let excess = logs.iter().map(|[log, noise]| (log - mean).powi(2) - noise * noise);
        prospect.spread = Spread { mean, variance: (excess.sum::<f64>() / count).max(0.0) };
        prospect
    }

    /// Keeps every k-th face, so that at most `most` are left: a running job is examined often.
    #[must_use]
    pub fn thinned(mut self, most: usize) -> Self {
        let step = self.standings.len().div_ceil(most).max(1);
        self.standings = self.standings.into_iter().step_by(step).collect();
        self
    }

    /// Whether the run meets its target after `walks` walks, if errors are larger by the part `noise` than the pilot
    /// says.
    pub fn is_met(&self, walks: u64, noise: f64) -> bool {
        self.meets(walks, noise, self.target.relative_error, self.target.min_hits as f64)
    }

    /// Whether a look after `walks` walks shows that twice as many will do.
    pub fn is_promising(&self, walks: u64, noise: f64) -> bool {
        walks.saturating_mul(self.paths_per_walk) >= self.target.min_paths
            && self.meets(
                walks,
                noise,
                foresight(self.target.relative_error),
                0.5 * self.target.min_hits as f64,
            )
    }

    fn meets(&self, walks: u64, noise: f64, error: f64, scores: f64) -> bool {
        let later = self.standings.iter().map(|standing| self.later(standing, walks, noise));
        let [part] = parts_within(later, [Bar { error, scores }]);
        part >= self.target.fraction
    }

    /// The accuracy of a face after `walks` walks. The largest of many errors is partly large by chance, and this part
    /// fades: the observed spread is √(true variance + noise²), and the noise falls as the walks grow.
    fn later(&self, standing: &Standing, walks: u64, noise: f64) -> Standing {
        let growth = walks as f64 / self.walks as f64;
        let Spread { mean, variance } = self.spread;
        let own = self.noise_of(standing).powi(2);
        let faded = if own > 0.0 { ((variance + own / growth) / (variance + own)).sqrt() } else { 1.0 };
        let student =
            if self.chains { student(self.level, walks) / student(self.level, self.walks) } else { 1.0 };
        let error = (mean + (standing.error.ln() - mean) * faded).exp();
        Standing {
            error: error * student * (1.0 + noise) / growth.sqrt(),
            scores: standing.scores * growth,
            ..*standing
        }
    }

    /// The standard error of a face's error, as a part of it: about 1/(2√h) with h scores, and 1/√(2(n − 1)) for n
    /// chains.
    fn noise_of(&self, standing: &Standing) -> f64 {
        match self.chains {
            true => (0.5 / (self.walks.max(2) - 1) as f64).sqrt(),
            false => 0.5 / standing.scores.sqrt(),
        }
    }

    /// The noise of the error that decides.
    pub fn noise(&self) -> f64 {
        self.decisive().map_or(0.0, |standing| self.noise_of(standing))
    }

    /// The error that decides; 0 if there are no faces.
    pub fn error(&self) -> f64 {
        self.decisive().map_or(0.0, |standing| standing.error)
    }

    /// The face whose error decides: the largest error outside the part of the area that may miss the target.
    fn decisive(&self) -> Option<&Standing> {
        let mut worst_first: Vec<&Standing> = self.standings.iter().collect();
        worst_first.sort_by(|a, b| b.error.total_cmp(&a.error));
        let spared = (1.0 - self.target.fraction) * worst_first.iter().map(|s| s.area).sum::<f64>();
        let mut passed = 0.0;
        worst_first.into_iter().find(|standing| {
            passed += standing.area;
            passed > spared * (1.0 + 1e-9)
        })
    }
}

fn student(level: f64, chains: u64) -> f64 {
    stats::student_quantile(0.5 + 0.5 * level, chains.max(2) - 1)
}

#[cfg(test)]
mod tests {
    use job::Unhit;

    use super::*;

    /// The deciding error of the thinned faces is that of all faces, but for the part of the area that one thinned face
    /// stands for.
    #[test]
    fn a_glance_sees_what_decides() {
        let target = Target {
            relative_error: 0.01,
            fraction: 0.9,
            min_paths: 0,
            min_hits: 10,
            unhit: Unhit::Infinite,
            patches: None,
        };
        let standing = |i: u32| Standing { area: 1.0, error: f64::from(i), scores: 100.0, hits: 100 };
        let whole = || Prospect {
            standings: (0..10_000).map(|i| standing(i * 7 % 10_000)).collect(),
            spread: Spread { mean: 0.0, variance: 1.0 },
            walks: 1000,
            level: 0.95,
            target: target.clone(),
            chains: false,
            paths_per_walk: 1,
        };
        assert_eq!(whole().error(), 8999.0);
        assert_eq!(whole().thinned(10_000).error(), 8999.0);
        let glance = whole().thinned(1000);
        assert_eq!(glance.standings.len(), 1000);
        assert!((glance.error() - 8999.0).abs() <= 10.0, "{}", glance.error());
    }
}
