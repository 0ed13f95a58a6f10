//! A parcel: a tally as it arrives, packed, and checked before it is taken.

use radiosity::{Counts, Layout, Overflow, Tally};

use crate::codec::unpack;
use crate::digest::{Digest, Digester};
use crate::limits::Limits;
use crate::rejected::Rejected;

/// The packed sums of a lease, whose digest was checked: they are what the worker sent.
#[derive(Debug)]
pub struct Parcel {
    counts: Counts,
    packed: Vec<u8>,
    sums: usize,
    digest: Digest,
}

impl Parcel {
    /// Checks packed sums against the digest that came with them.
    ///
    /// # Errors
    /// Where they cannot be unpacked or have another digest.
    pub fn new(
        counts: Counts,
        packed: Vec<u8>,
        digest: Digest,
        digester: &Digester,
    ) -> Result<Self, Rejected> {
        let (mut sums, mut malformed) = (0, false);
        let unpacked = unpack(&packed).map_while(|sum| {
            malformed |= sum.is_err();
            sums += 1;
            sum.ok()
        });
        let found = digester.digest_sums(&counts, unpacked);
        match () {
            () if malformed => Err(Rejected::Malformed),
            () if found != digest => Err(Rejected::Digest),
            () => Ok(Parcel { counts, packed, sums, digest }),
        }
    }

    /// The counts of the walks, by how they ended.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// The packed sums as bytes.
    pub fn packed(&self) -> &[u8] {
        &self.packed
    }

    /// Why no walks of a job can come to this parcel, if they cannot.
    pub fn breach(&self, limits: &Limits, layout: Layout) -> Option<&'static str> {
        let sums = unpack(&self.packed).map_while(Result::ok);
        limits.breach_of_counts(&self.counts).or_else(|| limits.breach_of_sums(&self.counts, layout, sums))
    }

    /// The number of sums in the parcel.
    pub fn sums(&self) -> usize {
        self.sums
    }

    /// The digest of the counts and sums.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// Adds the parcel to a tally of its shape.
    ///
    /// # Errors
    /// Where a sum overflows; then the tally is unusable.
    pub fn add_to(&self, tally: &mut Tally) -> Result<(), Overflow> {
        tally.add_sums(&self.counts, unpack(&self.packed).map_while(Result::ok))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::pack;

    #[test]
    fn a_parcel_is_what_was_sent_off_or_none() {
        let digester = Digester::new(&[7; 32]);
        let counts = Counts { walks: 3, ..Counts::default() };
        let layout = Layout { scores: 1, moments: 2, slopes: 0, events: false };
        let tally = Tally::from_parts(counts, 2, layout, vec![1, 300, 1 << 70, 0]).unwrap();
        let (packed, digest) = (pack(tally.sums()), digester.digest(&tally));
        let parcel = Parcel::new(counts, packed.clone(), digest, &digester).unwrap();
        assert_eq!((parcel.sums(), parcel.digest()), (4, digest));
        let mut sum = tally.clone();
        parcel.add_to(&mut sum).unwrap();
        let mut twice = tally.clone();
        twice.merge(&tally).unwrap();
        assert_eq!(sum, twice);

        let parcel = |counts, packed: Vec<u8>, digest| Parcel::new(counts, packed, digest, &digester).err();
        assert_eq!(parcel(counts, packed.clone(), digest + 1), Some(Rejected::Digest));
        assert_eq!(parcel(Counts::default(), packed.clone(), digest), Some(Rejected::Digest));
        assert_eq!(parcel(counts, [&packed[..], &[1]].concat(), digest), Some(Rejected::Digest));
        assert_eq!(parcel(counts, [&packed[..], &[255]].concat(), digest), Some(Rejected::Malformed));
        assert_eq!(parcel(counts, packed[..3].into(), digest), Some(Rejected::Malformed));
    }
}
