//! Random numbers: one sequence for a job, a place in it for every walk; Sobol sequences; what is drawn from them.

pub(crate) mod quasi;
pub(crate) mod rng;
pub(crate) mod sampling;
pub(crate) mod sobol;
