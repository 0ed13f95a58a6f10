//! What a running job leaves for others to see: a status file, and a page of metrics.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use cluster::coordinator::Coordinator;
use cluster::scrape::{Page, publish};
use serde::{Deserialize, Serialize};
use tracing::{debug, info};

use crate::fault::Fault;
use crate::gauge::{Standing, unix_seconds};
use crate::outputs::RunOutput;

/// Between two reports.
const INTERVAL: Duration = Duration::from_secs(2);

/// The name of a status file in an output folder.
pub const STATUS: &str = "status.json";

/// Workers beyond this are told of by their number only.
const NAMED: usize = 1000;

/// What a report says of the job itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// The name of the job.
    pub job: String,
    /// A walk counts as so many paths: chains are walks of many rays.
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

/// Where reports go.
pub struct Reports {
    description: Description,
    files: Vec<PathBuf>,
    page: Option<Page>,
    due: Instant,
}

impl Reports {
    /// Reports to the output folder; beside the access file, where that lies elsewhere; and to a page, where one is wanted.
    ///
    /// # Errors
    /// Where the page's address cannot be listened at.
    pub fn new(
        description: Description,
        output: &RunOutput,
        access: Option<&Path>,
        metrics: Option<&str>,
    ) -> Result<Self, Fault> {
        let mut files = vec![output.path().join(STATUS)];
        files.extend(access.filter(|access| access.parent() != Some(output.path())).map(beside));
        let page = metrics.map(open_page).transpose()?;
        Ok(Reports { description, files, page, due: Instant::now() + INTERVAL })
    }

    /// Whether it is time for a report.
    pub fn are_due(&self) -> bool {
        Instant::now() >= self.due
    }

    /// Reports, where it is time to.
    pub fn write(&mut self, standing: &Standing, coordinator: &Coordinator) {
        if !self.are_due() {
            return;
        }
        self.due = Instant::now() + INTERVAL;
        let report = self.report(standing, coordinator);
        let bytes = serde_json::to_vec_pretty(&report).expect("numbers and names");
        for file in &self.files {
            // A disk may be full for a while, and the run does not depend on this.
            if let Err(error) = report::write_soon(file, &bytes) {
                debug!("no status is written to {}: {error}", file.display());
            }
        }
        if let Some(page) = &self.page {
            page.set(metrics(&report));
        }
    }

    fn report(&self, standing: &Standing, coordinator: &Coordinator) -> Report {
        let per_walk = self.description.paths_per_walk;
        let mut known: HashMap<&str, (u64, u64)> = HashMap::new();
        for worker in coordinator.contributors() {
            known.insert(&worker.name, (worker.walks, worker.faults));
        }
        let crew = coordinator.present().into_iter().take(NAMED).map(|present| {
            let (walks, faults) = known.get(&present.name[..]).copied().unwrap_or_default();
            Hand {
                threads: present.threads,
                leases: present.leases,
                paths_per_second: present.walks_per_second * per_walk as f64,
                paths: walks.saturating_mul(per_walk),
                faults,
                name: present.name,
            }
        });
        Report {
            description: self.description.clone(),
            host: rustix::system::uname().nodename().to_string_lossy().into_owned(),
            pid: std::process::id(),
            time: unix_seconds(),
            standing: standing.clone(),
            crew: crew.collect(),
        }
    }
}

impl Drop for Reports {
    /// What the files say is over.
    fn drop(&mut self) {
        for file in &self.files {
            // One that was never written is not there.
            let _ = std::fs::remove_file(file);
        }
    }
}

/// `box.json` → `box.status.json`.
pub fn beside(access: &Path) -> PathBuf {
    access.with_extension(STATUS)
}

/// The address itself; a port alone is that of the loopback address.
pub fn at_loopback(address: &str) -> String {
    match address.trim_start_matches(':').parse::<u16>() {
        Ok(port) => format!("127.0.0.1:{port}"),
        Err(_) => address.to_owned(),
    }
}

/// Listens for monitors: at the loopback address, where a port alone is given.
fn open_page(address: &str) -> Result<Page, Fault> {
    let address = at_loopback(address);
    let page = Page::default();
    let open = || {
        let listener = TcpListener::bind(&address)?;
        let bound = listener.local_addr()?;
        let told = page.clone();
        publish(listener, "metrics", move |request| told.answer(request))?;
        Ok(bound)
    };
    let bound =
        open().map_err(|source| Fault::Listen { address: address.clone(), option: "--metrics", source })?;
    info!(event = "metrics", "metrics are at http://{bound}/metrics");
    Ok(page)
}

