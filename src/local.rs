//! The workers of `radwalk run`: started, replaced when they die, taken down at the end. They are processes, but for the first of a large
//! scene.

use std::io::{self, Write};
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use cluster::{Access, WorkerError, WorkerIntroduction};
use protocol::Notice;
use results::Replica;

use crate::build::BUILD;
use crate::clock::WalkClock;
use crate::commands::work::{ACCESS_BY_INPUT, name};
use crate::shift::Shift;
use crate::team::Team;

/// Deaths of each worker in a row, without any progress of the job and over [`FUTILE_TIME`] at least, after which no more
/// workers are started.
const FUTILE_DEATHS: usize = 3;

/// The least time since the first of these deaths: what has killed workers for so long will kill the next.
const FUTILE_TIME: Duration = Duration::from_secs(10);

/// The wait before a missing worker is started, once each of the workers has died in a row.
const RESTART_WAIT: Duration = Duration::from_millis(500);

/// A worker that a thread of this process runs on the replica of the process.
type WorkerHere = JoinHandle<Result<(), WorkerError>>;

/// The children of this process, and the worker that is a part of it.
pub(crate) struct LocalWorkers {
    /// What lets them in, as they read it. It goes by their standard input, so that no file is left behind whatever happens.
    access: Vec<u8>,
    threads: u32,
    here: Option<WorkerHere>,
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
    pub(crate) fn new(access: &Access, team: Team) -> Self {
        LocalWorkers {
            access: access.to_bytes(),
            threads: team.threads,
            here: None,
            children: Vec::new(),
            wanted: team.workers,
            deaths: 0,
            died: None,
            walks_at_last_death: 0,
            trouble: String::new(),
        }
    }

    /// Starts a worker that is a part of this process. Where it fails, a process follows.
    pub(crate) fn begin_here(&mut self, access: Access, replica: Replica) {
        let introduction = WorkerIntroduction {
            build: BUILD.into(),
            name: name(std::process::id()),
            threads: self.threads as usize,
            // The coordinator is told to stop, not this.
            leave: || false,
        };
        let clock = WalkClock::default();
        let shift = Shift::new(replica, clock.clone());
        let work = move || cluster::work(&access, &introduction, |_| Ok(shift), || clock.seconds());
        match thread::Builder::new().spawn(work) {
            Ok(here) => self.here = Some(here),
            Err(error) => self.trouble = format!("a worker thread cannot be started: {error}"),
        }
    }

    /// The number of workers that are there.
    fn living(&self) -> usize {
        usize::from(self.here.is_some()) + self.children.len()
    }

    /// Starts what is missing; `walks` is how far the job is. Returns false when it is futile.
    pub(crate) fn supervise(&mut self, walks: u64) -> bool {
        self.reap(walks);
        while self.living() < self.wanted {
            if self.is_futile() {
                return self.living() > 0;
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

    /// Forgets the workers that have died.
    fn reap(&mut self, walks: u64) {
        if let Some(here) = self.here.take_if(|here| here.is_finished()) {
            self.trouble = match here.join() {
                Ok(Ok(())) => "the worker of this process left".into(),
                Ok(Err(error)) => format!("the worker of this process ended: {error}"),
                Err(_) => "the worker of this process panicked".into(),
            };
            self.count_death(walks);
        }
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

    fn start(&self) -> io::Result<Child> {
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
        let Notice::Lost { name: lost, .. } = notice else { return };
        if let Some(child) = self.children.iter_mut().find(|child| name(child.id()) == *lost) {
            // It may have died by itself meanwhile.
            let _ = child.kill();
        } else if name(std::process::id()) == *lost {
            // Its threads end once they ask whether to go on.
            self.here = None;
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
