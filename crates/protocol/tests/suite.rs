//! Tests of this crate from outside, in one binary: each would link everything again.

mod toy;

mod coordinator;
mod late;
mod liveness;
mod relay;
mod transfers;
