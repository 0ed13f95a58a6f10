//! The methods that are compared, as overrides of the job, so that a job's own refusals apply here.

use std::path::Path;

use job::Job;
use radiosity::{Experiment, Scene, Sequence, Space};
use serde::{Deserialize, Serialize};

/// The kinds of walks with their settings, by name.
const METHODS: &[(&str, &str)] = &[
    ("collision", r#"{ estimator = "collision" }"#),
    ("absorption", r#"{ estimator = "absorption" }"#),
    ("survival", r#"{ estimator = "survival" }"#),
    ("infinite", r#"{ estimator = "infinite" }"#),
    (
        "infinite, cut at 0.001",
        r#"{ estimator = "infinite", infinite = { end = "cutoff", threshold = 0.001 } }"#,
    ),
    ("infinite, 20 hits", r#"{ estimator = "infinite", infinite = { end = "length", length = 20 } }"#),
    ("collision, sobol", r#"{ estimator = "collision", sampler = "sobol" }"#),
    ("continuous", r#"{ estimator = "collision", space = "continuous" }"#),
    ("gathering collision", r#"{ walk = "gathering", estimator = "collision" }"#),
    ("gathering absorption", r#"{ walk = "gathering", estimator = "absorption" }"#),
    ("gathering survival", r#"{ walk = "gathering", estimator = "survival" }"#),
    ("gathering infinite", r#"{ walk = "gathering", estimator = "infinite" }"#),
    ("gathering, uniform births", r#"{ walk = "gathering", estimator = "collision", birth = "uniform" }"#),
    ("gathering continuous", r#"{ walk = "gathering", estimator = "collision", space = "continuous" }"#),
    ("chains", r#"{ walk = "jacobi" }"#),
    ("chains of iterations", r#"{ walk = "jacobi", jacobi = { solve = "iterations" } }"#),
    (
        "chains of iterations, sobol",
        r#"{ walk = "jacobi", sampler = "sobol", jacobi = { solve = "iterations" } }"#,
    ),
];

/// A job in which methods are compared.
#[derive(Clone, Copy)]
pub(super) struct Arena<'a> {
    /// The path of the job's file.
    pub path: &'a Path,
    /// The changes of the job, as KEY=VALUE.
    pub set: &'a [String],
    /// The job with its changes.
    pub job: &'a Job,
    /// The scene of the job.
    pub scene: &'a Scene,
}

/// The fewest paths of a Sobol batch.
const FEWEST_PATHS: u64 = 16;

/// A method in a scene, as a job.
pub(super) struct Trial {
    /// The job with the method and the paths of a run.
    pub job: Job,
    /// The experiment of that job.
    pub experiment: Experiment,
}

impl Trial {
    /// The method of a job, with `paths` paths.
    ///
    /// # Errors
    /// If the job is refused, the reason in words.
    pub(super) fn new(arena: &Arena<'_>, method: &str, paths: u64) -> Result<Self, String> {
        let mut overrides = arena.set.to_vec();
        overrides.extend([
            format!("method={method}"),
            format!("budget.paths={paths}"),
            "budget.first_path=0".into(),
        ]);
        let mut job = job::load_as_written(arena.path, &overrides).map_err(|error| error.to_string())?;
        if let Some(note) = job.note {
            return Err(note);
        }
        job.budget.wall_seconds = None;
        let experiment =
            Experiment::new(arena.scene.clone(), job.method.walks()).map_err(|error| error.to_string())?;
        Ok(Trial { job, experiment })
    }

    /// The method of a job, for runs of about `rays` rays.
    ///
    /// # Errors
    /// If the job is refused, the reason in words.
    pub(super) fn of_rays(arena: &Arena<'_>, method: &str, rays: u64) -> Result<Self, String> {
        let trial = Trial::new(arena, method, rays)?;
        if trial.experiment.unit().is_chain() {
            return Ok(trial);
        }
        let paths = (rays as f64 / rays_per_walk(&trial.experiment)) as u64;
        Trial::new(arena, method, paths.max(FEWEST_PATHS))
    }

    /// The number of walks, chains or batches in a run.
    pub(super) fn walks(&self) -> u64 {
        self.job.budget.paths / self.experiment.unit().paths()
    }
}

/// The way in which errors fall with the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Convergence {
    /// Errors fall as 1/√rays.
    Walks,
    /// Errors fall to a bias.
    Biased,
    /// Errors fall faster: links, Sobol sequences.
    Chains,
}

/// A method that can be run.
pub(super) struct Contender {
    /// The name of the method in tables.
    pub name: &'static str,
    /// The method in the scene, for runs of some rays.
    pub trial: Trial,
}

impl Contender {
    /// The way in which its error falls.
    pub(super) fn kind(&self) -> Convergence {
        let experiment = &self.trial.experiment;
        match experiment.unit().batch() {
            Some(_) => Convergence::Chains,
            None if experiment.is_biased() => Convergence::Biased,
            None => Convergence::Walks,
        }
    }

    /// Whether its answer is that of the integral equation, not that of the patches' radiosity system.
    pub(super) fn is_continuous(&self) -> bool {
        self.trial.experiment.method().space() == Space::Continuous
    }
}

/// A method that cannot be run, and the reason.
pub(super) struct Absent {
    /// The name of the method.
    pub name: &'static str,
    /// The reason why it cannot be run.
    pub why: String,
}

/// The settings of a method by its name, as jobs have them.
pub(super) fn method(name: &str) -> Option<&'static str> {
    METHODS.iter().find(|(known, _)| *known == name).map(|&(_, method)| method)
}

/// The names of all methods, in the order of tables.
pub(super) fn names() -> Vec<&'static str> {
    METHODS.iter().map(|&(name, _)| name).collect()
}

/// The methods for runs of `rays` rays in the scene of a job.
pub(super) fn contenders(arena: &Arena<'_>, rays: u64) -> (Vec<Contender>, Vec<Absent>) {
    let (mut able, mut absent) = (Vec::new(), Vec::new());
    for &(name, method) in METHODS {
        match Trial::of_rays(arena, method, rays) {
            Ok(trial) => able.push(Contender { name, trial }),
            Err(why) => absent.push(Absent { name, why }),
        }
    }
    (able, absent)
}

/// The mean number of rays per walk, by a pilot.
fn rays_per_walk(experiment: &Experiment) -> f64 {
    // Paths: the mean is known to a hundredth.
    const SAMPLE: u64 = 20_000;
    // Batches are shot whole.
    let units = SAMPLE.div_ceil(experiment.unit().paths());
    let mut board = experiment.board();
    experiment.walk(&Sequence::new(3), 0..units, &mut board);
    let rays = board.take().expect("the sums of a pilot are small").counts.rays;
    rays as f64 / (units * experiment.unit().paths()) as f64
}
