//! The board that an experiment scores on.

use super::sensing::Sensing;
use crate::jacobi::ChainBoard;
use crate::tally::{LinearBoard, Overflow, Scoreboard, Tally};
use crate::walk::score::RELATED;

/// The board that an experiment scores on; M power sums per score.
#[derive(Clone, Debug)]
pub struct Board<const M: usize> {
    /// Of faces.
    pub(super) scores: Scores<M>,
    /// Of sensors, where there are any.
    pub(super) sensing: Option<Sensing<M>>,
}

/// Where the faces of a scene score.
#[derive(Clone, Debug)]
pub(super) enum Scores<const M: usize> {
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
    /// Grey analog shooting with slopes.
    LinearHits(LinearBoard<u64, (), 1>),
    /// Other grey walks with slopes.
    LinearFixed(LinearBoard<u128, u64, 1>),
    /// Three channels with slopes.
    LinearColoured(LinearBoard<u128, u64, 3>),
    /// Whole chains of stochastic Jacobi.
    Chains(ChainBoard<M>),
}

/// Does the same with every kind of scores.
macro_rules! with_board {
    ($self:expr, $board:ident => $body:expr) => {
        match $self {
            $crate::experiment::board::Scores::Hits($board) => $body,
            $crate::experiment::board::Scores::RelatedHits($board) => $body,
            $crate::experiment::board::Scores::Fixed($board) => $body,
            $crate::experiment::board::Scores::RelatedFixed($board) => $body,
            $crate::experiment::board::Scores::Coloured($board) => $body,
            $crate::experiment::board::Scores::LinearHits($board) => $body,
            $crate::experiment::board::Scores::LinearFixed($board) => $body,
            $crate::experiment::board::Scores::LinearColoured($board) => $body,
            $crate::experiment::board::Scores::Chains($board) => $body,
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
        match &mut self.sensing {
            None => self.scores.take(),
            Some(sensing) => sensing.take(&mut self.scores),
        }
    }

    /// Adds all that was scored to a tally of the same experiment and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped or leaves its range; then the tally is unusable.
    pub fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        match &mut self.sensing {
            None => self.scores.add_to(tally),
            Some(sensing) => tally.merge(&sensing.take(&mut self.scores)?).map_err(|_| Overflow),
        }
    }
}

impl<const M: usize> Scores<M> {
    /// Hands over what faces have scored.
    pub(super) fn take(&mut self) -> Result<Tally, Overflow> {
        with_board!(self, board => board.take())
    }

    /// Adds what faces have scored to a tally of faces.
    pub(super) fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        with_board!(self, board => board.add_to(tally))
    }
}
