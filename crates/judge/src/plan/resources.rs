//! Time, memory and traffic of a run, from what its pilot took on this machine.

use protocol::codec::pack;
use protocol::pace::{lease_seconds, taking_seconds};
use radiosity::{Experiment, Tally};
use serde::Serialize;

use super::pilot::PlanPilot;

/// The time that a run takes beside tracing: processes, handshakes, tables, picture [s].
const OVERHEAD: f64 = 0.2;

/// The bytes of a result beside its sums, about: counts, times, digest, frame and seal.
const MESSAGE: usize = 150;

/// The time and traffic of a run with a number of workers of one thread each.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResourceDemand {
    /// The number of workers.
    pub workers: u64,
    /// The wall-clock time [s].
    pub seconds: f64,
    /// The number of leases.
    pub leases: f64,
    /// The bytes from workers to coordinator in all.
    pub traffic_bytes: f64,
    /// The bytes from workers to coordinator per second.
    pub bytes_per_second: f64,
}

/// The cost of every worker and every lease.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// The processor time of a walk [s].
    walk_seconds: f64,
    /// The bytes of a lease's result.
    lease_bytes: f64,
    /// The number of sums in a tally.
    sums: usize,
    /// Whether a lease is a chain, however long it takes.
    chains: bool,
    /// The peak memory of a worker of one thread in bytes; `None` if the system does not tell.
    pub memory_bytes: Option<f64>,
}

impl Costs {
    /// The costs as the pilot of an experiment showed them. A worker holds what the process of the pilot does: scene,
    /// board, tally; `memory_bytes` at its peak.
    pub fn new(experiment: &Experiment, pilot: &PlanPilot, memory_bytes: Option<f64>) -> Self {
        let (walk_seconds, sums) =
            (pilot.seconds / pilot.tally.counts.walks as f64, pilot.tally.sums().len());
        let chains = !experiment.unit().is_walk();
        let lease_walks = if chains { 1.0 } else { lease_seconds(sums, 1, 0.0) / walk_seconds };
        let lease_bytes = (MESSAGE + bytes_of(&pilot.tally, lease_walks)) as f64;
        Costs { walk_seconds, lease_bytes, sums, chains, memory_bytes }
    }

    /// The demand of `walks` walks, leased by at least `stream` walks, with a number of workers.
    pub fn demand(&self, walks: f64, stream: f64, workers: u64) -> ResourceDemand {
        let streams = (walks / stream).max(1.0).ceil();
        let work = walks * self.walk_seconds;
        // Workers beyond the number of streams have nothing to do.
        let busy = (workers as f64).min(streams);
        let tracing = work / busy;
        // Leases grow with the threads, so that the coordinator keeps up.
        let lease = lease_seconds(self.sums, busy as usize, tracing);
        let by_time = if self.chains { streams } else { work / lease };
        // Each thread gets at least two leases, as far as there are streams.
        let leases = by_time.max(2.0 * workers as f64).min(streams);
        let seconds = OVERHEAD + tracing + taking_seconds(self.sums, busy as usize);
        let traffic_bytes = leases * self.lease_bytes;
        ResourceDemand { workers, seconds, leases, traffic_bytes, bytes_per_second: traffic_bytes / seconds }
    }
}

/// The bytes of the sums that a lease of `walks` walks sends, in proportion to the pilot's.
fn bytes_of(tally: &Tally, walks: f64) -> usize {
    let part = walks / tally.counts.walks as f64;
    let sums: Vec<u128> = tally.sums().iter().map(|&sum| (sum as f64 * part) as u128).collect();
    pack(&sums).len()
}
