//! Prospects: what the first walks of a job predict of its errors later.

use job::{SensorTarget, Target, Unhit};
use radiosity::{Estimates, precision::Quantity, sensors::Readings};
use stats::foresight;

use super::face_accuracy::{Bar, FaceAccuracy, face_accuracies, parts_within};
use super::sensors::{FEWEST_SAMPLES, SensorGoal};

/// The errors that a pilot predicts for its run: they fall as 1/√walks (for chains, with Student's t besides).
pub struct Prospect {
    face_accuracies: Vec<FaceAccuracy>,
    spread: ErrorSpread,
    /// Independent samples of the pilot: walks, chains, or samples of sensors.
    samples: u64,
    /// Walks of a sample.
    walks_per_sample: u64,
    /// The fewest samples whose spread tells anything.
    fewest: u64,
    /// The level of the intervals, in (0, 1).
    level: f64,
    target: Target,
    /// Whether intervals are those of Student.
    student: bool,
    paths_per_walk: u64,
}

/// The spread of the logarithms of errors over patches: a part of it is the pilot's own noise, which fades.
#[derive(Clone, Copy, Debug)]
struct ErrorSpread {
    mean: f64,
    /// The variance without the pilot's noise.
    variance: f64,
}

impl Prospect {
    /// What a job asks of patches and of each sensor, by the tally of its first walks; `most` faces at most are kept.
    pub fn all(
        target: Option<&Target>,
        sensors: Option<&SensorGoal>,
        estimates: &Estimates,
        (level, most): (f64, usize),
    ) -> Vec<Self> {
        let of_faces = target.map(|target| Prospect::new(target, estimates, level).thinned(most));
        let of_sensors = sensors.map(|goal| Prospect::of_sensors(goal, estimates)).unwrap_or_default();
        of_faces.into_iter().chain(of_sensors).collect()
    }

    /// The prospect of the patches of a job.
    fn new(target: &Target, estimates: &Estimates, level: f64) -> Self {
        let (experiment, walks) = (estimates.experiment(), estimates.tally().counts.walks);
        let prospect = Prospect {
            face_accuracies: face_accuracies(estimates, target)
                .into_iter()
                .map(|(_, accuracy)| accuracy)
                .collect(),
            spread: ErrorSpread { mean: 0.0, variance: 0.0 },
            samples: walks,
            walks_per_sample: 1,
            fewest: 1,
            level,
            target: target.clone(),
            student: !experiment.unit().is_walk(),
            paths_per_walk: experiment.unit().paths(),
        };
        prospect.with_spread()
    }

    /// The prospects of the sensors that a target is about. All cells of a sensor must meet it.
    fn of_sensors(goal: &SensorGoal, estimates: &Estimates) -> Vec<Self> {
        let (experiment, tally) = (estimates.experiment(), estimates.tally());
        let Some(readings) = Readings::new(experiment, tally, goal.level) else { return Vec::new() };
        let SensorTarget { sensors, min_paths, unhit } = &goal.target;
        let unit = experiment.unit();
        let prospect = |&(sensor, relative_error): &(u32, f64)| {
            let errors = readings.errors(sensor as usize, *unhit == Unhit::Ignore);
            let accuracy = |error| FaceAccuracy { area: 1.0, error, scores: f64::INFINITY, hits: 0 };
            let prospect = Prospect {
                face_accuracies: errors.map(accuracy).collect(),
                spread: ErrorSpread { mean: 0.0, variance: 0.0 },
                samples: readings.samples(),
                walks_per_sample: if unit.is_walk() { readings.sensors().sample_walks() } else { 1 },
                fewest: FEWEST_SAMPLES,
                level: goal.level,
                target: Target {
                    relative_error,
                    fraction: 1.0,
                    min_paths: *min_paths,
                    min_hits: 0,
                    unhit: *unhit,
                    patches: None,
                    quantity: Quantity::Irradiance,
                },
                student: true,
                paths_per_walk: unit.paths(),
            };
            prospect.with_spread()
        };
        sensors.iter().map(prospect).collect()
    }

    fn with_spread(mut self) -> Self {
        let known = self.face_accuracies.iter().filter(|s| s.error.is_finite() && s.error > 0.0);
        let logs: Vec<[f64; 2]> = known.map(|s| [s.error.ln(), self.noise_of(s)]).collect();
        let count = logs.len().max(1) as f64;
        let mean = logs.iter().map(|[log, _]| log).sum::<f64>() / count;
        let excess = logs.iter().map(|[log, noise]| (log - mean).powi(2) - noise * noise);
        self.spread = ErrorSpread { mean, variance: (excess.sum::<f64>() / count).max(0.0) };
        self
    }

