//! `radwalk diff`: two results of one scene, patch by patch.

use voice::{Phase, say};

use crate::args::DiffArgs;
use crate::fault::{Fault, Outcome};

/// Compares two results, and fails where they differ.
pub(crate) fn diff(args: &DiffArgs) -> Result<Outcome, Fault> {
    let phase = Phase::begin("reading the results");
    let comparison = results::compare(&args.first, &args.second)?;
    drop(phase);
    if args.json {
        say(&comparison.json().to_string());
    } else {
        comparison.lines().iter().for_each(|line| say(line));
    }
    comparison.fault().map_or(Ok(Outcome::Done), |how| Err(Fault::Differ(how)))
}
