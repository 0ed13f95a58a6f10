//! The length of leases in time, and of the chunks that they are walked in. Only the pace of a job depends on it, never the answer.

use std::time::Duration;

/// The least time of a lease [s]: long enough that messages cost little, short enough that a stop is prompt.
const LEASE_SECONDS: f64 = 0.25;

/// The part of the job's time so far that a lease may take: so the ledger of a week stays a few megabytes.
const LEASE_SHARE: f64 = 1e-4;

/// The time added per sum of the tally [s], so that packing and sending a large tally is a small part of a lease.
pub const LEASE_SECONDS_PER_SUM: f64 = 1e-6;

/// The time that the coordinator takes to open, check and merge a result, and per sum of it [s]
/// (docs/results/scale.md).
const TAKING_SECONDS: f64 = 1e-4;
const TAKING_SECONDS_PER_SUM: f64 = 4e-8;

/// A lease lasts at least this many times the time that the leader takes for one result of every thread, so that the
/// leader is idle for most of it.
const IDLENESS: f64 = 3.0;

/// A worker's next lease is at most this many times as long as its longest so far: rates are learnt from short leases.
pub const LEASE_GROWTH: f64 = 4.0;

/// A lease is late after this many times the time that its worker should have needed.
pub const LATE: f64 = 2.0;

/// The length of a relay's lease, in units of all leases that its workers hold at once: while the last workers finish
/// one lease, the others walk the next.
pub const RELAY_ROUNDS: f64 = 2.0;

/// The time that a leader needs to take one result from each of `senders`, whose tallies have `sums` sums [s].
pub fn taking_seconds(sums: usize, senders: usize) -> f64 {
    (TAKING_SECONDS + TAKING_SECONDS_PER_SUM * sums as f64) * senders as f64
}

/// The time that a lease should take [s], with `senders` threads (or relays), tallies of `sums` sums, and a job that is
/// `age` seconds old.
pub fn lease_seconds(sums: usize, senders: usize, age: f64) -> f64 {
    let sending = LEASE_SECONDS_PER_SUM * sums as f64;
    LEASE_SECONDS + sending + IDLENESS * taking_seconds(sums, senders) + LEASE_SHARE * age
}

/// The most results that a thread keeps while it goes on with its next lease. The coordinator gives each thread two
/// leases, and may ask for either of two kept results.
pub const MOST_KEPT: usize = 2;

/// The first number of walks between two marks of progress.
pub const FIRST_CHUNK: u64 = 512;

/// The most walks between two marks of progress. The last walks of a chunk leave places of a batch idle; in chunks this
/// long the loss is small.
const LARGEST_CHUNK: u64 = 1 << 16;

/// The time under which chunks grow; chunks that take ten times as long shrink.
const CHUNK_TIME: Duration = Duration::from_millis(5);

/// The most walks between two emptyings of a board: its 64-bit sums must not wrap.
pub const BOARD_WALKS: u64 = 1 << 22;

/// The number of walks in the next chunk, after `walks` walks took `time`.
pub fn next_chunk(walks: u64, time: Duration) -> u64 {
    match time {
        time if time < CHUNK_TIME => (2 * walks).min(LARGEST_CHUNK),
        time if time > 10 * CHUNK_TIME => (walks / 2).max(1),
        _ => walks,
    }
}
