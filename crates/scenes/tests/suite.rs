//! Tests of this crate from outside, in one binary: each would link everything again.

mod boxes;
mod interior;
