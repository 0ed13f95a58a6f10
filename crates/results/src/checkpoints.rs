//! `tally.bin` as checkpoint: written now and then while a run goes on, found again by `--resume`.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use job::{Budget, Job, Keyword, OutputFile};
use judge::limits;
use protocol::{
    Book, Checkpoint, CheckpointError, CheckpointFault, Coordinator, JobPlan, Judge, Past, Session, WalkRange,
};
use radiosity::{Experiment, SceneSpec};
use report::OutputFolder;

use crate::error::Error;
use crate::pilot::{ARRIVALS, PILOT};
use crate::replica::{Replica, pack};
use crate::settings::Settings;
use crate::views::pictures_in;

/// The latest tally of a run.
pub const CURRENT: &str = "tally.bin";
/// The tally before the latest, for the case that the latest is damaged.
pub(crate) const PREVIOUS: &str = "tally.previous.bin";

/// What a run's checkpoints have in common.
#[derive(Clone)]
pub struct Identity {
    /// The digest of the scene.
    pub scene_hash: [u8; 32],
    /// Scene, method and seed.
    pub job_hash: [u8; 32],
    /// The seed of the job.
    pub seed: u64,
    /// The number of the first walk.
    pub first: u64,
    /// The digest of the target and of the intervals' level, to which looks belong.
    pub goal: [u8; 32],
    /// The job as it travels.
    pub job: Arc<[u8]>,
    /// The processes that coordinated it, this one last.
    pub sessions: Vec<Session>,
}

impl Identity {
    /// The identity of a job whose checkpoints this `build` writes.
    ///
    /// # Errors
    /// Where the scene is too large to be sent.
    pub fn new(job: &Job, settings: &Settings, experiment: &Experiment, build: &str) -> Result<Self, Error> {
        let first = job.budget.first_path / experiment.unit().paths();
        Identity::of_walks((job.scene.spec(), settings), experiment, first, build)
    }

    /// [`Identity::new`] of walks from a first number on, in a scene.
    pub(crate) fn of_walks(
        (spec, settings): (&SceneSpec, &Settings),
        experiment: &Experiment,
        first: u64,
        build: &str,
    ) -> Result<Self, Error> {
        let scene = experiment.scene();
        let packed = pack(scene, spec, settings)
            .map_err(|error| Error::System { doing: "packing the job", source: io::Error::other(error) })?;
        Ok(Identity {
            scene_hash: scene.hash(),
            job_hash: settings.job_hash(scene.hash(), settings.seed),
            seed: settings.seed,
            first,
            goal: settings.goal(),
            job: packed.into(),
            sessions: vec![session(build)],
        })
    }

    /// A replica of the job that shares the scene of its experiment.
    pub fn replica(&self, experiment: &Experiment) -> Replica {
        Replica::of(experiment.clone(), self.seed, self.job_hash)
    }

    /// The plan of the job's walks up to the last of some looks, at which `judge` is asked. Workers of the same `build` may
    /// join; `lots`, a random number that they do not know, decides which leases an audit can draw.
    pub fn plan(
        &self,
        build: &str,
        budget: &Budget,
        experiment: &Experiment,
        (looks, judge): (Vec<u64>, Judge),
        lots: u64,
    ) -> JobPlan {
        // A batch is leased as a walk is, whole and alone.
        let (stream_paths, leases_per_thread) = match experiment.unit().batch() {
            Some(_) => (1, 1),
            None => (budget.stream_paths, 2),
        };
        JobPlan {
            job: self.job.clone(),
            scene_hash: self.scene_hash,
            job_hash: self.job_hash,
            build: build.into(),
            first: self.first,
            paths: looks.last().copied().unwrap_or(0),
            stream_paths,
            leases_per_thread,
            patches: experiment.rows(),
            layout: experiment.layout(),
            limits: limits(experiment),
            wall: budget.wall_seconds.map(Duration::from_secs_f64),
            lots,
            looks,
            judge,
        }
    }

