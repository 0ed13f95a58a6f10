//! Tallies as files keep them beside `tally.bin`.

use protocol::codec::{pack, unpack};
use radiosity::{Counts, Layout, Tally};
use serde::{Deserialize, Serialize};

/// A tally whose sums are packed.
#[derive(Serialize, Deserialize)]
pub(crate) struct KeptTally {
    counts: [u128; 15],
    sums: Vec<u8>,
}

impl KeptTally {
    /// Packs a tally.
    pub(crate) fn of(tally: &Tally) -> Self {
        KeptTally { counts: tally.counts.to_array(), sums: pack(tally.sums()) }
    }

    /// The tally, where it has this shape.
    pub(crate) fn unpack(&self, rows: usize, layout: Layout) -> Option<Tally> {
        let sums = unpack(&self.sums).collect::<Result<_, _>>().ok()?;
        Tally::from_parts(Counts::from_array(self.counts)?, rows, layout, sums).ok()
    }
}
