//! Ctrl-C and SIGTERM: the first asks for an end in good order, one that comes more than a second later quits at once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use tracing::warn;

static SIGNALS: AtomicU32 = AtomicU32::new(0);

/// The exit code of an interrupted program.
const INTERRUPTED: i32 = 130;

/// Signals that come so soon after the first are the same: `timeout` signals its child, and then its group with the child in
/// it.
const SAME: Duration = Duration::from_secs(1);

/// Begins to catch signals. Where that is impossible, signals end the program as they always did.
pub(crate) fn catch() {
    let first = OnceLock::new();
    let caught = ctrlc::set_handler(move || {
        let since = first.get_or_init(Instant::now).elapsed();
        SIGNALS.fetch_add(1, Ordering::Relaxed);
        if since > SAME {
            warn!("a second signal: the run quits at once; its last checkpoint is kept");
            std::process::exit(INTERRUPTED);
        }
    });
    if let Err(error) = caught {
        warn!("signals cannot be caught ({error}); Ctrl-C will end the run without saving");
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
