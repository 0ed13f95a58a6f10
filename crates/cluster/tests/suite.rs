//! Tests of this crate from outside, in one binary: each would link everything again.

mod net;
#[path = "../fuzz/targets.rs"]
mod targets;
#[path = "../../protocol/tests/toy/mod.rs"]
mod toy;

mod attacks;
mod fuzz;
mod liars;
mod relay_sockets;
mod sockets;
