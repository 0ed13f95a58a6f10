//! The walks of a pilot, by the workers of the run that it is for.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use protocol::{Coordinator, Look, Past};
use radiosity::Tally;
use results::{Groups, PilotBooks, PilotStage, RunOutput, Walked};
use tracing::{info, warn};
use voice::Phase;

use crate::build::BUILD;
use crate::choose::walk_here;
use crate::fault::Fault;
use crate::lead::{Executor, walk};
use crate::signals;

/// Between two times that a pilot is kept: it takes seconds, and no second of it is to be lost.
const INTERVAL: Duration = Duration::from_millis(250);

/// It is kept again after this many times the time that it took.
const RARELY: u32 = 20;

/// The run that a pilot is for.
pub(crate) trait Host {
    /// Claims the folder of the run.
    fn claim(&self) -> Result<RunOutput, Fault>;
    /// Opens what workers of a scene join.
    fn open(&self, scene_hash: [u8; 32]) -> Result<Executor, Fault>;
}

/// Those who walk a pilot.
pub(crate) struct Crew<'a> {
    host: &'a dyn Host,
    phase: &'a Phase,
    resume: bool,
    /// What there is once a stage was long enough for workers.
    camp: Option<Camp>,
}

/// The folder of a run, what is kept of its pilot there, and what its workers have joined.
struct Camp {
    output: RunOutput,
    executor: Executor,
    books: PilotBooks,
}

impl<'a> Crew<'a> {
    /// Those who walk a pilot for a run, and may go on with one that was begun in its folder.
    pub(crate) fn new(host: &'a dyn Host, resume: bool, phase: &'a Phase) -> Self {
        Crew { host, phase, resume, camp: None }
    }

    /// The folder and the workers, which go on with the run; without a run no more workers are let in.
    pub(crate) fn leave(self, is_run: bool) -> (Option<RunOutput>, Option<Executor>) {
        let Some(Camp { output, executor, .. }) = self.camp else { return (None, None) };
        if is_run {
            return (Some(output), Some(executor));
        }
        executor.close();
        (Some(output), None)
    }

    /// Claims the folder, and opens what workers of a scene join.
    fn settle(&mut self, scene_hash: [u8; 32]) -> Result<&mut Camp, Fault> {
        if self.camp.is_none() {
            let output = self.host.claim()?;
            let books = if self.resume { PilotBooks::read(output.folder()) } else { PilotBooks::default() };
            let executor = self.host.open(scene_hash)?;
            self.camp = Some(Camp { output, executor, books });
        }
        Ok(self.camp.as_mut().expect("just made"))
    }

    /// Walks a stage: on threads of this process where it is short, else on those of the workers, from what is kept of it on.
    ///
    /// # Errors
    /// Where the cluster fails, and where a signal ends it.
    pub(crate) fn walk(&mut self, stage: &PilotStage) -> Result<Walked, Fault> {
        if stage.is_short() {
            let walked = walk_here(stage)?;
            return if signals::stop_asked() { Err(Fault::Interrupted) } else { Ok(walked) };
        }
        let identity = stage.identity(BUILD)?;
        let phase = self.phase;
        let Camp { output, executor, books } = self.settle(identity.scene_hash)?;
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
        let (mut due, mut kept) = (Instant::now() + INTERVAL, past.tally.counts.walks);
        let mut keep = |coordinator: &Coordinator| {
            phase.done(coordinator.progress().walks as f64 / stage.walks() as f64);
            let walks = coordinator.prefix().counts.walks;
            let began = Instant::now();
            if walks == kept || (began < due && walks < stage.walks()) {
                return;
            }
            match books.keep(stage, (coordinator.prefix(), &groups.borrow()), output.folder()) {
                Ok(()) => kept = walks,
                Err(error) => warn!("{error}; the pilot goes on without being kept"),
            }
            due = Instant::now() + INTERVAL.max(RARELY * began.elapsed());
        };
        let budget = stage.budget();
        let job = (&identity, &budget, stage.experiment());
        let walked = walk(executor, job, past, (stage.looks(), Box::new(judge)), &mut keep)?;
        let groups = Rc::into_inner(groups).expect("the coordinator and its judge are gone").into_inner();
        Ok(Walked::new(groups, walked.tally))
    }
}

/// What a stage goes on from.
fn past(books: &PilotBooks, stage: &PilotStage) -> (Past, Groups) {
    let none = Past::none(stage.experiment().tally());
    let Some((tally, groups)) = books.past(stage) else { return (none, Groups::none(stage)) };
    info!("the pilot goes on after {} of {} paths", tally.counts.walks, stage.walks());
    (Past { tally, ..none }, groups)
}