    /// Keeps every k-th face, so that at most `most` are left: a running job is examined often.
    #[must_use]
    fn thinned(mut self, most: usize) -> Self {
        let step = self.face_accuracies.len().div_ceil(most).max(1);
        self.face_accuracies = self.face_accuracies.into_iter().step_by(step).collect();
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
        let samples = walks / self.walks_per_sample;
        if samples < self.fewest {
            return false;
        }
        let later = self.face_accuracies.iter().map(|accuracy| self.later(accuracy, samples, noise));
        let [part] = parts_within(later, [Bar { error, scores }]);
        part >= self.target.fraction
    }

    /// The accuracy of a face after some samples. The largest of many errors is partly large by chance, and this part
    /// fades: the observed spread is √(true variance + noise²), and the noise falls as the samples grow.
    fn later(&self, accuracy: &FaceAccuracy, samples: u64, noise: f64) -> FaceAccuracy {
        let growth = samples as f64 / self.samples as f64;
        let ErrorSpread { mean, variance } = self.spread;
        let own = self.noise_of(accuracy).powi(2);
        let faded = if own > 0.0 { ((variance + own / growth) / (variance + own)).sqrt() } else { 1.0 };
        let student = match self.student {
            true => student(self.level, samples) / student(self.level, self.samples),
            false => 1.0,
        };
        let error = (mean + (accuracy.error.ln() - mean) * faded).exp();
        FaceAccuracy {
            error: error * student * (1.0 + noise) / growth.sqrt(),
            scores: accuracy.scores * growth,
            ..*accuracy
        }
    }

    /// The standard error of a face's error, as a part of it: about 1/(2√h) with h scores, and 1/√(2(n − 1)) for n
    /// chains.
    fn noise_of(&self, accuracy: &FaceAccuracy) -> f64 {
        match self.student {
            true => (0.5 / (self.samples.max(2) - 1) as f64).sqrt(),
            false => 0.5 / accuracy.scores.sqrt(),
        }
    }

    /// The noise of the error that decides.
    pub fn noise(&self) -> f64 {
        self.decisive().map_or(0.0, |accuracy| self.noise_of(accuracy))
    }

    /// The error that decides; infinite if there is nothing to judge.
    pub fn error(&self) -> f64 {
        self.decisive().map_or(f64::INFINITY, |accuracy| accuracy.error)
    }

    /// The face whose error decides: the largest error outside the part of the area that may miss the target.
    fn decisive(&self) -> Option<&FaceAccuracy> {
        let mut worst_first: Vec<&FaceAccuracy> = self.face_accuracies.iter().collect();
        worst_first.sort_by(|a, b| b.error.total_cmp(&a.error));
        let spared = (1.0 - self.target.fraction) * worst_first.iter().map(|s| s.area).sum::<f64>();
        let mut passed = 0.0;
        worst_first.into_iter().find(|accuracy| {
            passed += accuracy.area;
            passed > spared * (1.0 + 1e-9)
        })
    }
}

fn student(level: f64, chains: u64) -> f64 {
    stats::student_quantile(0.5 + 0.5 * level, chains.max(2) - 1)
}

#[cfg(test)]
mod tests {
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
            quantity: Quantity::Irradiance,
        };
        let accuracy = |i: u32| FaceAccuracy { area: 1.0, error: f64::from(i), scores: 100.0, hits: 100 };
        let whole = || Prospect {
            face_accuracies: (0..10_000).map(|i| accuracy(i * 7 % 10_000)).collect(),
            spread: ErrorSpread { mean: 0.0, variance: 1.0 },
            samples: 1000,
            walks_per_sample: 1,
            fewest: 1,
            level: 0.95,
            target: target.clone(),
            student: false,
            paths_per_walk: 1,
        };
        assert_eq!(whole().error(), 8999.0);
        assert_eq!(whole().thinned(10_000).error(), 8999.0);
        let glance = whole().thinned(1000);
        assert_eq!(glance.face_accuracies.len(), 1000);
        assert!((glance.error() - 8999.0).abs() <= 10.0, "{}", glance.error());
    }
}
