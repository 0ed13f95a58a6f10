//! The ledger of walks: which are leased, which are in, which are lost; and the tally of a prefix.
//!
//! Walks are leased in ranges of whole streams. A lease comes in whole or not at all. What is reported is
//! always the tally of walks 0 … N − 1 for some N: results that arrive ahead of a gap wait beside the prefix
//! (neighbours merged into one) until the gap is filled. Of the leases in the prefix the ledger keeps who delivered
//! them, and their digests ([`crate::deliveries`]).

mod out_of_order;

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::Arc;

use radiosity::{Tally, boards::MergeError};

pub use self::out_of_order::OutOfOrderRange;
use self::out_of_order::{RangeSums, WaitingRange};
use crate::deliveries::{Deliveries, Delivery, Growing};
use crate::digest::Digester;
use crate::message::LeaseId;
use crate::message::SMALL_TALLY;
use crate::parcel::Parcel;
use crate::rejected::Rejected;

/// The books of one job: its walks, its leases and the tally of its prefix.
#[derive(Debug)]
pub struct Ledger {
    total: u64,
    stream_walks: u64,
    /// Walk numbers at which the prefix is looked at, ascending; no lease and no waiting range crosses one.
    looks: Vec<u64>,
    next: u64,
    next_lease: LeaseId,
    out: HashMap<LeaseId, Range<u64>>,
    /// The leases that are out, by their first walk: several if the same walks are out more than once.
    out_from: BTreeMap<u64, Vec<LeaseId>>,
    /// The ranges of lost walks by their first walk; they are leased again before new ones. Neighbours are one range.
    lost: BTreeMap<u64, u64>,
    /// The number of walks in all lost ranges.
    lost_walks: u64,
    waiting: BTreeMap<u64, WaitingRange>,
    /// The number of walks in all out-of-order ranges.
    waiting_walks: u64,
    prefix: Arc<Tally>,
    /// Whether the prefix moves on even where that takes a copy of it.
    hurried: bool,
    /// The deliveries of the prefix.
    deliveries: Growing,
    /// Decides which leases keep an entry of their own.
    lots: u64,
    /// The walk at which the prefix begins; what was before was taken off.
    begin: u64,
    /// The numbers of walks outside: walks from a key on are numbered on from its value.
    numbers: BTreeMap<u64, u64>,
    /// The number of streams that were leased again.
    pub streams_reissued: u64,
}

impl Ledger {
    /// Books for walks 0 … `total` − 1, beginning with the tally of a `prefix`, which may be empty, and the
    /// `deliveries` that it was made of.
    pub fn new(
        total: u64,
        stream_walks: u64,
        looks: Vec<u64>,
        prefix: Arc<Tally>,
        deliveries: Deliveries,
    ) -> Self {
        let next = prefix.counts.walks;
        Ledger {
            total,
            stream_walks,
            looks,
            next,
            next_lease: 0,
            out: HashMap::new(),
            out_from: BTreeMap::new(),
            lost: BTreeMap::new(),
            lost_walks: 0,
            waiting: BTreeMap::new(),
            waiting_walks: 0,
            prefix,
            hurried: false,
            deliveries: Growing::new(deliveries, next, 0),
            lots: 0,
            begin: 0,
            numbers: BTreeMap::from([(0, 0)]),
            streams_reissued: 0,
        }
    }

    /// Numbers walk 0 as `first` outside, and the others on from there.
    pub fn numbered_from(mut self, first: u64) -> Self {
        self.numbers = BTreeMap::from([(0, first)]);
        self
    }

    /// Numbers leases on from those of an earlier ledger, of which results may still be on their way.
    pub(crate) fn leased_after(mut self, earlier: &Ledger) -> Self {
        self.next_lease = earlier.next_lease;
        self
    }

    /// Decides by these lots which leases keep an entry of their own in a long run.
    pub fn drawn_by(mut self, lots: u64) -> Self {
        let next = self.next;
        self.deliveries = Growing::new(self.deliveries.into_deliveries(), next, lots);
        self.lots = lots;
        self
    }

    /// Takes up the out-of-order ranges of a checkpoint, in their order; the walks between them are leased first. An out-of-order range that no
    /// longer fits the job, because the job ends earlier or has a look within the range, is dropped and walked again.
    pub fn with_out_of_order(mut self, out_of_order: &[OutOfOrderRange], digester: &Digester) -> Self {
        for range in out_of_order {
            let Some(parcel) = range.parcel(digester) else { continue };
            let (first, walks) = (range.first, parcel.counts().walks);
            let Some(end) = first.checked_add(walks) else { continue };
            let is_looked_at = self.looks.iter().any(|&look| first < look && look < end);
            if first < self.next
                || end > self.total
                || is_looked_at
                || parcel.sums() != self.prefix.sums().len()
            {
                continue;
            }
            self.set_lost(self.next..first);
            self.next = end;
            self.waiting_walks += walks;
            let deliveries = Growing::new(range.deliveries.clone(), end, self.lots);
            self.waiting.insert(first, WaitingRange { end, sums: RangeSums::Packed(parcel), deliveries });
        }
        self
    }

