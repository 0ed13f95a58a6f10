//! Walks on worker processes of this machine, from the first to the last of some looks.

use std::cell::RefCell;
use std::sync::Arc;

use cluster::{Wish, serve};
use job::Budget;
use judge::MOMENTS;
use protocol::{Coordinator, Ending, Judge, Past};
use radiosity::{Experiment, Tally};
use results::Identity;
use studies::compare::Team;

use crate::commands::coordinate::{Door, plan};
use crate::fault::Fault;
use crate::signals;

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

/// Walks an experiment on the processes of a team, and asks `judge` at every look; `watch` is told how many walks are in.
///
/// # Errors
/// Where the cluster fails, and where a signal ends it.
pub(crate) fn walk(
    team: Team,
    identity: &Identity,
    budget: &Budget,
    experiment: &Experiment,
    (looks, judge): (Vec<u64>, Judge),
    watch: &dyn Fn(u64),
) -> Result<Walked, Fault> {
    let plan = plan(identity, budget, experiment, looks, judge)?;
    let mut coordinator = Coordinator::new(plan, Past::none(experiment.tally::<MOMENTS>()));
    let mut door = Door::open(identity, team)?;
    let notices = RefCell::new(Vec::new());
    let mut memory = None;
    let owner = |coordinator: &Coordinator| {
        watch(coordinator.progress().walks);
        notices.borrow_mut().drain(..).for_each(|notice| door.workers.heed(&notice));
        if coordinator.ending().is_some() {
            // The workers have not heard of the end yet, and are still there.
            memory = door.workers.peak_memory();
        } else if signals::stop_asked() {
            return Wish::Stop;
        } else if !door.workers.tend(coordinator.progress().walks) {
            return Wish::GiveUp;
        }
        Wish::Continue
    };
    let tell = |notice| notices.borrow_mut().push(notice);
    let ending = serve(door.listener, &door.access, &mut coordinator, owner, tell)
        .map_err(|source| Fault::System { doing: "serving the workers", source })?;
    match ending {
        Ending::BudgetSpent => {}
        Ending::Interrupted => return Err(Fault::Interrupted),
        Ending::Overflow => return Err(Fault::Overflow),
        Ending::NoWorkers | Ending::Stuck | Ending::TargetReached | Ending::WallClock => {
            return Err(Fault::NoWorkers(door.workers.trouble.clone()));
        }
    }
    let (cpu_seconds, received) = (coordinator.effort().cpu_seconds, coordinator.received());
    Ok(Walked { tally: coordinator.into_past().tally, cpu_seconds, received, memory })
}
