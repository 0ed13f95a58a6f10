//! `radwalk work`: one worker process.

use std::time::{Duration, Instant};

use cluster::access::Access;
use cluster::worker::{self, Identity, WorkerError};
use rustix::time::{ClockId, clock_gettime};

use crate::args::WorkArgs;
use crate::fault::{Fault, Outcome};
use crate::replica::Replica;

/// Between two looks for a coordinator that has gone.
const RETRY: Duration = Duration::from_millis(500);

/// Works until the coordinator's job is done. A coordinator that was lost without a word may come back: it is looked for
/// by the access file, which a restarted one writes anew.
pub fn work(args: &WorkArgs) -> Result<Outcome, Fault> {
    let mut lost: Option<Instant> = None;
    loop {
        let fault = match join(args) {
            Ok(()) => return Ok(Outcome::Done),
            Err(fault) => fault,
        };
        if let Fault::Worker(WorkerError::Lost(_)) = fault {
            // It was found, or found again: patience begins anew.
            lost = Some(Instant::now());
        }
        match lost {
            Some(since) if since.elapsed() < Duration::from_secs(args.wait) => std::thread::sleep(RETRY),
            _ => return Err(fault),
        }
    }
}

/// Works for the coordinator of the access file as long as it is there.
fn join(args: &WorkArgs) -> Result<(), Fault> {
    let access = Access::read(&args.access)
        .map_err(|source| Fault::AccessFile { path: args.access.clone(), source })?;
    let identity = Identity {
        build: crate::BUILD.into(),
        name: name(std::process::id()),
        threads: args.threads as usize,
    };
    Ok(worker::work(&access, &identity, Replica::decode, cpu_seconds)?)
}

/// What the worker process `pid` of this machine is called.
pub fn name(pid: u32) -> String {
    format!("{}:{pid}", rustix::system::uname().nodename().to_string_lossy())
}

/// CPU time of this process so far [s].
fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
