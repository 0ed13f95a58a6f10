//! Who contributed to a result.

use std::collections::HashMap;

use bincode::{Decode, Encode};

use crate::deliveries::{Delivery, SEVERAL};

/// The most names that are kept. Workers that come later are counted together.
const MOST_NAMES: usize = 1 << 16;

/// What workers are called that came after [`MOST_NAMES`] others, or whose leases were folded before they were counted.
const OTHERS: &str = "others";

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

/// The workers that brought something, by number and by name.
#[derive(Debug)]
pub struct Roster {
    workers: Vec<Contributor>,
    numbers: HashMap<String, u32>,
}

impl Roster {
    /// Goes on from the workers of earlier sessions.
    pub fn new(workers: Vec<Contributor>) -> Self {
        let numbers = workers.iter().zip(0..).map(|(worker, number)| (worker.name.clone(), number)).collect();
        Roster { workers, numbers }
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
}
