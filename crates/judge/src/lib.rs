//! Judgement of a tally: whether it is accurate enough, what the job still takes, and what is wrong with it.
//!
//! Before a run, [`fit`] says what theory has against a method in a scene, [`plan`] what the run will take, and
//! [`limits`] what its walks can come to at most. While it runs, [`target`] says at which numbers of walks to look and
//! whether to end there, [`sensors`] which sensors are badly placed, and [`drift`] compares the walks since the last
//! look with those before. When it is done, [`checks`] says in words what was verified.
//!
//! This crate reads no files, clocks or sockets, and prints nothing.

#![warn(unreachable_pub, unnameable_types)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

pub mod bounces;
pub mod checks;
pub mod coincident;
pub mod drift;
pub mod fit;
pub mod limits;
pub mod partition;
pub mod plan;
mod resolution;
pub mod sensors;
pub mod target;
pub mod total;

/// The number of power sums per score: Σx and Σx², as intervals need.
pub const MOMENTS: usize = 2;
