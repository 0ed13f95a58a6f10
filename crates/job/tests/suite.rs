//! Tests of this crate from outside, in one binary: each would link everything again.

#[path = "../fuzz/targets.rs"]
mod targets;

mod common;
#[path = "../../import/tests/fuzzing.rs"]
mod fuzzing;

mod accepts;
mod configs;
mod fuzz;
mod jacobi;
mod lighting;
mod meshes;
mod refusals;
mod schema;
