//! What errors are measured against.

use exact::Exact;
use job::Job;
use radiosity::{Direction, Estimates, EstimatorKind, Experiment, InfiniteEnd, Method, Scene, Space, Tally};

use super::measure::{rays_per_walk, walk};

/// The most patches of a scene that is no box for which form factors are worth their time.
const FEW_PATCHES: usize = 400;

/// The reference has so many times the rays of the longest run.
const LONGER: u64 = 16;

/// The seed of references; runs have others.
const SEED: u64 = 1 << 40;

/// B of every patch and channel, and how it is known.
pub struct Truth {
    /// B [W/m²], the channels of a patch side by side.
    pub radiosity: Vec<f64>,
    /// The squared standard error of each [W²/m⁴]; 0 where it is exact.
    pub variance: Vec<f64>,
    /// How, in words.
    pub how: String,
}

impl Truth {
    /// Of the patches' radiosity system: exact where that is quickly found, else by chains, by walks where chains are not
    /// long enough; runs have up to `rays` rays.
    pub fn discrete(job: &Job, scene: &Scene, rays: u64) -> Truth {
        exact(job, scene).unwrap_or_else(|| {
            let chain_rays = (LONGER * rays / 8).min(u64::from(u32::MAX));
            let long_enough = chain_rays >= 16 * scene.patches().len() as u64;
            let direction = if long_enough {
                Direction::Jacobi { chain_rays, solve: radiosity::Solve::Links }
            } else {
                Direction::Shooting
            };
            by_run(scene, direction, Space::Discrete, rays)
        })
    }

    /// Of the integral equation, by walks.
    pub fn continuous(scene: &Scene, rays: u64) -> Truth {
        by_run(scene, Direction::Shooting, Space::Continuous, rays)
    }
}

fn exact(job: &Job, scene: &Scene) -> Option<Truth> {
    let spec = job.scene.spec();
    let boxed = exact::BoxScene::recognise(spec).is_ok();
    if !boxed && scene.patches().len() > FEW_PATCHES {
        return None;
    }
    let channels = (0..scene.channels()).map(|c| Exact::of_scene(&spec.channel(c)));
    let channels = channels.collect::<Result<Vec<_>, _>>().ok()?;
    let patches = 0..scene.patches().len();
    let radiosity: Vec<f64> =
        patches.flat_map(|i| channels.iter().map(move |exact| exact.solution().radiosity[i])).collect();
    let how = format!(
        "the exact solution of the patches' radiosity system (form factors {})",
        exact_words(&channels[0])
    );
    Some(Truth { variance: vec![0.0; radiosity.len()], radiosity, how })
}

fn exact_words(exact: &Exact) -> String {
    exact::Accuracy::of(exact).form_factors.to_string()
}

fn by_run(scene: &Scene, direction: Direction, space: Space, rays: u64) -> Truth {
    let chains = matches!(direction, Direction::Jacobi { .. });
    let method = Method {
        direction,
        estimator: EstimatorKind::Collision,
        infinite: InfiniteEnd::default(),
        space,
        mix: false,
        sobol_batch: None,
    };
    let experiment = Experiment::new(scene.clone(), method).expect("collision and chains fit every scene");
    let walks = match experiment.chain_rays() {
        Some(_) => 8,
        None => ((LONGER * rays) as f64 / rays_per_walk(&experiment)) as u64,
    };
    let tally: Tally = walk(&experiment, SEED, walks);
    let estimates = Estimates::new(&experiment, &tally, 0.95);
    let (mut radiosity, mut variance) = (Vec::new(), Vec::new());
    for (_, _, known) in estimates.iter() {
        let known = known.expect("collision walks and chains tell of every patch");
        radiosity.extend(known.iter().map(|estimate| estimate.radiosity));
        variance.extend(known.iter().map(|estimate| estimate.std_error.unwrap_or(0.0).powi(2)));
    }
    let what = match (chains, space) {
        (true, _) => "8 chains",
        (false, Space::Discrete) => "discrete collision walks",
        (false, Space::Continuous) => "continuous collision walks",
    };
    let how = format!(
        "an independent run of {what} with {:.1e} rays, whose own variance is taken off",
        tally.counts.rays as f64
    );
    Truth { radiosity, variance, how }
}
