//! The walks of exchange factors, from look to look, and what is kept of them.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use exchange::{Counts, Plan};
use job::Budget;
use radiosity::{ExchangeSpec, Experiment, Segment, Tally, exchange_counts};
use report::OutputFolder;
use serde::{Deserialize, Serialize};

use super::fault::FactorsFault;
use super::question::Question;
use crate::checkpoints::Identity;
use crate::error::Error;
use crate::settings::Settings;

/// What is kept after every look.
pub(super) const COUNTS: &str = "factors.counts.json";

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

/// What was counted, and what it cost.
pub struct Counted {
    pub(super) counts: Counts,
    pub(super) cost: Cost,
    /// Whether a signal ended it.
    pub interrupted: bool,
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

impl Counted {
    /// Whether there is no walk to tell of.
    pub fn is_empty(&self) -> bool {
        self.counts.total() == 0
    }
}

/// Walks until the budget is spent or the tolerance is met; every look is kept in the folder, from which `resume` goes on.
/// `walk` walks a look, and returns nothing where a signal ended it; `watch` is told what part of the walks is done.
///
/// # Errors
/// Those of `walk`, and where counts cannot be read or written.
pub fn count<E: From<Error>>(
    question: &Question,
    build: &str,
    (folder, resume): (&OutputFolder, bool),
    walk: &mut dyn FnMut(Round<'_>) -> Result<Option<Walked>, E>,
    watch: &dyn Fn(f64),
) -> Result<Counted, E> {
    let groups = question.groups.count();
    let budget = question.job.budget.paths;
    let (mut counts, mut cost) = (Counts::none(groups), Cost::default());
    let path = folder.file(COUNTS);
    if resume && path.exists() {
        let kept = read(path, question).map_err(Error::from)?;
        counts.add(&kept.rows);
        cost = kept.cost;
    }
    loop {
        let plan = match counts.total() {
            0 => Plan::pilot(groups, budget),
            _ => Plan::next(&counts, budget, question.tolerance.as_ref()),
        };
        let Some(plan) = plan else { break };
        let spec = beyond(question, &plan, &counts);
        let (before, walks) = (counts.total(), spec.walks());
        let watch = |done| watch((before + done) as f64 / (before + walks) as f64);
        let began = Instant::now();
        let Some(walked) = walk(round(question, spec, build, &watch)?)? else {
            return Ok(Counted { counts, cost, interrupted: true });
        };
        counts.add(&exchange_counts(&walked.tally, groups as u32));
        cost.rays += walked.tally.counts.rays;
        cost.seconds += began.elapsed().as_secs_f64();
        cost.cpu_seconds += walked.cpu_seconds;
        keep(question, &counts, cost, folder)?;
    }
    Ok(Counted { counts, cost, interrupted: false })
}

/// The walks that a plan has beyond what is counted.
fn beyond(question: &Question, plan: &Plan, counts: &Counts) -> ExchangeSpec {
    let Question { groups, kind, .. } = question;
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
    question: &'a Question,
    spec: ExchangeSpec,
    build: &str,
    watch: &'a dyn Fn(u64),
) -> Result<Round<'a>, Error> {
    let Question { job, scene, .. } = question;
    let walks = spec.walks();
    let experiment = Experiment::new(scene.clone(), job.method.walks())?.with_exchange(spec.clone())?;
    let settings = Settings { exchange: Some(spec), ..Settings::of(job) };
    let identity = Identity::new(job, &settings, &experiment, build)?;
    Ok(Round { identity, experiment, budget: &job.budget, walks, watch })
}

/// Writes what was counted.
fn keep(question: &Question, counts: &Counts, cost: Cost, folder: &OutputFolder) -> Result<(), Error> {
    let rows = (0..counts.groups()).map(|i| counts.row(i).to_vec()).collect();
    let kept = Kept { question: digest(question), rows, cost };
    Ok(folder.write(COUNTS, |file| {
        serde_json::to_writer(&mut *file, &kept)?;
        file.write_all(b"\n")
    })?)
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
