//! Tests of this crate from outside, in one binary: each would link everything again.

mod common;
#[path = "../../exact/tests/common/shapes.rs"]
mod shapes;

mod factors;
mod rows;
mod thermal;
