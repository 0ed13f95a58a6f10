//! The study of one scene: uniform grids, what is chosen, and the ceilings.

use std::fs;

use job::{Cut, Forecast, Job, Partition};
use radiosity::SceneSpec;
use results::choose;

use super::oracle::{Ceiling, Cutting, GridOracle};
use super::reported::ReportedSpread;
use super::rooms::Room;
use super::runs::{Failure, cut_all, experiment, fastest, noise, walk};
use super::truth::Truth;
use crate::clock::thread_seconds;
use crate::walking::SeededWalks;

/// Walks by which grids are measured.
const MEASURED: u64 = 1 << 20;

/// Walks by which rates are compared, and how often.
const RACED: u64 = 1 << 19;
const RACES: usize = 5;

/// Seeds over which the error of chosen patches is taken.
pub const SEEDS: u64 = 6;

/// The walks of the jobs that are compared.
pub const PATHS: [u64; 5] = [100_000, 300_000, 1_000_000, 3_000_000, 10_000_000];

/// The partitions whose ceilings are sought: how surfaces are cut, and the degrees of the fits.
pub const CEILINGS: [(Cutting, &[usize]); 8] = [
    (Cutting::Grids, &[0]),
    (Cutting::Grids, &[1]),
    (Cutting::Grids, &[2]),
    (Cutting::Quadtrees, &[0]),
    (Cutting::Quadtrees, &[1]),
    (Cutting::Quadtrees, &[0, 1]),
    (Cutting::Quadtrees, &[2]),
    (Cutting::Rectangles, &[1]),
];

/// What was found of a scene.
pub struct PatchStudy {
    pub name: &'static str,
    /// Cells of a reference.
    pub cells: usize,
    pub rows: Vec<StudyRow>,
}

/// What was found for one number of walks. Errors are relative, over the area.
pub struct StudyRow {
    pub paths: u64,
    /// The best uniform grids of constants and of linear fits.
    pub uniform: [BestGrid; 2],
    pub chosen: ChosenMean,
    /// Of the chosen patches: errors.
    pub error: f64,
    pub noise: f64,
    pub lost: f64,
    /// Walks that the best uniform grid of constants takes to the same error, over those of the job, and over those of job and pilot; and
    /// its processor time over theirs.
    pub saved: [Option<f64>; 3],
    /// Walks that the best uniform grid of linear fits takes, over those of the job.
    pub against_linear: Option<f64>,
    /// The ceilings, in the order of [`CEILINGS`], with the walks that they save.
    pub ceilings: Vec<(Ceiling, Option<f64>)>,
}

/// A uniform grid that is best for some walks.
pub struct BestGrid {
    pub patches: usize,
    pub error: f64,
    pub seconds: f64,
    pub saved: Option<f64>,
    pub cuts: Vec<Cut>,
}

impl PatchStudy {
    /// Studies a scene, with references of some walks.
    pub fn new(room: &Room, walks: u64) -> Result<Self, Failure> {
        let truth = Truth::new(&room.spec, room.cells, walks)?;
        let grids = uniform(&room.spec, &truth, room.cells)?;
        let oracle = GridOracle::new(&truth);
        let energy = truth.energy();
        let part = |error: f64| (error.max(0.0) / energy).sqrt();
        let mut rows = Vec::new();
        for paths in PATHS {
            let n = paths as f64;
            let saved = |error: f64| Some(reach(&grids, 0, error)? / n);
            let uniform = [0, 1].map(|basis| {
                let grid = best(&grids, basis, n);
                let error = grid.error(basis, n);
                BestGrid {
                    patches: grid.patches,
                    error: part(error),
                    seconds: n * grid.seconds[basis],
                    saved: saved(error),
                    cuts: grid.cuts.clone(),
                }
            });
            let chosen = ChosenMean::new(&room.spec, &truth, paths)?;
            let error = chosen.noise + chosen.lost;
            let walks = saved(error);
            let time = reach_seconds(&grids, 0, error).map(|seconds| seconds / chosen.seconds);
            let with_pilot = walks.map(|walks| walks * n / (n + chosen.pilot));
            let ceiling = |&(cutting, degrees): &(Cutting, &[usize])| {
                let ceiling = oracle.best(cutting, degrees, n);
                (Ceiling { error: part(ceiling.error), ..ceiling }, saved(ceiling.error))
            };
            rows.push(StudyRow {
                paths,
                uniform,
                error: part(error),
                noise: part(chosen.noise),
                lost: part(chosen.lost),
                saved: [walks, with_pilot, time],
                against_linear: reach(&grids, 1, error).map(|walks| walks / n),
                ceilings: CEILINGS.iter().map(ceiling).collect(),
                chosen,
            });
        }
        Ok(PatchStudy { name: room.name, cells: truth.cells, rows })
    }
}

