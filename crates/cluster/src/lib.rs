//! Coordinator and workers: separate processes that split a job's walks over TCP.
//!
//! The coordinator leases ranges of walks; workers shoot them on their replica of the scene and send back
//! exact tallies; the coordinator merges them. Relays may stand in between. Nothing here knows more of physics than "shoot these walks,
//! merge tallies", and nothing here can enter the answer: which worker shot what, when, and how often a
//! lease was lost leaves no trace in it.

pub mod access;
pub mod channel;
pub mod checkpoint;
pub mod codec;
pub mod coordinator;
pub mod crew;
pub mod deliveries;
pub mod digest;
mod doorstep;
mod gossip;
pub mod lead;
pub mod ledger;
pub mod limits;
mod line;
mod link;
pub mod merge;
pub mod message;
pub mod noise;
pub mod pace;
pub mod parcel;
pub mod relay;
pub mod roster;
pub mod scrape;
pub mod server;
mod transfers;
pub mod upstream;
pub mod watch;
pub mod worker;
