//! The references that errors are measured against.

use exact::Exact;
use job::Job;
use radiosity::{Estimates, Scene, Space};

use super::contender::{Arena, Trial};
use super::shoot::TrialRuns;
use crate::fault::Fault;

/// The most patches of a scene that is no box for which computing form factors is worth the time.
const FEW_PATCHES: usize = 400;

/// The factor by which the reference has more rays than the longest run.
const LONGER: u64 = 16;

/// The distance of the reference's seed from that of the runs.
const SEED: u64 = 1 << 40;

/// The methods of references; the first that a job takes is used.
const DISCRETE: [&str; 2] = [r#"{ walk = "jacobi" }"#, r#"{ estimator = "collision" }"#];
const CONTINUOUS: [&str; 1] = [r#"{ estimator = "collision", space = "continuous" }"#];

/// B of every patch and channel, and the way in which it is known.
pub(super) struct ReferenceSolution {
    /// B [W/m²], the channels of a patch side by side.
    pub radiosity: Vec<f64>,
    /// The squared standard error of each [W²/m⁴]; 0 if it is exact.
    pub variance: Vec<f64>,
    /// The way in which B is known, in words.
    pub how: String,
}

impl ReferenceSolution {
    /// The solution of the patches' radiosity system: exact if that is quickly found, else by chains, or by walks if
    /// chains would be too short. Runs have up to `rays` rays.
    ///
    /// # Errors
    /// As `shoot`.
    pub(super) fn discrete(
        arena: &Arena<'_>,
        rays: u64,
        shoot: impl FnOnce(&Trial) -> Result<TrialRuns, Fault>,
    ) -> Result<ReferenceSolution, Fault> {
        match exact(arena.job, arena.scene) {
            Some(truth) => Ok(truth),
            None => by_run(arena, &DISCRETE, rays, shoot),
        }
    }

    /// The solution of the integral equation, by walks.
    ///
    /// # Errors
    /// As `shoot`.
    pub(super) fn continuous(
        arena: &Arena<'_>,
        rays: u64,
        shoot: impl FnOnce(&Trial) -> Result<TrialRuns, Fault>,
    ) -> Result<ReferenceSolution, Fault> {
        by_run(arena, &CONTINUOUS, rays, shoot)
    }
}

fn exact(job: &Job, scene: &Scene) -> Option<ReferenceSolution> {
    let spec = job.scene.spec();
    let boxed = exact::BoxScene::recognise(spec).is_ok();
    if !boxed && scene.faces().len() > FEW_PATCHES {
        return None;
    }
    let channels = (0..scene.channels()).map(|c| Exact::of_scene(&spec.channel(c)));
    let channels = channels.collect::<Result<Vec<_>, _>>().ok()?;
    let patches = 0..scene.faces().len();
    let radiosity: Vec<f64> =
        patches.flat_map(|i| channels.iter().map(move |exact| exact.solution().radiosity[i])).collect();
    let how = format!(
        "the exact solution of the patches' radiosity system (form factors {})",
        exact_words(&channels[0])
    );
    Some(ReferenceSolution { variance: vec![0.0; radiosity.len()], radiosity, how })
}

fn exact_words(exact: &Exact) -> String {
    exact::SystemAccuracy::of(exact).form_factors.to_string()
}

/// The solution by one run of the first method that the scene takes; `shoot` runs it.
fn by_run(
    arena: &Arena<'_>,
    methods: &[&str],
    rays: u64,
    shoot: impl FnOnce(&Trial) -> Result<TrialRuns, Fault>,
) -> Result<ReferenceSolution, Fault> {
    let trials = methods.iter().filter_map(|method| Trial::of_rays(arena, method, LONGER * rays).ok());
    let mut trial = { trials }.next().expect("collision walks fit every scene");
    trial.job.seed = trial.job.seed.wrapping_add(SEED);
    let shot = shoot(&trial)?;
    let (tally, experiment) = (&shot.tallies[0], &trial.experiment);
    let estimates = Estimates::new(experiment, tally, 0.95);
    let (mut radiosity, mut variance) = (Vec::new(), Vec::new());
    for (_, _, known) in estimates.iter() {
        let known = known.expect("collision walks and chains tell of every patch");
        radiosity.extend(known.iter().map(|estimate| estimate.radiosity));
        variance.extend(known.iter().map(|estimate| estimate.std_error.unwrap_or(0.0).powi(2)));
    }
    let what = match (experiment.unit().chain(), experiment.method().space()) {
        (Some(_), _) => format!("{} chains", trial.walks()),
        (None, Space::Discrete) => "discrete collision walks".into(),
        (None, Space::Continuous) => "continuous collision walks".into(),
    };
    let how = format!(
        "an independent run of {what} with {:.1e} rays, whose own variance is taken off",
        tally.counts.rays as f64
    );
    Ok(ReferenceSolution { radiosity, variance, how })
}
