//! The memory of this machine: whether a job fits it, before any of it is taken, and what processes have held.

use std::fs;

use job::Job;

use crate::error::Error;

/// What a coordinator holds of each face at least [bytes]: a grey tally of two sums.
const COORDINATOR: u64 = 32;

/// What a worker holds of each face at least [bytes]: its board and, while it hands over, a tally.
const WORKER: u64 = 48;

/// Refuses a job that cannot fit: the tallies of its coordinator and of a number of workers on this machine.
///
/// # Errors
/// [`Error::NoRoom`], with the memory that it would take.
pub fn check_memory(job: &Job, workers: usize) -> Result<(), Error> {
    let patches = job.scene.patch_count();
    // Sources that are distinguished, and materials whose influence is measured, have sums of their own.
    let tables = 1 + job.sources.len() + job.sensitivity.len();
    let needed = patches
        .saturating_mul(tables as u64)
        .saturating_mul(COORDINATOR + WORKER.saturating_mul(workers as u64));
    match there() {
        Some(there) if needed > there => Err(Error::NoRoom { patches, needed, there, workers }),
        _ => Ok(()),
    }
}

/// The memory of this machine, or what its container may take, where the system tells [bytes].
fn there() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo").ok();
    let machine = machine.and_then(|text| kilobytes(&text, "MemTotal:")).map(|kilobytes| 1024 * kilobytes);
    let container = fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let container = container.and_then(|text| text.trim().parse::<u64>().ok());
    machine.into_iter().chain(container).min()
}

/// The most memory that this process has held [bytes], on Linux.
pub fn peak_memory() -> Option<f64> {
    peak_memory_of("self").map(|bytes| bytes as f64)
}

/// The most memory that a process has held [bytes], as Linux tells it; `process` is its number, or `self`.
pub fn peak_memory_of(process: &str) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    kilobytes(&status, "VmHWM:").map(|kilobytes| 1024 * kilobytes)
}

/// The number behind a word, in the form of files of `/proc`.
fn kilobytes(text: &str, word: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(word))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok()
}
