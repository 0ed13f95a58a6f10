//! What measures walks themselves, and what these studies have in common: timing of whole walks, rays, scenes from files.

pub(crate) mod brute;
pub(crate) mod ceiling;
pub(crate) mod closed;
pub(crate) mod daylight;
pub(crate) mod embree;
pub(crate) mod gain;
pub(crate) mod gather;
pub(crate) mod lamps;
mod meshes;
pub(crate) mod methods;
pub(crate) mod quasi;
mod rays;
pub(crate) mod reading;
pub(crate) mod scaling;
pub(crate) mod sources;
pub(crate) mod walk;
pub(crate) mod write;

use radiosity::{Board, Estimator, Experiment, Method, Scene, Sequence};

use crate::clock::thread_seconds as processor_seconds;
use crate::walking::Failure;

/// An experiment of discrete collision shooting in a scene.
pub fn collision_shooting(scene: Scene) -> Result<Experiment, Failure> {
    Ok(Experiment::new(scene, Method::shooting(Estimator::Collision))?)
}

/// Whole walks of one experiment, timed a part at a time.
pub struct TimedWalks {
    experiment: Experiment,
    sequence: Sequence,
    board: Board,
    next: u64,
}

impl TimedWalks {
    pub fn new(experiment: Experiment) -> Self {
        let board = experiment.board();
        TimedWalks { experiment, sequence: Sequence::new(1), board, next: 0 }
    }

    /// The rays per second of processor time, over at least `at_least` rays.
    pub fn rate(&mut self, at_least: u64) -> Result<f64, Failure> {
        const PART: u64 = 65_536;
        let (mut rays, mut seconds) = (0, 0.0);
        while rays < at_least {
            let start = processor_seconds();
            self.experiment.walk(&self.sequence, self.next..self.next + PART, &mut self.board);
            seconds += processor_seconds() - start;
            self.next += PART;
            rays += self.board.take()?.counts.rays;
        }
        Ok(rays as f64 / seconds)
    }
}

/// The middle one of some values, or the upper of two middle ones.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
