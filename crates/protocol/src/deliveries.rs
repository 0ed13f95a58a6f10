//! Deliveries: the workers that brought each range of walks, in a bounded list.
//!
//! Each lease that comes in is an entry: its walks, its worker, its digest. A long run has too many leases to keep them
//! all, so entries are folded into their neighbours: walks and digests add up. Lots that workers do not know decide
//! which leases keep an entry of their own, so that these are a fair sample for `radwalk audit`.

use bincode::{Decode, Encode};

use crate::digest::{self, Digest};

/// A range of consecutive walks as they came in: one lease, or several that were folded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Delivery {
    /// The number of walks in the entry.
    pub walks: u64,
    /// The number of leases in the entry.
    pub leases: u64,
    /// The worker that brought them, by its place in the list of workers, or [`Delivery::SEVERAL`].
    pub worker: u32,
    /// The digest of the entry's tally.
    pub digest: Digest,
    /// Whether this is a single lease that the lots have spared so far, so that it stays in the sample.
    pub spared: bool,
}

impl Delivery {
    /// The worker of an entry that holds leases of several workers.
    pub const SEVERAL: u32 = u32::MAX;

    /// The entry of a single lease.
    pub fn lease(walks: u64, worker: u32, digest: Digest) -> Self {
        Delivery { walks, leases: 1, worker, digest, spared: true }
    }

    /// Folds the entry that follows into this one.
    fn fold(&mut self, later: Delivery) {
        self.walks += later.walks;
        self.leases += later.leases;
        self.digest = digest::add(self.digest, later.digest);
        self.spared = false;
        if self.worker != later.worker {
            self.worker = Delivery::SEVERAL;
        }
    }
}

/// The entries of a range of walks, in their order, without gaps.
#[derive(Clone, Debug, Default, PartialEq, Eq, Encode, Decode)]
pub struct Deliveries {
    entries: Vec<Delivery>,
    /// The rounds of folding so far: a lease has kept its own entry with a probability of 2^−rounds.
    rounds: u32,
}

impl From<Delivery> for Deliveries {
    fn from(delivery: Delivery) -> Self {
        Deliveries { entries: vec![delivery], rounds: 0 }
    }
}

impl Deliveries {
    /// The most entries that are kept of one range of walks.
    pub(crate) const MOST: usize = 1 << 15;

    /// The most entries of one lease that a relay passes on.
    pub const MOST_PARTS: usize = 1 << 8;

    /// All entries, in the order of their walks.
    pub fn entries(&self) -> &[Delivery] {
        &self.entries
    }

    /// The number of walks in all entries.
    pub fn walks(&self) -> u128 {
        self.entries.iter().map(|entry| u128::from(entry.walks)).sum()
    }

    /// The digest of all walks together.
    pub fn digest(&self) -> Digest {
        self.entries.iter().fold(0, |sum, entry| digest::add(sum, entry.digest))
    }

    /// Whether every entry holds a walk and a lease, and names one of `workers` workers.
    pub fn is_sound(&self, workers: usize) -> bool {
        let known = |worker: u32| worker == Delivery::SEVERAL || (worker as usize) < workers;
        self.entries.iter().all(|entry| entry.walks > 0 && entry.leases > 0 && known(entry.worker))
    }

    /// Whether one of the given workers may have brought some of these walks.
    pub fn may_be_of(&self, is_meant: impl Fn(u32) -> bool) -> bool {
        self.entries.iter().any(|entry| entry.worker == Delivery::SEVERAL || is_meant(entry.worker))
    }

    /// Replaces the number of each worker.
    pub fn rename(&mut self, place: impl Fn(u32) -> u32) {
        let named = self.entries.iter_mut().filter(|entry| entry.worker != Delivery::SEVERAL);
        named.for_each(|entry| entry.worker = place(entry.worker));
    }
}

/// The deliveries of a range of walks; further walks are added at its end.
#[derive(Clone, Debug)]
pub struct Growing {
    deliveries: Deliveries,
    /// The number of the walk after the last.
    end: u64,
    /// The lots, drawn by the coordinator; workers do not know them.
    lots: u64,
}

impl Growing {
    /// Entries that go on from the deliveries of the walks before `end`.
    pub fn new(deliveries: Deliveries, end: u64, lots: u64) -> Self {
        Growing { deliveries, end, lots }
    }

    /// The deliveries so far.
    pub fn deliveries(&self) -> &Deliveries {
        &self.deliveries
    }

    /// The deliveries so far, taken out.
    pub fn into_deliveries(self) -> Deliveries {
        self.deliveries
    }

    /// Adds the entry of the next walks.
    pub fn push(&mut self, mut delivery: Delivery) {
        delivery.spared &= (0..self.deliveries.rounds).all(|round| self.spares(self.end, round));
        self.end += delivery.walks;
        self.place(delivery);
        self.fold_to(Deliveries::MOST);
    }

    /// Folds entries until at most `most` are left.
    pub fn fold_to(&mut self, most: usize) {
        while self.deliveries.entries.len() > most.max(1) {
            self.fold_again();
        }
    }

