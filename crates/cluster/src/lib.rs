//! The cluster: a coordinator and workers, separate processes that split a job's walks over TCP.
//!
//! The coordinator leases ranges of walks; workers shoot them on their replica of the scene and send back exact
//! tallies; the coordinator merges them. Relays may stand in between. This crate knows no more of physics than "shoot
//! these walks, merge tallies", and nothing in it can change the answer: which worker shot which walks, when, and how
//! often a lease was lost leaves no trace in it.
//!
//! The messages and the state machines of coordinator and relay are in the crate `protocol`. This crate holds the shells
//! around them: sockets, threads, and the encrypted channel. Two modules are namespaces: `noise`, the channel's
//! cryptography, and `launcher`, what the environment of a job on a cluster says.

#![warn(unreachable_pub, unnameable_types)]

#[cfg(not(unix))]
compile_error!(
    "radwalk's processes need Unix: build it on Linux, on macOS, or on Windows in its subsystem for Linux"
);

mod access;
mod channel;
pub mod launcher;
mod lending;
mod line;
mod link;
mod listen;
pub mod noise;
mod notice_limiter;
mod pending;
mod server;
mod upstream;
mod worker;
mod worker_error;

pub use access::{Access, random_bytes};
pub use channel::{Inbound, Outbound};
pub use listen::{ListenError, bind};
pub use server::{Wish, serve};
pub use upstream::{Door, relay};
pub use worker::{JobHashes, Work, WorkerIntroduction, work};
pub use worker_error::WorkerError;
