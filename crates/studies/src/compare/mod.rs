//! Speed against accuracy: the methods that fit a scene, ranked by the time that they take to an error.
//!
//! Who walks is not decided here: runs come as [`Shot`]s.

use std::path::Path;

use job::Job;
use radiosity::{Scene, Tally};

pub mod contender;
pub mod judge;
pub mod measure;
pub mod page;
pub mod truth;

/// A job to compare methods in.
#[derive(Clone, Copy)]
pub struct Arena<'a> {
    /// The job's file.
    pub path: &'a Path,
    /// What is changed in it, as KEY=VALUE.
    pub set: &'a [String],
    /// The job, with its changes.
    pub job: &'a Job,
    /// Its scene.
    pub scene: &'a Scene,
}

/// Who walks.
#[derive(Clone, Copy)]
pub struct Team {
    /// Worker processes.
    pub workers: usize,
    /// Threads of each.
    pub threads: u32,
}

/// What some runs of a trial came to.
pub struct Shot {
    /// The tally of each.
    pub tallies: Vec<Tally>,
    /// Processor time that workers walked, of one run [s].
    pub seconds: f64,
    /// The most memory that a worker process took [bytes], where the system tells.
    pub memory: Option<u64>,
    /// What workers sent for one run [bytes].
    pub traffic: u64,
}
