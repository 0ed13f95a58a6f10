//! The walks of exchange factors, from look to look, and what is kept of them.

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use exchange::{Counts, Plan};
use protocol::Look;
use radiosity::{ExchangeSpec, Experiment, Segment, Tally, exchange_counts};
use report::OutputFolder;
use results::{Identity, Settings};
use serde::{Deserialize, Serialize};
use studies::compare::Team;
use voice::Phase;

use super::fault::FactorsFault;
use super::question::Question;
use crate::build::BUILD;
use crate::fault::Fault;
use crate::team::walk;

/// What is kept after every look.
pub(super) const COUNTS: &str = "factors.counts.json";

/// What was counted, and what it cost.
pub(super) struct Counted {
    pub(super) counts: Counts,
    pub(super) cost: Cost,
    /// Whether a signal ended it.
    pub(super) interrupted: bool,
}

/// What walks have cost.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Cost {
    pub(super) rays: u64,
    pub(super) seconds: f64,
    pub(super) cpu_seconds: f64,
}

/// The contents of the file [`COUNTS`].
#[derive(Serialize, Deserialize)]
struct Kept {
    /// Digest of what was asked.
    question: String,
    rows: Vec<Vec<u64>>,
    cost: Cost,
}

/// Walks until the budget is spent or the tolerance is met; every look is kept.
pub(super) fn count(
    question: &Question,
    team: Team,
    folder: &OutputFolder,
    resume: bool,
) -> Result<Counted, Fault> {
    let groups = question.groups.count();
    let budget = question.job.budget.paths;
    let (mut counts, mut cost) = (Counts::none(groups), Cost::default());
    let path = folder.file(COUNTS);
    if resume && path.exists() {
        let kept = read(path, question)?;
        counts.add(&kept.rows);
        cost = kept.cost;
    }
    let phase = Phase::begin("counting walks between groups");
    loop {
        let plan = match counts.total() {
            0 => Plan::pilot(groups, budget),
            _ => Plan::next(&counts, budget, question.tolerance.as_ref()),
        };
        let Some(plan) = plan else { break };
        match look(question, team, (&plan, &counts), &|part| phase.done(part)) {
            Ok((rows, of_look)) => {
                counts.add(&rows);
                cost.rays += of_look.rays;
                cost.seconds += of_look.seconds;
                cost.cpu_seconds += of_look.cpu_seconds;
            }
            Err(Fault::Interrupted) => return Ok(Counted { counts, cost, interrupted: true }),
            Err(fault) => return Err(fault),
        }
        let rows = (0..groups).map(|i| counts.row(i).to_vec()).collect();
        let kept = Kept { question: digest(question), rows, cost };
        folder.write(COUNTS, |file| {
            serde_json::to_writer(&mut *file, &kept)?;
            file.write_all(b"\n")
        })?;
    }
    Ok(Counted { counts, cost, interrupted: false })
}

/// The walks that a plan has beyond what is counted, as one job of the cluster; `watch` is told what part of the plan is done.
fn look(
    question: &Question,
    team: Team,
    (plan, counts): (&Plan, &Counts),
    watch: &dyn Fn(f64),
) -> Result<(Vec<Vec<u64>>, Cost), Fault> {
    let Question { job, scene, groups, kind, .. } = question;
    let segment = |(group, &walks): (usize, &u64)| {
        let first = counts.walks(group);
        Segment { group: group as u32, first, walks: walks - first }
    };
    let segments = plan.walks().iter().enumerate().map(segment).filter(|segment| segment.walks > 0);
    let number = groups.count() as u32;
    let spec = ExchangeSpec {
        kind: *kind,
        group_of_face: groups.of_face.clone(),
        groups: number,
        segments: segments.collect(),
    };
    let walks = spec.walks();
    let experiment = Experiment::new(scene.clone(), job.method.walks())?.with_exchange(spec.clone())?;
    let settings = Settings { exchange: Some(spec), ..Settings::of(job) };
    let identity = Identity::new(job, &settings, &experiment, BUILD)?;
    let judge = |prefix: &Tally, _: &[Look]| {
        let counts = prefix.counts;
        Look { walks: counts.walks, rays: counts.rays, ..Look::default() }
    };
    let began = Instant::now();
    let whole = (counts.total() + walks) as f64;
    let watch = |walks| watch((counts.total() + walks) as f64 / whole);
    let walked = walk(team, &identity, &job.budget, &experiment, (vec![walks], Box::new(judge)), &watch)?;
    let seconds = began.elapsed().as_secs_f64();
    let cost = Cost { rays: walked.tally.counts.rays, seconds, cpu_seconds: walked.cpu_seconds };
    Ok((exchange_counts(&walked.tally, number), cost))
}

/// What was kept of the same question.
fn read(path: PathBuf, question: &Question) -> Result<Kept, FactorsFault> {
    let text = std::fs::read(&path);
    let unreadable = |reason: String| FactorsFault::UnreadableCounts { path: path.clone(), reason };
    let kept: Kept = serde_json::from_slice(&text.map_err(|error| unreadable(error.to_string()))?)
        .map_err(|error| unreadable(error.to_string()))?;
    let columns = question.groups.count() + 2;
    let fits = kept.rows.len() + 2 == columns
        && kept.rows.iter().all(|row| {
            let walks = row.iter().fold(0_u64, |sum, count| sum.saturating_add(*count));
            row.len() == columns && walks.is_power_of_two()
        });
    match kept.question == digest(question) {
        true if fits => Ok(kept),
        true => Err(unreadable("its rows are not those of the groups".into())),
        false => Err(FactorsFault::OtherCounts { path }),
    }
}

/// Digest of all that the counts of given walks depend on.
fn digest(question: &Question) -> String {
    let Question { job, scene, groups, kind, .. } = question;
    let all = serde_json::to_vec(&(scene.hash(), job.seed, kind, job.method.space, &groups.of_face));
    blake3::hash(&all.expect("numbers and words")).to_hex().to_string()
}