/// A uniform grid and what its runs come to.
struct UniformGrid {
    cuts: Vec<Cut>,
    patches: usize,
    /// The energy of noise after one walk, of constants and of linear fits [W²/m²].
    noise: [f64; 2],
    /// The energy that either leaves out [W²/m²].
    lost: [f64; 3],
    /// Processor time of a walk, of either [s].
    seconds: [f64; 2],
}

impl UniformGrid {
    fn error(&self, basis: usize, walks: f64) -> f64 {
        self.noise[basis] / walks + self.lost[basis].max(0.0)
    }

    /// Walks by which its error falls to this; `None` where discretisation alone is above it.
    fn reach(&self, basis: usize, error: f64) -> Option<f64> {
        let lost = self.lost[basis].max(0.0);
        (lost < error).then(|| self.noise[basis] / (error - lost))
    }
}

/// The grid of the least error after some walks.
fn best(grids: &[UniformGrid], basis: usize, walks: f64) -> &UniformGrid {
    let error = |grid: &&UniformGrid| grid.error(basis, walks);
    grids.iter().min_by(|a, b| error(a).total_cmp(&error(b))).expect("there are grids")
}

/// The fewest walks by which a uniform grid comes to an error.
fn reach(grids: &[UniformGrid], basis: usize, error: f64) -> Option<f64> {
    grids.iter().filter_map(|grid| grid.reach(basis, error)).min_by(f64::total_cmp)
}

/// The least processor time by which a uniform grid comes to an error [s].
fn reach_seconds(grids: &[UniformGrid], basis: usize, error: f64) -> Option<f64> {
    let of = |grid: &UniformGrid| Some(grid.reach(basis, error)? * grid.seconds[basis]);
    grids.iter().filter_map(of).min_by(f64::total_cmp)
}

/// The uniform grids, from the coarsest on.
fn uniform(spec: &SceneSpec, truth: &Truth, most: f64) -> Result<Vec<UniformGrid>, Failure> {
    let mut grids: Vec<UniformGrid> = Vec::new();
    let (mut last, mut cells) = (Vec::new(), spec.surfaces.len() as f64 / 2.0);
    while cells < most {
        let cuts = cut_all(spec, cells);
        cells *= 1.4;
        if cuts != last {
            grids.push(measure(spec, truth, &cuts)?);
            last = cuts;
        }
    }
    Ok(grids)
}

fn measure(spec: &SceneSpec, truth: &Truth, cuts: &[Cut]) -> Result<UniformGrid, Failure> {
    let linear = experiment(spec, cuts, true)?;
    let (of_linear, tally) = fastest(|| walk(&linear, 7, MEASURED));
    let constant = experiment(spec, cuts, false)?;
    let (of_constant, _) = fastest(|| walk(&constant, 7, MEASURED));
    Ok(UniformGrid {
        cuts: cuts.to_vec(),
        patches: linear.scene().faces().len(),
        noise: noise(&linear, &tally),
        lost: truth.lost(cuts),
        seconds: [of_constant, of_linear].map(|seconds| seconds / MEASURED as f64),
    })
}

