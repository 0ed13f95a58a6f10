//! What a run leaves, and what is done with it later.
//!
//! A job travels to workers, and stays in `tally.bin`, as its [`Settings`] and its scene; a [`Replica`] walks it. While a
//! run goes on, a [`Keeper`] writes checkpoints, from which another run can [`resume`]; at the end [`RunOutput`] writes the files of the output folder, all of which
//! follow from the tally. Later, results are opened ([`StoredRun`]), [`merge`]d, held against each other ([`compare`]), and
//! audited ([`audit`]: some of their walks are traced again), and mixtures of their sources are computed ([`combine`]).
//!
//! Counts that no `tally.bin` keeps are walked round by round ([`Round`]), on the same workers.
//! [`factors`] is a namespace of its own: exchange factors, whose walks are counted and kept otherwise. [`daylight`] is another: coefficients of the sky,
//! and what a year of weather makes of them.
//!
//! [`walk_here`] walks a job on threads of this process, and comes to what the cluster comes to. [`solve`] is the deterministic
//! solution. Nothing is printed here.

#![warn(unreachable_pub, unnameable_types)]

#[cfg(not(unix))]
compile_error!(
    "radwalk's processes need Unix: build it on Linux, on macOS, or on Windows in its subsystem for Linux"
);

mod audit;
mod checkpoints;
mod combine;
mod control;
pub mod daylight;
mod diff;
mod error;
mod exact_answer;
pub mod factors;
mod findings;
mod memory;
mod merge;
mod meshes;
mod outputs;
mod packed_tally;
mod pilot;
mod replica;
mod resume;
mod rounds;
mod settings;
mod solo;
mod stored_run;
mod text;
mod views;

pub use audit::{Audit, Extent, Wrong, audit};
pub use checkpoints::{CURRENT, Identity, Keeper, Latest, has_tally, unix_seconds};
pub use combine::{combine, mix};
pub use diff::{Comparison, Difference, JobDifference, compare};
pub use error::Error;
pub use exact_answer::{ExactAnswer, solve};
pub use findings::{FINDINGS, write_findings};
pub use memory::{check_memory, peak_memory, peak_memory_of};
pub use merge::merge;
pub use outputs::{LivePage, RunOutput, units};
pub use parallel::cores as all_threads;
pub use pilot::{
    Chosen, EndedGroups, PILOT, PilotBooks, PilotRunner, PilotStage, StageResult, choose, choose_by,
    is_being_replaced,
};
pub use protocol::Ending;
pub use replica::Replica;
pub use resume::{Resumed, resume};
pub use rounds::{Round, RoundResult};
pub use settings::Settings;
pub use solo::{SoloProgress, walk_here};
pub use stored_run::{StoredRun, stored_partition};
pub use text::summary_lines;
