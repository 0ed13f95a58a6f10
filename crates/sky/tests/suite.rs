//! Tests of this crate from outside, in one binary: each would link everything again.

#[path = "../../import/tests/fuzzing.rs"]
mod fuzzing;
#[path = "../fuzz/targets.rs"]
mod targets;

mod cie171;
mod fuzz;
