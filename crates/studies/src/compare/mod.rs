//! Speed against accuracy: the methods that fit a scene, ranked by the time that they take to an error.
//!
//! The caller decides which processes walk: runs come as [`Shot`]s.

use std::path::Path;

use job::Job;
use radiosity::{Scene, Tally};

mod contender;
mod judge;
mod measure;
pub mod page;
mod truth;

pub use contender::{Absent, Contender, Kind, Trial, contenders, names};
pub use measure::{Judged, Point, point};
pub use truth::Truth;

/// A job in which methods are compared.
#[derive(Clone, Copy)]
pub struct Arena<'a> {
    /// The path of the job's file.
    pub path: &'a Path,
    /// The changes of the job, as KEY=VALUE.
    pub set: &'a [String],
    /// The job with its changes.
    pub job: &'a Job,
    /// The scene of the job.
    pub scene: &'a Scene,
}

/// The processes that walk.
#[derive(Clone, Copy)]
pub struct Team {
    /// The number of worker processes.
    pub workers: usize,
    /// The threads of each worker process.
    pub threads: u32,
}

/// The result of some runs of a trial.
pub struct Shot {
    /// The tally of each run.
    pub tallies: Vec<Tally>,
    /// The processor time of one run's walks [s].
    pub seconds: f64,
    /// The most memory that a worker process took [bytes], if the system tells.
    pub memory: Option<u64>,
    /// The bytes that workers sent for one run.
    pub traffic: u64,
}
