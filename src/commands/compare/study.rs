//! All sizes of all methods in the scene of a job.

use voice::Phase;

use super::contender::{Absent, Arena, Trial, contenders, names};
use super::measure::{ContenderResult, point};
use super::page::JobChapter;
use super::shoot::shoot;
use super::table::ResultTable;
use super::truths::Truths;
use crate::fault::Fault;
use crate::team::Team;

/// The sizes of runs, each of which has [`STEP`] times the rays of the one before.
const SIZES: u32 = 3;
const STEP: u64 = 8;

/// Rays of the longest run where none are asked for: enough for its eight chains, 32 rays a patch each.
const LEAST_RAYS: u64 = 1 << 20;
const RAYS_PER_PATCH: u64 = 32 * 8;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StudySize {
    /// The rays of the longest runs, where they are asked for.
    pub rays: Option<u64>,
    /// The runs of every method and size.
    pub runs: usize,
}

/// What a study works with: the processes that walk, the table that keeps points, and who hears of them.
pub(crate) struct Bench<'a> {
    /// The processes that walk.
    pub team: Team,
    /// The points so far.
    pub table: ResultTable<'a>,
    /// Hears of each point that has been measured.
    pub announce: &'a dyn Fn(&ContenderResult),
}

/// Measures all sizes of all methods in the scene of a job.
///
/// # Errors
/// If the cluster fails, a row cannot be kept, or a signal ends it.
pub(crate) fn study(arena: Arena<'_>, of: StudySize, bench: &mut Bench<'_>) -> Result<JobChapter, Fault> {
    let Arena { path, job, scene, .. } = arena;
    let patches = scene.faces().len();
    let most = of.rays.unwrap_or(LEAST_RAYS.max(RAYS_PER_PATCH * patches as u64));
    let phase = Phase::begin("computing the reference solution");
    let truths = Truths::new(arena, most, |trial| shoot(bench.team, trial, 1))?;
    drop(phase);
    let (mut points, mut missing) = (Vec::new(), Vec::new());
    for size in (0..SIZES).rev() {
        let rays = most / STEP.pow(size);
        let (able, absent) = contenders(&arena, rays);
        missing.extend(absent);
        for contender in &able {
            let key = key(&contender.trial, most);
            if let Some(known) = bench.table.find(&key, contender.name, rays, of.runs) {
                points.push(known.clone());
                continue;
            }
            let phase = Phase::begin(contender.name);
            let shot = shoot(bench.team, &contender.trial, of.runs)?;
            drop(phase);
            let fresh = point(key, rays, contender, &shot, truths.of(contender));
            bench.table.add(fresh.clone())?;
            (bench.announce)(&fresh);
            points.push(fresh);
        }
    }
    // A method that some size has no room for is still compared at others.
    missing
        .retain(|absent: &Absent| points.iter().all(|point: &ContenderResult| point.method != absent.name));
    missing.sort_by_key(|absent| absent.name);
    missing.dedup_by(|a, b| a.name == b.name);
    let order = names();
    points.sort_by_key(|point| (order.iter().position(|name| *name == point.method), point.rays));
    let [truth, continuous_truth] = truths.words();
    Ok(JobChapter {
        job: job.name.clone(),
        path: path.into(),
        size: [patches, scene.surfaces().len()],
        points,
        absent: missing,
        truth,
        continuous_truth,
    })
}

/// Names all that a point depends on beside method and rays: the job, and the rays that its reference goes by.
fn key(Trial { job, experiment }: &Trial, most: u64) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&job::job_hash(
        experiment.scene().hash(),
        &job.method,
        job.scene.sensors(),
        [&job.sources, &job.sensitivity],
        job.seed,
    ));
    hasher.update(&most.to_le_bytes());
    hasher.finalize().to_hex()[..16].to_string()
}
