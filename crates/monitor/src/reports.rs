//! The reports of a running job, every two seconds: a status file, and a page of metrics.

use std::collections::HashMap;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use protocol::Coordinator;
use results::unix_seconds;
use tracing::debug;

use crate::address::{NoPage, listen};
use crate::metrics::metrics;
use crate::run_status::RunStatus;
use crate::scrape::{HttpResponse, Request, TextPage, publish};
use crate::status::{Description, Report, STATUS, WorkerStatus, beside};

/// The time between two reports.
const INTERVAL: Duration = Duration::from_secs(2);

/// The most workers that a report names; the others are only counted.
const NAMED: usize = 1000;

/// Opens a page of metrics at an address. Returns the page and the address that it got.
///
/// # Errors
/// If the system refuses to listen at the address, or to start a thread.
pub fn open_metrics(address: &str) -> Result<(TextPage, SocketAddr), NoPage> {
    let (listener, bound) = listen(address, "--metrics")?;
    let page = TextPage::default();
    let served = page.clone();
    let is_local = bound.ip().is_loopback();
    let answer = move |request: &Request<'_>| match is_local && !request.is_to_here() {
        true => HttpResponse::text("403 Forbidden", "The page is for this machine, by its local names.\n"),
        false => served.answer(request),
    };
    publish(listener, "metrics", answer)
        .map_err(|source| NoPage::System { doing: "starting a thread", source })?;
    Ok((page, bound))
}

/// The outputs of a running job's reports: status files, and the metrics page.
pub struct Reports {
    description: Description,
    files: Vec<PathBuf>,
    page: Option<TextPage>,
    due: Instant,
}

impl Reports {
    /// Reports to the output folder; to a file beside the access file, if that lies elsewhere; and to a page, if one is
    /// wanted.
    pub fn new(
        description: Description,
        output: &Path,
        access: Option<&Path>,
        page: Option<TextPage>,
    ) -> Self {
        let mut files = vec![output.join(STATUS)];
        files.extend(access.filter(|access| access.parent() != Some(output)).map(beside));
        Reports { description, files, page, due: Instant::now() + INTERVAL }
    }

    /// Whether the next report is due.
    pub fn are_due(&self) -> bool {
        Instant::now() >= self.due
    }

    /// Writes a report if one is due.
    pub fn write(&mut self, status: &RunStatus, coordinator: &Coordinator) {
        if !self.are_due() {
            return;
        }
        self.due = Instant::now() + INTERVAL;
        let report = self.report(status, coordinator);
        let bytes = serde_json::to_vec_pretty(&report).expect("numbers and names");
        for file in &self.files {
            // A disk may be full for a while, and the run does not depend on the report.
            if let Err(error) = report::write_soon(file, &bytes) {
                debug!("no status is written to {}: {error}", file.display());
            }
        }
        if let Some(page) = &self.page {
            page.set(metrics(&report));
        }
    }

    fn report(&self, status: &RunStatus, coordinator: &Coordinator) -> Report {
        let per_walk = self.description.paths_per_walk;
        let mut known: HashMap<&str, (u64, u64)> = HashMap::new();
        for worker in coordinator.contributors() {
            // The results of workers behind a relay came over its connection.
            let (walks, faults) = known.entry(worker.peer()).or_default();
            *walks += worker.walks;
            *faults += worker.faults;
        }
        let workers = coordinator.present().into_iter().take(NAMED).map(|present| {
            let (walks, faults) = known.get(&present.name[..]).copied().unwrap_or_default();
            WorkerStatus {
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
            status: status.clone(),
            workers: workers.collect(),
        }
    }
}

impl Drop for Reports {
    /// Removes the status files, since the run is over.
    fn drop(&mut self) {
        for file in &self.files {
            // A file that was never written is not there.
            let _ = std::fs::remove_file(file);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpStream;

    use super::*;

    #[test]
    fn a_page_of_this_machine_has_only_its_local_names() {
        let (page, bound) = open_metrics("0").unwrap();
        page.set("radwalk_workers 2\n".into());
        let asked = |host: &str| {
            let mut stream = TcpStream::connect(bound).unwrap();
            write!(stream, "GET /metrics HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
            let mut answer = String::new();
            stream.read_to_string(&mut answer).unwrap();
            answer.contains("radwalk_workers 2")
        };
        assert_eq!(["localhost:9", "127.0.0.1", "evil.example"].map(asked), [true, true, false]);
    }
}
