//! What was counted of exchange factors, and what the walks have cost.

use exchange::ExchangeCounts;

use crate::rounds::Cost;

/// The file of counts, which is written after every look.
pub(crate) const COUNTS: &str = "factors.counts.json";

/// What was counted, and what it cost.
pub struct Counted {
    /// The seeds of the walks.
    pub(super) seeds: Vec<u64>,
    pub(super) counts: ExchangeCounts,
    pub(super) cost: Cost,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

impl Counted {
    /// Whether there is no walk to tell of.
    pub fn is_empty(&self) -> bool {
        self.counts.total() == 0
    }
}
