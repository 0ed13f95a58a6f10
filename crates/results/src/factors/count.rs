//! The walks of exchange factors, from look to look, and what is kept of them.

use exchange::{ExchangeCounts, WalkPlan};
use radiosity::{
    Experiment, Tally,
    exchange::{ExchangeSpec, Segment, exchange_counts},
};
use report::OutputFolder;

use super::answer::FILES;
use super::counted::{COUNTS, Counted};
use super::question::FactorsQuestion;
use super::stored::FactorCounts;
use crate::error::Error;
use crate::rounds::{Cost, Round, RoundCounts, RoundPlan, RoundResult, walk_rounds};
use crate::settings::Settings;

/// Walks until the budget is spent or the tolerance is met; every look is kept in the folder, from which `resume` goes on.
/// `walk` walks a look, and returns nothing where a signal ended it; `watch` is told what part of the walks is done.
///
/// # Errors
/// Those of `walk`, and where counts cannot be read or written.
pub fn count<E: From<Error>>(
    question: &FactorsQuestion,
    build: &str,
    (folder, resume): (&OutputFolder, bool),
    walk: &mut dyn FnMut(Round<'_>) -> Result<Option<RoundResult>, E>,
    watch: &dyn Fn(f64),
) -> Result<Counted, E> {
    let groups = question.groups.count();
    let mut looks = FactorsRounds { question, counts: ExchangeCounts::none(groups), cost: Cost::default() };
    let path = folder.file(COUNTS);
    if resume && path.exists() {
        let kept = FactorCounts::of_question(&path, question).map_err(Error::from)?;
        looks.counts.add(&kept.rows);
        looks.cost = kept.cost;
    }
    let replaced: &[&str] = if resume { &[] } else { &FILES };
    let done = walk_rounds(&mut looks, (&question.job, build), (folder, replaced), walk, watch)?;
    let FactorsRounds { counts, cost, .. } = looks;
    Ok(Counted { seeds: vec![question.job.seed], counts, cost, interrupted: !done })
}

/// The counts of a question, look by look.
struct FactorsRounds<'a> {
    question: &'a FactorsQuestion,
    counts: ExchangeCounts,
    cost: Cost,
}

impl RoundCounts for FactorsRounds<'_> {
    fn next(&mut self) -> Result<Option<RoundPlan>, Error> {
        let FactorsQuestion { job, scene, groups, tolerance, .. } = self.question;
        let budget = job.budget.paths;
        let plan = match self.counts.total() {
            0 => WalkPlan::pilot(groups.count(), budget),
            _ => WalkPlan::next(&self.counts, budget, tolerance.as_ref()),
        };
        let Some(plan) = plan else { return Ok(None) };
        let spec = beyond(self.question, &plan, &self.counts);
        let (before, walks) = (self.counts.total(), spec.walks());
        let experiment = Experiment::new(scene.clone(), job.method.walks())?.with_exchange(spec.clone())?;
        let settings = Settings { exchange: Some(spec), ..Settings::of(job) };
        let parts = [before as f64 / (before + walks) as f64, 1.0];
        Ok(Some(RoundPlan { experiment, settings, walks, parts }))
    }

    fn add(&mut self, tally: &Tally, cost: Cost) {
        self.counts.add(&exchange_counts(tally, self.question.groups.count() as u32));
        self.cost.add(cost);
    }

    fn keep(&self, folder: &OutputFolder) -> Result<(), Error> {
        FactorCounts::new(self.question, &self.counts, self.cost).write(folder)
    }
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
