//! `radwalk compare`: speed against accuracy, for every method that fits a scene, ranked by the time that it takes to an error.
//!
//! Worker processes of this machine walk the runs ([`shoot`]); the points measured so far are kept in a [`ResultTable`].

mod contender;
mod judge;
mod measure;
mod page;
mod shoot;
mod study;
mod table;
mod truth;
mod truths;

use std::io::Write;
use std::path::{Path, PathBuf};

use job::Job;
use radiosity::{Experiment, Scene};
use report::OutputFolder;
use serde_json::json;
use tracing::warn;
use voice::{emit, say};

use self::contender::Arena;
use self::measure::ContenderResult;
use self::study::{Bench, StudySize, study};
use self::table::{ResultTable, TABLE};
use crate::args::CompareArgs;
use crate::choose::load_given;
use crate::date::today;
use crate::fault::{Fault, Outcome};
use crate::signals;

const PAGE: &str = "compare.md";
/// The charts' folder, beside the page.
const CHARTS: &str = "compare";

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
    let table = ResultTable::new(&folder, args.resume)?;
    let team = args.team.team();
    let mut bench = Bench { team, table, announce: &|point| announce(args, point) };
    let size = StudySize { rays: args.rays, runs: args.runs };
    signals::catch();
    let mut chapters = Vec::new();
    for (path, (job, scene)) in args.jobs.iter().zip(&jobs) {
        let chapter = match study(Arena { path, set: &args.set, job, scene }, size, &mut bench) {
            Err(Fault::Interrupted) => {
                warn!(
                    "interrupted; {} rows are kept in {}, go on with: {} --resume",
                    bench.table.len(),
                    folder.file(TABLE).display(),
                    command(args)
                );
                return Ok(Outcome::Interrupted);
            }
            chapter => chapter?,
        };
        for (name, chart) in page::charts(&chapter) {
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
    let workers = args.team.workers.map_or(String::new(), |workers| format!(" --workers {workers}"));
    let threads =
        if args.team.threads == 1 { String::new() } else { format!(" --threads {}", args.team.threads) };
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

fn announce(args: &CompareArgs, point: &ContenderResult) {
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
