//! Leads worker processes through the walks of a job: those of this machine, or those that are started elsewhere.

use std::cell::RefCell;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{Access, Wish, random_bytes, serve};
use job::Budget;
use protocol::{Coordinator, Ending, JobPlan, Judge, Look, Notice, Past};
use radiosity::{Experiment, Tally};
use results::Identity;
use tracing::info;

use crate::build::BUILD;
use crate::fault::Fault;
use crate::local::LocalWorkers;
use crate::progress::tell_notice;
use crate::signals;
use crate::team::Team;

/// For how long workers that look for their next job are told that there is none: they look twice a second.
const PARTING: Duration = Duration::from_millis(1500);

/// The processes that walk.
pub(crate) enum Executor {
    /// Processes of this machine, started for each job.
    Local(Team),
    /// Processes that are started elsewhere, and stay from job to job.
    Remote(Remote),
}

/// A listener for workers that are started elsewhere, and the access file that lets them in. The file goes with it, however that ends: its key is of
/// no use any more, and workers learn by this that it is over.
pub(crate) struct Remote {
    listener: TcpListener,
    access: Access,
    file: PathBuf,
}

impl Remote {
    /// Listens at `address` for workers of a scene, and writes the access file that lets them in.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn open(
        scene_hash: [u8; 32],
        (address, advertise): (&str, Option<&str>),
        file: PathBuf,
    ) -> Result<Self, Fault> {
        let (listener, access) = listen(scene_hash, address, advertise)?;
        let replaced =
            access.write(&file).map_err(|source| Fault::AccessFileWrite { path: file.clone(), source })?;
        signals::remove_on_quitting(access.clone(), file.clone());
        tell_replaced(replaced, &file);
        info!(
            "listening at {}; start workers with: radwalk work --access {}",
            access.address,
            file.display()
        );
        Ok(Remote { listener, access, file })
    }

    /// Tells the workers that all is done: those of an experiment that was walked, or another of its scene.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn dismiss(
        self,
        identity: &Identity,
        budget: &Budget,
        experiment: &Experiment,
    ) -> Result<(), Fault> {
        let _ = self.access.remove(&self.file);
        let nothing_left = plan(identity, budget, experiment, vec![], Box::new(|_, _| Look::default()))?;
        let mut coordinator = Coordinator::new(nothing_left, Past::none(experiment.tally()));
        let executor = Executor::Remote(self);
        let began = Instant::now();
        while began.elapsed() < PARTING {
            let station = executor.station(identity, experiment)?;
            serve(station.listener, &station.access, &mut coordinator, |_| Wish::Continue, |_| {})
                .map_err(|source| Fault::System { doing: "parting with the workers", source })?;
        }
        Ok(())
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        // Where the file is gone, or another coordinator's by now, there is nothing to do.
        let _ = self.access.remove(&self.file);
    }
}

/// Says whose access file another one has replaced.
pub(crate) fn tell_replaced(address: Option<String>, file: &Path) {
    if let Some(address) = address {
        info!("{} let workers in at {address}; from now on it does so here", file.display());
    }
}

impl Executor {
    /// Opens what workers of an experiment join. A large scene is there once: the first worker of this machine is then a part of this process.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn station(&self, identity: &Identity, experiment: &Experiment) -> Result<WorkerEntry, Fault> {
        match self {
            Executor::Local(team) => {
                let (team, is_shared) = team.for_replica(experiment.scene().memory());
                let (listener, access) = listen(identity.scene_hash, "127.0.0.1:0", None)?;
                let mut workers = LocalWorkers::new(&access, team);
                if is_shared {
                    workers.begin_here(access.clone(), identity.replica(experiment));
                }
                Ok(WorkerEntry { listener, access, workers: Some(workers) })
            }
            Executor::Remote(Remote { listener, access, .. }) => {
                let listener = listener
                    .try_clone()
                    .map_err(|source| Fault::System { doing: "listening for workers", source })?;
                Ok(WorkerEntry { listener, access: access.clone(), workers: None })
            }
        }
    }

    /// The access file by which workers join from elsewhere.
    pub(crate) fn access_file(&self) -> Option<&Path> {
        match self {
            Executor::Local(_) => None,
            Executor::Remote(remote) => Some(&remote.file),
        }
    }
}

/// Where the workers of one job join.
pub(crate) struct WorkerEntry {
    listener: TcpListener,
    access: Access,
    /// Those of this machine, none of which is started yet.
    workers: Option<LocalWorkers>,
}

/// What becomes of the workers of a job that has ended.
pub(crate) struct Left {
    /// Why the job ended.
    pub ending: Ending,
    /// The last thing that went wrong with a worker of this machine.
    pub trouble: String,
    /// The most memory that a worker process of this machine took [bytes], where the system tells.
    pub memory: Option<u64>,
}

