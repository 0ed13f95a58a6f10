//! Transfers of large results: offered by workers, asked for when there is room, staged as they arrive.
//!
//! The leader holds the tally of the prefix, the out-of-order ranges beyond gaps, and packed results under way. A result that
//! continues the prefix or an out-of-order range needs no further tally; one that would found an out-of-order range is asked for only when
//! there is room for one. Until then its worker keeps the result and goes on with its next lease. The result that
//! continues the prefix is always asked for, so that the job goes on.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::time::Duration;

use crate::lead::PeerId;
use crate::ledger::Ledger;
use crate::message::LeaseId;

/// The most large results that may be under way at once.
const UNDER_WAY: usize = 16;

/// The longest that a worker may take to send a result, beside one second per [`BYTES_PER_SECOND`] bytes: other results
/// wait for its room.
const PATIENCE: Duration = Duration::from_secs(60);
const BYTES_PER_SECOND: f64 = 1e5;

/// The longest wait for the next piece of a result; a worker that sends none for so long will not send any.
const PIECE_PATIENCE: Duration = Duration::from_secs(20);

/// The room for large results.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TransferRoom {
    /// The most out-of-order ranges that may be held.
    pub ranges: usize,
    /// The most bytes of packed results under way; one result of any size is always allowed.
    pub bytes: usize,
}

/// A result that a worker keeps.
#[derive(Debug)]
pub(crate) struct Offer {
    /// The peer of the worker.
    pub peer: PeerId,
    /// The lease of the result.
    pub lease: LeaseId,
    /// The walks of the lease.
    pub walks: Range<u64>,
    /// The bytes of the lease's packed sums.
    pub bytes: usize,
}

#[derive(Debug)]
struct Transfer {
    offer: Offer,
    staged: Vec<u8>,
    /// The time at which the result was asked for.
    since: Duration,
    /// The time at which the last piece came or, before the first, the result was asked for.
    heard: Duration,
}

/// All results that are offered or under way.
#[derive(Debug, Default)]
pub(crate) struct Transfers {
    /// The offers by first walk: the lowest is asked for first. The same walks may be offered under several leases.
    offers: BTreeMap<(u64, LeaseId), Offer>,
    under_way: HashMap<LeaseId, Transfer>,
}

impl Transfers {
    /// Notes an offer. Returns false if the lease was offered before.
    pub(crate) fn offer(&mut self, offer: Offer) -> bool {
        !self.under_way.contains_key(&offer.lease)
            && self.offers.insert((offer.walks.start, offer.lease), offer).is_none()
    }

    /// Chooses the results to ask for at `now` of the waking clock.
    pub(crate) fn grant(
        &mut self,
        ledger: &Ledger,
        room: TransferRoom,
        now: Duration,
    ) -> Vec<(PeerId, LeaseId)> {
        let mut bytes: usize = self.under_way.values().map(|transfer| transfer.offer.bytes).sum();
        let founding = |offer: &Offer| !ledger.adjoins(&offer.walks);
        let mut out_of_order = ledger.out_of_order_ranges()
            + self.under_way.values().filter(|transfer| founding(&transfer.offer)).count();
        let mut granted = Vec::new();
        for (&place, offer) in &self.offers {
            let under_way = self.under_way.len() + granted.len();
            if under_way == UNDER_WAY || (under_way > 0 && bytes + offer.bytes > room.bytes) {
                break;
            }
            if founding(offer) {
                if out_of_order >= room.ranges {
                    continue;
                }
                out_of_order += 1;
            }
            bytes += offer.bytes;
            granted.push(place);
        }
        granted
            .into_iter()
            .filter_map(|place| self.offers.remove(&place))
            .map(|offer| {
                let asked = (offer.peer, offer.lease);
                let staged = Vec::with_capacity(offer.bytes);
                self.under_way.insert(offer.lease, Transfer { offer, staged, since: now, heard: now });
                asked
            })
            .collect()
    }

    /// Stages a piece. Returns false if it was not asked for or exceeds the offer.
    pub(crate) fn stage(&mut self, peer: PeerId, lease: LeaseId, piece: &[u8], now: Duration) -> bool {
        match self.under_way.get_mut(&lease) {
            Some(Transfer { offer, staged, heard, .. })
                if offer.peer == peer && staged.len() + piece.len() <= offer.bytes =>
            {
                staged.extend_from_slice(piece);
                *heard = now;
                true
            }
            _ => false,
        }
    }

    /// The whole packed sums of a lease, of which `rest` follows the pieces; `None` if they were not asked for or are
    /// not as long as offered.
    pub(crate) fn finish(&mut self, peer: PeerId, lease: LeaseId, rest: &[u8]) -> Option<Vec<u8>> {
        self.under_way.get(&lease).filter(|transfer| transfer.offer.peer == peer)?;
        let Transfer { offer, mut staged, .. } = self.under_way.remove(&lease)?;
        staged.extend_from_slice(rest);
        (staged.len() == offer.bytes).then_some(staged)
    }