/// What is chosen for a number of walks, in the mean over seeds.
pub struct ChosenMean {
    /// Energies [W²/m²].
    noise: f64,
    lost: f64,
    /// Processor time of pilot and run [s].
    pub seconds: f64,
    /// Walks of the pilot.
    pub pilot: f64,
    pub patches: f64,
    /// Seeds for which linear fits were chosen.
    pub linear: u64,
    /// Noise and discretisation as predicted: squares of relative errors.
    pub predicted: [f64; 2],
    /// What was chosen for the first seed.
    pub cuts: Vec<Cut>,
    pub is_linear: bool,
    /// Of the first seed: whether a run tells its errors truly.
    pub reported: ReportedSpread,
    /// Of the first seed: the rate with linear fits over that with constants, and the rate over that of a uniform grid of as many
    /// patches.
    pub rates: [f64; 2],
}

/// A job that leaves the patches of a scene open.
pub fn open_job(spec: &SceneSpec, paths: u64, seed: u64) -> Result<Job, Failure> {
    let folder = tempfile::tempdir()?;
    fs::write(folder.path().join("scene.toml"), job::to_toml(spec))?;
    let text = format!("[scene]\nfile = \"scene.toml\"\npatches = \"auto\"\n[budget]\npaths = {paths}\n");
    let path = folder.path().join("job.toml");
    fs::write(&path, text)?;
    Ok(job::load(&path, &[format!("seed={seed}")])?)
}

impl ChosenMean {
    fn new(spec: &SceneSpec, truth: &Truth, paths: u64) -> Result<Self, Failure> {
        let mut all: Vec<(Vec<Cut>, Forecast, f64, UniformGrid)> = Vec::new();
        for seed in 0..SEEDS {
            let job = open_job(spec, paths, seed)?;
            let (pilot, chosen) = fastest(|| choose(&job, 1));
            let Partition { cuts, forecast, .. } = chosen?.ok_or("nothing is open")?.partition;
            let grid = measure(spec, truth, &cuts)?;
            all.push((cuts, forecast.ok_or("a pilot predicts")?, pilot, grid));
        }
        let mean = |of: &dyn Fn(&Forecast, f64, &UniformGrid) -> f64| {
            all.iter().map(|(_, forecast, pilot, grid)| of(forecast, *pilot, grid)).sum::<f64>()
                / SEEDS as f64
        };
        let n = paths as f64;
        let basis = |forecast: &Forecast| usize::from(forecast.linear);
        let (cuts, forecast, ..) = &all[0];
        Ok(ChosenMean {
            noise: mean(&|forecast, _, grid| grid.noise[basis(forecast)] / n),
            lost: mean(&|forecast, _, grid| grid.lost[basis(forecast)].max(0.0)),
            seconds: mean(&|forecast, pilot, grid| pilot + n * grid.seconds[basis(forecast)]),
            pilot: mean(&|forecast, _, _| forecast.paths as f64),
            patches: mean(&|_, _, grid| grid.patches as f64),
            linear: all.iter().filter(|(_, forecast, ..)| forecast.linear).count() as u64,
            predicted: [
                mean(&|forecast, _, _| forecast.noise.powi(2)),
                mean(&|forecast, _, _| forecast.discretisation.powi(2)),
            ],
            is_linear: forecast.linear,
            reported: ReportedSpread::new(spec, truth, cuts, SeededWalks { seed: 0, walks: paths })?,
            rates: rates(spec, cuts, forecast.linear)?,
            cuts: cuts.clone(),
        })
    }
}

/// Rates of walks by processor time, the fastest of some runs in turn: linear fits over constants on a grid, and what is chosen over a
/// uniform grid of about as many patches.
fn rates(spec: &SceneSpec, cuts: &[Cut], is_linear: bool) -> Result<[f64; 2], Failure> {
    let patches: u64 = cuts.iter().map(|cut| cut.cells()).sum();
    let fixed = cut_all(spec, patches as f64);
    let raced =
        [experiment(spec, cuts, false)?, experiment(spec, cuts, true)?, experiment(spec, &fixed, is_linear)?];
    let mut least = [f64::INFINITY; 3];
    for _ in 0..RACES {
        for (least, experiment) in least.iter_mut().zip(&raced) {
            let began = thread_seconds();
            walk(experiment, 3, RACED);
            *least = least.min(thread_seconds() - began);
        }
    }
    let chosen = least[usize::from(is_linear)];
    Ok([least[0] / least[1], least[2] / chosen])
}
