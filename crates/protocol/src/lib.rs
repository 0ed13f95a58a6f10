//! The protocol between coordinator, relays and workers, as pure functions of the messages that arrive: messages and
//! their bytes, exact books of walks, and the state machines that lead workers.
//!
//! From the ground up: the [`digest`] of a tally, the [`Deliveries`] and the [`Roster`] of the workers that delivered,
//! the [`LeaseProvenance`] that a relay sends of its workers, the [`message`] and its bytes ([`codec`]), the [`Ledger`] of
//! walks, the pool of workers with their leases, and at the top [`Coordinator`] and [`Relay`]: events and a time go
//! in, actions come out ([`Lead`]). A [`Checkpoint`] holds all of this state in a file.
//!
//! Four modules are namespaces: `message` is the protocol itself, and what `codec`, `digest` and `pace` hold are verbs and
//! numbers that read well with these names before them.
//!
//! There are no sockets, threads or clocks here, and clippy holds that (`clippy.toml`). The crate `cluster` is the shell.

#![warn(unreachable_pub, unnameable_types)]

mod checkpoint;
pub mod codec;
mod coordinator;
mod deliveries;
pub mod digest;
mod effort;
mod foreign;
mod lead;
mod leader;
mod ledger;
mod limits;
mod merge;
pub mod message;
pub mod pace;
mod parcel;
mod pool;
mod provenance;
mod rejected;
mod relay;
mod roster;
mod terms;
mod transfers;
mod watch;

pub use checkpoint::{Book, Checkpoint, CheckpointError, CheckpointFault, Look, Past, Session, WalkRange};
pub use coordinator::{Coordinator, Ending, JobPlan, Judge, Progress};
pub use deliveries::{Deliveries, Delivery, Growing};
pub use effort::Effort;
pub use foreign::Foreign;
pub use lead::{Action, Lead, Notice, Now, PeerId};
pub use ledger::{Ledger, OutOfOrderRange};
pub use limits::{Limits, MaterialLimits, SensorLimits};
pub use merge::MergeFault;
pub use message::LeaseId;
pub use parcel::Parcel;
pub use pool::{Present, SILENCE, STALL};
pub use provenance::LeaseProvenance;
pub use rejected::Rejected;
pub use relay::{Relay, RelayEnd};
pub use roster::{Contributor, Roster};
pub use terms::Terms;