    /// Takes out the offers of leases that are no longer out, because other workers have brought their walks.
    pub(crate) fn take_void(&mut self, ledger: &Ledger) -> Vec<(PeerId, LeaseId)> {
        let is_void = |offer: &&Offer| ledger.range(offer.lease).is_none();
        let void: Vec<_> =
            self.offers.values().filter(is_void).map(|offer| (offer.peer, offer.lease)).collect();
        self.offers.retain(|_, offer| !is_void(&&*offer));
        void
    }

    /// The end of the furthest walks that workers keep or send.
    pub(crate) fn end(&self) -> Option<u64> {
        let under_way = self.under_way.values().map(|transfer| &transfer.offer);
        self.offers.values().chain(under_way).map(|offer| offer.walks.end).max()
    }

    /// The number of results that workers keep.
    pub(crate) fn kept(&self) -> usize {
        self.offers.len()
    }

    /// The number of results that each worker keeps, for workers that keep any.
    pub(crate) fn keepers(&self) -> HashMap<PeerId, usize> {
        let mut keepers = HashMap::new();
        self.offers.values().for_each(|offer| *keepers.entry(offer.peer).or_default() += 1);
        keepers
    }

    /// Whether a worker keeps the result of one of several leases of the same walks.
    pub(crate) fn keeps_any(&self, start: u64, leases: &[LeaseId]) -> bool {
        leases.iter().any(|&lease| self.offers.contains_key(&(start, lease)))
    }

    /// Whether any result is being sent.
    pub(crate) fn is_receiving(&self) -> bool {
        !self.under_way.is_empty()
    }

    /// Takes out all offers of the peer whose kept result is furthest from the prefix.
    pub(crate) fn take_furthest(&mut self) -> Vec<(PeerId, LeaseId)> {
        let Some(peer) = self.offers.values().next_back().map(|offer| offer.peer) else { return vec![] };
        self.take_of(peer)
    }

    /// Takes out all offers of a peer.
    pub(crate) fn take_of(&mut self, peer: PeerId) -> Vec<(PeerId, LeaseId)> {
        let taken = self.offers.values().filter(|offer| offer.peer == peer);
        let taken = taken.map(|offer| (offer.peer, offer.lease)).collect();
        self.offers.retain(|_, offer| offer.peer != peer);
        taken
    }

    /// Whether a peer waits for one of its results to be asked for.
    pub(crate) fn keeps_waiting(&self, peer: PeerId) -> bool {
        self.offers.values().any(|offer| offer.peer == peer)
    }

    /// Whether a peer takes too long to send what it was asked for, or has stopped sending.
    pub(crate) fn is_overdue(&self, peer: PeerId, now: Duration) -> bool {
        let of_peer = || self.under_way.values().filter(|transfer| transfer.offer.peer == peer);
        // A worker sends one result after the other.
        let silent = of_peer().map(|transfer| transfer.heard).max();
        let allowed =
            |offer: &Offer| PATIENCE + Duration::from_secs_f64(offer.bytes as f64 / BYTES_PER_SECOND);
        silent.is_some_and(|heard| now.saturating_sub(heard) > PIECE_PATIENCE)
            || of_peer().any(|transfer| now.saturating_sub(transfer.since) > allowed(&transfer.offer))
    }

