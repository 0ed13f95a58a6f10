//! What a run leaves behind: its output folder, and a few lines on screen.

use std::path::Path;

use cluster::coordinator::Coordinator;
use job::{Job, Target, WalkKind, Word};
use radiosity::{Estimate, Experiment, Scene, Solution, Tally};
use report::{Check, Method, OutputFolder, RunFacts, Summary};

use crate::args::OutArgs;
use crate::console::{say, tell};
use crate::fault::Fault;
use crate::progress::{duration, percent, quantity};

/// The files of a run, in the order they are written: the tally first, since all else follows from it.
const RUN_FILES: &[&str] = &["tally.bin", "patches.csv", "summary.json", "radiosity.png"];

/// The output folder of a run.
pub struct RunOutput {
    folder: OutputFolder,
}

impl RunOutput {
    /// Claims the folder.
    ///
    /// # Errors
    /// Where it holds results and `force` is not given.
    pub fn new(path: &Path, force: bool) -> Result<Self, Fault> {
        Ok(RunOutput { folder: OutputFolder::claim(path, RUN_FILES, force)? })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes the results of the walks that are in, and says what they are. Nothing is written where none is.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn write(
        &self,
        job: &Job,
        experiment: &Experiment,
        coordinator: &Coordinator,
        out: &OutArgs,
    ) -> Result<(), Fault> {
        let (scene, tally) = (experiment.scene(), coordinator.prefix());
        if tally.counts.walks == 0 {
            tell(&format!(
                "radwalk: no walk was finished, so nothing is written to {}",
                self.path().display()
            ));
            return Ok(());
        }
        let solution = Solution::new(experiment, tally, job.confidence);
        let facts = facts(job, scene, &solution, coordinator);
        let summary = Summary::new(scene, tally, &solution, facts);
        let radiosities = shown(scene, &solution);
        let picture = report::Picture::render(scene, &radiosities);
        self.folder.write("tally.bin", |file| {
            report::write_tally(file, &summary.job_hash, &summary.scene_hash, tally)
        })?;
        self.folder.write("patches.csv", |file| report::write_patches(file, scene, &solution))?;
        self.folder.write("summary.json", |file| summary.write(file))?;
        self.folder.write("radiosity.png", |file| picture.write_png(file))?;
        if out.json {
            tell(&format!(
                "{}",
                serde_json::json!({"event": "done", "out": self.path(), "paths": summary.paths})
            ));
        } else if !out.quiet {
            self.describe(&summary, scene, job);
        }
        Ok(())
    }

    /// A few lines for people.
    fn describe(&self, summary: &Summary, scene: &Scene, job: &Job) {
        let whole = if summary.paths < job.budget.paths {
            format!(" of {}", job.budget.paths)
        } else {
            String::new()
        };
        say(&format!(
            "{}{whole} paths, {} rays in {} by {} workers: {} paths/s, {} rays/s",
            summary.paths,
            summary.rays,
            duration(summary.seconds),
            summary.workers_seen,
            quantity(summary.paths_per_second),
            quantity(summary.rays_per_second)
        ));
        let precision = &summary.precision;
        let worst = precision.worst_patch.map_or(String::new(), |patch| {
            let surface = scene.surface_name(scene.patches().get(patch as usize).surface);
            format!(", worst {} (patch {patch} on {surface})", percent(precision.max_relative_error))
        });
        say(&format!(
            "half-widths of the {} % intervals: rms {}{worst}",
            100.0 * summary.confidence,
            percent(precision.rms_relative_error)
        ));
        for check in summary.checks.iter().filter(|check| !check.ok) {
            say(&format!("note: {}", check.message));
        }
        if let Some(target) = &summary.target {
            let verdict = if target.reached { "reached" } else { "not reached" };
            say(&format!(
                "target {verdict}: {:.2} % of the patch area is within {}",
                100.0 * target.achieved,
                percent(target.relative_error)
            ));
        }
        say(&format!("written to {}", self.path().display()));
    }
}

/// B of every patch and channel as the picture shows it; a patch that no walk could tell of shows what it emits.
fn shown(scene: &Scene, solution: &Solution) -> Vec<f64> {
    let patches = scene.patches().iter().zip(solution.estimates.chunks_exact(solution.channels));
    let shown = patches.flat_map(|(patch, channels)| {
        let emitted = patch.emittance.channels();
        channels.iter().zip(emitted).map(|(estimate, e)| estimate.map_or(e, |estimate| estimate.radiosity))
    });
    shown.collect()
}

/// Whether the tally of a prefix meets a target.
pub fn target_met(target: &Target, experiment: &Experiment, tally: &Tally, confidence: f64) -> bool {
    tally.counts.walks > 0
        && judge(target, experiment.scene(), &Solution::new(experiment, tally, confidence)).reached
}

fn judge(target: &Target, scene: &Scene, solution: &Solution) -> report::Target {
    report::Target::judge(scene, solution, target.relative_error, target.fraction)
}

fn facts(job: &Job, scene: &Scene, solution: &Solution, coordinator: &Coordinator) -> RunFacts {
    let effort = coordinator.effort();
    let git = env!("RADWALK_GIT");
    RunFacts {
        version: env!("CARGO_PKG_VERSION").into(),
        git: (git != "unknown").then(|| git.into()),
        job_hash: job::job_hash(scene.hash(), &job.method, job.seed),
        seed: job.seed,
        method: method(job),
        seconds: effort.seconds,
        cpu_seconds: effort.cpu_seconds,
        workers_seen: effort.workers_seen,
        workers_lost: effort.workers_lost,
        streams: effort.streams,
        streams_reissued: effort.streams_reissued,
        target: job.target.as_ref().map(|target| judge(target, scene, solution)),
        checks: checks(job, scene, solution, coordinator.prefix()),
    }
}

/// The method in the words of job files.
pub fn method(job: &Job) -> Method {
    Method {
        walk: job.method.walk.word().into(),
        estimator: job.method.estimator.word().into(),
        space: job.method.space.word().into(),
        sampler: job.method.sampler.word().into(),
    }
}

/// What is verified of every run, and said in words where it fails.
fn checks(job: &Job, scene: &Scene, solution: &Solution, tally: &Tally) -> Vec<Check> {
    let check = |name: &str, ok, message| Check { name: name.into(), ok, message };
    let counts = tally.counts;
    let ended = counts.absorbed + counts.absorbed_back + counts.escaped + counts.truncated;
    // The rays of a chain are ended one by one.
    let (emitted, what) = match job.method.walk {
        WalkKind::Jacobi => (counts.rays, "rays"),
        _ => (counts.walks, "walks"),
    };
    let unhit = solution.precision(scene).unhit_patches;
    let is_rare = |channels: &&[Option<Estimate>]| channels.iter().flatten().any(Estimate::is_rare);
    let rare = solution.estimates.chunks_exact(solution.channels).filter(is_rare).count();
    let note = job.note.clone();
    vec![
        check("method", note.is_none(), note.unwrap_or_else(|| "the method is the one asked for".into())),
        check(
            "energy",
            ended == emitted,
            format!("{emitted} {what} were emitted, {ended} absorbed or escaped"),
        ),
        check(
            "backs",
            counts.absorbed_back == 0,
            format!("{} {what} ended on the back of a one-sided surface", counts.absorbed_back),
        ),
        check(
            "unhit",
            unhit == 0,
            format!("{unhit} reflecting patches have no score: only bounds are known"),
        ),
        check(
            "rare",
            rare == 0,
            format!("{rare} patches have fewer than 10 scores: trust their intervals, not their values"),
        ),
    ]
}
