//! What chosen patches leave out of the light, measured by walks that have not chosen them.

use job::{Forecast, Job};
use judge::partition::Control;
use radiosity::{Arrival, EstimatorKind, Experiment, Sequence, Space, Walks};

use crate::error::Error;
use crate::pilot::{Chosen, seed};

/// The control takes one of this many parts of the walks that the patches are for …
const SHARE: u64 = 16;

/// … but this many at least, where there are as many, and at most.
const WALKS: [u64; 2] = [1 << 13, 1 << 18];

impl Chosen {
    /// The choice, foretelling what walks of their own find that its patches leave out. These are the same whatever the threads.
    ///
    /// # Errors
    /// Where the scene is refused.
    pub(crate) fn controlled(mut self, job: &Job, threads: usize) -> Result<Self, Error> {
        let Some(forecast) = self.partition.forecast else { return Ok(self) };
        let cells = (&self.partition.cuts[..], &self.partition.groups[..]);
        let scene = job.scene.recut(&self.scene, cells)?;
        let walks = Walks { space: Space::Continuous, ..Walks::shooting(EstimatorKind::Collision) };
        let experiment = Experiment::new(scene.clone(), walks)?;
        let least = WALKS[0].min(forecast.for_paths);
        let control = Control::new(&experiment, (forecast.for_paths / SHARE).clamp(least, WALKS[1]));
        // Neither the walks of a pilot nor those of a first look.
        let sequence = Sequence::new(seed(seed(seed(job.seed))));
        let done = parallel::on_threads(
            threads,
            Control::GROUPS,
            || (),
            |(), group| control.group(group, &sequence),
        );
        let (groups, counts): (Vec<Vec<Arrival>>, Vec<[u64; 2]>) = done.into_iter().unzip();
        let [paths, rays] = [0, 1].map(|k| counts.iter().map(|counts| counts[k]).sum::<u64>());
        let foretold = forecast.discretisation * forecast.discretisation;
        let missed =
            control.missed(&groups, forecast.linear).map_or(foretold, |missed| missed.with(foretold));
        self.partition.forecast = Some(Forecast {
            paths: forecast.paths + paths,
            rays: forecast.rays + rays,
            discretisation: missed.sqrt(),
            ..forecast
        });
        self.scene = scene;
        Ok(self)
    }
}
