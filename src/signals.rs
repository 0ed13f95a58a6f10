//! Ctrl-C, SIGTERM and a terminal that closes: the first asks for an end in good order, one that comes more than a second later quits at once.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use cluster::Access;
use tracing::warn;

static SIGNALS: AtomicU32 = AtomicU32::new(0);

/// When the first was heard.
static FIRST: OnceLock<Instant> = OnceLock::new();

/// The access file that this process has written last.
static ACCESS: Mutex<Option<(Access, PathBuf)>> = Mutex::new(None);

/// The exit code of an interrupted program.
const INTERRUPTED: i32 = 130;

/// Signals that come so soon after the first are the same: `timeout` signals its child, and then its group with the child in
/// it.
const SAME: Duration = Duration::from_secs(1);

/// Begins to catch signals. Where that is impossible, signals end the program as they always did.
pub(crate) fn catch() {
    let caught = ctrlc::set_handler(hear).map_err(|error| error.to_string());
    if let Err(error) = caught.and_then(|()| catch_others().map_err(|error| error.to_string())) {
        warn!("signals cannot be caught ({error}); Ctrl-C will end the run without saving");
    }
}

fn hear() {
    let since = FIRST.get_or_init(Instant::now).elapsed();
    SIGNALS.fetch_add(1, Ordering::Relaxed);
    if since > SAME {
        warn!("a second signal: the run quits at once; its last checkpoint is kept");
        if let Some((access, file)) = ACCESS.lock().ok().and_then(|mut last| last.take()) {
            let _ = access.remove(&file);
        }
        std::process::exit(INTERRUPTED);
    }
}

/// SIGTERM, and the end of a terminal, which a process of `nohup` is to outlive.
#[cfg(unix)]
fn catch_others() -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGTERM};
    let caught = [SIGTERM, SIGHUP].into_iter().filter(|&signal| signal != SIGHUP || !is_ignored(SIGHUP));
    let mut signals = signal_hook::iterator::Signals::new(caught)?;
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || signals.forever().for_each(|_| hear()))
        .map(drop)
}

#[cfg(not(unix))]
fn catch_others() -> std::io::Result<()> {
    Ok(())
}

/// Whether who started this process lets it ignore a signal, where the system tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    ignored.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// A second signal removes this access file, too, if it is still that of this process.
pub(crate) fn remove_on_quitting(access: Access, file: PathBuf) {
    if let Ok(mut last) = ACCESS.lock() {
        *last = Some((access, file));
    }
}

/// Keeps what this process holds in memory, an access key above all, out of core dumps.
pub(crate) fn keep_memory_private() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{DumpableBehavior, set_dumpable_behavior};
        // Where it is refused, the key is as private as core dumps are.
        let _ = set_dumpable_behavior(DumpableBehavior::NotDumpable);
    }
}

/// Whether an end was asked for.
pub(crate) fn stop_asked() -> bool {
    SIGNALS.load(Ordering::Relaxed) > 0
}
