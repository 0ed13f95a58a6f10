//! Tests of this crate from outside, in one binary: each would link everything again.

#[path = "../fuzz/targets.rs"]
mod targets;

mod formats;
mod fuzz;
mod fuzzing;
mod groups;