    /// Adds the entries of the range that follows.
    pub fn append(&mut self, later: &Deliveries) {
        while self.deliveries.rounds < later.rounds {
            self.fold_again();
        }
        later.entries.iter().for_each(|&delivery| self.push(delivery));
    }

    /// Adds an entry at the end, or folds it into the last one if neither is spared.
    fn place(&mut self, delivery: Delivery) {
        match self.deliveries.entries.last_mut() {
            Some(last) if !last.spared && !delivery.spared => last.fold(delivery),
            _ => self.deliveries.entries.push(delivery),
        }
    }

    /// Folds about half of the leases that still have entries of their own.
    fn fold_again(&mut self) {
        let round = self.deliveries.rounds;
        self.deliveries.rounds += 1;
        let entries = std::mem::take(&mut self.deliveries.entries);
        let mut first = self.end - entries.iter().map(|entry| entry.walks).sum::<u64>();
        for entry in entries {
            let spared = entry.spared && self.spares(first, round);
            first += entry.walks;
            self.place(Delivery { spared, ..entry });
        }
    }

    /// Whether the lots of a round spare the lease that begins with walk `first`.
    fn spares(&self, first: u64, round: u32) -> bool {
        let mixed = |z: u64| {
            let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        };
        mixed(mixed(self.lots ^ mixed(first)).wrapping_add(round.into())) & 1 == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lease n of one to three walks, by one of five workers.
    fn lease(n: u64) -> Delivery {
        Delivery::lease(1 + n % 3, (n * n % 5) as u32, n * 7919)
    }

    fn grown(leases: std::ops::Range<u64>, lots: u64) -> Growing {
        let before: u64 = (0..leases.start).map(|n| lease(n).walks).sum();
        let mut growing = Growing::new(Deliveries::default(), before, lots);
        leases.for_each(|n| growing.push(lease(n)));
        growing
    }

    fn totals(deliveries: &Deliveries) -> (u128, u64, Digest) {
        let leases = deliveries.entries().iter().map(|entry| entry.leases).sum();
        (deliveries.walks(), leases, deliveries.digest())
    }

    fn exact(leases: std::ops::Range<u64>) -> (u128, u64, Digest) {
        let walks = leases.clone().map(|n| u128::from(lease(n).walks)).sum();
        let digest = leases.clone().fold(0, |sum, n| digest::add(sum, lease(n).digest));
        (walks, leases.end - leases.start, digest)
    }

    #[test]
    fn few_leases_are_kept_as_they_came() {
        let growing = grown(0..1000, 1);
        assert_eq!(growing.deliveries().entries(), (0..1000).map(lease).collect::<Vec<_>>());
    }

    #[test]
    fn however_many_leases_come_few_entries_stay_and_nothing_of_them_is_lost() {
        let mut growing = grown(0..0, 1);
        for n in 0..1_000_000 {
            growing.push(lease(n));
            assert!(growing.deliveries().entries().len() <= Deliveries::MOST);
        }
        assert_eq!(totals(growing.deliveries()), exact(0..1_000_000));
        let alone = growing.deliveries().entries().iter().filter(|entry| entry.spared).count();
        assert!(alone > Deliveries::MOST / 8, "{alone} leases to draw a sample from");
        assert!(growing.deliveries().is_sound(5) && !growing.deliveries().is_sound(4));
    }

    /// Each tenth of 400,000 leases should have a tenth of the entries of single leases, about 1,250: five standard
    /// deviations are 170.
    #[test]
    fn old_leases_are_as_likely_to_keep_their_entry_as_new_ones() {
        let mut growing = grown(0..200_000, 1);
        // A coordinator that goes on draws other lots.
        growing.lots = 2;
        (200_000..400_000).for_each(|n| growing.push(lease(n)));
        let (mut alone, mut first) = ([0_i32; 10], 0);
        let whole = exact(0..400_000).0 as u64;
        for entry in growing.deliveries().entries() {
            alone[(10 * first / whole) as usize] += i32::from(entry.spared);
            first += entry.walks;
        }
        let mean = alone.iter().sum::<i32>() / 10;
        assert!(mean > 500 && alone.iter().all(|&n| (n - mean).abs() < 6 * mean.isqrt()), "{alone:?}");
    }

    #[test]
    fn ranges_of_other_rounds_are_put_together() {
        for (cut, end) in [(100, 200_000), (150_000, 150_100)] {
            let mut growing = grown(0..cut, 1);
            growing.append(grown(cut..end, 2).deliveries());
            assert_eq!(totals(growing.deliveries()), exact(0..end));
            assert!(growing.deliveries().entries().len() <= Deliveries::MOST);
        }
    }

    #[test]
    fn workers_are_named_where_all_leases_of_an_entry_are_theirs() {
        let mut entry = lease(0);
        entry.fold(Delivery { worker: 0, ..lease(1) });
        assert_eq!((entry.worker, entry.leases), (0, 2));
        entry.fold(lease(2));
        assert_eq!((entry.worker, entry.leases, entry.walks), (Delivery::SEVERAL, 3, 6));
    }
}
