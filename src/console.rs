//! Lines for people. A reader that has gone away is no reason to end a run.

use std::io::Write;

/// A line on stdout: results.
pub fn say(line: &str) {
    // Nobody reads: nobody misses it.
    let _ = writeln!(std::io::stdout(), "{}", harmless(line));
}

/// Text without what commands a terminal: names in files may hold anything.
fn harmless(text: &str) -> String {
    text.chars().filter(|c| !c.is_control() || matches!(c, '\n' | '\t')).collect()
}

/// A line on stderr: progress and trouble.
pub fn tell(line: &str) {
    // Likewise.
    let _ = writeln!(std::io::stderr(), "{}", harmless(line));
}
