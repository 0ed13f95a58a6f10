//! The worker processes of `radwalk run`: started, replaced when they die, taken down at the end.

use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cluster::Access;
use protocol::Notice;

use crate::commands::work::{ACCESS_BY_INPUT, name};

/// Deaths of each worker in a row, without any progress of the job and over [`FUTILE_TIME`] at least, after which no more
/// workers are started.
const FUTILE_DEATHS: usize = 3;

/// The least time since the first of these deaths: what has killed workers for so long will kill the next.
const FUTILE_TIME: Duration = Duration::from_secs(10);

/// The wait before a missing worker is started, once each of the workers has died in a row.
const RESTART_WAIT: Duration = Duration::from_millis(500);

/// The children of this process.
pub(crate) struct LocalWorkers {
    /// What lets them in, as they read it. It goes by their standard input, so that no file is left behind whatever happens.
    access: Vec<u8>,
    threads: u32,
    children: Vec<Child>,
    wanted: usize,
    deaths: usize,
    /// When the first and the last of these were.
    died: Option<(Instant, Instant)>,
    walks_at_last_death: u64,
    /// What was last seen to go wrong.
    pub trouble: String,
}

impl LocalWorkers {
    /// None yet; `access` lets them in.
    pub(crate) fn new(access: &Access, wanted: usize, threads: u32) -> Self {
        LocalWorkers {
            access: access.to_bytes(),
            threads,
            children: Vec::new(),
            wanted,
            deaths: 0,
            died: None,
            walks_at_last_death: 0,
            trouble: String::new(),
        }
    }

    /// Starts what is missing; `walks` is how far the job is. Returns false when it is futile.
    pub(crate) fn supervise(&mut self, walks: u64) -> bool {
        self.reap(walks);
        while self.children.len() < self.wanted {
            if self.is_futile() {
                return !self.children.is_empty();
            }
            let waits = self.deaths >= self.wanted
                && self.died.is_some_and(|(_, last)| last.elapsed() < RESTART_WAIT);
            if waits {
                return true;
            }
            match self.start() {
                Ok(child) => self.children.push(child),
                Err(error) => {
                    self.trouble = format!("a worker process cannot be started: {error}");
                    self.count_death(walks);
                }
            }
        }
        true
    }

    /// Forgets the children that have died.
    fn reap(&mut self, walks: u64) {
        let (mut living, mut died) = (Vec::with_capacity(self.children.len()), 0);
        for mut child in self.children.drain(..) {
            match child.try_wait() {
                Ok(None) => living.push(child),
                Ok(Some(status)) => {
                    self.trouble = format!("worker process {} ended with {status}", child.id());
                    died += 1;
                }
                Err(error) => {
                    self.trouble = format!("worker process {} cannot be watched: {error}", child.id())
                }
            }
        }
        self.children = living;
        (0..died).for_each(|_| self.count_death(walks));
    }

    fn count_death(&mut self, walks: u64) {
        let now = Instant::now();
        let first = match self.died {
            Some((first, _)) if walks <= self.walks_at_last_death => first,
            _ => {
                self.deaths = 0;
                now
            }
        };
        self.died = Some((first, now));
        self.deaths += 1;
        self.walks_at_last_death = walks;
    }

    fn is_futile(&self) -> bool {
        let for_long = self.died.is_some_and(|(first, _)| first.elapsed() >= FUTILE_TIME);
        self.deaths >= FUTILE_DEATHS * self.wanted && for_long
    }

    fn start(&self) -> std::io::Result<Child> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["work", "--access", ACCESS_BY_INPUT, "--quiet", "--wait", "0"]);
        command.arg("--threads").arg(self.threads.to_string());
        command.stdin(Stdio::piped()).stdout(Stdio::null());
        // A Ctrl-C on the terminal is for the coordinator, which takes its workers down in good order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn()?;
        if let Some(mut input) = child.stdin.take() {
            // A worker that is gone already is reaped with the others. What is written fits a pipe.
            let _ = input.write_all(&self.access);
        }
        Ok(child)
    }

    /// The most memory that one of them has taken [bytes], where the system tells.
    pub(crate) fn peak_memory(&self) -> Option<u64> {
        self.children.iter().filter_map(|child| results::peak_memory_of(&child.id().to_string())).max()
    }

    /// A worker that the coordinator has given up is of no use any more, though its process may live on.
    pub(crate) fn heed(&mut self, notice: &Notice) {
        if let Notice::Lost { name: lost, .. } = notice
            && let Some(child) = self.children.iter_mut().find(|child| name(child.id()) == *lost)
        {
            // It may have died by itself meanwhile.
            let _ = child.kill();
        }
    }
}

impl Drop for LocalWorkers {
    fn drop(&mut self) {
        for child in &mut self.children {
            // Workers leave by themselves when the job is done; a worker that has not left has nothing to do.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
