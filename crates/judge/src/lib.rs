//! Judgement of a tally: whether it is accurate enough, what the job still takes, and what is wrong with it.
//!
//! Before a run, [`misfits`] says what theory has against a method in a scene, [`plan`] what the run will take, and
//! [`limits`] what its walks can come to at most. While it runs, [`target`] says at which numbers of walks to look and
//! whether to end there; each look compares the walks since the last one with those before. When it is done, [`checks`]
//! says in words what was verified.
//!
//! Two modules are namespaces: `target` and `plan`, the questions "is it good enough?" and "what will it take?".
//!
//! This crate reads no files, clocks or sockets, and prints nothing.

#![warn(unreachable_pub, unnameable_types)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

mod bounces;
mod checks;
mod coincident;
mod discretised;
mod drift;
mod fit;
mod limits;
mod model;
pub mod partition;
pub mod plan;
mod resolution;
mod sensors;
pub mod target;

pub use bounces::bounces;
pub use checks::{checks, checks_of_result};
pub use coincident::Coincident;
pub use discretised::{DiscretisedControl, is_discretised};
pub use fit::misfits;
pub use limits::limits;
pub use model::{job_lines, scene_lines};
pub use sensors::sensor_warnings;
