//! Tests of this crate from outside, in one binary: each would link everything again.

#[path = "../fuzz/targets.rs"]
mod targets;

#[path = "../../import/tests/fuzzing.rs"]
mod fuzzing;
mod support;

mod files;
mod fuzz;
mod glare;
mod light;
