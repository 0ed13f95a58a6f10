//! Tests of this crate from outside, in one binary: each would link everything again.

mod support;

mod files;
mod glare;
mod light;
