//! The state of a running job, as displays, status files and metrics show it.

use serde::{Deserialize, Serialize};

/// The state of a running job. Numbers that are not known, or not finite, are `None`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunStatus {
    /// The time since this coordinator started [s].
    pub seconds: f64,
    /// The paths that are in (for Jacobi: rays).
    pub paths: u64,
    /// The paths of the budget.
    pub paths_total: u64,
    /// The paths per second over the last half minute.
    pub paths_per_second: f64,
    /// The rays per second over the last half minute.
    pub rays_per_second: f64,
    /// The number of workers that walk now.
    pub workers: usize,
    /// The relative error that half of the area does not exceed.
    pub median_relative_error: Option<f64>,
    /// The root mean square of relative errors over the faces that were hit, weighted by area.
    pub rms_relative_error: Option<f64>,
    /// The relative error of the worst face.
    pub max_relative_error: Option<f64>,
    /// The target of the job.
    pub target: Option<Goal>,
    /// The paths at which the targets of the job, those on sensors included, will probably be reached.
    pub paths_expected: Option<u64>,
    /// The time to the target, the end of the budget or the wall clock, whichever comes first [s]; `None` if it is not
    /// known.
    pub seconds_left: Option<f64>,
    /// The latest checkpoint of this session.
    pub checkpoint: Option<Saved>,
    /// The faults of this session.
    pub faults: FaultCounts,
}

/// A target, and the distance to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// The relative error that the target asks for.
    pub relative_error: f64,
    /// The part of the area that must reach it.
    pub fraction: f64,
    /// The error that decides: the one that this part of the area does not exceed now.
    pub decisive_error: Option<f64>,
    /// The paths at which the run will probably end (`radwalk plan` predicts by the same rule).
    pub paths_expected: Option<u64>,
}

/// A checkpoint that was written.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// The time since it was written [s].
    pub seconds_ago: f64,
    /// The paths in it (for Jacobi: rays).
    pub paths: u64,
}

/// The faults of this session, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultCounts {
    /// The number of workers that were lost, or left early.
    pub workers_lost: u64,
    /// The number of workers that were not let in.
    pub workers_refused: u64,
    /// The number of connections that failed.
    pub connections_failed: u64,
    /// The number of checkpoints that could not be written.
    pub checkpoints_failed: u64,
}
