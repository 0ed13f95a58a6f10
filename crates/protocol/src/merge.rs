//! Merging of several results: parts of a job that ran elsewhere or later, and the same walks under other seeds.

use std::sync::Arc;

use thiserror::Error;

use crate::checkpoint::{Checkpoint, WalkRange};
use crate::deliveries::Growing;
use crate::effort::Effort;

/// The reason why two results cannot be merged.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum MergeFault {
    /// The results are of different scenes.
    #[error("it is of another scene (its patches are other patches); merge runs of one scene")]
    Scene,
    /// The results were walked by different methods.
    #[error(
        "its walks were scored differently (another walk, estimator, space, mix or length of chains); merge runs of one method"
    )]
    Method,
    /// Some walks are in both results.
    #[error(
        "walks {from} to {to} of seed {seed} are in two of the runs (they would count twice); leave one out"
    )]
    Overlap {
        /// The seed of these walks.
        seed: u64,
        /// The first walk in both.
        from: u64,
        /// The last walk in both.
        to: u64,
    },
    /// A sum of both exceeds 128 bits.
    #[error("the merged sums are too large (more than 2^128 units); merge fewer walks")]
    Overflow,
}

impl Checkpoint {
    /// Adds the walks of another result; the caller must know that both are of one method. Looks are dropped, since
    /// none was taken of these walks together, and so are out-of-order ranges.
    ///
    /// # Errors
    /// Where they do not go together; nothing is changed then, but for an overflow.
    pub fn merge(&mut self, other: Checkpoint) -> Result<(), MergeFault> {
        if self.scene_hash != other.scene_hash {
            return Err(MergeFault::Scene);
        }
        let shape = |of: &Checkpoint| (of.tally.layout(), of.tally.patches());
        if shape(self) != shape(&other) {
            return Err(MergeFault::Method);
        }
        let mut book = other.book;
        let offset = self.book.workers.len() as u32;
        book.parts.iter_mut().for_each(|part| part.deliveries.rename(|worker| worker + offset));
        self.book.parts = united(self.book.parts.iter().cloned().chain(book.parts).collect())?;
        self.book.workers.append(&mut book.workers);
        self.book.sessions.append(&mut book.sessions);
        self.book.looks.clear();
        self.book.out_of_order.clear();
        self.book.effort = sum(&self.book.effort, &book.effort);
        Arc::make_mut(&mut self.tally).merge(&other.tally).map_err(|_| MergeFault::Overflow)
    }
}

/// Joins walks in the fewest parts, sorted by seed, job and first walk.
fn united(mut parts: Vec<WalkRange>) -> Result<Vec<WalkRange>, MergeFault> {
    parts.sort_by_key(|part| (part.seed, part.job_hash, part.first));
    let mut united: Vec<WalkRange> = Vec::with_capacity(parts.len());
    // A run that was stopped before its first walk has a part of none.
    for part in parts.into_iter().filter(|part| part.walks() > 0) {
        match united.last_mut().filter(|last| last.job_hash == part.job_hash) {
            Some(last) if part.first < last.end() => {
                let to = last.end().min(part.end()) - 1;
                return Err(MergeFault::Overlap { seed: part.seed, from: part.first, to });
            }
            Some(last) if part.first == last.end() => {
                let before = std::mem::take(&mut last.deliveries);
                let mut growing = Growing::new(before, part.first, 0);
                growing.append(&part.deliveries);
                last.deliveries = growing.into_deliveries();
            }
            _ => united.push(part),
        }
    }
    Ok(united)
}

fn sum(a: &Effort, b: &Effort) -> Effort {
    Effort {
        seconds: a.seconds + b.seconds,
        cpu_seconds: a.cpu_seconds + b.cpu_seconds,
        workers_seen: a.workers_seen + b.workers_seen,
        workers_lost: a.workers_lost + b.workers_lost,
        streams_reissued: a.streams_reissued + b.streams_reissued,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deliveries::{Deliveries, Delivery};

    fn part(seed: u8, first: u64, walks: u64) -> WalkRange {
        let deliveries = Delivery::lease(walks, 0, first).into();
        WalkRange { job_hash: [seed; 32], seed: seed.into(), first, deliveries }
    }

    #[test]
    fn neighbours_become_one_part_and_others_stay_apart() {
        let parts = united(vec![part(2, 0, 5), part(1, 10, 10), part(1, 0, 10), part(1, 30, 1)]).unwrap();
        let ranges: Vec<_> = parts.iter().map(|part| (part.seed, part.first, part.walks())).collect();
        assert_eq!(ranges, [(1, 0, 20), (1, 30, 1), (2, 0, 5)]);
        let digests: Vec<_> = parts[0].deliveries.entries().iter().map(|delivery| delivery.digest).collect();
        assert_eq!(digests, [0, 10]);
    }

    #[test]
    fn walks_that_are_in_two_parts_are_named() {
        let overlap = united(vec![part(1, 0, 10), part(1, 7, 10)]).unwrap_err();
        assert_eq!(overlap, MergeFault::Overlap { seed: 1, from: 7, to: 9 });
        let within = united(vec![part(1, 0, 10), part(1, 2, 3)]).unwrap_err();
        assert_eq!(within, MergeFault::Overlap { seed: 1, from: 2, to: 4 });
        assert!(united(vec![part(1, 0, 10), part(2, 0, 10)]).is_ok(), "other seeds are other walks");
        let none = || WalkRange { deliveries: Deliveries::default(), ..part(1, 0, 1) };
        for parts in [[part(1, 0, 10), none()], [none(), part(1, 0, 10)]] {
            assert_eq!(united(parts.into()), Ok(vec![part(1, 0, 10)]), "no walks are in no other part");
        }
    }
}
