//! Ctrl-C and SIGTERM: the first asks for an end in good order, a second quits at once.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::console::tell;

static SIGNALS: AtomicU32 = AtomicU32::new(0);

/// The exit code of an interrupted program.
const INTERRUPTED: i32 = 130;

/// Begins to catch signals. Where that is impossible, signals end the program as they always did.
pub fn catch() {
    let caught = ctrlc::set_handler(|| {
        if SIGNALS.fetch_add(1, Ordering::Relaxed) > 0 {
            std::process::exit(INTERRUPTED);
        }
    });
    if let Err(error) = caught {
        tell(&format!("radwalk: signals cannot be caught ({error}); Ctrl-C will end the run without saving"));
    }
}

/// Whether an end was asked for.
pub fn stop_asked() -> bool {
    SIGNALS.load(Ordering::Relaxed) > 0
}
