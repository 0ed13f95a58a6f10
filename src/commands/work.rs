//! `radwalk work`: one worker process.

use std::io::ErrorKind;
use std::path::Path;
use std::time::{Duration, Instant};

use cluster::{Access, WorkerError, WorkerIntroduction, launcher};
use tracing::warn;

use crate::args::WorkArgs;
use crate::build::BUILD;
use crate::clock::WalkClock;
use crate::fault::{Fault, Outcome};
use crate::shift::Shift;
use crate::signals;

/// Between two looks for a coordinator that has gone.
const RETRY: Duration = Duration::from_millis(500);

/// How long a coordinator is looked for before that is said: one that goes from a pilot to its run is soon there again.
const SILENCE: Duration = Duration::from_secs(5);

/// How long a coordinator is looked for, unless `--wait` says otherwise.
const PATIENCE: Duration = Duration::from_secs(600);

/// Works until the coordinator's job is done. If the connection breaks without notice, the worker looks for a
/// coordinator by the access file, which a restarted coordinator writes anew. Launchers start workers and coordinator
/// at once, so workers under a launcher, and those with `--wait`, also look for a coordinator that has not started yet.
/// Other workers report a missing coordinator at once.
pub(crate) fn work(args: &WorkArgs) -> Result<Outcome, Fault> {
    signals::catch();
    signals::keep_memory_private();
    keep_joining(args.wait, args.quiet, || join(args))
}

/// Joins a coordinator, again where it was lost without a word.
pub(crate) fn keep_joining(
    wait: Option<u64>,
    quiet: bool,
    mut join: impl FnMut() -> Result<(), Fault>,
) -> Result<Outcome, Fault> {
    let patience = wait.map_or(PATIENCE, Duration::from_secs);
    let mut since = (wait.is_some() || launcher::is_there(variable)).then(Instant::now);
    let (mut joined, mut announced) = (false, quiet);
    loop {
        let fault = match join() {
            Ok(()) => return Ok(Outcome::Done),
            Err(_) if signals::stop_asked() => return Ok(Outcome::Interrupted),
            Err(fault) => fault,
        };
        match &fault {
            Fault::Worker(WorkerError::Lost(_)) => {
                // It was found, or found again: patience begins anew.
                (joined, since) = (true, Some(Instant::now()));
            }
            // Coordinators remove it when they end in good order.
            Fault::AccessFile { source, .. } if joined && source.kind() == ErrorKind::NotFound => {
                return Ok(Outcome::Done);
            }
            _ if joined || may_come(&fault) => {}
            _ => return Err(fault),
        }
        let waited = match since {
            Some(since) if since.elapsed() < patience => since.elapsed(),
            _ => return Err(fault),
        };
        if waited >= SILENCE && !std::mem::replace(&mut announced, true) {
            warn!("{fault}; waiting for it");
        }
        std::thread::sleep(RETRY);
        if signals::stop_asked() {
            return Ok(Outcome::Interrupted);
        }
    }
}

/// Whether a coordinator that begins later would change this. One that resumes at the same port has another key than the file
/// that was read before.
fn may_come(fault: &Fault) -> bool {
    match fault {
        Fault::AccessFile { source, .. } => source.kind() == ErrorKind::NotFound,
        Fault::Worker(error) => matches!(error, WorkerError::Unreachable { .. } | WorkerError::Impostor(_)),
        _ => false,
    }
}

/// Works for the coordinator of the access file as long as it is there.
fn join(args: &WorkArgs) -> Result<(), Fault> {
    let access = read_access(&args.access)?;
    let identity = WorkerIntroduction {
        build: BUILD.into(),
        name: name(std::process::id()),
        threads: args.threads as usize,
        leave: signals::stop_asked,
    };
    let clock = WalkClock::default();
    let build = |job: &[u8]| {
        let shift = Shift::decode(job, clock.clone());
        #[cfg(debug_assertions)]
        let shift = shift.map(crate::faulty::Faulty::if_asked_for);
        shift
    };
    Ok(cluster::work(&access, &identity, build, || clock.seconds())?)
}

/// What stands for an access file that comes by standard input.
pub(crate) const ACCESS_BY_INPUT: &str = "-";

/// What the coordinator wrote for its workers.
pub(crate) fn read_access(path: &Path) -> Result<Access, Fault> {
    let read = match path.to_str() {
        Some(ACCESS_BY_INPUT) => Access::read_from(std::io::stdin()),
        _ => Access::read(path),
    };
    read.map_err(|source| Fault::AccessFile { path: path.into(), source })
}

/// What the worker process `pid` of this machine is called.
pub(crate) fn name(pid: u32) -> String {
    launcher::name(variable, &rustix::system::uname().nodename().to_string_lossy(), pid)
}

fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok()
}
