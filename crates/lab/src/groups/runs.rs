//! Runs of the interior on given and on chosen patches.

use std::path::Path;

use job::{Cut, Job, Partition};
use judge::partition::{Grid, doublings};
use radiosity::{Experiment, Scene, Sequence, Space, SurfaceSpec, Tally};

use super::light::{LightErrors, Reference};
use crate::clock::thread_seconds;

pub use crate::walking::Failure;

/// Walks by which given patches are measured.
const MEASURED: u64 = 1_000_000;

/// Patches, and what runs on them come to.
pub struct GroupOutcome {
    pub patches: usize,
    pub errors: LightErrors,
    /// Walks of each of two runs.
    pub walks: u64,
    /// Processor time of one of them [s].
    pub walking: f64,
    /// Processor time of the pilot and the choice [s].
    pub choosing: f64,
    /// Processor time of building the scene [s].
    pub building: f64,
    /// The predicted noise and discretisation, relative to the light.
    pub predicted: [f64; 2],
    /// Whether light is described by linear fits.
    pub is_linear: bool,
}

impl GroupOutcome {
    /// Processor time of one run and all before it [s].
    pub fn time(&self) -> f64 {
        self.choosing + self.building + self.walking
    }

    /// The squared error after a number of walks, over the energy of the light.
    pub fn after(&self, walks: u64, k: usize) -> f64 {
        let lost = self.errors.lost[k].max(0.0);
        lost + (self.errors.total[k] - self.errors.lost[k]) * self.walks as f64 / walks as f64
    }
}

/// Every face in cells below an area.
pub fn uniform(job: &Path, area: f64) -> Result<Partition, Failure> {
    let job = job::load(job, &["budget.paths=1".into()])?;
    let cut = |surface: &SurfaceSpec| -> Cut {
        let base = Grid::of(&surface.shape);
        base.doubled(doublings(&surface.shape, base, area)).cut()
    };
    let cuts = job.scene.spec().surfaces.iter().map(cut).collect();
    Ok(Partition { cuts, groups: Vec::new(), linear: false, space: Space::Continuous, forecast: None })
}

/// The walks of a job on given patches, in the scene that `build` makes, and the processor time of building it [s].
pub fn experiment(
    job: &Path,
    partition: &Partition,
    build: impl FnOnce(&Job) -> Result<Scene, job::Error>,
) -> Result<(Experiment, f64), Failure> {
    let job = job::load(job, &["budget.paths=1".into()])
        .and_then(|job| job.cut(&["budget.paths=1".into()], partition))?;
    let start = thread_seconds();
    let scene = build(&job)?;
    let building = thread_seconds() - start;
    Ok((Experiment::new(scene, job.method.walks())?, building))
}

pub fn walk(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board());
    let mut tally = experiment.tally();
    for first in (0..walks).step_by(1 << 20) {
        experiment.walk(&sequence, first..walks.min(first + (1 << 20)), &mut board);
        board.add_to(&mut tally).expect("few walks");
    }
    tally
}

/// What is found on cells below an area.
pub fn given(job: &Path, area: f64, reference: &Reference) -> Result<GroupOutcome, Failure> {
    let experiment = experiment(job, &uniform(job, area)?, Job::build_scene)?;
    found(experiment, MEASURED, reference)
}

/// What is found on the patches that a pilot chooses; `more` are keys of the job.
pub fn chosen(job: &Path, paths: u64, more: &[&str], reference: &Reference) -> Result<GroupOutcome, Failure> {
    let keys: Vec<String> =
        [format!("budget.paths={paths}")].into_iter().chain(more.iter().map(|key| key.to_string())).collect();
    let open = job::load(job, &keys)?;
    let start = thread_seconds();
    let chosen = results::choose(&open, 1)?.ok_or("nothing is open")?;
    let choosing = thread_seconds() - start;
    let forecast = chosen.partition.forecast.ok_or("no forecast")?;
    let predicted = [forecast.noise, forecast.discretisation];
    let partition = chosen.partition.clone();
    let experiment = experiment(job, &partition, |job| chosen.build_scene(job))?;
    Ok(GroupOutcome { choosing, predicted, ..found(experiment, paths, reference)? })
}

fn found(
    (experiment, building): (Experiment, f64),
    walks: u64,
    reference: &Reference,
) -> Result<GroupOutcome, Failure> {
    let start = thread_seconds();
    let tallies = [1, 2].map(|seed| walk(&experiment, seed, walks));
    let walking = 0.5 * (thread_seconds() - start);
    let [one, other] = tallies.map(|tally| reference.light(&experiment, &tally));
    let patches = experiment.scene().faces().patch_count();
    let errors = reference.errors([&one, &other]);
    let is_linear = experiment.method().is_linear();
    Ok(GroupOutcome {
        patches,
        errors,
        walks,
        walking,
        choosing: 0.0,
        building,
        predicted: [0.0; 2],
        is_linear,
    })
}
