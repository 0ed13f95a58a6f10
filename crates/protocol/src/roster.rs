//! The roster: the workers that contributed to a result.

use std::collections::HashMap;

use bincode::{Decode, Encode};

use crate::deliveries::Delivery;

/// The most names that are kept. Workers that come later are counted together as [`OTHERS`].
const MOST_NAMES: usize = 1 << 16;

/// The name for workers that came after [`MOST_NAMES`] others, or whose leases were folded before they were counted.
const OTHERS: &str = "others";

/// The most bytes that names behind relays take in all; each name counts as at least [`LEAST_BYTES_BEHIND`].
const MOST_BYTES_BEHIND: usize = 4 << 20;
const LEAST_BYTES_BEHIND: usize = 128;

/// A worker, and what it brought to the result.
#[derive(Clone, Debug, Default, PartialEq, Eq, Encode, Decode)]
pub struct Contributor {
    /// The name that the worker gave.
    pub name: String,
    /// The worker's walks in the result.
    pub walks: u64,
    /// The worker's leases in the result.
    pub leases: u64,
    /// The worker's results that were impossible; its other walks are in doubt, too.
    pub faults: u64,
}

impl Contributor {
    /// The separator between a relay's name and that of a worker behind it.
    pub const BEHIND: &str = " > ";

    /// The name of the peer that answers for the worker: its own, or that of its relay.
    pub fn peer(&self) -> &str {
        self.name.split(Contributor::BEHIND).next().expect("a string has a first part")
    }
}

fn bytes_behind(name: &str) -> usize {
    name.len().max(LEAST_BYTES_BEHIND)
}

/// All workers that brought something, by number and by name.
#[derive(Debug)]
pub struct Roster {
    workers: Vec<Contributor>,
    numbers: HashMap<String, u32>,
    /// The bytes of names behind relays, counted against [`MOST_BYTES_BEHIND`].
    bytes_behind: usize,
}

impl Roster {
    /// A roster that goes on from the workers of earlier sessions.
    pub fn new(workers: Vec<Contributor>) -> Self {
        let numbers = workers.iter().zip(0..).map(|(worker, number)| (worker.name.clone(), number)).collect();
        let behind = workers.iter().filter(|worker| worker.peer() != worker.name);
        let bytes_behind = behind.map(|worker| bytes_behind(&worker.name)).sum();
        Roster { workers, numbers, bytes_behind }
    }

    /// All workers; deliveries name a worker by its place in this list.
    pub fn workers(&self) -> &[Contributor] {
        &self.workers
    }

    /// All workers, taken out of the roster.
    pub fn into_workers(self) -> Vec<Contributor> {
        self.workers
    }

    /// The number of a worker; a new worker is entered.
    pub fn number(&mut self, name: &str) -> u32 {
        let name =
            if self.workers.len() < MOST_NAMES || self.numbers.contains_key(name) { name } else { OTHERS };
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = u32::try_from(self.workers.len()).expect("names are few");
        self.numbers.insert(name.into(), number);
        self.workers.push(Contributor { name: name.into(), ..Contributor::default() });
        number
    }

    /// The number of a worker behind a relay. Once names behind relays fill their room, it is the relay's number, so
    /// that no relay leaves others without names.
    pub fn number_behind(&mut self, relay: &str, name: &str) -> u32 {
        let whole = [relay, name].join(Contributor::BEHIND);
        let bytes = bytes_behind(&whole);
        if self.numbers.contains_key(&whole) {
            self.number(&whole)
        } else if self.bytes_behind + bytes <= MOST_BYTES_BEHIND {
            self.bytes_behind += bytes;
            self.number(&whole)
        } else {
            self.number(relay)
        }
    }

    /// The walks in the result that came over a peer's connection: its own and those of workers behind it.
    pub fn walks_over(&self, peer: &str) -> u64 {
        let of_peer = self.workers.iter().filter(|worker| worker.peer() == peer);
        of_peer.fold(0, |walks, worker| walks.saturating_add(worker.walks))
    }

    /// Credits a worker with a delivery that became a part of the result.
    pub fn credit(&mut self, delivery: &Delivery) {
        let number = match delivery.worker {
            Delivery::SEVERAL => self.number(OTHERS),
            number => number,
        };
        let worker = &mut self.workers[number as usize];
        worker.walks = worker.walks.saturating_add(delivery.walks);
        worker.leases = worker.leases.saturating_add(delivery.leases);
    }

    /// Counts an impossible result against a worker.
    pub fn blame(&mut self, number: u32) {
        self.workers[number as usize].faults += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_bounded_and_every_worker_is_counted() {
        let mut roster = Roster::new(vec![]);
        for n in 0..MOST_NAMES + 1000 {
            let number = roster.number(&format!("worker {n}"));
            roster.credit(&Delivery::lease(10, number, 0));
        }
        assert_eq!(roster.workers().len(), MOST_NAMES + 1);
        assert_eq!(
            roster.workers().iter().map(|worker| worker.walks).sum::<u64>(),
            10 * (MOST_NAMES as u64 + 1000)
        );
        assert_eq!(roster.number("worker 7"), 7);
        let again = Roster::new(roster.into_workers()).number("worker 7");
        assert_eq!(again, 7, "it is known after a resume");
    }

    #[test]
    fn names_behind_a_relay_leave_room_for_others() {
        let mut roster = Roster::new(vec![]);
        let relay = roster.number("relay");
        let known = roster.number_behind("relay", "0");
        assert_eq!(roster.workers()[known as usize].peer(), "relay");
        let long = "x".repeat(600);
        let named =
            |roster: &mut Roster, n: usize| roster.number_behind("relay", &format!("{n} {long}")) != relay;
        let long = (0..).take_while(|&n| named(&mut roster, n)).count();
        assert!((6000..7000).contains(&long), "{long}");
        let mut roster = Roster::new(roster.into_workers());
        assert!(!named(&mut roster, long + 1), "all is known after a resume");
        assert_eq!(roster.number_behind("relay", "0"), known);
        assert_ne!(roster.number("direct"), roster.number("others"));
        let mut roster = Roster::new(vec![]);
        (0..MOST_NAMES).for_each(|n| _ = roster.number_behind("relay", &n.to_string()));
        assert!(roster.workers().len() <= MOST_NAMES / 2 + 1);
        roster.credit(&Delivery::lease(7, 0, 0));
        roster.credit(&Delivery::lease(8, 1, 0));
        assert_eq!(roster.walks_over("relay"), 15);
    }
}
