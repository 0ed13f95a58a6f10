//! The interface between a leader of workers (the coordinator or a relay) and its sockets: messages go in, actions come
//! out, and time is a number. The crate `cluster` holds the sockets.

use std::fmt;
use std::time::Duration;

use crate::message::{ToCoordinator, ToWorker};

/// The number of a connection, given by the sockets; it is never used twice.
pub type PeerId = u64;

/// The time since the leader started.
pub type Now = Duration;

/// What the leader asks its sockets to do.
#[derive(Debug, PartialEq)]
pub enum Action {
    /// Send a message to a peer.
    Send(PeerId, ToWorker),
    /// Close a connection once everything sent over it has gone out.
    Close(PeerId),
    /// Tell the owner of the run about an event.
    Tell(Notice),
}

/// An event that the owner of a run should know about.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// A worker has built its replica and gets walks from now on.
    Joined {
        /// The name that the worker gave.
        name: String,
        /// The worker's threads; 0 for a relay, whose workers join later.
        threads: usize,
    },
    /// A worker's connection ended, or the leader gave it up.
    Lost {
        /// The name that the worker gave.
        name: String,
        /// The reason, as a person may read it.
        reason: String,
    },
    /// A worker has left because its owner told it to.
    Left {
        /// The name that the worker gave.
        name: String,
    },
    /// A worker was not let in.
    Refused {
        /// The name that the worker gave.
        name: String,
        /// The reason, as a person may read it.
        reason: String,
    },
    /// A connection ended before the other end introduced itself.
    Failed(String),
    /// No result has come in for a long time.
    Quiet {
        /// The time since the last result [s].
        seconds: u64,
        /// What the workers are doing meanwhile.
        why: String,
    },
    /// The number of connections that failed without a notice of their own.
    Hushed(usize),
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Notice::Joined { name, threads: 0 } => write!(f, "{name} joins"),
            Notice::Joined { name, threads: 1 } => write!(f, "worker {name} joins with 1 thread"),
            Notice::Joined { name, threads } => write!(f, "worker {name} joins with {threads} threads"),
            Notice::Lost { name, reason } => {
                write!(f, "lost worker {name}: {reason}; its walks go to others")
            }
            Notice::Left { name } => {
                write!(f, "worker {name} left, as it was told to; its walks go to others")
            }
            Notice::Refused { name, reason } => write!(f, "refused worker {name}: {reason}"),
            Notice::Failed(reason) => write!(f, "a connection failed: {reason}"),
            Notice::Quiet { seconds, why } => write!(f, "no result has come in for {seconds} s: {why}"),
            Notice::Hushed(connections) => write!(f, "{connections} more connections failed"),
        }
    }
}

/// A state machine that leads workers: a coordinator or a relay.
pub trait Lead {
    /// Takes up a connection whose other end has proved that it knows the key.
    fn on_connect(&mut self, id: PeerId) -> Vec<Action>;
    /// Handles a message of a peer.
    fn on_message(&mut self, id: PeerId, message: ToCoordinator, now: Now) -> Vec<Action>;
    /// Notes that a peer has read more of a long message. A peer may send nothing until it has the whole message, so
    /// this counts as a sign of life and of progress.
    fn on_stir(&mut self, id: PeerId);
    /// Counts bytes that peers have sent.
    fn on_bytes(&mut self, bytes: usize) {
        let _ = bytes;
    }
    /// Takes a connection that has ended out of the books.
    fn on_lost(&mut self, id: PeerId, reason: &str, now: Now) -> Vec<Action>;
    /// Does what is due at a time: gives up silent peers, looks for late leases.
    fn on_tick(&mut self, now: Now) -> Vec<Action>;
    /// The largest frame that a peer may send [bytes].
    fn frame_cap(&self, id: PeerId) -> usize;
}
