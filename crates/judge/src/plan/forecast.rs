//! The forecast of a job: what `radwalk plan` prints.

use job::{Job, Target};
use radiosity::{Estimates, Experiment, instruments::Memory};
use report::words::{bytes, duration, quantity};
use report::{Units, target_scope};
use serde_json::{Value, json};

use super::bound::Bound;
use super::cut::{ChainSplit, cuts};
use super::pilot::PlanPilot;
use super::resources::{Costs, ResourceDemand};
use crate::target::{SensorGoal, asked_of_sensors, judge};

/// Workers that a forecast is made for, unless it is asked for a number of them.
const WORKERS: [u64; 5] = [1, 10, 100, 1_000, 10_000];

/// What a job will take, by a pilot and by theory.
pub struct RunForecast<'a> {
    target: Option<&'a Target>,
    /// Whether the pilot can tell of no patch that the target is about.
    nothing: bool,
    /// What is asked of sensors, in words.
    of_sensors: Option<String>,
    /// What is asked of all patches together, in words.
    of_total: Option<String>,
    /// The budget of the whole job.
    budget: u64,
    /// The paths that a walk counts as.
    paths_per_walk: u64,
    pilot: PlanPilot,
    bound: Option<Bound>,
    costs: Costs,
    memory: Memory,
    tally_bytes: usize,
    /// Walks that the run will take, its budget permitting.
    walks: u64,
    /// The chains of the job, and those that suit the workers best.
    cuts: Option<[ChainSplit; 2]>,
    demands: Vec<ResourceDemand>,
}

/// What this process has taken so far.
#[derive(Clone, Copy)]
pub struct ProcessMeters {
    /// Processor time [s].
    pub cpu_seconds: fn() -> f64,
    /// The most memory that it has held [bytes], where the system tells.
    pub peak_memory: fn() -> Option<f64>,
}

impl<'a> RunForecast<'a> {
    /// Walks a pilot of a job whose intervals have `level` each and whose sensors have a `goal`, for the number of `workers`
    /// that is asked for.
    pub fn of(
        job: &'a Job,
        experiment: &Experiment,
        (level, goal): (f64, Option<&SensorGoal>),
        workers: Option<u64>,
        meters: ProcessMeters,
    ) -> Self {
        let target = job.target.as_ref();
        let paths_per_walk = experiment.unit().paths();
        let budget = job.budget.paths / paths_per_walk;
        let first = job.budget.first_path / paths_per_walk;
        let pilot =
            PlanPilot::shoot(experiment, job.seed, first, budget, (target, goal), level, meters.cpu_seconds);
        let estimates = Estimates::new(experiment, &pilot.tally, level);
        let bound = target.and_then(|target| Bound::new(experiment, target, &estimates, level));
        let costs = Costs::new(experiment, &pilot, (meters.peak_memory)());
        let sensors = job.sensor_target.as_ref();
        let of_sensors = sensors.map(|target| asked_of_sensors(target, job.scene.sensors()));
        let of_total =
            job.total_target.map(|target| format!("a total error of {} over the area", target.total_error));
        let ending = pilot.ending.filter(|_| job.total_target.is_none());
        let walks = ending.map_or(budget, |ending| ending.walks().min(budget));
        let stream = if experiment.unit().is_walk() { job.budget.stream_paths } else { 1 };
        let demand = |workers| costs.demand(walks as f64, stream as f64, workers);
        RunForecast {
            memory: experiment.scene().memory(),
            tally_bytes: size_of_val(pilot.tally.sums()),
            target,
            nothing: target.is_some_and(|target| judge(target, &estimates, 0).achieved.is_nan()),
            of_sensors,
            of_total,
            budget,
            paths_per_walk,
            bound,
            costs,
            walks,
            cuts: workers.and_then(|workers| cuts(experiment, job.budget.paths, workers)),
            demands: workers.map_or(WORKERS.map(demand).into(), |workers| vec![demand(workers)]),
            pilot,
        }
    }

    fn paths(&self, walks: u64) -> u64 {
        walks.saturating_mul(self.paths_per_walk)
    }

    fn rays(&self) -> f64 {
        self.walks as f64 * self.pilot.rays_per_walk()
    }

    /// The forecast as `--json` prints it.
    pub fn json(&self) -> Value {
        let RunForecast { pilot, bound, .. } = self;
        json!({
            "sensors": self.of_sensors,
            "target": self.target.map(|t| json!({"relative_error": t.relative_error, "fraction": t.fraction, "patches": t.patches, "quantity": t.quantity.word()})),
            "budget_paths": self.paths(self.budget),
            "pilot": {
                "paths": self.paths(pilot.tally.counts.walks),
                "rays": pilot.tally.counts.rays,
                "cpu_seconds": pilot.seconds,
            },
            "bound": bound.map(|b| json!({
                "darkest_radiosity": b.darkest,
                "variance_threshold": b.threshold,
                "variance_of_a_walk": b.variance,
                "paths": b.walks,
                "ends_at_paths": b.ends,
                "rays": b.rays,
            })),
            "ending": pilot.ending.map(|e| json!({
                "least_paths": self.paths(e.least),
                "most_paths": self.paths(e.most),
                "within_budget": e.most <= self.budget,
            })),
            "paths": self.paths(self.walks),
            "rays": self.rays(),
            "memory_bytes": {
                "surfaces": self.memory.surfaces,
                "index": self.memory.index,
                "tally": self.tally_bytes,
            },
            "worker_memory_bytes": self.costs.memory_bytes,
            "workers": self.demands,
            "chains": self.cuts.map(|[now, best]| json!({ "now": now, "best": best })),
        })
    }

