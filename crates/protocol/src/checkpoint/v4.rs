//! Books of format 4: an entry for every lease, the names of workers alone, and no out-of-order ranges.

use std::sync::Arc;

use bincode::Decode;

use super::{Book, Look, Session, WalkRange};
use crate::codec::decode_book;
use crate::deliveries::{Deliveries, Delivery, Growing};
use crate::digest::Digest;
use crate::effort::Effort;
use crate::roster::Roster;

/// The number of this format.
pub(super) const VERSION: u32 = 4;

#[derive(Decode)]
struct OldBook {
    parts: Vec<OldPart>,
    workers: Vec<String>,
    looks: Vec<Look>,
    goal: [u8; 32],
    effort: Effort,
    sessions: Vec<Session>,
    job: Arc<[u8]>,
}

#[derive(Decode)]
struct OldPart {
    job_hash: [u8; 32],
    seed: u64,
    first: u64,
    deliveries: Vec<OldDelivery>,
}

#[derive(Decode)]
struct OldDelivery {
    walks: u64,
    worker: u32,
    digest: Digest,
}

/// Reads a book of format 4 into today's form.
pub(super) fn book(bytes: &[u8]) -> Option<Book> {
    let OldBook { parts, workers, looks, goal, effort, sessions, job } = decode_book(bytes).ok()?;
    let mut roster = Roster::new(vec![]);
    let numbers: Vec<u32> = workers.iter().map(|name| roster.number(name)).collect();
    let part = |OldPart { job_hash, seed, first, deliveries }| {
        let mut growing = Growing::new(Deliveries::default(), 0, 0);
        for OldDelivery { walks, worker, digest } in deliveries {
            let number = *numbers.get(worker as usize)?;
            let lease = Delivery::lease(walks, number, digest);
            roster.credit(&lease);
            growing.push(lease);
        }
        Some(WalkRange { job_hash, seed, first, deliveries: growing.into_deliveries() })
    };
    let parts = parts.into_iter().map(part).collect::<Option<_>>()?;
    let (out_of_order, workers) = (vec![], roster.into_workers());
    Some(Book { parts, out_of_order, workers, looks, goal, effort, sessions, job })
}
