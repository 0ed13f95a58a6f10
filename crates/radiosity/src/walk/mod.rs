//! Walks: many side by side through the same verbs, leave, trace, arrive, survive or die, score.

pub(crate) mod arrive;
pub(crate) mod batch;
pub(crate) mod depart;
pub(crate) mod fate;
pub(crate) mod score;
