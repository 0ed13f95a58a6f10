//! Targets: whether a job is accurate enough, and what it still takes.
//!
//! `stats::DoubleSampling` decides when to stop, so that intervals stay true. Looks happen at walk counts that the job
//! fixes.

mod face_accuracy;
mod prospect;
mod sensors;
mod total;

use job::{Target, TotalTarget};
use parallel::run_on_all_cores;
use protocol::Look;
use radiosity::{Estimates, Experiment, Tally, precision::Quantity, sensors::Readings};
use report::WorstPatch;
use stats::{DoubleSampling, foresight};

pub use self::face_accuracy::about;
use self::face_accuracy::{Bar, FaceAccuracy, face_accuracies, parts_within};
pub use self::prospect::Prospect;
pub(crate) use self::sensors::FEWEST_SAMPLES;
pub use self::sensors::{SensorGoal, asked_of_sensors, judge_sensors};
pub use self::total::total_is_met;
use crate::drift::{ScoreMoments, drift};

/// The number of walks at the first look. Fewer walks tell little, even about how little they tell.
const FIRST_LOOK: u64 = 1 << 10;

/// The number of chains at the first look; the spread of fewer tells nothing.
const FIRST_LOOK_AT_CHAINS: u64 = 8;

/// The number of patches furthest from a target that are named.
const NAMED: usize = 5;

/// Judges a tally of `paths` paths by a target.
pub fn judge(target: &Target, estimates: &Estimates, paths: u64) -> report::TargetReport {
    let scene = estimates.scene();
    let Target { relative_error, fraction, quantity, .. } = *target;
    let bar = Bar { error: relative_error, scores: target.min_hits as f64 };
    let mut ranks = face_accuracies(estimates, target);
    let [achieved] = parts_within(ranks.iter().map(|(_, accuracy)| *accuracy), [bar]);
    let judged = !ranks.is_empty();
    let reached = judged && achieved >= fraction && paths >= target.min_paths;
    ranks.sort_by(|(i, a), (j, b)| b.error.total_cmp(&a.error).then(i.cmp(j)));
    let worst_first = || ranks.iter().copied();
    let needed = |accuracy: &FaceAccuracy| {
        let by_error = (accuracy.error / relative_error).powi(2);
        paths as f64 * by_error.max(target.min_hits as f64 / accuracy.scores)
    };
    let named = worst_first().filter(|(_, s)| !bar.is_met(s)).take(NAMED).map(|(face, s)| WorstPatch {
        patch: scene.faces().get(face).patch as usize,
        words: report::face_words(scene, face),
        surface: scene.surface_name(scene.faces().get(face).surface).into(),
        relative_error: s.error,
        hits: u64::try_from(s.hits).unwrap_or(u64::MAX),
        paths_needed: needed(&s),
    });
    let total: f64 = ranks.iter().map(|(_, accuracy)| accuracy.area).sum();
    let mut spared = (1.0 - fraction) * total;
    // The worst faces may stay as they are, as long as the rest makes up the fraction.
    let mut decisive = worst_first().filter(|(_, accuracy)| {
        spared -= accuracy.area;
        spared < -1e-9 * total
    });
    let paths_needed = match decisive.next() {
        _ if reached => None,
        Some((_, accuracy)) => {
            Some(needed(&accuracy).max(target.min_paths as f64)).filter(|paths| paths.is_finite())
        }
        None => None,
    };
    report::TargetReport {
        reached,
        relative_error,
        fraction,
        patches: target.patches.clone(),
        quantity,
        achieved: if judged { achieved } else { f64::NAN },
        paths_needed,
        worst: named.collect(),
    }
}

/// The observer of one job: it looks at the job's prefixes.
pub struct Observer {
    experiment: Experiment,
    level: f64,
    target: Option<Target>,
    sensors: Option<SensorGoal>,
    total: Option<TotalTarget>,
    /// The discretisation of the answer that a pilot predicted.
    predicted: Option<f64>,
    /// The sample of the previous look, or of the tally that the run was resumed from.
    before: Option<ScoreMoments>,
}

impl Observer {
    /// An observer of a job whose intervals have this level each.
    pub fn new(experiment: Experiment, level: f64, target: Option<Target>) -> Self {
        Observer { experiment, level, target, sensors: None, total: None, predicted: None, before: None }
    }