    /// The forecast in words; `units` are those of the scene's light.
    pub fn lines(&self, units: &Units) -> Vec<String> {
        let counts = &self.pilot.tally.counts;
        let mut lines = vec![format!(
            "pilot: {} paths, {} rays, {} of processor time",
            quantity(self.paths(counts.walks) as f64),
            quantity(counts.rays as f64),
            duration(self.pilot.seconds)
        )];
        lines.extend(self.end());
        lines.extend(self.bound.iter().map(|bound| of_bound(bound, units)));
        let (paths, rays) = (quantity(self.paths(self.walks) as f64), quantity(self.rays()));
        lines.push(format!("so: {paths} paths, about {rays} rays"));
        let [surfaces, index, tally] =
            [self.memory.surfaces, self.memory.index, self.tally_bytes].map(|size| bytes(size as u64));
        lines.push(format!(
            "memory: {surfaces} for surfaces, {index} for the index of rays, {tally} for a tally"
        ));
        let worker = |size: f64| format!("a worker of one thread holds {} at its peak", bytes(size as u64));
        lines.extend(self.costs.memory_bytes.map(worker));
        lines.push("  workers       time   results in all   per second".into());
        lines.extend(self.demands.iter().map(|demand| {
            let [all, rate] = [demand.traffic_bytes, demand.bytes_per_second].map(|size| bytes(size as u64));
            format!("{:>9} {:>10} {all:>16} {rate:>12}", demand.workers, duration(demand.seconds))
        }));
        lines.push("times are for processors like this one, all alike, with one thread a worker".into());
        lines.extend(self.cuts.map(of_cuts));
        lines
    }

    /// Where the run ends, and why.
    fn end(&self) -> Vec<String> {
        let of_patches = self.target.map(|target| {
            let area = target_scope(target.patches.as_deref(), target.quantity);
            let quantity = target.quantity.words();
            format!(
                "relative half-widths of {} of the {quantity} on {} of {area}",
                target.relative_error, target.fraction
            )
        });
        let asked = of_patches.into_iter().chain(self.of_sensors.clone()).chain(self.of_total.clone());
        let asked: Vec<String> = asked.collect();
        if asked.is_empty() {
            return vec!["no target: the whole budget will be spent".into()];
        }
        let what = asked.join("; ");
        if self.nothing {
            return vec![format!("{what}: there is nothing to judge; the whole budget will be spent")];
        }
        let Some(ending) = self.pilot.ending.filter(|_| self.of_total.is_none()) else {
            return vec![format!("{what}: this pilot cannot predict when; the plan is for the whole budget")];
        };
        let [least, most] = [ending.least, ending.most].map(|walks| quantity(self.paths(walks) as f64));
        let range = if least == most { least } else { format!("{least} … {most}") };
        let mut lines = vec![format!("{what}: reached at {range} paths")];
        if ending.most > self.budget {
            lines.push(format!(
                "the budget of {} paths {} the run before (target not reached); give --paths {} or more",
                quantity(self.paths(self.budget) as f64),
                if ending.least > self.budget { "ends" } else { "may end" },
                self.paths(ending.most)
            ));
        }
        lines
    }
}

/// The chains that err least at the same time.
fn of_cuts([now, best]: [ChainSplit; 2]) -> String {
    if now.chains == best.chains {
        return format!("{} chains suit {} workers", now.chains, now.workers);
    }
    format!(
        "for {} workers batch_paths = {} ({} chains) errs least at a given time; the job has {} chains of {} rays",
        now.workers, best.batch_paths, best.chains, now.chains, now.batch_paths
    )
}

/// What the theory of S97 guarantees.
fn of_bound(bound: &Bound, units: &Units) -> String {
    let rays = bound.rays.map_or(String::new(), |rays| format!(", {} rays", quantity(rays)));
    format!(
        "bound (S97 §§2.3, 3.3): no variance of a walk exceeds {:.3e} ({})²; for {:.3e} (the darkest patch: {:.4} {}) \
         {} paths{rays} always do, the run ends at {} at the latest",
        bound.variance,
        units.radiosity,
        bound.threshold,
        bound.darkest,
        units.radiosity,
        quantity(bound.walks),
        quantity(bound.ends as f64)
    )
}
