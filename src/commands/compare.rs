//! `radwalk compare`: speed against accuracy, for every method that fits a scene.

mod shoot;
mod table;

use std::io::Write;
use std::path::{Path, PathBuf};

use job::Job;
use radiosity::{Experiment, Scene};
use report::OutputFolder;
use report::words::percent;
use serde_json::json;
use studies::compare::contender::{self, Absent, Contender, Trial, contenders};
use studies::compare::measure::{Judged, Point, point};
use studies::compare::page::{self, Chapter, charts};
use studies::compare::truth::Truth;
use studies::compare::{Arena, Team};
use tracing::warn;
use voice::{Phase, emit, say};

use self::shoot::shoot;
use self::table::{TABLE, Table};

use crate::args::CompareArgs;
use crate::choose::load_given;
use crate::commands::coordinate::processes;
use crate::date::today;
use crate::fault::{Fault, Outcome};
use crate::signals;

const PAGE: &str = "compare.md";
/// The charts' folder, beside the page.
const CHARTS: &str = "compare";

/// The sizes of runs, each of which has [`STEP`] times the rays of the one before.
const SIZES: u32 = 3;
const STEP: u64 = 8;

/// Rays of the longest run of a job that names none: enough for its eight chains, 32 rays a patch each.
const LEAST_RAYS: u64 = 1 << 20;
const RAYS_PER_PATCH: u64 = 32 * 8;

/// Compares the methods in the scene of each job; writes page, table and charts.
pub(crate) fn compare(args: &CompareArgs) -> Result<Outcome, Fault> {
    let jobs = args.jobs.iter().map(|path| load(args, path)).collect::<Result<Vec<_>, _>>()?;
    let names: Vec<&str> = jobs.iter().map(|(job, _)| &job.name[..]).collect();
    if let Some(twin) = (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
        return Err(Fault::TwinJobs(names[twin].into()));
    }
    let path = args.out.out.clone().unwrap_or_else(|| PathBuf::from("out/compare"));
    let replace = args.out.force || args.resume;
    let folder = OutputFolder::claim(&path, &[PAGE, TABLE], replace)?;
    let drawings = OutputFolder::claim(&path.join(CHARTS), &[], replace)?;
    let mut table = Table::new(&folder, args.resume)?;
    let team = Team { workers: processes(args.workers), threads: args.threads };
    signals::catch();
    let mut chapters = Vec::new();
    for (path, (job, scene)) in args.jobs.iter().zip(&jobs) {
        let chapter = match study(args, team, Arena { path, set: &args.set, job, scene }, &mut table) {
            Err(Fault::Interrupted) => {
                warn!(
                    "interrupted; {} rows are kept in {}, go on with: {} --resume",
                    table.len(),
                    folder.file(TABLE).display(),
                    command(args)
                );
                return Ok(Outcome::Interrupted);
            }
            chapter => chapter?,
        };
        for (name, chart) in charts(&chapter) {
            drawings.write(&format!("{name}.svg"), |file| file.write_all(chart.svg().as_bytes()))?;
            drawings.write(&format!("{name}.png"), |file| file.write_all(&chart.png()))?;
        }
        chapters.push(chapter);
        let text = page::write(&command(args), &today().to_string(), team, &chapters);
        folder.write(PAGE, |file| file.write_all(text.as_bytes()))?;
    }
    if !args.out.quiet {
        say(&format!("written to {}", folder.file(PAGE).display()));
    }
    Ok(Outcome::Done)
}

/// The command line, as the page shows it.
fn command(args: &CompareArgs) -> String {
    let jobs: Vec<String> = args.jobs.iter().map(|job| job.display().to_string()).collect();
    let rays = args.rays.map_or(String::new(), |rays| format!(" --rays {rays}"));
    let set: String = args.set.iter().map(|set| format!(" --set {set}")).collect();
    let workers = args.workers.map_or(String::new(), |workers| format!(" --workers {workers}"));
    let threads = if args.threads == 1 { String::new() } else { format!(" --threads {}", args.threads) };
    let out = args.out.out.as_ref().map_or(String::new(), |out| format!(" --out {}", out.display()));
    format!("radwalk compare {} --runs {}{rays}{set}{workers}{threads}{out}", jobs.join(" "), args.runs)
}

