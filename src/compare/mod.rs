//! `radwalk compare`: speed against accuracy, for every method that fits a scene.

mod contender;
mod judge;
mod measure;
mod page;
mod truth;

use std::io::Write;
use std::path::{Path, PathBuf};

use job::Job;
use radiosity::Scene;
use report::OutputFolder;
use serde_json::json;

use self::contender::{Absent, Contender, contenders, load};
use self::measure::{Judged, Point, Record};
use self::page::{Chapter, charts, page};
use self::truth::Truth;
use crate::args::CompareArgs;
use crate::console::{say, tell};
use crate::date::today;
use crate::fault::{Fault, Outcome};
use crate::progress::percent;

const PAGE: &str = "compare.md";
const TABLE: &str = "compare.csv";
/// The charts' folder, beside the page.
const CHARTS: &str = "compare";

/// Each of so many sizes has this many times the rays of the one before.
const SIZES: u32 = 3;
const STEP: u64 = 8;

/// Rays of the longest run of a job that names none: enough for chains, which take 32 rays a patch each.
const LEAST_RAYS: u64 = 1 << 20;
const RAYS_PER_PATCH: u64 = 32 * contender::CHAINS;

/// Compares the methods in the scene of each job; writes page, table and charts.
pub fn compare(args: &CompareArgs) -> Result<Outcome, Fault> {
    let path = args.out.out.clone().unwrap_or_else(|| PathBuf::from("out/compare"));
    let replace = args.out.force || args.resume;
    let folder = OutputFolder::claim(&path, &[PAGE, TABLE], replace)?;
    let drawings = OutputFolder::claim(&path.join(CHARTS), &[], replace)?;
    let mut table = Table::new(&folder, args.resume)?;
    let mut chapters = Vec::new();
    for job in &args.jobs {
        let chapter = study(args, job, &mut table)?;
        for (name, chart) in charts(&chapter) {
            drawings.write(&format!("{name}.svg"), |file| file.write_all(chart.svg().as_bytes()))?;
            drawings.write(&format!("{name}.png"), |file| file.write_all(&chart.png()))?;
        }
        chapters.push(chapter);
        let text = page(&command(args), &today().to_string(), &chapters);
        folder.write(PAGE, |file| file.write_all(text.as_bytes()))?;
    }
    if !args.out.quiet {
        say(&format!("written to {}", folder.file(PAGE).display()));
    }
    Ok(Outcome::Done)
}

/// What was typed, as far as it enters the answer.
fn command(args: &CompareArgs) -> String {
    let jobs: Vec<String> = args.jobs.iter().map(|job| job.display().to_string()).collect();
    let rays = args.rays.map_or(String::new(), |rays| format!(" --rays {rays}"));
    let set: String = args.set.iter().map(|set| format!(" --set {set}")).collect();
    format!("radwalk compare {} --runs {}{rays}{set}", jobs.join(" "), args.runs)
}

/// The rows that are there, kept in the file as they come.
struct Table<'a> {
    folder: &'a OutputFolder,
    points: Vec<Point>,
}

impl<'a> Table<'a> {
    fn new(folder: &'a OutputFolder, resume: bool) -> Result<Self, Fault> {
        let file = folder.file(TABLE);
        let unreadable = |source| Fault::Table { path: file.clone(), source };
        let points = match resume && file.exists() {
            true => {
                csv::Reader::from_path(&file).map_err(unreadable)?.deserialize().collect::<Result<_, _>>()
            }
            false => Ok(Vec::new()),
        };
        Ok(Table { folder, points: points.map_err(unreadable)? })
    }

    fn find(&self, key: &str, method: &str, rays: u64, runs: usize) -> Option<Point> {
        let is_it = |p: &&Point| (&p.key[..], &p.method[..], p.rays, p.runs) == (key, method, rays, runs);
        self.points.iter().find(is_it).cloned()
    }

    fn add(&mut self, new: &[Point]) -> Result<(), Fault> {
        self.points.extend(new.iter().cloned());
        Ok(self.folder.write(TABLE, |file| {
            let mut writer = csv::Writer::from_writer(file);
            self.points.iter().try_for_each(|point| writer.serialize(point))?;
            writer.flush()
        })?)
    }
}

/// All sizes of all methods in the scene of a job.
fn study(args: &CompareArgs, path: &Path, table: &mut Table<'_>) -> Result<Chapter, Fault> {
    let (job, scene) = load(args, path)?;
    let patches = scene.patches().len();
    let most = args.rays.unwrap_or(LEAST_RAYS.max(RAYS_PER_PATCH * patches as u64));
    let truths = Truths::new(&job, &scene, most);
    let key = blake3::Hash::from_bytes(scene.hash()).to_hex()[..16].to_string();
    let (mut points, mut missing) = (Vec::new(), Vec::new());
    for size in (0..SIZES).rev() {
        let rays = most / STEP.pow(size);
        let (able, absent) = contenders(args, path, &scene, rays);
        missing.extend(absent);
        let known = |contender: &Contender| table.find(&key, contender.name, rays, args.runs);
        let (old, new): (Vec<_>, Vec<_>) = able
            .into_iter()
            .map(|contender| (known(&contender), contender))
            .partition(|(old, _)| old.is_some());
        let new: Vec<Contender> = new.into_iter().map(|(_, contender)| contender).collect();
        let fresh = truths.run(args, &new).into_iter().map(|(contender, record)| {
            record.point(&job.name, &key, contender, rays, truths.judged(contender))
        });
        let fresh: Vec<Point> = fresh.collect();
        table.add(&fresh)?;
        fresh.iter().for_each(|point| announce(args, point));
        points.extend(old.into_iter().filter_map(|(old, _)| old).chain(fresh));
    }
    // A method that some size has no room for is still compared at others.
    missing.retain(|absent: &Absent| points.iter().all(|point: &Point| point.method != absent.name));
    missing.dedup_by(|a, b| a.name == b.name);
    missing.sort_by_key(|absent| absent.name);
    missing.dedup_by(|a, b| a.name == b.name);
    // Rows that were there come where they would have come now.
    let order = contender::names();
    points.sort_by_key(|point| (order.iter().position(|name| *name == point.method), point.rays));
    Ok(Chapter {
        job: job.name,
        size: [patches, scene.surfaces().len()],
        points,
        absent: missing,
        truth: told(&truths.discrete),
        continuous_truth: told(&truths.continuous),
    })
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
        tell(&event.to_string());
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
    fn new(job: &Job, scene: &Scene, rays: u64) -> Self {
        let judged = |truth: Truth| {
            let judged = Judged::new(scene, &truth);
            (truth, judged)
        };
        Truths {
            discrete: judged(Truth::discrete(job, scene, rays)),
            continuous: judged(Truth::continuous(scene, rays)),
        }
    }

    fn of(&self, contender: &Contender) -> &(Truth, Judged) {
        if contender.is_continuous() { &self.continuous } else { &self.discrete }
    }

    fn judged(&self, contender: &Contender) -> &Judged {
        &self.of(contender).1
    }

    /// All runs of some contenders, in turn: what slows the machine down slows all of them.
    fn run<'c>(&self, args: &CompareArgs, contenders: &'c [Contender]) -> Vec<(&'c Contender, Record)> {
        let mut records: Vec<_> = contenders.iter().map(|c| (c, Record::new(self.judged(c)))).collect();
        for run in 0..args.runs as u64 {
            for (contender, record) in &mut records {
                let (truth, judged) = self.of(contender);
                record.run(contender, 1 + run, truth, judged);
            }
        }
        records
    }
}
