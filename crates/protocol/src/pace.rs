//! How long leases take. Only the pace depends on it, never the answer.

/// How long a lease should take: long enough that messages cost nothing, short enough that a stop is prompt.
const LEASE_SECONDS: f64 = 0.25;

/// A lease may take this part of the time that the job has run: the ledger of a week stays a matter of megabytes.
const LEASE_SHARE: f64 = 1e-4;

/// Added per sum of the tally, so that packing and sending large ones stays a small part of a lease.
pub const LEASE_SECONDS_PER_SUM: f64 = 1e-6;

/// What the coordinator needs to open, check and merge a result, and per sum of it (docs/results/scale.md).
const TAKING_SECONDS: f64 = 1e-4;
const TAKING_SECONDS_PER_SUM: f64 = 4e-8;

/// It takes the results of all threads, and is to be idle for most of the time that a lease takes.
const IDLENESS: f64 = 3.0;

/// A new lease is at most so many times as long as the last: rates are learnt from short leases.
pub const LEASE_GROWTH: f64 = 4.0;

/// A lease is late after so many times the time in which its worker should have been done with it.
pub const LATE: f64 = 2.0;

/// A relay's lease takes so many times as long as all that its workers hold at once: while the last of one lease come in,
/// they are at the next.
pub const RELAY_ROUNDS: f64 = 2.0;

/// How long whoever leads needs for a result of each of so many, whose tallies have so many sums [s].
pub fn taking_seconds(sums: usize, senders: usize) -> f64 {
    (TAKING_SECONDS + TAKING_SECONDS_PER_SUM * sums as f64) * senders as f64
}

/// How long a lease should take where so many threads (or relays) work on tallies of so many sums, `age` seconds after the
/// job began [s].
pub fn lease_seconds(sums: usize, senders: usize, age: f64) -> f64 {
    let sending = LEASE_SECONDS_PER_SUM * sums as f64;
    LEASE_SECONDS + sending + IDLENESS * taking_seconds(sums, senders) + LEASE_SHARE * age
}

/// Results that a thread keeps while it goes on with its next lease: the coordinator gives each two leases, and of two that
/// are kept either may be the one that is asked for.
pub const MOST_KEPT: usize = 2;
