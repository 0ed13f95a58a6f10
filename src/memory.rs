//! Whether a job fits this machine's memory, before any of it is taken.

use std::fs;

use job::Job;

use crate::fault::Fault;

/// What a coordinator holds of each face at least [bytes]: a grey tally of two sums.
const COORDINATOR: u64 = 32;

/// What a worker holds of each face at least [bytes]: its board and, while it hands over, a tally.
const WORKER: u64 = 48;

/// Refuses what cannot fit: the tallies of a coordinator and of workers on this machine.
///
/// # Errors
/// With the memory that it would take.
pub(crate) fn check(job: &Job, workers: usize) -> Result<(), Fault> {
    let patches = job.scene.patch_count();
    // Sources that are told apart, and materials whose influence is measured, have sums of their own.
    let tables = 1 + job.sources.len() + job.sensitivity.len();
    let needed = patches
        .saturating_mul(tables as u64)
        .saturating_mul(COORDINATOR + WORKER.saturating_mul(workers as u64));
    match there() {
        Some(there) if needed > there => Err(Fault::NoRoom { patches, needed, there, workers }),
        _ => Ok(()),
    }
}

/// The memory of this machine, or what its container may take, where the system tells [bytes].
fn there() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kilobytes| 1024 * kilobytes)
    });
    let container = fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let container = container.and_then(|text| text.trim().parse::<u64>().ok());
    machine.into_iter().chain(container).min()
}
