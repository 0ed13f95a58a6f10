//! Whether the readings of sensors meet the target that a job sets them.

use job::{SensorTarget, Unhit};
use radiosity::{
    Experiment, Tally,
    sensors::{Readings, SensorSpec},
};
use report::{SensorSummary, SensorsSummary};

/// The fewest samples of sensors whose spread tells anything.
pub(crate) const FEWEST_SAMPLES: u64 = 8;

/// A target on sensors, and the level of each of their intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorGoal {
    /// The target of the job.
    pub target: SensorTarget,
    /// The level of each interval, in (0, 1).
    pub level: f64,
}

impl SensorGoal {
    /// Whether every sensor of the target is within `part` of its error, with samples enough to tell.
    pub(super) fn is_met_within(
        &self,
        part: impl Fn(f64) -> f64,
        experiment: &Experiment,
        tally: &Tally,
    ) -> bool {
        let Some(readings) = Readings::new(experiment, tally, self.level) else { return false };
        let SensorTarget { sensors, min_paths, unhit } = &self.target;
        let paths = tally.counts.walks.saturating_mul(experiment.unit().paths());
        let ignore_dark = *unhit == Unhit::Ignore;
        let known =
            |&(sensor, error): &(u32, f64)| readings.worst_error(sensor as usize, ignore_dark) <= part(error);
        paths >= *min_paths && readings.samples() >= FEWEST_SAMPLES && sensors.iter().all(known)
    }

    /// What is asked of every patch of a sensor.
    pub fn asked_of(&self, number: usize) -> Option<f64> {
        let asked = self.target.sensors.iter().find(|(sensor, _)| *sensor as usize == number);
        asked.map(|&(_, error)| error)
    }

    /// Whether a tally meets the target.
    pub fn is_met(&self, experiment: &Experiment, tally: &Tally) -> bool {
        self.is_met_within(|error| error, experiment, tally)
    }
}

/// The result of a tally's sensors, and whether they meet their target.
pub fn judge_sensors(
    goal: Option<&SensorGoal>,
    readings: &Readings,
    experiment: &Experiment,
    tally: &Tally,
) -> SensorsSummary {
    let sensors = readings.sensors();
    let asked = |number: usize| goal?.asked_of(number);
    let of_cells = sensors.specs().iter().enumerate().filter(|(_, spec)| !spec.shape.is_plane());
    let list = of_cells.map(|(number, spec)| SensorSummary {
        name: spec.name.clone(),
        patches: sensors.cells_of(number).len(),
        relative_error: readings.worst_error(number, false),
        target: asked(number),
    });
    SensorsSummary {
        samples: readings.samples(),
        rays: readings.rays(),
        reached: goal.map(|goal| goal.is_met(experiment, tally)),
        list: list.collect(),
    }
}

/// A target on sensors, in words.
pub fn asked_of_sensors(target: &SensorTarget, sensors: &[SensorSpec]) -> String {
    let asked = target.sensors.iter().map(|&(sensor, error)| {
        format!("relative half-width {error} on every patch of sensor {:?}", sensors[sensor as usize].name)
    });
    asked.collect::<Vec<_>>().join(", ")
}
