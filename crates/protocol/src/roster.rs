//! Who contributed to a result.

use std::collections::HashMap;

use bincode::{Decode, Encode};

use crate::deliveries::{Delivery, SEVERAL};

/// The most names that are kept. Workers that come later are counted together.
const MOST_NAMES: usize = 1 << 16;

/// What workers are called that came after [`MOST_NAMES`] others, or whose leases were folded before they were counted.
const OTHERS: &str = "others";

/// What names behind relays may take in all, where each counts as at least the next [bytes].
const MOST_BYTES_BEHIND: usize = 4 << 20;
const LEAST_BYTES_BEHIND: usize = 128;

/// Between a relay's name and that of a worker behind it.
pub const BEHIND: &str = " > ";

/// A worker, and what it brought.
#[derive(Clone, Debug, Default, PartialEq, Eq, Encode, Decode)]
pub struct Contributor {
    /// As it called itself.
    pub name: String,
    /// Its walks in the result.
    pub walks: u64,
    /// Its leases.
    pub leases: u64,
    /// Results of it that cannot be: its other walks are in doubt, too.
    pub faults: u64,
}

impl Contributor {
    /// The name of the peer that answers for it: its own, or that of the relay that it is behind.
    pub fn peer(&self) -> &str {
        self.name.split(BEHIND).next().expect("a string has a first part")
    }
}

fn bytes_behind(name: &str) -> usize {
    name.len().max(LEAST_BYTES_BEHIND)
}

/// The workers that brought something, by number and by name.
#[derive(Debug)]
pub struct Roster {
    workers: Vec<Contributor>,
    numbers: HashMap<String, u32>,
    /// What names behind relays take of [`MOST_BYTES_BEHIND`].
    bytes_behind: usize,
}

impl Roster {
    /// Goes on from the workers of earlier sessions.
    pub fn new(workers: Vec<Contributor>) -> Self {
        let numbers = workers.iter().zip(0..).map(|(worker, number)| (worker.name.clone(), number)).collect();
        let behind = workers.iter().filter(|worker| worker.peer() != worker.name);
        let bytes_behind = behind.map(|worker| bytes_behind(&worker.name)).sum();
        Roster { workers, numbers, bytes_behind }
    }

    /// All workers; deliveries name them by their place here.
    pub fn workers(&self) -> &[Contributor] {
        &self.workers
    }

    /// All workers.
    pub fn into_workers(self) -> Vec<Contributor> {
        self.workers
    }

    /// The place of a worker, which it gets where it has none.
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

    /// The place of a worker that a relay names. Where names behind relays take all the room that they may, it is the relay's,
    /// so that no relay leaves others without names.
    pub fn number_behind(&mut self, relay: &str, name: &str) -> u32 {
        let whole = format!("{relay}{BEHIND}{name}");
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

    /// Walks in the result that came over a peer's connection: its own and those of workers behind it.
    pub fn walks_over(&self, peer: &str) -> u64 {
        let of_peer = self.workers.iter().filter(|worker| worker.peer() == peer);
        of_peer.fold(0, |walks, worker| walks.saturating_add(worker.walks))
    }

    /// What was delivered became a part of the result.
    pub fn credit(&mut self, delivery: &Delivery) {
        let number = match delivery.worker {
            SEVERAL => self.number(OTHERS),
            number => number,
        };
        let worker = &mut self.workers[number as usize];
        worker.walks = worker.walks.saturating_add(delivery.walks);
        worker.leases = worker.leases.saturating_add(delivery.leases);
    }

    /// A worker brought a result that cannot be.
    pub fn blame(&mut self, number: u32) {
        self.workers[number as usize].faults += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_bounded_and_everybody_is_counted() {
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
