//! Tests of the program and its crates as a whole, in one binary: thirty binaries would each link everything.

#[path = "../../crates/radiosity/tests/common/mod.rs"]
mod common;
mod support;
mod verdict;

mod against_exact;
mod chaos;
mod choice;
mod chosen;
mod coincident;
mod colour;
mod compare;
mod continuous;
mod coverage;
mod daylight;
mod diff;
mod disk;
mod documents;
mod estimators;
mod exact_command;
mod factors;
mod figures;
mod final_gather;
mod folders;
mod follow;
mod general_scenes;
mod groups;
mod import;
mod independent;
mod jacobi;
mod jacobi_iterations;
mod jacobi_run;
mod lamp;
mod linear;
mod normals;
mod operators;
mod output;
mod partition;
mod plan;
mod planes;
mod refusals;
mod relay;
mod report;
mod resume;
mod rooms;
mod run;
mod sensors;
mod sign;
mod sobol_run;
mod sources;
mod sparse_factors;
mod stuck;
#[cfg(target_os = "linux")]
mod terminal;
mod voice;
mod watch;
