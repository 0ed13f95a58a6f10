//! Whoever leads workers, as its sockets see it: what connections say goes in, what is to be done comes out, and time is a
//! number. The coordinator and relays are such; [`crate::server`] is the shell around them.

use std::fmt;
use std::time::Duration;

use crate::message::{ToCoordinator, ToWorker};

/// A connection, named by the shell; never used twice.
pub type PeerId = u64;

/// Time since whoever leads began.
pub type Now = Duration;

/// What the shell has to do.
#[derive(Debug, PartialEq)]
pub enum Action {
    /// Send a message.
    Send(PeerId, ToWorker),
    /// Close a connection, after what was sent has gone out.
    Close(PeerId),
    /// Tell the owner of the run.
    Tell(Notice),
}

/// What the owner of a run should know about its workers.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// A worker has built its replica, and gets walks from now on.
    Joined {
        /// As it called itself.
        name: String,
        /// Its threads; 0 of a relay, whose workers come later.
        threads: usize,
    },
    /// A worker is gone, or was given up.
    Lost {
        /// As it called itself.
        name: String,
        /// Why.
        reason: String,
    },
    /// A worker has left because its owner told it to.
    Left {
        /// As it called itself.
        name: String,
    },
    /// Somebody was not let in.
    Refused {
        /// As it called itself.
        name: String,
        /// Why.
        reason: String,
    },
    /// A connection ended before anybody was introduced.
    Failed(String),
    /// No walk has come in for long.
    Quiet {
        /// For how long [s].
        seconds: u64,
        /// What all are at.
        why: String,
    },
    /// So many connections were refused or ended of which nothing was told.
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
            Notice::Failed(reason) => write!(f, "a connection came to nothing: {reason}"),
            Notice::Quiet { seconds, why } => write!(f, "no walk has come in for {seconds} s: {why}"),
            Notice::Hushed(connections) => write!(f, "{connections} more connections came to nothing"),
        }
    }
}

/// A state machine that leads workers.
pub trait Lead {
    /// Somebody who knows the key has connected.
    fn on_connect(&mut self, id: PeerId) -> Vec<Action>;
    /// A peer said something.
    fn on_message(&mut self, id: PeerId, message: ToCoordinator, now: Now) -> Vec<Action>;
    /// A long message to a peer gets on. It may say nothing until it has all of it, so this is a sign of life and of
    /// progress.
    fn on_stir(&mut self, id: PeerId);
    /// So many bytes of peers have come in.
    fn on_bytes(&mut self, bytes: usize) {
        let _ = bytes;
    }
    /// A connection is gone.
    fn on_lost(&mut self, id: PeerId, reason: &str, now: Now) -> Vec<Action>;
    /// Time goes by.
    fn on_tick(&mut self, now: Now) -> Vec<Action>;
    /// The largest frame that a peer may send.
    fn frame_cap(&self, id: PeerId) -> usize;
}
