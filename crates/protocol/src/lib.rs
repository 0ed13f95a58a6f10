//! The protocol between coordinator, relays and workers, as pure functions of the messages that arrive: messages and
//! their bytes, exact books of walks, and the state machines that lead workers.
//!
//! From the ground up: the [`digest`] of a tally, the [`deliveries`] and the [`roster`] of the workers that delivered,
//! the [`provenance`] that a relay sends of its workers, the [`message`] and its bytes ([`codec`]), the [`ledger`] of
//! walks, the [`crew`] of workers with their leases, and at the top [`coordinator`] and [`relay`]: events and a time go
//! in, actions come out ([`lead`]). A [`checkpoint`] holds all of this state in a file.
//!
//! There are no sockets, threads or clocks here, and clippy holds that (`clippy.toml`). The crate `cluster` is the shell.

#![warn(unreachable_pub, unnameable_types)]

pub mod captain;
pub mod checkpoint;
pub mod codec;
pub mod coordinator;
pub mod crew;
pub mod deliveries;
pub mod digest;
pub mod effort;
pub mod foreign;
pub mod lead;
pub mod ledger;
pub mod limits;
pub mod merge;
pub mod message;
pub mod pace;
pub mod parcel;
pub mod provenance;
pub mod rejected;
pub mod relay;
pub mod roster;
pub mod terms;
mod transfers;
pub mod watch;
