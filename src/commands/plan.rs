//! `radwalk plan`: what a job will take, before it is run.

use job::{Job, Target};
use judge::plan::bound::Bound;
use judge::plan::cut::{Cut, cuts};
use judge::plan::pilot::Pilot;
use judge::plan::resources::{Costs, Demand};
use judge::target::{asked_of_sensors, scope};
use radiosity::{Estimates, Experiment, Memory};
use report::Units;
use report::words::{duration, quantity};
use results::Settings;
use results::units;
use serde_json::{Value, json};
use voice::{Phase, say};

use crate::args::PlanArgs;
use crate::choose::load_anew;
use crate::clock::cpu_seconds;
use crate::fault::{Fault, Outcome};
use crate::memory;

/// Workers that a plan is made for, unless it is asked for a number of them.
const WORKERS: [u64; 5] = [1, 10, 100, 1_000, 10_000];

/// The plan of a job, as `--json` prints it.
struct Plan<'a> {
    units: Units,
    target: Option<&'a Target>,
    /// What is asked of sensors, in words.
    of_sensors: Option<String>,
    /// Of the whole job.
    budget: u64,
    /// The paths that a walk counts as.
    paths_per_walk: u64,
    pilot: Pilot,
    bound: Option<Bound>,
    costs: Costs,
    memory: Memory,
    tally_bytes: usize,
    /// Walks that the run will take, its budget permitting.
    walks: u64,
    /// The chains of the job, and those that suit the workers best.
    cuts: Option<[Cut; 2]>,
    demands: Vec<Demand>,
}

/// Plans a job and prints the plan. Nothing is written.
pub(crate) fn plan(args: &PlanArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the scene");
    let job = load_anew(&args.job, &phase)?;
    memory::check(&job, 1)?;
    let experiment = Experiment::new(job.build_scene()?, job.method.walks())?
        .with_sensors(job.scene.sensors())?
        .with_groups(&job.sources, &job.sensitivity)?;
    phase.now("shooting a pilot");
    let plan = Plan::new(&job, &experiment, args.workers);
    drop(phase);
    if args.json {
        say(&plan.json().to_string());
    } else {
        plan.describe();
    }
    Ok(Outcome::Done)
}

