//! The board that an experiment scores on.

use super::sensing::Sensing;
use crate::jacobi::ChainBoard;
use crate::tally::{Overflow, Scoreboard, Tally};
use crate::walk::apart::MarkBoard;
use crate::walk::score::RELATED;

/// The board that an experiment scores on; M power sums per score.
#[derive(Clone, Debug)]
pub struct Board<const M: usize> {
    /// Of faces.
    pub(super) scores: Scores<M>,
    /// Of sensors, where there are any.
    pub(super) sensing: Option<Sensing<M>>,
    /// Of groups, where there are any. Where there are, there are no sensors.
    pub(super) apart: Option<Apart>,
}

/// What a board keeps for groups of patches.
#[derive(Clone, Debug)]
pub(super) struct Apart {
    /// Of the scene.
    pub(super) faces: usize,
    /// What materials do, where that is asked for.
    pub(super) marks: Option<MarkBoard>,
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
        match (&mut self.sensing, &mut self.apart) {
            (None, None) => self.scores.take(),
            (Some(sensing), _) => sensing.take(&mut self.scores),
            (None, Some(apart)) => apart.take(&mut self.scores),
        }
    }

    /// Adds all that was scored to a tally of the same experiment and empties the board.
    ///
    /// # Errors
    /// Where a sum may have wrapped or leaves its range; then the tally is unusable.
    pub fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        if self.sensing.is_none() && self.apart.is_none() {
            return self.scores.add_to(tally);
        }
        tally.merge(&self.take()?).map_err(|_| Overflow)
    }
}

impl Apart {
    /// Hands over what faces have scored: all classes together, then each but the first, then what materials do.
    fn take<const M: usize>(&mut self, scores: &mut Scores<M>) -> Result<Tally, Overflow> {
        scores.total_first(self.faces);
        let of_classes = scores.take()?;
        let Some(marks) = &mut self.marks else { return Ok(of_classes) };
        let (counts, layout) = (of_classes.counts, of_classes.layout());
        let mut sums = of_classes.into_sums();
        sums.extend(marks.take().ok_or(Overflow)?);
        let rows = sums.len() / layout.columns();
        Ok(Tally::from_parts(counts, rows, layout, sums).expect("the layout is the board's own"))
    }
}

impl<const M: usize> Scores<M> {
    /// Adds what all classes have scored to the slots of the first, which stand for all of them then.
    fn total_first(&mut self, faces: usize) {
        match self {
            Scores::Hits(board) => board.total_first(faces),
            Scores::Fixed(board) => board.total_first(faces),
            Scores::Coloured(board) => board.total_first(faces),
            Scores::RelatedHits(_) | Scores::RelatedFixed(_) | Scores::Chains(_) => {}
        }
    }

    /// Hands over what faces have scored.
    pub(super) fn take(&mut self) -> Result<Tally, Overflow> {
        with_board!(self, board => board.take())
    }

    /// Adds what faces have scored to a tally of faces.
    pub(super) fn add_to(&mut self, tally: &mut Tally) -> Result<(), Overflow> {
        with_board!(self, board => board.add_to(tally))
    }
}
