//! How many processes of this machine walk.

use radiosity::Memory;

/// A replica that takes more memory is shared by threads, unless the number of worker processes was asked for [bytes]. Each process builds and
/// holds a replica of its own: 64 MB take some 0.3 s, about as long as a process takes to start and join.
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
    /// The team for a scene that takes so much memory: one process with all threads where nobody asked for more and replicas are large.
    pub(crate) fn for_replica(self, replica: Memory) -> Team {
        let all = u32::try_from(self.workers).ok().and_then(|workers| workers.checked_mul(self.threads));
        match all {
            Some(threads) if !self.is_fixed && replica.surfaces + replica.index > SHARED_REPLICA => {
                Team { workers: 1, threads, ..self }
            }
            _ => self,
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
            let Team { workers, threads, .. } = team(is_fixed).for_replica(replica);
            (workers, threads)
        };
        assert_eq!(sized(false, small), (8, 2));
        assert_eq!(sized(false, large), (1, 16));
        assert_eq!(sized(true, large), (8, 2));
    }
}