/// Reads a job, and makes sure that light has a way into its scene.
fn load(args: &CompareArgs, path: &Path) -> Result<(Job, Scene), Fault> {
    let job = load_given(path, &args.set, "compare")?;
    let scene = job.build_scene()?;
    Experiment::new(scene.clone(), job::MethodTable::default().walks())?;
    Ok((job, scene))
}

/// All sizes of all methods in the scene of a job.
fn study(args: &CompareArgs, team: Team, arena: Arena<'_>, table: &mut Table<'_>) -> Result<Chapter, Fault> {
    let Arena { path, job, scene, .. } = arena;
    let patches = scene.faces().len();
    let most = args.rays.unwrap_or(LEAST_RAYS.max(RAYS_PER_PATCH * patches as u64));
    let phase = Phase::begin("computing the reference solution");
    let truths = Truths::new(arena, team, most)?;
    drop(phase);
    let (mut points, mut missing) = (Vec::new(), Vec::new());
    for size in (0..SIZES).rev() {
        let rays = most / STEP.pow(size);
        let (able, absent) = contenders(&arena, rays);
        missing.extend(absent);
        for contender in &able {
            let key = key(&contender.trial, most);
            if let Some(known) = table.find(&key, contender.name, rays, args.runs) {
                points.push(known.clone());
                continue;
            }
            let phase = Phase::begin(contender.name);
            let shot = shoot(team, &contender.trial, args.runs)?;
            drop(phase);
            let fresh = point(crate::build::BUILD, key, rays, contender, &shot, truths.of(contender));
            table.add(fresh.clone())?;
            announce(args, &fresh);
            points.push(fresh);
        }
    }
    // A method that some size has no room for is still compared at others.
    missing.retain(|absent: &Absent| points.iter().all(|point: &Point| point.method != absent.name));
    missing.sort_by_key(|absent| absent.name);
    missing.dedup_by(|a, b| a.name == b.name);
    let order = contender::names();
    points.sort_by_key(|point| (order.iter().position(|name| *name == point.method), point.rays));
    Ok(Chapter {
        job: job.name.clone(),
        path: path.into(),
        size: [patches, scene.surfaces().len()],
        points,
        absent: missing,
        truth: told(&truths.discrete),
        continuous_truth: told(&truths.continuous),
    })
}

/// Names all that a row depends on beside method and rays: the job, and the rays that its reference goes by.
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

/// What errors are measured against, in words.
fn told((truth, judged): &(Truth, Judged)) -> String {
    match judged.own_error(truth) {
        0.0 => truth.how.clone(),
        own => format!("{} (rms {})", truth.how, percent(own.sqrt())),
    }
}

fn announce(args: &CompareArgs, point: &Point) {
    if args.out.json {
        let event = json!({"event": "point", "job": point.job, "method": point.method, "rays": point.rays});
        emit(&event);
    } else if !args.out.quiet {
        let seconds = point.seconds;
        let rms = point.rms().value;
        say(&format!(
            "{}, {}, {} rays: {seconds:.3} s, rms error {rms:.3e}",
            point.job, point.method, point.rays
        ));
    }
}

/// What errors are measured against, and on which patches.
struct Truths {
    discrete: (Truth, Judged),
    continuous: (Truth, Judged),
}

impl Truths {
    fn new(arena: Arena<'_>, team: Team, rays: u64) -> Result<Self, Fault> {
        let shoot = |trial: &Trial| shoot(team, trial, 1);
        let judged = |truth: Truth| {
            let judged = Judged::new(arena.scene, &truth);
            (truth, judged)
        };
        Ok(Truths {
            discrete: judged(Truth::discrete(&arena, rays, shoot)?),
            continuous: judged(Truth::continuous(&arena, rays, shoot)?),
        })
    }

    fn of(&self, contender: &Contender) -> &(Truth, Judged) {
        if contender.is_continuous() { &self.continuous } else { &self.discrete }
    }
}
