//! Coordinator and workers: separate processes that split a job's walks over TCP.
//!
//! The coordinator leases ranges of walks; workers shoot them on their replica of the scene and send back
//! exact tallies; the coordinator merges them. Relays may stand in between. Nothing here knows more of physics than "shoot these walks,
//! merge tallies", and nothing here can enter the answer: which worker shot what, when, and how often a
//! lease was lost leaves no trace in it.
//!
//! What they agree on, and the state machines of coordinator and relay, are the crate `protocol`, whose modules stand here
//! too; what is here are its shells: sockets, threads, and the channel that hides what passes.

#![warn(unreachable_pub, unnameable_types)]

pub mod access;
pub mod channel;
mod doorstep;
mod gossip;
pub mod launcher;
mod line;
mod link;
pub mod listen;
pub mod noise;
pub mod server;
pub mod upstream;
pub mod worker;
mod worker_error;

pub use protocol::{
    checkpoint, codec, coordinator, crew, deliveries, digest, foreign, lead, ledger, limits, merge, message,
    pace, parcel, provenance, rejected, relay, roster, watch,
};