    /// The out-of-order ranges, lowest first, as many as fit into `bytes` bytes.
    pub fn kept_out_of_order(&self, bytes: usize) -> Vec<OutOfOrderRange> {
        let mut left = bytes;
        let mut out_of_order = Vec::new();
        for (&first, waiting) in &self.waiting {
            let (counts, sums) = (Box::new(waiting.sums.counts().to_array()), waiting.sums.packed());
            let deliveries = waiting.deliveries.deliveries().clone();
            let size = sums.len() + size_of_val(deliveries.entries());
            if size > left && !out_of_order.is_empty() {
                break;
            }
            left = left.saturating_sub(size);
            out_of_order.push(OutOfOrderRange { first, counts, sums, deliveries });
        }
        out_of_order
    }

    /// The number of a walk outside.
    pub fn number(&self, walk: u64) -> u64 {
        let (&from, &number) = self.numbers.range(..=walk).next_back().expect("from the prefix on");
        number.saturating_add(walk - from)
    }

    /// Adds walks that are numbered `first` … outside. No lease crosses their beginning, and there is a look at both of
    /// their ends. Returns false if the numbers of walks run out.
    pub fn extend(&mut self, first: u64, walks: u64) -> bool {
        let Some(end) = self.total.checked_add(walks) else { return false };
        self.numbers.insert(self.total, first);
        self.looks.push(end);
        self.total = end;
        true
    }

    /// Takes off the prefix, which ends at a look, with its deliveries in at most [`Deliveries::MOST_PARTS`] entries. The next
    /// prefix begins there.
    pub fn take_off(&mut self) -> (Arc<Tally>, Deliveries) {
        let empty = Tally::new(self.prefix.patches(), self.prefix.layout());
        self.begin = self.prefix_walks();
        self.looks.retain(|&look| look > self.begin);
        // The last entry that begins here or before is still needed.
        let of_use = self.numbers.range(..=self.begin).next_back().map_or(0, |(&from, _)| from);
        self.numbers.retain(|&from, _| from >= of_use);
        let begun = Growing::new(Deliveries::default(), self.begin, self.lots);
        let mut deliveries = std::mem::replace(&mut self.deliveries, begun);
        deliveries.fold_to(Deliveries::MOST_PARTS);
        (std::mem::replace(&mut self.prefix, empty.into()), deliveries.into_deliveries())
    }

    /// The number of walks between the looks before and after the next walk to lease; 0 if all walks are out or in.
    pub fn span(&self) -> u64 {
        let next = self.lost.keys().next().copied().unwrap_or(self.next);
        let end = self.looks.iter().copied().find(|&look| look > next);
        let start = self.looks.iter().copied().rfind(|&look| look <= next).unwrap_or(self.begin);
        end.map_or(0, |end| end - start)
    }

    /// The merged tally of walks 0 … N − 1, which are in without a gap.
    pub fn prefix(&self) -> &Arc<Tally> {
        &self.prefix
    }

    /// The deliveries of the prefix.
    pub fn deliveries(&self) -> &Deliveries {
        self.deliveries.deliveries()
    }

    /// The prefix and its deliveries, taken out of the ledger.
    pub fn into_prefix(self) -> (Arc<Tally>, Deliveries) {
        (self.prefix, self.deliveries.into_deliveries())
    }

    /// The number N of walks in the prefix.
    pub fn prefix_walks(&self) -> u64 {
        self.begin + self.prefix.counts.walks
    }

    /// The number of walks that are in, those beyond a gap included.
    pub fn walks_in(&self) -> u64 {
        self.prefix_walks() + self.waiting_walks
    }

    /// The number of walks of the whole job.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Whether every walk is in.
    pub fn is_complete(&self) -> bool {
        self.prefix_walks() == self.total
    }

    /// The number of walks that no worker has yet.
    pub fn unleased(&self) -> u64 {
        self.total - self.next + self.lost_walks
    }

    /// Leases about `walks` walks, rounded up to whole streams: lost walks first, lowest first. Returns `None` if all
    /// walks are out or in.
    pub fn lease(&mut self, walks: u64) -> Option<(LeaseId, Range<u64>)> {
        let (start, available) = match self.lost.pop_first() {
            Some((start, end)) => {
                self.lost_walks -= end - start;
                (start, end)
            }
            None if self.next < self.total => (self.next, self.total),
            None => return None,
        };
        let end = self.lease_end(start, walks, available);
        if start == self.next {
            self.next = end;
        } else {
            self.set_lost(end..available);
        }
        Some(self.give_out(start..end))
    }

