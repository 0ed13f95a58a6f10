//! The board that an experiment scores on.

use crate::jacobi::ChainBoard;
use crate::tally::{Overflow, Scoreboard, Tally};
use crate::walk::score::RELATED;

/// The board that an experiment scores on; M power sums per score.
#[derive(Clone, Debug)]
pub enum Board<const M: usize> {
    /// Grey analog shooting: whole hits.
    Hits(Scoreboard<u64, (), 1, M>),
    /// The same with three estimators at once.
    RelatedHits(Scoreboard<u64, (), RELATED, M>),
    /// Other grey walks: fixed point.
    Fixed(Scoreboard<u128, u64, 1, M>),
    /// Gathering with three estimators at once.
    RelatedFixed(Scoreboard<u128, u64, RELATED, M>),
    /// Three channels.
    Coloured(Scoreboard<u128, u64, 3, M>),
    /// Whole chains of stochastic Jacobi.
    Chains(ChainBoard<M>),
}

/// Does the same with whichever board it is.
macro_rules! with_board {
    ($self:expr, $board:ident => $body:expr) => {
        match $self {
            $crate::experiment::board::Board::Hits($board) => $body,
            $crate::experiment::board::Board::RelatedHits($board) => $body,
            $crate::experiment::board::Board::Fixed($board) => $body,
            $crate::experiment::board::Board::RelatedFixed($board) => $body,
            $crate::experiment::board::Board::Coloured($board) => $body,
            $crate::experiment::board::Board::Chains($board) => $body,
        }
    };
}

pub(super) use with_board;

impl<const M: usize> Board<M> {
    /// Hands over all that was scored and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped.
    pub fn take(&mut self) -> Result<Tally, Overflow> {
        with_board!(self, board => board.take())
    }

    /// Adds all that was scored to a tally of the same experiment and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped or leaves its range; then the tally is unusable.
    pub fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        with_board!(self, board => board.add_to(tally))
    }
}
