//! The methods that are compared: as overrides of the job, so that whatever a job refuses is refused here in its words.

use job::Job;
use radiosity::{Experiment, Scene, Space};

use super::measure::{Kind, rays_per_walk};
use crate::args::CompareArgs;
use crate::fault::Fault;

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

/// Chains, or batches, of a run.
pub const CHAINS: u64 = 8;

/// A method that can be run.
pub struct Contender {
    /// Names it in tables.
    pub name: &'static str,
    /// The method in the scene, for runs of so many rays.
    pub experiment: Experiment,
    /// Walks or chains of a run.
    pub walks: u64,
}

impl Contender {
    /// How its error falls.
    pub fn kind(&self) -> Kind {
        match self.experiment.batch_paths() {
            Some(_) => Kind::Chains,
            None if self.experiment.is_biased() => Kind::Biased,
            None => Kind::Walks,
        }
    }

    /// Whether its answer is that of the integral equation, not of the patches' system.
    pub fn is_continuous(&self) -> bool {
        self.experiment.method().space == Space::Continuous
    }
}

/// A method that cannot, and why.
pub struct Absent {
    /// Its name.
    pub name: &'static str,
    /// Why not.
    pub why: String,
}

/// All names, in the order of tables.
pub fn names() -> Vec<&'static str> {
    METHODS.iter().map(|&(name, _)| name).collect()
}

/// The methods for runs of `rays` rays in the scene of a job.
pub fn contenders(
    args: &CompareArgs,
    path: &std::path::Path,
    scene: &Scene,
    rays: u64,
) -> (Vec<Contender>, Vec<Absent>) {
    let (mut able, mut absent) = (Vec::new(), Vec::new());
    for &(name, method) in METHODS {
        match contender(args, path, scene, name, method, rays) {
            Ok(contender) => able.push(contender),
            Err(why) => absent.push(Absent { name, why }),
        }
    }
    (able, absent)
}

fn contender(
    args: &CompareArgs,
    path: &std::path::Path,
    scene: &Scene,
    name: &'static str,
    method: &str,
    rays: u64,
) -> Result<Contender, String> {
    let prepare = |paths: u64| -> Result<Experiment, String> {
        let mut overrides = args.set.clone();
        overrides.extend([
            format!("method={method}"),
            format!("budget.paths={paths}"),
            "budget.first_path=0".into(),
        ]);
        let job = job::load(path, &overrides).map_err(|error| error.to_string())?;
        match job.note {
            Some(note) => Err(note),
            None => Experiment::new(scene.clone(), job.method.walks()).map_err(|error| error.to_string()),
        }
    };
    let experiment = prepare(rays)?;
    if experiment.chain_rays().is_some() {
        return Ok(Contender { name, experiment, walks: CHAINS });
    }
    // Batches of walks are told by walks, chains by rays.
    let walks = ((rays as f64 / rays_per_walk(&experiment)) as u64).max(2 * CHAINS);
    match experiment.batch_paths() {
        Some(_) => Ok(Contender { name, experiment: prepare(walks)?, walks: CHAINS }),
        None => Ok(Contender { name, experiment, walks }),
    }
}

/// The job as it is written.
///
/// # Errors
/// Where it is refused.
pub fn load(args: &CompareArgs, path: &std::path::Path) -> Result<(Job, Scene), Fault> {
    let job = job::load(path, &args.set)?;
    let scene = job.build_scene()?;
    Ok((job, scene))
}
