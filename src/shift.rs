//! What a worker process does with its replica of a job: it walks leases against a clock.

use std::ops::Range;
use std::thread::{self, ThreadId};

use cluster::{JobHashes, Work};
use judge::limits;
use protocol::Limits;
use radiosity::{Board, Overflow, Tally, parallel::ThreadPool};
use results::Replica;

use crate::clock::WalkClock;

/// The work of a process.
pub(crate) struct Shift {
    replica: Replica,
    clock: WalkClock,
}

impl Shift {
    /// Builds the replica from what the coordinator sent; `clock` counts its walks.
    ///
    /// # Errors
    /// In words, where the bytes are no job or the scene is invalid.
    pub(crate) fn decode(bytes: &[u8], clock: WalkClock) -> Result<Self, String> {
        Ok(Shift::new(Replica::decode(bytes)?, clock))
    }

    /// The work on a replica that is there.
    pub(crate) fn new(replica: Replica, clock: WalkClock) -> Self {
        Shift { replica, clock }
    }
}

impl Work for Shift {
    type Board = Board;

    fn hashes(&self) -> JobHashes {
        JobHashes { scene: self.replica.experiment().scene().hash(), job: self.replica.job_hash() }
    }

    fn empty(&self) -> Tally {
        self.replica.experiment().tally()
    }

    fn limits(&self) -> Limits {
        limits(self.replica.experiment())
    }

    fn board(&self) -> Self::Board {
        self.replica.experiment().board()
    }

    fn shoot(&self, walks: Range<u64>, board: &mut Self::Board) {
        let (experiment, sequence) = (self.replica.experiment(), self.replica.sequence());
        self.clock.time(|| experiment.walk(sequence, walks, board));
    }

    fn shoot_while(&self, walks: Range<u64>, board: &mut Self::Board, pool: &dyn ThreadPool) {
        let (experiment, sequence) = (self.replica.experiment(), self.replica.sequence());
        let timed = Timed { pool, clock: &self.clock, owner: thread::current().id() };
        self.clock.time(|| experiment.walk_while(sequence, walks, board, &timed));
    }

    fn hand_over(&self, board: &mut Self::Board, tally: &mut Tally) -> Result<(), Overflow> {
        self.clock.time(|| board.add_to(tally))
    }
}

/// A thread pool whose lent threads are timed, too. The owner's own time is taken already.
struct Timed<'a> {
    pool: &'a dyn ThreadPool,
    clock: &'a WalkClock,
    owner: ThreadId,
}

impl ThreadPool for Timed<'_> {
    fn go_on(&self) -> bool {
        self.pool.go_on()
    }

    fn count(&self) -> usize {
        self.pool.count()
    }

    fn share(&self, parts: usize, part: &(dyn Fn(usize) + Sync)) {
        self.pool.share(parts, &|number| match thread::current().id() {
            id if id == self.owner => part(number),
            _ => self.clock.time(|| part(number)),
        });
    }
}
