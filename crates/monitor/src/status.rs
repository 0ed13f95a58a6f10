//! Status files: the state of a job as its coordinator writes it, and how another process finds and reads it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use results::{CURRENT, unix_seconds};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::run_status::RunStatus;

/// The name of a status file in an output folder.
pub(crate) const STATUS: &str = "status.json";

/// The age in seconds from which a report is late. A coordinator reports every two seconds, so it may be gone.
const LATE: u64 = 10;

/// The time to wait for another report; without one the coordinator is gone. Clocks of machines differ, so age alone
/// does not tell.
const WATCH: Duration = Duration::from_secs(6);

/// The part of a report that describes the job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// The name of the job.
    pub job: String,
    /// The paths that one walk counts as: chains are walks of many rays.
    pub paths_per_walk: u64,
}

/// The content of a status file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The description of the job.
    #[serde(flatten)]
    pub description: Description,
    /// The machine of the coordinator.
    pub host: String,
    /// The number of the coordinator's process there.
    pub pid: u32,
    /// The time of writing, in seconds since 1970-01-01 UTC.
    pub time: u64,
    /// The state of the job.
    #[serde(flatten)]
    pub status: RunStatus,
    /// The workers that are connected, a thousand at most.
    #[serde(rename = "crew")]
    pub workers: Vec<WorkerStatus>,
}

/// A worker that is connected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorkerStatus {
    /// The name that the worker gave.
    pub name: String,
    /// The number of the worker's threads.
    pub threads: usize,
    /// The leases that the worker has.
    pub leases: usize,
    /// The worker's paths per second, learnt from its results.
    pub paths_per_second: f64,
    /// The worker's paths in the result so far.
    pub paths: u64,
    /// The number of the worker's impossible results.
    pub faults: u64,
}

/// What is known of a job: a report or a summary.
pub enum JobState {
    /// The job runs: its coordinator's last report and the file that holds it.
    Report(PathBuf, Box<Report>),
    /// The job has ended: the summary of its result.
    Summary(Value),
}

/// The error that nothing is known of a job.
#[derive(Debug, thiserror::Error)]
#[error("nothing is known of a job at {} ({reason}); {remedy}", of.display())]
pub struct NoStatus {
    /// The access file or output folder that was given.
    pub of: PathBuf,
    /// The reason why nothing is known.
    pub reason: String,
    /// What to do.
    pub remedy: &'static str,
}

/// The report of a running job, or the summary of one that has ended.
///
/// # Errors
/// If there is neither, or it cannot be read.
pub fn find(of: &Path) -> Result<JobState, NoStatus> {
    let folder = if of.is_dir() { of } else { of.parent().unwrap_or(Path::new("")) };
    let mut candidates = vec![folder.join(STATUS)];
    if !of.is_dir() {
        candidates.insert(0, beside(of));
    }
    let remedy = "give the output folder of a job, or its access file";
    let unknown = |reason: String| NoStatus { of: of.into(), reason, remedy };
    if !of.exists() && !candidates[0].exists() {
        return Err(unknown(
            "there is nothing by that name, and access files are removed when a job ends".into(),
        ));
    }
    for file in candidates {
        let Ok(bytes) = fs::read(&file) else { continue };
        let report = serde_json::from_slice(&bytes)
            .map_err(|error| unknown(format!("{} is not a status file: {error}", file.display())))?;
        return Ok(JobState::Report(file, Box::new(report)));
    }
    let summary = folder.join("summary.json");
    match fs::read(&summary) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map(JobState::Summary)
            .map_err(|error| unknown(format!("{} is no summary: {error}", summary.display()))),
        Err(_) if folder.join(CURRENT).exists() => Err(unknown(
            "no coordinator reports: it writes results now, or the job ended without summary.json, which radwalk report OUT --export summary makes"
                .into(),
        )),
        Err(_) if of.is_file() => Err(NoStatus {
            remedy: "ask again, or give an output folder or an access file",
            ..unknown("no coordinator has reported by it yet: it does so two seconds after its walks begin".into())
        }),
        Err(_) => {
            Err(unknown("no job has reported there: reports begin with its walks, when its patches are chosen".into()))
        }
    }
}

/// The report, or a later one if it looks old; and whether its coordinator is alive.
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

/// The status file beside an access file: `box.json` → `box.status.json`.
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
