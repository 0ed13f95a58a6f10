//! Status files: what a coordinator says of its job, and how another process finds and reads it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use results::unix_seconds;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::standing::Standing;

/// The name of a status file in an output folder.
pub(crate) const STATUS: &str = "status.json";

/// A coordinator reports every two seconds. One whose last report is older than this may be gone …
const LATE: u64 = 10;

/// … and is, where no other report comes in this time: clocks of machines differ.
const WATCH: Duration = Duration::from_secs(6);

/// What a report says of the job itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// The name of the job.
    pub job: String,
    /// The paths that a walk counts as: chains are walks of many rays.
    pub paths_per_walk: u64,
}

/// A status file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// What runs.
    #[serde(flatten)]
    pub description: Description,
    /// The machine of the coordinator.
    pub host: String,
    /// Its process there.
    pub pid: u32,
    /// When this was written, in seconds since 1970.
    pub time: u64,
    /// Where the job stands.
    #[serde(flatten)]
    pub standing: Standing,
    /// The workers that are there, a thousand at most.
    pub crew: Vec<Hand>,
}

/// A worker that is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hand {
    /// As it called itself.
    pub name: String,
    /// Its threads.
    pub threads: usize,
    /// Leases that it has.
    pub leases: usize,
    /// As far as it has shown.
    pub paths_per_second: f64,
    /// Its walks in the result so far.
    pub paths: u64,
    /// Results of it that cannot be.
    pub faults: u64,
}

/// What is known of a job.
pub enum Found {
    /// Its coordinator's last report.
    Report(PathBuf, Box<Report>),
    /// The summary of its result.
    Summary(Value),
}

/// Nothing is known of a job.
#[derive(Debug, thiserror::Error)]
#[error("nothing is known of a job at {} ({reason}); give the output folder of a job, or its access file", of.display())]
pub struct NoStatus {
    /// The access file or output folder that was given.
    pub of: PathBuf,
    /// Why not.
    pub reason: String,
}

/// The report of a running job, else the summary of one that has ended.
///
/// # Errors
/// Where there is neither, and where it cannot be read.
pub fn find(of: &Path) -> Result<Found, NoStatus> {
    let folder = if of.is_dir() { of } else { of.parent().unwrap_or(Path::new("")) };
    let mut candidates = vec![folder.join(STATUS)];
    if !of.is_dir() {
        candidates.insert(0, beside(of));
    }
    let unknown = |reason: String| NoStatus { of: of.into(), reason };
    if !of.exists() && !candidates[0].exists() {
        return Err(unknown(
            "there is nothing by that name, and access files are removed when a job ends".into(),
        ));
    }
    for file in candidates {
        let Ok(bytes) = fs::read(&file) else { continue };
        let report = serde_json::from_slice(&bytes)
            .map_err(|error| unknown(format!("{} is not a status file: {error}", file.display())))?;
        return Ok(Found::Report(file, Box::new(report)));
    }
    let summary = folder.join("summary.json");
    match fs::read(&summary) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map(Found::Summary)
            .map_err(|error| unknown(format!("{} is no summary: {error}", summary.display()))),
        Err(_) => {
            Err(unknown("no job has reported there: reports begin two seconds after its coordinator".into()))
        }
    }
}

/// The report, or one that comes later where it looks old, and whether its coordinator is alive.
pub fn watched(file: &Path, report: Report) -> (Report, bool) {
    if unix_seconds().abs_diff(report.time) <= LATE {
        return (report, true);
    }
    let began = Instant::now();
    while began.elapsed() < WATCH {
        std::thread::sleep(Duration::from_millis(200));
        let later = fs::read(file).ok().and_then(|bytes| serde_json::from_slice::<Report>(&bytes).ok());
        if let Some(later) = later.filter(|later| later.time != report.time) {
            return (later, true);
        }
    }
    (report, false)
}

/// `box.json` → `box.status.json`.
pub(crate) fn beside(access: &Path) -> PathBuf {
    access.with_extension(STATUS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn status_files_lie_beside_access_files() {
        assert_eq!(beside(Path::new("shared/box.json")), Path::new("shared/box.status.json"));
        assert_eq!(beside(Path::new("key")), Path::new("key.status.json"));
    }
}
