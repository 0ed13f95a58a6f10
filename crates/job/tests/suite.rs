//! Tests of this crate from outside, in one binary: each would link everything again.

mod common;

mod accepts;
mod configs;
mod jacobi;
mod lighting;
mod meshes;
mod refusals;
mod schema;
