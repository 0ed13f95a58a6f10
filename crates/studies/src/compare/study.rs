//! All sizes of all methods in the scene of a job.

use super::Arena;
use super::contender::{Absent, Trial, contenders, names};
use super::measure::{Point, point};
use super::page::Chapter;
use super::shot::Shot;
use super::truths::Truths;

/// The sizes of runs, each of which has [`STEP`] times the rays of the one before.
const SIZES: u32 = 3;
const STEP: u64 = 8;

/// Rays of the longest run where none are asked for: enough for its eight chains, 32 rays a patch each.
const LEAST_RAYS: u64 = 1 << 20;
const RAYS_PER_PATCH: u64 = 32 * 8;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// The rays of the longest runs, where they are asked for.
    pub rays: Option<u64>,
    /// The runs of every method and size.
    pub runs: usize,
    /// The build that measures.
    pub build: &'static str,
}

/// What a study asks of its caller: processes that walk, and a table that keeps points.
pub trait Bench {
    /// Why it cannot go on.
    type Error;

    /// Is told what takes its time from now on.
    fn begin(&mut self, what: &'static str);

    /// Is told that it is done.
    fn end(&mut self);

    /// Walks a trial in a number of runs.
    ///
    /// # Errors
    /// If the processes fail.
    fn shoot(&mut self, trial: &Trial, runs: usize) -> Result<Shot, Self::Error>;

    /// A point that was measured before.
    fn known(&self, key: &str, method: &str, rays: u64) -> Option<Point>;

    /// Keeps a point that has been measured.
    ///
    /// # Errors
    /// If it cannot be kept.
    fn keep(&mut self, point: &Point) -> Result<(), Self::Error>;
}

/// Measures all sizes of all methods in the scene of a job.
///
/// # Errors
/// Those of the bench.
pub fn study<B: Bench>(arena: Arena<'_>, course: Course, bench: &mut B) -> Result<Chapter, B::Error> {
    let Arena { path, job, scene, .. } = arena;
    let patches = scene.faces().len();
    let most = course.rays.unwrap_or(LEAST_RAYS.max(RAYS_PER_PATCH * patches as u64));
    bench.begin("computing the reference solution");
    let truths = Truths::new(arena, most, |trial| bench.shoot(trial, 1))?;
    bench.end();
    let (mut points, mut missing) = (Vec::new(), Vec::new());
    for size in (0..SIZES).rev() {
        let rays = most / STEP.pow(size);
        let (able, absent) = contenders(&arena, rays);
        missing.extend(absent);
        for contender in &able {
            let key = key(&contender.trial, most);
            if let Some(known) = bench.known(&key, contender.name, rays) {
                points.push(known);
                continue;
            }
            bench.begin(contender.name);
            let shot = bench.shoot(&contender.trial, course.runs)?;
            bench.end();
            let fresh = point(course.build, key, rays, contender, &shot, truths.of(contender));
            bench.keep(&fresh)?;
            points.push(fresh);
        }
    }
    // A method that some size has no room for is still compared at others.
    missing.retain(|absent: &Absent| points.iter().all(|point: &Point| point.method != absent.name));
    missing.sort_by_key(|absent| absent.name);
    missing.dedup_by(|a, b| a.name == b.name);
    let order = names();
    points.sort_by_key(|point| (order.iter().position(|name| *name == point.method), point.rays));
    let [truth, continuous_truth] = truths.words();
    Ok(Chapter {
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
