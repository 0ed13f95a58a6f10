//! Tests of this crate from outside, in one binary: each would link everything again.

mod common;

mod meshes;
mod partition;
mod solo;
mod survival;
