//! Walks on worker processes, from the first to the last of some looks.

use std::cell::RefCell;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{Access, Wish, serve};
use job::Budget;
use judge::MOMENTS;
use protocol::{Coordinator, Ending, Judge, Look, Past};
use radiosity::{Experiment, Tally};
use results::Identity;
use tracing::info;

use crate::commands::coordinate::{Door, listen, plan};
use crate::fault::Fault;
use crate::local::LocalWorkers;
use crate::progress::tell_notice;
use crate::signals;

/// For how long workers that look for their next job are told that there is none: they look twice a second.
const PARTING: Duration = Duration::from_millis(1500);

/// Worker processes of this machine.
#[derive(Clone, Copy)]
pub(crate) struct Team {
    /// The number of worker processes.
    pub workers: usize,
    /// The threads of each worker process.
    pub threads: u32,
}

/// The processes that walk.
pub(crate) enum Hands {
    /// Processes of this machine, started for each job.
    Local(Team),
    /// Processes that are started elsewhere, and stay from job to job.
    Remote(Remote),
}

/// A door for workers that are started elsewhere.
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
        access.write(&file).map_err(|source| Fault::AccessFileWrite { path: file.clone(), source })?;
        info!(
            "listening at {}; start workers with: radwalk work --access {}",
            access.address,
            file.display()
        );
        Ok(Remote { listener, access, file })
    }

    fn listener(&self) -> Result<TcpListener, Fault> {
        self.listener.try_clone().map_err(|source| Fault::System { doing: "listening for workers", source })
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
        // Workers find no more under this name. Where the file is gone, or another coordinator's by now, there is nothing to do.
        let _ = self.access.remove(&self.file);
        let nothing_left = plan(identity, budget, experiment, vec![], Box::new(|_, _| Look::default()))?;
        let mut coordinator = Coordinator::new(nothing_left, Past::none(experiment.tally::<MOMENTS>()));
        let began = Instant::now();
        while began.elapsed() < PARTING {
            serve(self.listener()?, &self.access, &mut coordinator, |_| Wish::Continue, |_| {})
                .map_err(|source| Fault::System { doing: "parting with the workers", source })?;
        }
        Ok(())
    }
}

/// What the walks came to.
pub(crate) struct Walked {
    /// The tally of all walks.
    pub tally: Arc<Tally>,
    /// Processor time of the walks [s].
    pub cpu_seconds: f64,
    /// Bytes that came from workers.
    pub received: u64,
    /// The most memory that a worker took [bytes], where the system tells.
    pub memory: Option<u64>,
}

/// Walks an experiment, and asks `judge` at every look; `watch` is told how many walks are in.
///
/// # Errors
/// Where the cluster fails, and where a signal ends it.
pub(crate) fn walk(
    hands: &Hands,
    identity: &Identity,
    budget: &Budget,
    experiment: &Experiment,
    (looks, judge): (Vec<u64>, Judge),
    watch: &dyn Fn(u64),
) -> Result<Walked, Fault> {
    let plan = plan(identity, budget, experiment, looks, judge)?;
    let mut coordinator = Coordinator::new(plan, Past::none(experiment.tally::<MOMENTS>()));
    let (listener, access, mut workers) = match hands {
        Hands::Local(team) => {
            let door = Door::open(identity, *team)?;
            (door.listener, door.access, Some(door.workers))
        }
        Hands::Remote(remote) => {
            coordinator = coordinator.followed_by_another();
            (remote.listener()?, remote.access.clone(), None)
        }
    };
    let notices = RefCell::new(Vec::new());
    let mut memory = None;
    let owner = |coordinator: &Coordinator| {
        watch(coordinator.progress().walks);
        let notices: Vec<_> = notices.borrow_mut().drain(..).collect();
        match &mut workers {
            Some(workers) => notices.iter().for_each(|notice| workers.heed(notice)),
            None => notices.iter().for_each(tell_notice),
        }
        if coordinator.ending().is_some() {
            // The workers have not heard of the end yet, and are still there.
            memory = workers.as_ref().and_then(LocalWorkers::peak_memory);
        } else if signals::stop_asked() {
            return Wish::Stop;
        } else if workers.as_mut().is_some_and(|workers| !workers.tend(coordinator.progress().walks)) {
            return Wish::GiveUp;
        }
        Wish::Continue
    };
    let tell = |notice| notices.borrow_mut().push(notice);
    let ending = serve(listener, &access, &mut coordinator, owner, tell)
        .map_err(|source| Fault::System { doing: "serving the workers", source })?;
    match ending {
        Ending::BudgetSpent => {}
        Ending::Interrupted => return Err(Fault::Interrupted),
        Ending::Overflow => return Err(Fault::Overflow),
        Ending::NoWorkers | Ending::Stuck | Ending::TargetReached | Ending::WallClock => {
            return Err(Fault::NoWorkers(
                workers.map_or_else(String::new, |workers| workers.trouble.clone()),
            ));
        }
    }
    let (cpu_seconds, received) = (coordinator.effort().cpu_seconds, coordinator.received());
    Ok(Walked { tally: coordinator.into_past().tally, cpu_seconds, received, memory })
}
