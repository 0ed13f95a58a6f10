//! Tests of this crate from outside, in one binary: each would link everything again.

mod common;
#[path = "common/rays.rs"]
mod rays;
#[path = "common/shapes.rs"]
mod shapes;

mod box_scene;
mod colour;
mod form_factor;
mod general;
mod groups;
mod independent;
mod lamps;
mod layers;
mod patches;
mod sensors;
mod shadows;
mod system;
mod unmet;
mod variance;
mod walks;
mod wall;
