//! Where a job stands while it runs: what displays, status files and metrics show.

use serde::{Deserialize, Serialize};

/// Where a job stands. Numbers that are not known, or not finite, are `None`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Standing {
    /// Since this coordinator began [s].
    pub seconds: f64,
    /// Walks that are in (Jacobi: rays).
    pub paths: u64,
    /// The budget.
    pub paths_total: u64,
    /// Of the last half minute.
    pub paths_per_second: f64,
    /// Of the last half minute.
    pub rays_per_second: f64,
    /// Workers that walk now.
    pub workers: usize,
    /// Half of the area is known within this part of itself.
    pub median_relative_error: Option<f64>,
    /// Area-weighted, of the faces that were hit.
    pub rms_relative_error: Option<f64>,
    /// Of the worst face.
    pub max_relative_error: Option<f64>,
    /// What is asked for.
    pub target: Option<Goal>,
    /// To the target, the end of the budget or the wall clock, whichever comes first; `None` where nothing tells.
    pub seconds_left: Option<f64>,
    /// The latest one of this session.
    pub checkpoint: Option<Saved>,
    /// What went wrong.
    pub faults: Faults,
}

/// How far a target is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// Asked for.
    pub relative_error: f64,
    /// The part of the area that must have it.
    pub fraction: f64,
    /// The error that decides: what this part of the area is known within now.
    pub decisive_error: Option<f64>,
    /// Where the run will probably end (`radwalk plan` foretells by the same rule).
    pub paths_expected: Option<u64>,
}

/// A checkpoint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    /// Since it was written.
    pub seconds_ago: f64,
    /// Its walks (Jacobi: rays).
    pub paths: u64,
}

/// What went wrong in this session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Faults {
    /// Workers that were lost, or left early.
    pub workers_lost: u64,
    /// Workers that were not let in.
    pub workers_refused: u64,
    /// The number of connections that failed.
    pub connections_failed: u64,
    /// Checkpoints that could not be written.
    pub checkpoints_failed: u64,
}
