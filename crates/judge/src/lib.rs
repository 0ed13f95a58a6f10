//! Whether a tally is good enough, what it still takes, and what speaks against it.
//!
//! Before a run, [`fit`] says what theory holds against a method in a scene, [`plan`] what the run will take, and
//! [`limits`] what its walks can come to at most. While it runs, [`target`] says at which numbers of walks it is looked at
//! and whether it ends there, [`sensors`] where they lie badly; [`drift`] compares what came since the look before with what was there. When it is done,
//! [`checks`] says in words what was verified of it.
//!
//! Nothing here reads files, clocks or sockets, and nothing is printed.

#![warn(unreachable_pub, unnameable_types)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

pub mod bounces;
pub mod checks;
pub mod coincident;
pub mod drift;
pub mod fit;
pub mod limits;
pub mod plan;
mod resolution;
pub mod sensors;
pub mod target;
pub mod total;

/// Σx and Σx²: what intervals need.
pub const MOMENTS: usize = 2;
