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

/// Chunks of this many walks keep the 128 places of a batch filled for most of the time. Chunks up to it grow and shrink by
/// [`FILLING_TIME`]: where a walk takes 10,000 rays, [`CHUNK_TIME`] is the time of one walk, which has a batch to itself.
const FILLING_CHUNK: u64 = 1 << 12;
const FILLING_TIME: Duration = Duration::from_millis(500);

/// The most walks between two emptyings of a board: its 64-bit sums must not wrap.
pub const BOARD_WALKS: u64 = 1 << 22;

/// The number of walks in the next chunk, after `walks` walks took `time`.
pub fn next_chunk(walks: u64, time: Duration) -> u64 {
    let time_to = |walks| if walks > FILLING_CHUNK { CHUNK_TIME } else { FILLING_TIME };
    match time {
        time if time < time_to(2 * walks) => (2 * walks).min(LARGEST_CHUNK),
        time if time > 10 * time_to(walks) => (walks / 2).max(1),
        _ => walks,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The chunk that a thread settles on, whose batch of 128 places takes 3 µs for a ray of each of its walks. A walk ends with a probability of `ends` at each ray: the
    /// last of n walks that are left takes H(n)/`ends` rays.
    fn settled(ends: f64) -> (u64, Duration) {
        let mut chunk = FIRST_CHUNK;
        for _ in 0..20 {
            chunk = next_chunk(chunk, time(chunk, ends));
        }
        (chunk, time(chunk, ends))
    }

    fn time(walks: u64, ends: f64) -> Duration {
        let full = walks.saturating_sub(128) as f64 / 128.0;
        let last: f64 = (1..=walks.min(128)).map(|n| 1.0 / n as f64).sum();
        Duration::from_secs_f64(3e-6 * (full + last) / ends)
    }

    #[test]
    fn long_walks_share_batches_and_short_ones_mark_progress_often() {
        for (ends, least) in
            [(0.5, LARGEST_CHUNK), (0.01, FILLING_CHUNK), (1e-4, FILLING_CHUNK / 2), (1e-5, FIRST_CHUNK)]
        {
            let (chunk, time) = settled(ends);
            let longest = if chunk > FILLING_CHUNK { 10 * CHUNK_TIME } else { 10 * FILLING_TIME };
            assert!(chunk >= least && time <= longest, "{ends}: {chunk} walks in {time:?}");
        }
        // Where one walk takes minutes, each is a chunk.
        assert_eq!(next_chunk(2, Duration::from_secs(100)), 1);
    }
}