/// A report in the text format of Prometheus.
fn metrics(report: &Report) -> String {
    let Report { standing, crew, description, .. } = report;
    let mut text = String::new();
    let mut metric = |name: &str, kind: &str, help: &str, value: Option<f64>| {
        // What is not known is left out. A string takes what it is given.
        let Some(value) = value else { return };
        let _ = write!(
            text,
            "# HELP radwalk_{name} {help}\n# TYPE radwalk_{name} {kind}\nradwalk_{name} {value}\n"
        );
    };
    let goal = standing.target;
    let faults = standing.faults;
    for (name, kind, help, value) in [
        ("seconds", "gauge", "Seconds since this coordinator began.", Some(standing.seconds)),
        ("paths", "gauge", "Paths that are in, earlier sessions included.", Some(standing.paths as f64)),
        ("paths_budget", "gauge", "Paths of the budget.", Some(standing.paths_total as f64)),
        ("paths_per_second", "gauge", "Of the last half minute.", Some(standing.paths_per_second)),
        ("rays_per_second", "gauge", "Of the last half minute.", Some(standing.rays_per_second)),
        ("workers", "gauge", "Workers that walk now.", Some(standing.workers as f64)),
        (
            "relative_error_median",
            "gauge",
            "Half of the area is known within this part.",
            standing.median_relative_error,
        ),
        (
            "relative_error_max",
            "gauge",
            "Half-width over estimate of the worst face.",
            standing.max_relative_error,
        ),
        ("relative_error_target", "gauge", "Asked for.", goal.map(|goal| goal.relative_error)),
        (
            "relative_error_decisive",
            "gauge",
            "What the target's part of the area is known within.",
            goal.and_then(|goal| goal.decisive_error),
        ),
        (
            "paths_expected",
            "gauge",
            "Where the target will probably be reached.",
            goal.and_then(|goal| goal.paths_expected).map(|paths| paths as f64),
        ),
        ("seconds_left", "gauge", "To the target or the end of the budget.", standing.seconds_left),
        (
            "checkpoint_age_seconds",
            "gauge",
            "Since the last checkpoint of this session.",
            standing.checkpoint.map(|saved| saved.seconds_ago),
        ),
        (
            "checkpoint_paths",
            "gauge",
            "Paths of the last checkpoint.",
            standing.checkpoint.map(|saved| saved.paths as f64),
        ),
        (
            "workers_lost_total",
            "counter",
            "Workers that were lost or left early.",
            Some(faults.workers_lost as f64),
        ),
        (
            "workers_refused_total",
            "counter",
            "Workers that were not let in.",
            Some(faults.workers_refused as f64),
        ),
        (
            "connections_failed_total",
            "counter",
            "Connections that came to nothing.",
            Some(faults.connections_failed as f64),
        ),
        (
            "checkpoints_failed_total",
            "counter",
            "Checkpoints that could not be written.",
            Some(faults.checkpoints_failed as f64),
        ),
    ] {
        metric(name, kind, help, value);
    }
    let _ = write!(
        text,
        "# HELP radwalk_job_info The job.\n# TYPE radwalk_job_info gauge\nradwalk_job_info{{job=\"{}\"}} 1\n",
        label(&description.job)
    );
    let _ = text.write_str(
        "# HELP radwalk_worker_paths_per_second As far as each worker has shown.\n\
         # TYPE radwalk_worker_paths_per_second gauge\n",
    );
    for hand in crew {
        let _ = writeln!(
            text,
            "radwalk_worker_paths_per_second{{worker=\"{}\"}} {}",
            label(&hand.name),
            hand.paths_per_second
        );
    }
    text
}

/// The value of a label, with its marks escaped.
fn label(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_escaped() {
        assert_eq!(label("a\"b\\c\nd"), "a\\\"b\\\\c\\nd");
    }

    #[test]
    fn status_files_lie_beside_access_files() {
        assert_eq!(beside(Path::new("shared/box.json")), Path::new("shared/box.status.json"));
        assert_eq!(beside(Path::new("key")), Path::new("key.status.json"));
    }
}
