//! The walks of a pilot, by the workers of the run that it is for.

use std::cell::RefCell;
use std::rc::Rc;

use protocol::{Coordinator, Look, Past};
use radiosity::Tally;
use report::OutputFolder;
use results::{EndedGroups, PilotBooks, PilotRunner, PilotStage, RunOutput, StageResult};
use tracing::{info, warn};
use voice::Phase;

use crate::build::BUILD;
use crate::choose::walk_here;
use crate::fault::Fault;
use crate::keeping::Keeping;
use crate::lead::{Executor, WalkJob, walk};
use crate::signals;

/// The run that a pilot is for.
pub(crate) trait Host {
    /// Claims the folder of the run.
    fn claim(&self) -> Result<RunOutput, Fault>;
    /// Opens what workers of a scene join.
    fn open(&self, scene_hash: [u8; 32]) -> Result<Executor, Fault>;
}

/// The worker processes that trace the walks of a pilot.
pub(crate) struct PilotWorkers<'a> {
    host: &'a dyn Host,
    phase: &'a Phase,
    resume: bool,
    camp: Option<Camp>,
}

/// The folder of a run and what is kept of its pilot there. Workers join once a stage is long enough for them.
struct Camp {
    output: RunOutput,
    books: PilotBooks,
    executor: Option<Executor>,
}

impl<'a> PilotWorkers<'a> {
    /// Those who walk a pilot for a run, and may go on with one that was begun in its folder.
    pub(crate) fn new(host: &'a dyn Host, resume: bool, phase: &'a Phase) -> Self {
        PilotWorkers { host, phase, resume, camp: None }
    }

    /// The folder and the workers, which go on with the run; without a run no more workers are let in.
    pub(crate) fn leave(self, is_run: bool) -> (Option<RunOutput>, Option<Executor>) {
        let Some(Camp { output, executor, .. }) = self.camp else { return (None, None) };
        if is_run {
            return (Some(output), executor);
        }
        (Some(output), None)
    }

    /// Claims the folder.
    fn settle(&mut self) -> Result<&mut Camp, Fault> {
        if self.camp.is_none() {
            let output = self.host.claim()?;
            let books = if self.resume { PilotBooks::read(output.folder()) } else { PilotBooks::default() };
            self.camp = Some(Camp { output, books, executor: None });
        }
        Ok(self.camp.as_mut().expect("just made"))
    }
}

impl PilotRunner<Fault> for PilotWorkers<'_> {
    /// Walks a stage: on threads of this process where it is short, else on those of the workers, from what is kept of it on.
    ///
    /// # Errors
    /// Where the cluster fails, and where a signal ends it.
    fn walk(&mut self, stage: &PilotStage) -> Result<StageResult, Fault> {
        if stage.is_short() {
            let walked = walk_here(stage)?;
            return if signals::stop_asked() { Err(Fault::Interrupted) } else { Ok(walked) };
        }
        let identity = stage.identity(BUILD)?;
        let (phase, host) = (self.phase, self.host);
        let Camp { output, books, executor } = self.settle()?;
        let executor = match executor {
            Some(executor) => executor,
            none => none.insert(host.open(identity.scene_hash)?),
        };
        if let Some(walked) = books.walked(stage) {
            return Ok(walked);
        }
        let (past, groups) = past(books, stage);
        let groups = Rc::new(RefCell::new(groups));
        let judge = {
            let groups = groups.clone();
            move |prefix: &Tally, _: &[Look]| {
                groups.borrow_mut().end_next(prefix);
                Look { walks: prefix.counts.walks, rays: prefix.counts.rays, ..Look::default() }
            }
        };
        let mut keeping = Keeping::new(stage.walks(), past.tally.counts.walks);
        let mut keep = |coordinator: &Coordinator| {
            phase.done(coordinator.progress().walks as f64 / stage.walks() as f64);
            let prefix = coordinator.prefix();
            let keep = || books.keep(stage, (prefix, &groups.borrow()), output.folder());
            keeping.keep(prefix.counts.walks, keep);
        };
        let budget = stage.budget();
        let job = WalkJob { identity: &identity, budget: &budget, experiment: stage.experiment() };
        let walked = walk(executor, job, past, (stage.looks(), Box::new(judge)), &mut keep)?;
        phase.goes_on();
        let groups = Rc::into_inner(groups).expect("the coordinator and its judge are gone").into_inner();
        Ok(StageResult::new(groups, walked.tally))
    }

    fn books(&mut self) -> Result<Option<(&mut PilotBooks, &OutputFolder)>, Fault> {
        let Camp { output, books, .. } = self.settle()?;
        Ok(Some((books, output.folder())))
    }

    fn has_past(&self) -> bool {
        self.resume
    }

    fn trouble(&mut self, error: results::Error) {
        warn!("{error}; the choice of patches goes on without being kept");
    }
}

/// What a stage goes on from.
fn past(books: &PilotBooks, stage: &PilotStage) -> (Past, EndedGroups) {
    let none = Past::none(stage.experiment().tally());
    let Some((tally, groups)) = books.past(stage) else { return (none, EndedGroups::none(stage)) };
    info!("the pilot goes on after {} of {} paths", tally.counts.walks, stage.walks());
    (Past { tally, ..none }, groups)
}