impl WorkerEntry {
    /// Leads workers through the walks of a coordinator to their end. `turn` is called at least every 50 ms with what has happened, and says
    /// whether the job goes on.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn lead(
        self,
        coordinator: &mut Coordinator,
        mut turn: impl FnMut(&Coordinator, &[Notice]) -> bool,
    ) -> Result<Left, Fault> {
        let WorkerEntry { listener, access, mut workers } = self;
        let notices = RefCell::new(Vec::new());
        let mut memory = None;
        let owner = |coordinator: &Coordinator| {
            let happened = notices.take();
            let goes_on = turn(coordinator, &happened);
            if coordinator.ending().is_some() {
                // The workers have not heard of the end yet, and are still there.
                memory = workers.as_ref().and_then(LocalWorkers::peak_memory);
                return Wish::Continue;
            }
            if !goes_on || signals::stop_asked() {
                return Wish::Stop;
            }
            let Some(workers) = &mut workers else { return Wish::Continue };
            happened.iter().for_each(|notice| workers.heed(notice));
            if workers.supervise(coordinator.progress().walks) { Wish::Continue } else { Wish::GiveUp }
        };
        let ending = serve(listener, &access, coordinator, owner, |notice| notices.borrow_mut().push(notice))
            .map_err(|source| Fault::System { doing: "serving the workers", source })?;
        let trouble = workers.map_or_else(String::new, |workers| workers.trouble.clone());
        Ok(Left { ending, trouble, memory })
    }
}

/// What the walks came to.
pub(crate) struct LedJob {
    /// The tally of all walks.
    pub tally: Arc<Tally>,
    /// Processor time of the walks [s].
    pub cpu_seconds: f64,
    /// Bytes that came from workers.
    pub received: u64,
    /// The most memory that a worker process took [bytes], where the system tells.
    pub memory: Option<u64>,
}

/// The identity of a job, its budget, and the experiment that its walks score in.
#[derive(Clone, Copy)]
pub(crate) struct WalkJob<'a> {
    pub identity: &'a Identity,
    pub budget: &'a Budget,
    pub experiment: &'a Experiment,
}

/// Walks an experiment on from a past, and asks `judge` at every look; `watch` is called at least every 50 ms.
///
/// # Errors
/// Where the cluster fails, and where a signal ends it.
pub(crate) fn walk(
    executor: &Executor,
    WalkJob { identity, budget, experiment }: WalkJob<'_>,
    past: Past,
    (looks, judge): (Vec<u64>, Judge),
    watch: &mut dyn FnMut(&Coordinator),
) -> Result<LedJob, Fault> {
    let plan = plan(identity, budget, experiment, looks, judge)?;
    let mut coordinator = Coordinator::new(plan, past);
    let is_remote = matches!(executor, Executor::Remote(_));
    if is_remote {
        coordinator = coordinator.followed_by_another();
    }
    let turn = |coordinator: &Coordinator, notices: &[Notice]| {
        watch(coordinator);
        if is_remote {
            notices.iter().for_each(tell_notice);
        }
        true
    };
    let station = executor.station(identity, experiment)?;
    let Left { ending, trouble, memory } = station.lead(&mut coordinator, turn)?;
    match ending {
        Ending::BudgetSpent => {}
        Ending::Interrupted => return Err(Fault::Interrupted),
        Ending::Overflow => return Err(Fault::Overflow),
        Ending::NoWorkers | Ending::Stuck | Ending::TargetReached | Ending::WallClock => {
            return Err(Fault::NoWorkers(trouble));
        }
    }
    let (cpu_seconds, received) = (coordinator.effort().cpu_seconds, coordinator.received());
    Ok(LedJob { tally: coordinator.into_past().tally, cpu_seconds, received, memory })
}

/// The walks of a job up to the last of some looks, at which `judge` is asked.
///
/// # Errors
/// Where the system has no random numbers.
pub(crate) fn plan(
    identity: &Identity,
    budget: &Budget,
    experiment: &Experiment,
    looks: Vec<u64>,
    judge: Judge,
) -> Result<JobPlan, Fault> {
    let lots = random_bytes().map_err(|source| Fault::System { doing: "drawing lots", source })?;
    let lots = u64::from_le_bytes(lots[..8].try_into().expect("eight bytes"));
    Ok(identity.plan(BUILD, budget, experiment, (looks, judge), lots))
}

/// Listens at an address; returns what lets workers of a scene in.
fn listen(
    scene_hash: [u8; 32],
    address: &str,
    advertise: Option<&str>,
) -> Result<(TcpListener, Access), Fault> {
    let (listener, address) = cluster::bind(address, advertise)?;
    signals::keep_memory_private();
    let access = Access::new(address, BUILD, scene_hash)
        .map_err(|source| Fault::System { doing: "drawing a random key", source })?;
    Ok((listener, access))
}
