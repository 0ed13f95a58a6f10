//! A test hook of debug builds: a worker whose memory fails now and then. With `RADWALK_TEST_WRONG_WORKER=P` in its environment, about one in P of
//! what it hands over has a bit flipped, before any digest is taken.

use std::ops::Range;

use cluster::{JobHashes, Work};
use protocol::Limits;
use radiosity::{Overflow, Tally, parallel::ThreadPool};

use crate::shift::Shift;

/// The work of a process, sound or not.
pub(crate) struct Faulty {
    shift: Shift,
    one_in: Option<u64>,
}

impl Faulty {
    /// Faulty where the environment asks for it.
    pub(crate) fn if_asked_for(shift: Shift) -> Self {
        let asked = std::env::var("RADWALK_TEST_WRONG_WORKER");
        Faulty { shift, one_in: asked.ok().and_then(|number| number.parse().ok()) }
    }
}

impl Work for Faulty {
    type Board = <Shift as Work>::Board;

    fn hashes(&self) -> JobHashes {
        self.shift.hashes()
    }

    fn empty(&self) -> Tally {
        self.shift.empty()
    }

    fn limits(&self) -> Limits {
        self.shift.limits()
    }

    fn board(&self) -> Self::Board {
        self.shift.board()
    }

    fn shoot(&self, walks: Range<u64>, board: &mut Self::Board) {
        self.shift.shoot(walks, board);
    }

    fn shoot_while(&self, walks: Range<u64>, board: &mut Self::Board, pool: &dyn ThreadPool) {
        self.shift.shoot_while(walks, board, pool);
    }

    fn hand_over(&self, board: &mut Self::Board, tally: &mut Tally) -> Result<(), Overflow> {
        match self.one_in {
            Some(one_in) => tally.merge(&spoilt(board.take()?, one_in)).map_err(|_| Overflow),
            None => self.shift.hand_over(board, tally),
        }
    }
}

/// A tally of which one in some has a bit flipped.
fn spoilt(tally: Tally, one_in: u64) -> Tally {
    let lot = u64::from_le_bytes(tally.hash()[..8].try_into().expect("eight bytes"));
    if !lot.is_multiple_of(one_in) {
        return tally;
    }
    let (counts, patches, layout) = (tally.counts, tally.patches(), tally.layout());
    let mut sums = tally.into_sums();
    sums[0] ^= 1;
    Tally::from_parts(counts, patches, layout, sums).expect("as many sums as before")
}
