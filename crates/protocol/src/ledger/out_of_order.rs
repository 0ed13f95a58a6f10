//! An out-of-order range: results that wait beyond a gap, merged with their neighbours.

use bincode::{Decode, Encode};
use radiosity::{Counts, Tally, boards::MergeError};

use crate::codec::pack;
use crate::deliveries::{Deliveries, Growing};
use crate::digest::Digester;
use crate::parcel::Parcel;

/// A range of walks that waits beyond a gap: an out-of-order range.
#[derive(Debug)]
pub(super) struct WaitingRange {
    pub(super) end: u64,
    pub(super) sums: RangeSums,
    pub(super) deliveries: Growing,
}

/// An out-of-order range as a checkpoint keeps it.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct OutOfOrderRange {
    /// The number of the range's first walk.
    pub first: u64,
    /// How its walks ended ([`Counts::to_array`]).
    pub counts: Box<[u128; 15]>,
    /// The range's sums, packed ([`crate::codec::pack`]).
    pub sums: Vec<u8>,
    /// The deliveries of the range's walks.
    pub deliveries: Deliveries,
}

impl OutOfOrderRange {
    /// The range's sums, ready to be merged; `None` if they are not those that were delivered.
    pub fn parcel(&self, digester: &Digester) -> Option<Parcel> {
        let counts = Counts::from_array(*self.counts)?;
        let parcel = Parcel::new(counts, self.sums.clone(), self.deliveries.digest(), digester).ok()?;
        (u128::from(counts.walks) == self.deliveries.walks() && counts.walks > 0).then_some(parcel)
    }
}

/// The sums of an out-of-order range. Those of a single lease stay packed: most are soon added to the prefix, and the others take
/// less memory.
#[derive(Debug)]
pub(super) enum RangeSums {
    Packed(Parcel),
    Merged(Tally),
}

impl RangeSums {
    pub(super) fn add_to(&self, tally: &mut Tally) -> Result<(), MergeError> {
        match self {
            RangeSums::Packed(parcel) => Ok(parcel.add_to(tally)?),
            RangeSums::Merged(merged) => tally.merge(merged),
        }
    }

    pub(super) fn counts(&self) -> &Counts {
        match self {
            RangeSums::Packed(parcel) => parcel.counts(),
            RangeSums::Merged(merged) => &merged.counts,
        }
    }

    pub(super) fn packed(&self) -> Vec<u8> {
        match self {
            RangeSums::Packed(parcel) => parcel.packed().to_vec(),
            RangeSums::Merged(merged) => pack(merged.sums()),
        }
    }

    /// Adds other sums to these; `empty` makes a tally of the same shape.
    fn add(&mut self, mut other: RangeSums, empty: impl Fn() -> Tally) -> Result<(), MergeError> {
        // If either side has a tally already, no further one is made.
        if matches!((&*self, &other), (RangeSums::Packed(_), RangeSums::Merged(_))) {
            std::mem::swap(self, &mut other);
        }
        if let RangeSums::Packed(parcel) = self {
            let mut tally = empty();
            parcel.add_to(&mut tally)?;
            *self = RangeSums::Merged(tally);
        }
        match self {
            RangeSums::Merged(tally) => other.add_to(tally),
            RangeSums::Packed(_) => unreachable!("merged above"),
        }
    }
}

impl WaitingRange {
    /// Adds the range that follows this one.
    pub(super) fn append(
        &mut self,
        later: WaitingRange,
        empty: impl Fn() -> Tally,
    ) -> Result<(), MergeError> {
        self.sums.add(later.sums, empty)?;
        self.deliveries.append(later.deliveries.deliveries());
        self.end = later.end;
        Ok(())
    }
}