    fn give_out(&mut self, range: Range<u64>) -> (LeaseId, Range<u64>) {
        let id = self.next_lease;
        self.next_lease += 1;
        self.out.insert(id, range.clone());
        self.out_from.entry(range.start).or_default().push(id);
        (id, range)
    }

    /// Leases the walks of a lease that is out once more, under a new number. The first result counts, and the other
    /// leases of these walks are then no longer out. Returns `None` if the lease is not out.
    pub fn lease_again(&mut self, id: LeaseId) -> Option<(LeaseId, Range<u64>)> {
        let range = self.out.get(&id)?.clone();
        self.streams_reissued += (range.end - range.start).div_ceil(self.stream_walks);
        Some(self.give_out(range))
    }

    /// The end of a lease from `start`: on a boundary of streams, no later than the next look, within the available
    /// walks.
    fn lease_end(&self, start: u64, walks: u64, available: u64) -> u64 {
        let streams = start.saturating_add(walks.max(1)).div_ceil(self.stream_walks);
        let end = streams.saturating_mul(self.stream_walks);
        let look = self.looks.iter().copied().find(|&look| look > start).unwrap_or(u64::MAX);
        end.min(look).min(available)
    }

    /// Takes the result of a lease and its deliveries: one entry, or the parts of a relay's lease, which add up to the
    /// parcel.
    ///
    /// # Errors
    /// Where the lease is not out or the parcel does not fit; nothing is changed then, except that an overflow
    /// of the prefix ends the job.
    pub fn accept(&mut self, id: LeaseId, parcel: Parcel, brought: &[Delivery]) -> Result<(), Rejected> {
        let range = self.out.get(&id).ok_or(Rejected::NotLeased(id))?.clone();
        let (expected, got) = (range.end - range.start, parcel.counts().walks);
        if expected != got {
            return Err(Rejected::Walks { expected, got });
        }
        if parcel.sums() != self.prefix.sums().len() {
            return Err(MergeError::Shape(self.prefix.sums().len(), parcel.sums()).into());
        }
        for copy in self.out_from.remove(&range.start).unwrap_or_default() {
            self.out.remove(&copy);
        }
        let mut deliveries = Growing::new(Deliveries::default(), range.start, self.lots);
        brought.iter().for_each(|&part| deliveries.push(part));
        self.waiting_walks += got;
        self.wait(range.start, WaitingRange { end: range.end, sums: RangeSums::Packed(parcel), deliveries })?;
        Ok(())
    }

    /// The walks of a lease that is out.
    pub fn range(&self, id: LeaseId) -> Option<Range<u64>> {
        self.out.get(&id).cloned()
    }

    /// The number of ranges that wait beyond a gap.
    pub fn out_of_order_ranges(&self) -> usize {
        self.waiting.len()
    }

    /// Whether a range would be added to the prefix or to an out-of-order range, so that it makes no new range. A range that
    /// continues the prefix always does, and so is always asked for; while the prefix is being read, the range waits
    /// beside it.
    pub fn adjoins(&self, range: &Range<u64>) -> bool {
        let continues = range.start == self.prefix_walks();
        continues || self.before(range.start).is_some() || self.follows(range.end)
    }

    /// The first walk of the range that ends at a walk, unless there is a look at that walk.
    fn before(&self, walk: u64) -> Option<u64> {
        let (&start, earlier) = self.waiting.range(..walk).next_back()?;
        (earlier.end == walk && !self.looks.contains(&walk)).then_some(start)
    }

    /// Whether an out-of-order range begins at a walk, and there is no look at that walk.
    fn follows(&self, walk: u64) -> bool {
        self.waiting.contains_key(&walk) && !self.looks.contains(&walk)
    }

    /// Puts a range beside the prefix and merges it with its neighbours.
    fn wait(&mut self, mut start: u64, mut range: WaitingRange) -> Result<(), MergeError> {
        let (patches, layout) = (self.prefix.patches(), self.prefix.layout());
        let empty = || Tally::new(patches, layout);
        if let Some(before) = self.before(start) {
            let mut earlier = self.waiting.remove(&before).expect("just found");
            earlier.append(range, empty)?;
            (start, range) = (before, earlier);
        }
        if self.follows(range.end) {
            let later = self.waiting.remove(&range.end).expect("just found");
            range.append(later, empty)?;
        }
        self.waiting.insert(start, range);
        Ok(())
    }