impl<'a> Plan<'a> {
    fn new(job: &'a Job, experiment: &Experiment, workers: Option<u64>) -> Self {
        let settings = Settings::of(job);
        let level = settings.level(experiment.scene());
        let target = job.target.as_ref();
        let paths_per_walk = experiment.unit().paths();
        let budget = job.budget.paths / paths_per_walk;
        let first = job.budget.first_path / paths_per_walk;
        let pilot = Pilot::shoot(experiment, job.seed, first, budget, target, level, cpu_seconds);
        let estimates = Estimates::new(experiment, &pilot.tally, level);
        let bound = target.and_then(|target| Bound::new(experiment, target, &estimates, level));
        let costs = Costs::new(experiment, &pilot, peak_memory());
        let sensors = job.sensor_target.as_ref();
        let of_sensors = sensors.map(|target| asked_of_sensors(target, job.scene.sensors()));
        let ending = pilot.ending.filter(|_| of_sensors.is_none() && job.total_target.is_none());
        let walks = ending.map_or(budget, |ending| ending.walks().min(budget));
        let stream = if experiment.unit().is_walk() { job.budget.stream_paths } else { 1 };
        let demand = |workers| costs.demand(walks as f64, stream as f64, workers);
        Plan {
            units: units(job.light),
            memory: experiment.scene().memory(),
            tally_bytes: size_of_val(pilot.tally.sums()),
            target,
            of_sensors,
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

    fn json(&self) -> Value {
        let Plan { pilot, bound, .. } = self;
        json!({
            "target": self.target.map(|t| json!({"relative_error": t.relative_error, "fraction": t.fraction, "patches": t.patches})),
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

    fn describe(&self) {
        let counts = &self.pilot.tally.counts;
        say(&format!(
            "pilot: {} paths, {} rays, {} of processor time",
            quantity(self.paths(counts.walks) as f64),
            quantity(counts.rays as f64),
            duration(self.pilot.seconds)
        ));
        self.describe_end();
        if let Some(bound) = &self.bound {
            describe_bound(bound, &self.units);
        }
        say(&format!(
            "so: {} paths, about {} rays",
            quantity(self.paths(self.walks) as f64),
            quantity(self.rays())
        ));
        let [surfaces, index, tally] = [self.memory.surfaces, self.memory.index, self.tally_bytes]
            .map(|bytes| format!("{}B", quantity(bytes as f64)));
        say(&format!("memory: {surfaces} for surfaces, {index} for the index of rays, {tally} for a tally"));
        if let Some(bytes) = self.costs.memory_bytes {
            say(&format!("a worker of one thread holds {}B at its peak", quantity(bytes)));
        }
        say("  workers       time   results in all   per second");
        for demand in &self.demands {
            let [all, rate] =
                [demand.traffic_bytes, demand.bytes_per_second].map(|b| format!("{}B", quantity(b)));
            say(&format!("{:>9} {:>10} {all:>16} {rate:>12}", demand.workers, duration(demand.seconds)));
        }
        say("times are for processors like this one, all alike, with one thread a worker");
        if let Some(cuts) = self.cuts {
            describe_cuts(cuts);
        }
    }

    /// Where the run ends, and why.
    fn describe_end(&self) {
        if let Some(sensors) = &self.of_sensors {
            say(&format!(
                "{sensors}: a pilot cannot predict when; the run goes on until this is reached, or to its budget"
            ));
        }
        let Some(target) = self.target else {
            if self.of_sensors.is_none() {
                say("no target: the whole budget will be spent");
            }
            return;
        };
        let what = format!(
            "relative half-widths of {} on {} of {}",
            target.relative_error,
            target.fraction,
            scope(target.patches.as_deref())
        );
        let Some(ending) = self.pilot.ending else {
            return say(&format!("{what}: this pilot cannot predict when; the plan is for the whole budget"));
        };
        let [least, most] = [ending.least, ending.most].map(|walks| quantity(self.paths(walks) as f64));
        let range = if least == most { least } else { format!("{least} … {most}") };
        say(&format!("{what}: reached at {range} paths"));
        if ending.most > self.budget {
            say(&format!(
                "the budget of {} paths {} the run before (target not reached); give --paths {} or more",
                quantity(self.paths(self.budget) as f64),
                if ending.least > self.budget { "ends" } else { "may end" },
                self.paths(ending.most)
            ));
        }
    }
}

/// The chains that err least at the same time.
fn describe_cuts([now, best]: [Cut; 2]) {
    if now.chains == best.chains {
        return say(&format!("{} chains suit {} workers", now.chains, now.workers));
    }
    say(&format!(
        "for {} workers batch_paths = {} ({} chains) errs least at a given time; the job has {} chains of {} rays",
        now.workers, best.batch_paths, best.chains, now.chains, now.batch_paths
    ));
}

/// What the theory of S97 guarantees.
fn describe_bound(bound: &Bound, units: &Units) {
    let rays = bound.rays.map_or(String::new(), |rays| format!(", {} rays", quantity(rays)));
    say(&format!(
        "bound (S97 §§2.3, 3.3): no variance of a walk exceeds {:.3e} ({})²; for {:.3e} (the darkest patch: {:.4} {}) \
         {} paths{rays} always do, the run ends at {} at the latest",
        bound.variance,
        units.radiosity,
        bound.threshold,
        bound.darkest,
        units.radiosity,
        quantity(bound.walks),
        quantity(bound.ends as f64)
    ));
}

/// The most memory that this process has held, on Linux.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().next()?.parse::<f64>().ok()?)
}
