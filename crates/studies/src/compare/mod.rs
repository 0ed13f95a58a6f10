//! Speed against accuracy: the methods that fit a scene, ranked by the time that they take to an error.
//!
//! The caller decides which processes walk: runs come as [`Shot`]s.

use std::path::Path;

use job::Job;
use radiosity::Scene;

mod contender;
mod judge;
mod measure;
pub mod page;
mod shot;
mod study;
mod table;
mod truth;
mod truths;

pub use contender::{Absent, Kind, Trial};
pub use measure::Point;
pub use shot::Shot;
pub use study::{Bench, Course, study};
pub use table::Rows;

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
