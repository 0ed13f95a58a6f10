//! The cluster: a coordinator and workers, separate processes that split a job's walks over TCP.
//!
//! The coordinator leases ranges of walks; workers shoot them on their replica of the scene and send back exact
//! tallies; the coordinator merges them. Relays may stand in between. This crate knows no more of physics than "shoot
//! these walks, merge tallies", and nothing in it can change the answer: which worker shot which walks, when, and how
//! often a lease was lost leaves no trace in it.
//!
//! The messages and the state machines of coordinator and relay are in the crate `protocol`, whose modules are
//! re-exported here. This crate holds the shells around them: sockets, threads, and the encrypted channel.

#![warn(unreachable_pub, unnameable_types)]

pub mod access;
pub mod channel;
mod doorstep;
mod gossip;
pub mod launcher;
mod lending;
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
