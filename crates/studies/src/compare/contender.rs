//! The methods that are compared: as overrides of the job, so that whatever a job refuses is refused here in its words.

use ::judge::MOMENTS;
use job::Job;
use radiosity::{Experiment, Space};
use serde::{Deserialize, Serialize};

use super::Arena;
use crate::walking::walk;

/// A kind of walk with its settings, by name.
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

/// The paths that Sobol batches need.
const FEWEST_PATHS: u64 = 16;

/// A method in a scene as a job.
pub struct Trial {
    /// With the method and the paths of a run.
    pub job: Job,
    /// The same for walking.
    pub experiment: Experiment,
}

impl Trial {
    /// The method of a job, with `paths` paths.
    ///
    /// # Errors
    /// In words, where the job is refused.
    pub fn new(arena: &Arena<'_>, method: &str, paths: u64) -> Result<Self, String> {
        let mut overrides = arena.set.to_vec();
        overrides.extend([
            format!("method={method}"),
            format!("budget.paths={paths}"),
            "budget.first_path=0".into(),
        ]);
        let mut job = job::load(arena.path, &overrides).map_err(|error| error.to_string())?;
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
    /// In words, where the job is refused.
    pub fn of_rays(arena: &Arena<'_>, method: &str, rays: u64) -> Result<Self, String> {
        let trial = Trial::new(arena, method, rays)?;
        if trial.experiment.unit().is_chain() {
            return Ok(trial);
        }
        let paths = (rays as f64 / rays_per_walk(&trial.experiment)) as u64;
        Trial::new(arena, method, paths.max(FEWEST_PATHS))
    }

    /// Walks, chains or batches of a run.
    pub fn walks(&self) -> u64 {
        self.job.budget.paths / self.experiment.unit().paths()
    }
}

/// How errors fall with the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// As 1/√rays.
    Walks,
    /// To a bias.
    Biased,
    /// Faster: links, Sobol sequences.
    Chains,
}

/// A method that can be run.
pub struct Contender {
    /// Names it in tables.
    pub name: &'static str,
    /// The method in the scene, for runs of some rays.
    pub trial: Trial,
}

impl Contender {
    /// How its error falls.
    pub fn kind(&self) -> Kind {
        let experiment = &self.trial.experiment;
        match experiment.unit().batch() {
            Some(_) => Kind::Chains,
            None if experiment.is_biased() => Kind::Biased,
            None => Kind::Walks,
        }
    }

    /// Whether its answer is that of the integral equation, not of the patches' system.
    pub fn is_continuous(&self) -> bool {
        self.trial.experiment.method().space() == Space::Continuous
    }
}

/// A method that cannot, and why.
pub struct Absent {
    /// Its name.
    pub name: &'static str,
    /// Why not.
    pub why: String,
}

/// A method by its name, as jobs have it.
pub fn method(name: &str) -> Option<&'static str> {
    METHODS.iter().find(|(known, _)| *known == name).map(|&(_, method)| method)
}

/// All names, in the order of tables.
pub fn names() -> Vec<&'static str> {
    METHODS.iter().map(|&(name, _)| name).collect()
}

/// The methods for runs of `rays` rays in the scene of a job.
pub fn contenders(arena: &Arena<'_>, rays: u64) -> (Vec<Contender>, Vec<Absent>) {
    let (mut able, mut absent) = (Vec::new(), Vec::new());
    for &(name, method) in METHODS {
        match Trial::of_rays(arena, method, rays) {
            Ok(trial) => able.push(Contender { name, trial }),
            Err(why) => absent.push(Absent { name, why }),
        }
    }
    (able, absent)
}

/// How many rays a walk takes, by a pilot.
fn rays_per_walk(experiment: &Experiment) -> f64 {
    const SAMPLE: u64 = 20_000;
    // Batches are walked whole.
    let units = SAMPLE.div_ceil(experiment.unit().paths());
    let rays = walk::<MOMENTS>(experiment, 3, units).counts.rays;
    rays as f64 / (units * experiment.unit().paths()) as f64
}