    /// Adds the job's target on sensors.
    pub fn with_sensors(self, sensors: Option<SensorGoal>) -> Self {
        Observer { sensors, ..self }
    }

    /// Adds the job's target on noise and discretisation together, of which a pilot may have predicted the second.
    pub fn with_total(self, total: Option<TotalTarget>, predicted: Option<f64>) -> Self {
        Observer { total, predicted, ..self }
    }

    /// Sets the tally that a resumed job goes on from: the first look compares the walks since then with it.
    pub fn going_on_from(self, past: &Tally) -> Self {
        let before =
            (past.counts.walks > 0).then(|| ScoreMoments::new(past, self.experiment.scene().faces().len()));
        Observer { before, ..self }
    }

    /// Looks at the tally of a prefix.
    pub fn look(&mut self, tally: &Tally, looks: &[Look]) -> Look {
        let walks = tally.counts.walks;
        let estimates = Estimates::new(&self.experiment, tally, self.level);
        let quantity = self.target.as_ref().map_or_else(Quantity::default, |target| target.quantity);
        let precision = estimates.precision(quantity, &run_on_all_cores);
        let of_patches = self.target.as_ref().map(|target| {
            let early = walks * self.experiment.unit().paths() < target.min_paths;
            if early { [false; 2] } else { meets(target, &estimates) }
        });
        let of_sensors = self.sensors.as_ref().map(|goal| {
            [goal.is_met(&self.experiment, tally), goal.is_met_within(foresight, &self.experiment, tally)]
        });
        let of_total = self.total.as_ref().map(|target| {
            // What a scene's sensors read has intervals, too, and needs samples for them.
            let is_sensed = Readings::new(&self.experiment, tally, self.level)
                .is_none_or(|readings| readings.samples() >= FEWEST_SAMPLES);
            let early = walks * self.experiment.unit().paths() < target.min_paths;
            if early || !is_sensed { [false; 2] } else { total::meets(target, self.predicted, &estimates) }
        });
        let asked = of_patches
            .into_iter()
            .chain(of_sensors)
            .chain(of_total)
            .reduce(|a, b| [a[0] && b[0], a[1] && b[1]]);
        let (promising, reached) =
            asked.map_or((false, false), |[met, promising]| (promising, ends(walks, looks, met, promising)));
        let now = ScoreMoments::new(tally, self.experiment.scene().faces().len());
        let drift = self.before.as_ref().map_or(f64::NAN, |before| drift(before, &now));
        self.before = Some(now);
        Look {
            walks,
            rays: tally.counts.rays,
            median_relative_error: precision.headline.quantiles[0],
            max_relative_error: precision.max_relative_error,
            drift,
            promising,
            reached,
        }
    }
}

/// Whether a target is met, and whether twice these walks will meet it.
fn meets(target: &Target, estimates: &Estimates) -> [bool; 2] {
    let Target { relative_error, fraction, .. } = *target;
    let scores = target.min_hits as f64;
    let met = Bar { error: relative_error, scores };
    let foreseen = Bar { error: foresight(relative_error), scores: 0.5 * scores };
    let face_accuracies = face_accuracies(estimates, target).into_iter().map(|(_, accuracy)| accuracy);
    parts_within(face_accuracies, [met, foreseen]).map(|part| part >= fraction)
}

/// Whether a run ends after this number of walks.
fn ends(walks: u64, looks: &[Look], met: bool, promising: bool) -> bool {
    let mut rule = DoubleSampling::default();
    // Targets that were met at earlier looks did not end the run.
    for look in looks {
        rule.look(look.walks, look.promising, false);
    }
    rule.look(walks, promising, met)
}

/// The walk (or chain) counts at which a run of `walks` walks is looked at. Fewer walks than patches tell nothing of
/// most patches, and a look at many patches takes time; a chain tells of every patch, and takes longer than a look.
pub fn looks(experiment: &Experiment, walks: u64) -> Vec<u64> {
    match experiment.unit().batch() {
        Some(_) => ladder(FIRST_LOOK_AT_CHAINS, walks, 0),
        None => ladder(FIRST_LOOK, walks, experiment.scene().faces().len()),
    }
}

/// The numbers 2^k and 3·2^(k−1) from both `first` and `least` on, up to `walks`: they depend on the job alone.
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
}
