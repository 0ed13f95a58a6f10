//! Runs of the interior on given and on chosen patches.

use std::error::Error;
use std::path::Path;

use job::{Cut, Partition};
use judge::MOMENTS;
use judge::partition::{Grid, doublings};
use radiosity::{Experiment, Sequence, Space, SurfaceSpec, Tally};
use rustix::time::{ClockId, clock_gettime};

use crate::light::{Errors, Reference};

pub type Failure = Box<dyn Error>;

/// Walks by which given patches are measured.
const MEASURED: u64 = 1_000_000;

/// Patches, and what runs on them come to.
pub struct Found {
    pub patches: usize,
    pub errors: Errors,
    /// Walks of each of two runs.
    pub walks: u64,
    /// Processor time of one of them [s].
    pub walking: f64,
    /// Processor time of the pilot and the choice [s].
    pub choosing: f64,
    /// The foretold noise and discretisation, relative to the light.
    pub foretold: [f64; 2],
    /// Whether light is told by linear fits.
    pub is_linear: bool,
}

impl Found {
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

pub fn experiment(job: &Path, partition: &Partition) -> Result<Experiment, Failure> {
    let job = job::load_cut(job, &["budget.paths=1".into()], partition)?;
    Ok(Experiment::new(job.build_scene()?, job.method.walks())?)
}

pub fn walk(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board::<MOMENTS>());
    let mut tally = experiment.tally::<MOMENTS>();
    for first in (0..walks).step_by(1 << 20) {
        experiment.walk(&sequence, first..walks.min(first + (1 << 20)), &mut board);
        board.add_to(&mut tally).expect("few walks");
    }
    tally
}

/// What is found on cells below an area.
pub fn given(job: &Path, area: f64, reference: &Reference) -> Result<Found, Failure> {
    found(job, &uniform(job, area)?, MEASURED, reference)
}

/// What is found on the patches that a pilot chooses.
pub fn chosen(job: &Path, paths: u64, reference: &Reference) -> Result<Found, Failure> {
    let open = job::load(job, &[format!("budget.paths={paths}")])?;
    let start = seconds();
    let partition = results::choose(&open, 1)?.ok_or("nothing is open")?;
    let choosing = seconds() - start;
    let forecast = partition.forecast.ok_or("no forecast")?;
    let foretold = [forecast.noise, forecast.discretisation];
    Ok(Found { choosing, foretold, ..found(job, &partition, paths, reference)? })
}

fn found(job: &Path, partition: &Partition, walks: u64, reference: &Reference) -> Result<Found, Failure> {
    let experiment = experiment(job, partition)?;
    let start = seconds();
    let tallies = [1, 2].map(|seed| walk(&experiment, seed, walks));
    let walking = 0.5 * (seconds() - start);
    let [one, other] = tallies.map(|tally| reference.light(&experiment, &tally));
    let patches = experiment.scene().faces().patch_count();
    let errors = reference.errors([&one, &other]);
    let is_linear = experiment.method().is_linear();
    Ok(Found { patches, errors, walks, walking, choosing: 0.0, foretold: [0.0; 2], is_linear })
}

/// Processor time of this thread [s].
fn seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
