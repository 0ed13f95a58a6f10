//! What was counted of exchange factors, and what the walks have cost.

use exchange::ExchangeCounts;
use serde::{Deserialize, Serialize};

/// The file of counts, which is written after every look.
pub(super) const COUNTS: &str = "factors.counts.json";

/// What was counted, and what it cost.
pub struct Counted {
    /// The seeds of the walks.
    pub(super) seeds: Vec<u64>,
    pub(super) counts: ExchangeCounts,
    pub(super) cost: Cost,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// What walks have cost.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Cost {
    pub(super) rays: u64,
    pub(super) seconds: f64,
    pub(super) cpu_seconds: f64,
}

impl Cost {
    /// Adds what other walks have cost.
    pub(super) fn add(&mut self, other: Cost) {
        self.rays += other.rays;
        self.seconds += other.seconds;
        self.cpu_seconds += other.cpu_seconds;
    }
}

impl Counted {
    /// Whether there is no walk to tell of.
    pub fn is_empty(&self) -> bool {
        self.counts.total() == 0
    }
}