    /// A checkpoint of these books.
    pub fn checkpoint(&self, past: Past) -> Checkpoint {
        let Past { tally, deliveries, out_of_order, workers, looks, effort } = past;
        let mut sessions = self.sessions.clone();
        if let Some(session) = sessions.last_mut() {
            session.ended = unix_seconds();
        }
        let part = WalkRange { job_hash: self.job_hash, seed: self.seed, first: self.first, deliveries };
        let (goal, job) = (self.goal, self.job.clone());
        let book = Book { parts: vec![part], out_of_order, workers, looks, goal, effort, sessions, job };
        Checkpoint { scene_hash: self.scene_hash, tally, book }
    }
}

/// This process, of a build of the program, as a session that begins now.
pub(crate) fn session(build: &str) -> Session {
    let now = unix_seconds();
    let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
    Session { host, build: build.into(), began: now, ended: now }
}

/// Seconds since 1970. A clock before that gives 0: times are reported, never computed with.
pub fn unix_seconds() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

/// The checkpoint that `--resume` goes on from.
pub(crate) struct ResumePoint {
    /// The checkpoint itself, verified.
    pub(crate) checkpoint: Checkpoint,
    /// Why the latest one was not used, where it was not.
    pub(crate) passed_over: Option<CheckpointError>,
}

/// Looks for the latest usable checkpoint in a folder; `None` where there is none at all.
///
/// # Errors
/// Where there are files, but none that can be used: why the latest cannot.
pub(crate) fn find(
    folder: &Path,
    fits: impl Fn(&Checkpoint) -> Result<(), CheckpointFault>,
) -> Result<Option<ResumePoint>, CheckpointError> {
    let read = |name: &str| {
        let path = folder.join(name);
        let checkpoint = Checkpoint::read(&path)?;
        fits(&checkpoint).map_err(|fault| CheckpointError { path, fault })?;
        Ok(checkpoint)
    };
    if !has_tally(folder) {
        return Ok(None);
    }
    match read(CURRENT) {
        Ok(checkpoint) => Ok(Some(ResumePoint { checkpoint, passed_over: None })),
        Err(error) => match read(PREVIOUS) {
            Ok(checkpoint) => Ok(Some(ResumePoint { checkpoint, passed_over: Some(error) })),
            Err(other) if !folder.join(CURRENT).exists() => Err(other),
            Err(_) => Err(error),
        },
    }
}

/// Whether a folder has the tally of some run.
pub fn has_tally(folder: &Path) -> bool {
    [CURRENT, PREVIOUS].iter().any(|file| folder.join(file).exists())
}

/// What is made from a tally. It does not stand beside that of another run.
pub(crate) fn derived() -> Vec<&'static str> {
    let chosen = OutputFile::ALL.iter().map(|file| file.name());
    chosen.chain([PARTITION, SENSORS, PLANES, ISOLUX, ISOLUX_PICTURE, SOURCES, SENSITIVITIES]).collect()
}

/// How surfaces are cut; absent where no pilot has chosen it.
pub(crate) const PARTITION: &str = "partition.toml";

/// What sensors read; absent where there are none.
pub(crate) const SENSORS: &str = "sensors.csv";

/// What the points of planes read; absent where there are none.
pub(crate) const PLANES: &str = "planes.csv";

/// Lines of equal light on planes; absent where none is a grid.
pub(crate) const ISOLUX: &str = "planes.svg";
pub(crate) const ISOLUX_PICTURE: &str = "planes.png";

/// What each source does; absent where none are distinguished.
pub(crate) const SOURCES: &str = "sources.csv";

/// What materials do; absent where that is not asked for.
pub(crate) const SENSITIVITIES: &str = "sensitivities.csv";

/// What the latest tally of a folder is to a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Latest {
    /// The run goes on from it: it becomes the previous one.
    Good,
    /// The checkpoint is damaged, and the previous one is not.
    Damaged,
    /// The checkpoint is another run's, as is all that is made from it, or there is none.
    Foreign,
}

