//! What coordinator, relays and workers agree on, as pure functions of what they hear: messages and their bytes, exact books
//! of walks, and the state machines that lead workers.
//!
//! From the ground up: [`digest`]s of tallies, [`deliveries`] and the [`roster`] of those who delivered, what a relay tells of its
//! workers ([`provenance`]), [`message`] and its bytes ([`codec`]), the [`ledger`] of walks, the [`crew`] of workers with their leases, and at the top [`coordinator`] and
//! [`relay`]: events and a time go in, actions come out ([`lead`]). A [`checkpoint`] is all of it as a file.
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