    /// Drops everything that a peer has offered or begun to send.
    pub(crate) fn forget(&mut self, peer: PeerId) {
        self.offers.retain(|_, offer| offer.peer != peer);
        self.under_way.retain(|_, transfer| transfer.offer.peer != peer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::pack;
    use crate::deliveries::{Deliveries, Delivery};
    use crate::digest::Digester;
    use crate::parcel::Parcel;
    use radiosity::{Counts, Layout, Tally};

    const NOW: Duration = Duration::ZERO;
    const ROOM: TransferRoom = TransferRoom { ranges: 1, bytes: 50 };

    /// A ledger of which ten leases of ten walks are out.
    fn books() -> Ledger {
        let layout = Layout { scores: 1, moments: 1, slopes: 0, events: false };
        let mut books = Ledger::new(100, 10, vec![], Tally::new(1, layout).into(), Deliveries::default());
        (0..10).for_each(|lease| assert_eq!(books.lease(10).unwrap().0, lease));
        books
    }

    fn arrive(books: &mut Ledger, lease: LeaseId) {
        let digester = Digester::new(&[7; 32]);
        let counts = Counts { walks: 10, ..Counts::default() };
        let digest = digester.digest_sums(&counts, [1].into_iter());
        let parcel = Parcel::new(counts, pack(&[1]), digest, &digester).unwrap();
        books.accept(lease, parcel, &[Delivery::lease(10, 0, digest)]).unwrap();
        while books.advance(|_| {}).unwrap() {}
    }

    /// Lets peer n offer the result of lease n.
    fn offer(transfers: &mut Transfers, lease: LeaseId) {
        let walks = 10 * lease..10 * lease + 10;
        assert!(transfers.offer(Offer { peer: lease, lease, walks, bytes: 10 }));
    }

    fn asked(transfers: &mut Transfers, books: &Ledger, room: TransferRoom) -> Vec<LeaseId> {
        transfers.grant(books, room, Duration::ZERO).into_iter().map(|(_, lease)| lease).collect()
    }

    #[test]
    fn only_one_of_those_beyond_a_gap_founds_an_island_and_the_others_adjoin_it() {
        let (mut books, mut transfers) = (books(), Transfers::default());
        [3, 5, 4, 8].iter().for_each(|&lease| offer(&mut transfers, lease));
        assert_eq!(asked(&mut transfers, &books, ROOM), [3], "the lowest");
        assert_eq!(asked(&mut transfers, &books, ROOM), [0; 0]);
        transfers.finish(3, 3, &[0; 10]).unwrap();
        arrive(&mut books, 3);
        assert_eq!(asked(&mut transfers, &books, ROOM), [4]);
        offer(&mut transfers, 2);
        offer(&mut transfers, 0);
        assert_eq!(asked(&mut transfers, &books, ROOM), [0, 2], "the prefix always goes on");
        for lease in [2, 4, 0] {
            transfers.finish(lease, lease, &[0; 10]).unwrap();
            arrive(&mut books, lease);
        }
        assert_eq!((books.out_of_order_ranges(), books.prefix_walks()), (1, 10));
        assert_eq!(asked(&mut transfers, &books, ROOM), [5]);
        transfers.finish(5, 5, &[0; 10]).unwrap();
        arrive(&mut books, 5);
        arrive(&mut books, 1);
        assert_eq!((books.out_of_order_ranges(), books.prefix_walks()), (0, 60));
        assert_eq!(asked(&mut transfers, &books, ROOM), [8]);
    }

    #[test]
    fn bytes_under_way_are_bounded_but_one_result_always_comes() {
        let (books, mut transfers) = (books(), Transfers::default());
        (0..9).for_each(|lease| offer(&mut transfers, lease));
        let wide = TransferRoom { ranges: 9, bytes: 35 };
        assert_eq!(asked(&mut transfers, &books, wide), [0, 1, 2]);
        transfers.finish(1, 1, &[0; 10]).unwrap();
        assert_eq!(asked(&mut transfers, &books, wide), [3]);
        transfers.forget(0);
        transfers.forget(4);
        assert_eq!(asked(&mut transfers, &books, wide), [5]);
        [2, 3, 5].iter().for_each(|&peer| transfers.forget(peer));
        assert_eq!(asked(&mut transfers, &books, TransferRoom { ranges: 9, bytes: 0 }), [6]);
    }

    #[test]
    fn a_worker_that_was_asked_is_given_time() {
        let (books, mut transfers) = (books(), Transfers::default());
        assert!(transfers.offer(Offer { peer: 7, lease: 0, walks: 0..10, bytes: 1_000_000 }));
        assert!(!transfers.is_overdue(7, 100 * PATIENCE), "it was not asked");
        assert_eq!(transfers.grant(&books, ROOM, PATIENCE), [(7, 0)]);
        let second = Duration::from_secs(1);
        assert!(!transfers.is_overdue(7, PATIENCE + PIECE_PATIENCE));
        assert!(transfers.is_overdue(7, PATIENCE + PIECE_PATIENCE + second), "nothing of it comes");
        let allowed = PATIENCE + 10 * second;
        for at in (1..=70).step_by(10) {
            assert!(transfers.stage(7, 0, &[1], PATIENCE + at * second));
        }
        assert!(!transfers.is_overdue(7, PATIENCE + allowed));
        assert!(transfers.is_overdue(7, PATIENCE + allowed + second), "it comes too slowly");
        assert!(!transfers.is_overdue(6, 100 * PATIENCE));
    }

    #[test]
    fn only_what_was_asked_for_is_staged_and_only_as_much() {
        let (books, mut transfers) = (books(), Transfers::default());
        assert!(!transfers.stage(0, 0, &[1], NOW), "not offered");
        offer(&mut transfers, 0);
        assert!(!transfers.offer(Offer { peer: 0, lease: 0, walks: 0..10, bytes: 10 }), "twice");
        assert!(!transfers.stage(0, 0, &[1], NOW), "not asked for");
        assert_eq!(asked(&mut transfers, &books, ROOM), [0]);
        assert!(!transfers.offer(Offer { peer: 0, lease: 0, walks: 0..10, bytes: 10 }), "again");
        assert!(!transfers.stage(1, 0, &[1], NOW), "of another");
        assert!(transfers.stage(0, 0, &[1, 2, 3, 4], NOW));
        assert!(!transfers.stage(0, 0, &[0; 7], NOW), "too much");
        assert!(transfers.stage(0, 0, &[5, 6], NOW));
        assert_eq!(transfers.finish(0, 0, &[7, 8, 9, 10]), Some(vec![1, 2, 3, 4, 5, 6, 7, 8, 9, 10]));
        assert_eq!(transfers.finish(0, 0, &[]), None, "taken");
        offer(&mut transfers, 0);
        asked(&mut transfers, &books, ROOM);
        assert_eq!(transfers.finish(0, 0, &[1]), None, "too little");
    }
}
