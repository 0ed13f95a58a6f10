//! How many processes of this machine walk.

use radiosity::instruments::Memory;

/// The most memory of a replica that each worker process builds for itself [bytes]. All threads share a larger one with this process. 64 MB are
/// some 40,000 two-sided triangles.
const SHARED_REPLICA: usize = 64_000_000;

/// Worker processes of this machine.
#[derive(Clone, Copy)]
pub(crate) struct Team {
    /// The number of worker processes.
    pub workers: usize,
    /// The threads of each worker process.
    pub threads: u32,
    /// Whether the number of processes was asked for.
    pub is_fixed: bool,
}

impl Team {
    /// The team for replicas of a size, and whether it shares one with this process: one worker with all threads does so where the replica
    /// is large, unless the number of processes was asked for.
    pub(crate) fn for_replica(self, replica: Memory) -> (Team, bool) {
        let all = u32::try_from(self.workers).ok().and_then(|workers| workers.checked_mul(self.threads));
        match all {
            Some(threads) if !self.is_fixed && replica.surfaces + replica.index > SHARED_REPLICA => {
                (Team { workers: 1, threads, ..self }, true)
            }
            _ => (self, false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_replica_is_shared_unless_processes_were_asked_for() {
        let [small, large] =
            [1, 2].map(|part| Memory { surfaces: SHARED_REPLICA / 2, index: part * SHARED_REPLICA / 2 });
        let team = |is_fixed| Team { workers: 8, threads: 2, is_fixed };
        let sized = |is_fixed, replica| {
            let (Team { workers, threads, .. }, is_shared) = team(is_fixed).for_replica(replica);
            (workers, threads, is_shared)
        };
        assert_eq!(sized(false, small), (8, 2, false));
        assert_eq!(sized(false, large), (1, 16, true));
        assert_eq!(sized(true, large), (8, 2, false));
    }
}
