//! Tests of this crate from outside, in one binary: each would link everything again.

mod common;
#[path = "../../photometry/tests/support/mod.rs"]
mod support;

mod chains;
mod cylinders;
mod daylight;
mod glare;
mod groups;
mod lamps;
mod leaves;
mod light_tables;
mod linear;
mod linear_groups;
mod lit_parts;
mod panes;
mod same_bits;
mod scene;
mod sealed;
mod sensors;
mod sequences;
mod sheets;
mod solution;
mod walks;
mod watertight;
mod weights;