    /// Moves the prefix on, at most to the next look. Returns whether it moved; the caller repeats this until it does
    /// not, and judges the prefix in between. `credit` is called with each delivery that the prefix gains.
    ///
    /// # Errors
    /// Where a sum overflows; the job cannot go on.
    pub fn advance(&mut self, credit: impl FnMut(&Delivery)) -> Result<bool, MergeError> {
        if !self.may_advance() {
            return Ok(false);
        }
        let range = self.waiting.remove(&self.prefix_walks()).expect("it may advance");
        self.waiting_walks -= range.sums.counts().walks;
        range.sums.add_to(Arc::make_mut(&mut self.prefix))?;
        let deliveries = range.deliveries.deliveries();
        deliveries.entries().iter().for_each(credit);
        self.deliveries.append(deliveries);
        Ok(true)
    }

    /// Whether the prefix can move on now.
    pub fn may_advance(&self) -> bool {
        self.waiting.contains_key(&self.prefix_walks()) && !self.is_held()
    }

    /// Whether another owner still reads the prefix, to write a checkpoint, and it is too large to be copied for that.
    /// Results then wait beside it.
    pub fn is_held(&self) -> bool {
        !self.hurried && self.prefix.sums().len() > SMALL_TALLY && Arc::strong_count(&self.prefix) > 1
    }

    /// Lets the prefix move on from now on even while it is being read.
    pub fn hurry(&mut self) {
        self.hurried = true;
    }

    /// Whether the prefix ends at a look.
    pub fn at_look(&self) -> bool {
        self.looks.binary_search(&self.prefix_walks()).is_ok()
    }

    /// The end of the last range that waits beyond a gap.
    pub fn last_waiting(&self) -> Option<u64> {
        self.waiting.values().next_back().map(|waiting| waiting.end)
    }

    /// Whether a lease that is out could still fill a gap before a walk.
    pub fn gap_is_out(&self, before: u64) -> bool {
        self.out_from.keys().next().is_some_and(|&start| start < before)
    }

    /// Whether lost walks wait to be leased again.
    pub fn has_lost(&self) -> bool {
        !self.lost.is_empty()
    }

    /// Whether a lost range is a gap before a walk.
    pub fn gap_is_lost(&self, before: u64) -> bool {
        self.lost.keys().next().is_some_and(|&start| start < before)
    }

    /// Leases walks as [`Ledger::lease`] does, but only walks that were lost before a given one: a stopping job shoots only what saves
    /// other results.
    pub fn lease_gap(&mut self, walks: u64, before: u64) -> Option<(LeaseId, Range<u64>)> {
        if self.gap_is_lost(before) { self.lease(walks) } else { None }
    }

    /// The leases that are out by their first walk, lowest first: several if the same walks are out more than once.
    pub fn out(&self) -> impl Iterator<Item = (u64, &[LeaseId])> {
        self.out_from.iter().map(|(&start, leases)| (start, &leases[..]))
    }

    /// Gives up a lease: its walks are leased again, unless another worker has them already.
    pub fn lose(&mut self, id: LeaseId) {
        let Some(range) = self.out.remove(&id) else { return };
        let copies =
            self.out_from.get_mut(&range.start).expect("what is out is known by its first walk, too");
        copies.retain(|&copy| copy != id);
        if !copies.is_empty() {
            return;
        }
        self.out_from.remove(&range.start);
        self.streams_reissued += (range.end - range.start).div_ceil(self.stream_walks);
        self.set_lost(range);
    }

    /// Marks walks to be leased again, in one range with their neighbours.
    fn set_lost(&mut self, Range { mut start, mut end }: Range<u64>) {
        if start == end {
            return;
        }
        self.lost_walks += end - start;
        if let Some((&before, &its_end)) = self.lost.range(..start).next_back()
            && its_end == start
        {
            self.lost.remove(&before);
            start = before;
        }
        if let Some(its_end) = self.lost.remove(&end) {
            end = its_end;
        }
        self.lost.insert(start, end);
    }

    /// Gives up everything beyond gaps in which given workers may have had a part. Returns the number of its walks.
    pub fn lose_waiting_of(&mut self, is_meant: impl Fn(u32) -> bool) -> u64 {
        let suspect = |waiting: &WaitingRange| waiting.deliveries.deliveries().may_be_of(&is_meant);
        let suspects: Vec<Range<u64>> = self
            .waiting
            .iter()
            .filter(|(_, waiting)| suspect(waiting))
            .map(|(&start, waiting)| start..waiting.end)
            .collect();
        let mut walks = 0;
        for range in suspects {
            self.waiting.remove(&range.start);
            walks += range.end - range.start;
            self.streams_reissued += (range.end - range.start).div_ceil(self.stream_walks);
            self.set_lost(range);
        }
        self.waiting_walks -= walks;
        walks
    }
}

#[cfg(test)]
mod tests;
