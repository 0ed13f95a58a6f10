//! Monitoring of a running job.
//!
//! A [`Gauge`] measures the state of the job ([`RunStatus`]); [`Reports`] writes it every two seconds to status files
//! and to a page of metrics; [`Showing`] serves the report of the result so far; a [`Watch`] does all this in the coordinator's
//! loop, and keeps checkpoints. [`find`] reads a status file in
//! another process, without a connection or a key.
//!
//! This crate prints nothing.

#![warn(unreachable_pub, unnameable_types)]

mod address;
mod gauge;
mod metrics;
mod reports;
mod run_status;
mod scrape;
mod showing;
mod status;
mod text;
mod watch;

pub use address::NoPage;
pub use gauge::Gauge;
pub use reports::{Reports, open_metrics};
pub use run_status::{FaultCounts, Goal, RunStatus, Saved};
pub use scrape::TextPage;
pub use showing::Showing;
pub use status::{Description, JobState, NoStatus, Report, WorkerStatus, find, watched};
pub use text::ended;
pub use watch::{Looked, Watch};
