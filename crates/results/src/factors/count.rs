//! The walks of exchange factors, from look to look, and what is kept of them.

use std::sync::Arc;
use std::time::Instant;

use exchange::{ExchangeCounts, WalkPlan};
use job::Budget;
use radiosity::{
    Experiment, Tally,
    exchange::{ExchangeSpec, Segment, exchange_counts},
};
use report::OutputFolder;

use super::counted::{COUNTS, Cost, Counted};
use super::kept::KeptCounts;
use super::question::FactorsQuestion;
use crate::checkpoints::Identity;
use crate::error::Error;
use crate::settings::Settings;

/// The walks of one look, for the processes of the caller.
pub struct Round<'a> {
    /// The job of these walks, as it travels.
    pub identity: Identity,
    /// The experiment whose walks they are.
    pub experiment: Experiment,
    /// The budget of the whole job.
    pub budget: &'a Budget,
    /// The number of walks.
    pub walks: u64,
    /// Is told how many walks are in.
    pub watch: &'a dyn Fn(u64),
}

/// What the walks of a look came to.
pub struct Walked {
    /// The tally of all of them.
    pub tally: Arc<Tally>,
    /// The processor time of the walks [s].
    pub cpu_seconds: f64,
}

/// Walks until the budget is spent or the tolerance is met; every look is kept in the folder, from which `resume` goes on.
/// `walk` walks a look, and returns nothing where a signal ended it; `watch` is told what part of the walks is done.
///
/// # Errors
/// Those of `walk`, and where counts cannot be read or written.
pub fn count<E: From<Error>>(
    question: &FactorsQuestion,
    build: &str,
    (folder, resume): (&OutputFolder, bool),
    walk: &mut dyn FnMut(Round<'_>) -> Result<Option<Walked>, E>,
    watch: &dyn Fn(f64),
) -> Result<Counted, E> {
    let groups = question.groups.count();
    let budget = question.job.budget.paths;
    let seeds = vec![question.job.seed];
    let (mut counts, mut cost) = (ExchangeCounts::none(groups), Cost::default());
    let path = folder.file(COUNTS);
    if resume && path.exists() {
        let kept = KeptCounts::of_question(&path, question).map_err(Error::from)?;
        counts.add(&kept.rows);
        cost = kept.cost;
    }
    loop {
        let plan = match counts.total() {
            0 => WalkPlan::pilot(groups, budget),
            _ => WalkPlan::next(&counts, budget, question.tolerance.as_ref()),
        };
        let Some(plan) = plan else { break };
        let spec = beyond(question, &plan, &counts);
        let (before, walks) = (counts.total(), spec.walks());
        let watch = |done| watch((before + done) as f64 / (before + walks) as f64);
        let began = Instant::now();
        let Some(walked) = walk(round(question, spec, build, &watch)?)? else {
            return Ok(Counted { seeds, counts, cost, interrupted: true });
        };
        counts.add(&exchange_counts(&walked.tally, groups as u32));
        cost.add(Cost {
            rays: walked.tally.counts.rays,
            seconds: began.elapsed().as_secs_f64(),
            cpu_seconds: walked.cpu_seconds,
        });
        KeptCounts::new(question, &counts, cost).write(folder)?;
    }
    Ok(Counted { seeds, counts, cost, interrupted: false })
}

/// The walks that a plan has beyond what is counted.
fn beyond(question: &FactorsQuestion, plan: &WalkPlan, counts: &ExchangeCounts) -> ExchangeSpec {
    let FactorsQuestion { groups, kind, .. } = question;
    let segment = |(group, &walks): (usize, &u64)| {
        let first = counts.walks(group);
        Segment { group: group as u32, first, walks: walks - first }
    };
    let segments = plan.walks().iter().enumerate().map(segment).filter(|segment| segment.walks > 0);
    ExchangeSpec {
        kind: *kind,
        group_of_face: groups.of_face.clone(),
        groups: groups.count() as u32,
        segments: segments.collect(),
    }
}

/// Walks as one job of the cluster.
fn round<'a>(
    question: &'a FactorsQuestion,
    spec: ExchangeSpec,
    build: &str,
    watch: &'a dyn Fn(u64),
) -> Result<Round<'a>, Error> {
    let FactorsQuestion { job, scene, .. } = question;
    let walks = spec.walks();
    let experiment = Experiment::new(scene.clone(), job.method.walks())?.with_exchange(spec.clone())?;
    let settings = Settings { exchange: Some(spec), ..Settings::of(job) };
    let identity = Identity::new(job, &settings, &experiment, build)?;
    Ok(Round { identity, experiment, budget: &job.budget, walks, watch })
}
