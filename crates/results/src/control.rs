//! What chosen patches leave out of the light, measured by walks that have not chosen them, and finer patches where it is much.

use job::{Auto, Forecast, Job};
use judge::partition::{Control, Finer, Missed};
use radiosity::{Arrival, EstimatorKind, Experiment, Sequence, Shape, Space, Walks};

use crate::error::Error;
use crate::pilot::{Chosen, seed};

/// The control takes one of this many parts of the walks that the patches are for …
const SHARE: u64 = 16;

/// … or one of this many, if the error of what it measures is above this part of the energy of the whole error, …
const LARGE_SHARE: u64 = 4;
const SHARP: f64 = 0.2;

/// … but this many at least, where there are as many, and at most.
const WALKS: [u64; 2] = [1 << 13, 1 << 18];

/// Patches are cut finer by what a control finds this many times at the most, …
const ROUNDS: u32 = 4;

/// … where the fits leave out more than is foretold by this many standard errors, …
const SURE: f64 = 2.0;

/// … and cuts are expected to take this part of the energy of the whole error.
const WORTH: f64 = 0.1;

impl Chosen {
    /// The choice, cut finer where walks of a control find that its patches leave out more than is foretold, and foretelling what further
    /// walks find that they leave out then. It is the same whatever the threads.
    ///
    /// # Errors
    /// Where the scene is refused.
    pub(crate) fn controlled(mut self, (job, auto): (&Job, &Auto), threads: usize) -> Result<Self, Error> {
        let Some(mut forecast) = self.partition.forecast else { return Ok(self) };
        let foretold = forecast.discretisation * forecast.discretisation;
        // Neither the walks of a pilot nor those of a first look.
        let mut seed_of_round = seed(seed(job.seed));
        for round in 0..=ROUNDS {
            let cells = (&self.partition.cuts[..], &self.partition.groups[..]);
            self.scene = job.scene.recut(&self.scene, cells)?;
            let walks = Walks { space: Space::Continuous, ..Walks::shooting(EstimatorKind::Collision) };
            let experiment = Experiment::new(self.scene.clone(), walks)?;
            let measured = measure(&experiment, foretold, &mut seed_of_round, (&mut forecast, threads));
            let (control, groups, Some(missed)) = measured else { break };
            forecast.discretisation = missed.with(foretold).sqrt();
            let excess = missed.part - foretold;
            if round == ROUNDS || !forecast.linear || excess < SURE * missed.error {
                break;
            }
            let is_open = |surface: usize| can_be_cut(job, auto, surface);
            let finer = control.finer(&groups, cells, is_open, forecast.for_paths as f64);
            let Some(Finer { cuts, groups, noise, gained }) = finer else { break };
            let [noise, gained] = [noise, gained].map(|energy| energy / missed.energy);
            if gained.min(excess) - noise < WORTH * forecast.total() * forecast.total() {
                break;
            }
            forecast.noise = (forecast.noise * forecast.noise + noise).sqrt();
            (self.partition.cuts, self.partition.groups) = (cuts, groups);
        }
        self.partition.forecast = Some(forecast);
        Ok(self)
    }
}

/// A control, the arrivals of its groups, and what it measures; by more walks where these are too few to know it. Each has a seed of its own, so that
/// what few walks happen to find does not bend what is told.
fn measure<'a>(
    experiment: &'a Experiment,
    foretold: f64,
    last_seed: &mut u64,
    (forecast, threads): (&mut Forecast, usize),
) -> (Control<'a>, Vec<Vec<Arrival>>, Option<Missed>) {
    let least = WALKS[0].min(forecast.for_paths);
    let [few, many] = [SHARE, LARGE_SHARE].map(|share| (forecast.for_paths / share).clamp(least, WALKS[1]));
    let noise = forecast.noise * forecast.noise;
    let mut with = |walks: u64| {
        *last_seed = seed(*last_seed);
        let control = Control::new(experiment, walks);
        let groups = walked(&control, &Sequence::new(*last_seed), (&mut *forecast, threads));
        let missed = control.missed(&groups, forecast.linear);
        (control, groups, missed)
    };
    // Light that a first look finds even has nothing foretold of it: few walks make sure of that.
    let is_sharp =
        |missed: Missed| foretold == 0.0 || missed.error <= SHARP * (noise + missed.part.max(foretold));
    match with(few) {
        (.., Some(missed)) if !is_sharp(missed) && few < many => with(many),
        measured => measured,
    }
}

/// The arrivals of all groups of a control. Its walks and rays are added to those of the pilot.
fn walked(
    control: &Control<'_>,
    sequence: &Sequence,
    (forecast, threads): (&mut Forecast, usize),
) -> Vec<Vec<Arrival>> {
    let done =
        parallel::on_threads(threads, Control::GROUPS, || (), |(), group| control.group(group, sequence));
    let (groups, counts): (Vec<Vec<Arrival>>, Vec<[u64; 2]>) = done.into_iter().unzip();
    for [paths, rays] in counts {
        forecast.paths += paths;
        forecast.rays += rays;
    }
    groups
}

/// Whether a surface may be cut into parts of different sizes: one that is open, and has no cells of its own. Those of a triangle are groups.
fn can_be_cut(job: &Job, auto: &Auto, surface: usize) -> bool {
    let shape = &job.scene.spec().surfaces[surface].shape;
    let can_be_grouped = !auto.kinds.is_empty();
    auto.surfaces.binary_search(&surface).is_ok()
        && shape.cell_count() == 1
        && (can_be_grouped || !matches!(shape, Shape::Triangle { .. }))
}