/// Writes a checkpoint in place of the latest one, which is kept as the previous one where it is good. It is read back
/// before that: a checkpoint that cannot be resumed from takes no other's place.
///
/// # Errors
/// Where the books do not balance (nothing is written then) or the file cannot be written.
pub(crate) fn write(folder: &OutputFolder, checkpoint: &Checkpoint, latest: Latest) -> Result<(), Error> {
    let path = folder.file(CURRENT);
    checkpoint.verify().map_err(|fault| CheckpointError { path: path.clone(), fault })?;
    folder.keep_hold()?;
    let previous = (latest == Latest::Good).then(|| folder.file(PREVIOUS));
    let prove = |file: &File| {
        let length = file.metadata()?.len();
        Checkpoint::prove(BufReader::new(file), length).map_err(io::Error::other)
    };
    report::replace_atomically(&path, previous.as_deref(), |file| checkpoint.write(file), prove)?;
    if latest == Latest::Foreign {
        let views = pictures_in(folder);
        let views: Vec<&str> = views.iter().map(String::as_str).collect();
        folder.remove(&[&derived()[..], &[PREVIOUS, ARRIVALS], &views].concat())?;
    }
    // The pilot goes last: a process that dies before takes the new tally for the one that it replaces, and walks again.
    Ok(folder.remove(&[PILOT])?)
}

/// Writes checkpoints beside a run, in a thread of its own: the run only pays for a copy of its books.
pub struct Keeper {
    interval: Duration,
    due: Instant,
    /// Walks of the last checkpoint, those beyond gaps included.
    walks: u64,
    identity: Identity,
    checkpoints: SyncSender<Checkpoint>,
    written: Receiver<Result<(), Error>>,
    under_way: bool,
    /// When the latest one of this run was written, and its walks.
    saved: Option<(Instant, u64)>,
    thread: JoinHandle<Latest>,
}

impl Keeper {
    /// A keeper of a run that has `walks` in its latest checkpoint.
    ///
    /// # Errors
    /// Where no thread can be started.
    pub fn new(
        folder: Arc<OutputFolder>,
        interval: Duration,
        identity: Identity,
        walks: u64,
        latest: Latest,
    ) -> Result<Self, Error> {
        let (checkpoints, inbox) = sync_channel::<Checkpoint>(1);
        let (outbox, written) = sync_channel(1);
        let keep = move || {
            let mut latest = latest;
            for checkpoint in inbox {
                let done = write(&folder, &checkpoint, latest);
                if done.is_ok() {
                    latest = Latest::Good;
                }
                // A run that has ended does not listen.
                let _ = outbox.send(done);
            }
            latest
        };
        let thread = std::thread::Builder::new()
            .spawn(keep)
            .map_err(|source| Error::System { doing: "starting a thread", source })?;
        let due = Instant::now() + interval;
        Ok(Keeper {
            interval,
            due,
            walks,
            identity,
            checkpoints,
            written,
            under_way: false,
            saved: None,
            thread,
        })
    }

    /// Begins a checkpoint where one is due.
    ///
    /// # Errors
    /// What went wrong with the one before. The run may go on: the latest good one is still there.
    pub fn supervise(&mut self, coordinator: &Coordinator) -> Result<(), Error> {
        match self.written.try_recv() {
            Ok(done) => {
                self.under_way = false;
                self.due = Instant::now() + self.interval;
                done?;
                self.saved = Some((Instant::now(), self.walks));
            }
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => {}
        }
        let walks = coordinator.progress().walks;
        if !self.under_way && walks > self.walks && Instant::now() >= self.due {
            self.walks = walks;
            // A thread that is gone will be noticed at the end.
            self.under_way = self.checkpoints.try_send(self.identity.checkpoint(coordinator.past())).is_ok();
        }
        Ok(())
    }

    /// When the latest checkpoint of this run was written, and its walks, those beyond gaps included.
    pub fn saved(&self) -> Option<(Instant, u64)> {
        self.saved
    }

    /// Ends the thread. Returns what the last checkpoint of the run is made from, and what the latest one on disk is.
    pub fn finish(self) -> (Identity, Latest) {
        drop((self.checkpoints, self.written));
        (self.identity, self.thread.join().unwrap_or(Latest::Damaged))
    }
}
