//! `radwalk work`: one worker process.

use cluster::access::Access;
use cluster::worker::{self, Identity};
use rustix::time::{ClockId, clock_gettime};

use crate::args::WorkArgs;
use crate::fault::{Fault, Outcome};
use crate::replica::Replica;

/// Works until the coordinator's job is done.
pub fn work(args: &WorkArgs) -> Result<Outcome, Fault> {
    let access = Access::read(&args.access)
        .map_err(|source| Fault::AccessFile { path: args.access.clone(), source })?;
    let identity = Identity {
        build: crate::BUILD.into(),
        name: name(std::process::id()),
        threads: args.threads as usize,
    };
    worker::work(&access, &identity, Replica::decode, cpu_seconds)?;
    Ok(Outcome::Done)
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
