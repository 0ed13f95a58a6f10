//! The table `[budget]`: what a job may cost.

use crate::document::{KeyTable, Value};
use crate::error::Error;
use crate::vocabulary::MAX_STREAM_PATHS;

/// Walks per lease of a job that names no number.
pub const DEFAULT_STREAM_PATHS: u64 = 65_536;

/// Seconds between checkpoints of a job that names none.
pub const DEFAULT_CHECKPOINT_SECONDS: f64 = 60.0;

/// The longest wall time [s], some 30 years: what clocks can add to the present.
const MAX_WALL_SECONDS: f64 = 1e9;

/// The table `[budget]` of a job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// The number of the first walk (Jacobi: ray); default 0. Runs of other ranges of one job can be merged.
    pub first_path: u64,
    /// Walks of the whole job (Jacobi: rays), at least 1.
    pub paths: u64,
    /// Walks per lease, in [1, 2²⁴]; default [`DEFAULT_STREAM_PATHS`].
    pub stream_paths: u64,
    /// Wall time in seconds, above 0 and at most 10⁹.
    pub wall_seconds: Option<f64>,
    /// Seconds between checkpoints, above 0 and at most 10⁹; default [`DEFAULT_CHECKPOINT_SECONDS`].
    pub checkpoint_seconds: f64,
}

/// Reads the table `[budget]` of a job, with `paths` as its default.
pub(crate) fn read_budget(mut table: KeyTable<'_>, paths: Option<u64>) -> Result<Budget, Error> {
    let read = |value: Value<'_>| value.integer(1..=i64::MAX as u64, "without a walk there is no estimate");
    let paths = match (table.take("paths"), paths) {
        (Some(value), _) => read(value)?,
        (None, Some(paths)) => paths,
        (None, None) => read(table.require(
            "paths",
            "it bounds the work, also where a target may end the job earlier",
            "[budget] paths = 10_000_000, the number of walks",
        )?)?,
    };
    let first_path = table.take("first_path").map(|value| read_first_path(&value, paths)).transpose()?;
    let stream_paths = table.take("stream_paths").map(|value| read_stream_paths(&value)).transpose()?;
    let checkpoint_seconds =
        table.take("checkpoint_seconds").map(|value| read_seconds(&value)).transpose()?;
    Ok(Budget {
        first_path: first_path.unwrap_or(0),
        paths,
        stream_paths: stream_paths.unwrap_or(DEFAULT_STREAM_PATHS),
        wall_seconds: table.take("wall_seconds").map(|value| read_seconds(&value)).transpose()?,
        checkpoint_seconds: checkpoint_seconds.unwrap_or(DEFAULT_CHECKPOINT_SECONDS),
    })
}

fn read_first_path(value: &Value<'_>, paths: u64) -> Result<u64, Error> {
    value.integer(0..=i64::MAX as u64 - paths, "walks are numbered from 0 to 2⁶³ − 1")
}

fn read_stream_paths(value: &Value<'_>) -> Result<u64, Error> {
    value.integer(
        1..=MAX_STREAM_PATHS,
        "a lease holds at least one walk, and a lost one is traced again whole",
    )
}

fn read_seconds(value: &Value<'_>) -> Result<f64, Error> {
    let seconds = value.number()?;
    if seconds > 0.0 && seconds <= MAX_WALL_SECONDS {
        return Ok(seconds);
    }
    Err(value.refuse(
        format!("{seconds} s is outside (0, {MAX_WALL_SECONDS}]"),
        "a run takes time, and clocks end",
        "choose a positive number of seconds, or remove the key",
    ))
}
