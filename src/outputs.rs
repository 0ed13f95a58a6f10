//! What a run leaves behind: its output folder, and a few lines on screen.

use std::path::Path;
use std::sync::Arc;

use clap::ValueEnum;
use cluster::checkpoint::{Book, Checkpoint, Look};
use cluster::roster::Contributor;
use job::Light;
use judge::bounces::bounces;
use judge::checks::checks_of_result;
use judge::target;
use radiosity::{Estimates, Experiment, Precision, Readings};
use report::{
    Draft, Milestone, Model, OutputFolder, Page, PartSummary, Provenance, RunFacts, SensorSummary,
    SensorsSummary, SessionSummary, Smooth, Summary, Units, WorkerSummary, WorstPatch,
};
use tracing::warn;

use crate::args::{Export, OutArgs};
use crate::checkpoints::{self, CURRENT, DERIVED, Latest, PAGE, PREVIOUS, SENSORS};
use crate::console::{Phase, emit, say};
use crate::fault::Fault;
use crate::settings::Settings;
use report::words::{counted, duration, percent, quantity};

/// Above this many patches the page takes longer to open than most want to wait, and is not written.
const PAGE_UP_TO: usize = 200_000;

/// The output folder of a run.
pub struct RunOutput {
    folder: Arc<OutputFolder>,
    exports: Vec<Export>,
}

impl RunOutput {
    /// Claims the folder.
    ///
    /// # Errors
    /// Where it holds results that may not be `replace`d.
    pub fn new(path: &Path, replace: bool, exports: &[Export]) -> Result<Self, Fault> {
        let files = [&[CURRENT, PREVIOUS][..], &DERIVED].concat();
        let folder = OutputFolder::claim(path, &files, replace)?.into();
        Ok(RunOutput { folder, exports: exports.into() })
    }

    /// The folder itself.
    pub fn folder(&self) -> &Arc<OutputFolder> {
        &self.folder
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes the results of some walks, and says what they are. Nothing is written where there are none. All files take their
    /// places when all are written, so that a full disk leaves those that were there.
    ///
    /// # Errors
    /// Where the books do not balance or a file cannot be written.
    pub fn write(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        latest: Latest,
        out: &OutArgs,
    ) -> Result<(), Fault> {
        if checkpoint.tally.counts.walks == 0 {
            warn!(
                "no walk was finished, so nothing is written to {}; what is there is from before",
                self.path().display()
            );
            return Ok(());
        }
        let phase = Phase::begin("estimating every patch");
        let (summary, drafts) = self.drafts(settings, experiment, checkpoint, &phase)?;
        checkpoints::write(&self.folder, checkpoint, latest)?;
        drafts.into_iter().try_for_each(Draft::place)?;
        self.folder.sync()?;
        drop(phase);
        if out.json {
            emit(&serde_json::json!({"event": "done", "out": self.path(), "paths": summary.paths}));
        } else if !out.quiet {
            self.describe(&summary, settings);
        }
        Ok(())
    }

    /// Makes what follows from a tally again: all files but the tally.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn rebuild(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
    ) -> Result<(), Fault> {
        let phase = Phase::begin("estimating every patch");
        let (_, drafts) = self.drafts(settings, experiment, checkpoint, &phase)?;
        drafts.into_iter().try_for_each(Draft::place)?;
        Ok(self.folder.sync()?)
    }

    /// What follows from the tally of a checkpoint, written but not in its place.
    fn drafts(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        phase: &Phase,
    ) -> Result<(Summary, Vec<Draft>), Fault> {
        let scene = experiment.scene();
        let estimates = Estimates::new(experiment, &checkpoint.tally, settings.level(scene));
        let precision = estimates.precision();
        phase.now("checking the result");
        let facts = facts(settings, &estimates, &precision, &checkpoint.book);
        let summary = Summary::new(scene, &checkpoint.tally, precision, facts);
        phase.now("drawing the picture");
        let smooth = Smooth::new(&estimates);
        let (picture, shot) = report::Picture::shoot(&estimates, &smooth);
        let readings = readings(settings, &estimates);
        self.folder.keep_hold()?;
        phase.now("writing the results");
        let mut drafts = vec![
            self.folder.draft("patches.csv", |file| report::write_patches(file, &estimates))?,
            self.folder.draft("summary.json", |file| summary.write(file))?,
            self.folder.draft("radiosity.png", |file| picture.write_png(file))?,
        ];
        match &readings {
            Some(readings) => {
                drafts.push(self.folder.draft(SENSORS, |file| report::write_sensors(file, readings))?);
            }
            // Those of an earlier result would show other numbers.
            None => self.folder.remove(&[SENSORS])?,
        }
        if scene.faces().patch_count() <= PAGE_UP_TO {
            let page = Page {
                name: &settings.name,
                summary: &summary,
                estimates: &estimates,
                readings: readings.as_ref(),
                milestones: &milestones(&checkpoint.book, experiment),
                command: &command(settings, &summary),
                shot,
                smooth: &smooth,
            };
            drafts.push(self.folder.draft(PAGE, |file| page.write(file))?);
        } else {
            // One of an earlier result would show other numbers.
            self.folder.remove(&[PAGE])?;
        }
        for export in Export::value_variants() {
            let file = export.file();
            if !self.exports.contains(export) {
                self.folder.remove(&[file])?;
                continue;
            }
            drafts.push(self.folder.draft(file, |writer| match export {
                Export::Vtu => report::write_vtu(writer, &estimates),
                Export::Glb => report::write_glb(writer, &estimates, &shot),
                Export::Parquet => report::write_parquet(writer, &estimates),
            })?);
        }
        Ok((summary, drafts))
    }

    /// A few lines for people.
    fn describe(&self, summary: &Summary, settings: &Settings) {
        let whole =
            if summary.paths < settings.paths { format!(" of {}", settings.paths) } else { String::new() };
        say(&format!(
            "{}{whole} paths, {} rays in {} by {}: {} paths/s, {} rays/s",
            summary.paths,
            summary.rays,
            duration(summary.seconds),
            counted(summary.workers_seen, "worker"),
            quantity(summary.paths_per_second),
            quantity(summary.rays_per_second)
        ));
        let precision = &summary.precision;
        // While some patch is unknown, the worst is that one, and says nothing of the others.
        let worst = match &precision.worst_place {
            Some(place) if precision.max_relative_error.is_finite() => {
                format!(", worst {} ({place})", percent(precision.max_relative_error))
            }
            _ => format!(", 99 hundredths within {}", percent(precision.error_quantiles["0.99"])),
        };
        // Of light that was never there, nothing is known to any part of itself.
        if precision.error_quantiles["0.99"].is_finite() || precision.unhit.area < 1.0 - 1e-12 {
            say(&format!(
                "half-widths of the {}{} % intervals: half of the area within {}, 9 tenths within {}{worst}",
                if summary.simultaneous { "simultaneous " } else { "" },
                100.0 * summary.confidence,
                percent(precision.error_quantiles["0.5"]),
                percent(precision.error_quantiles["0.9"])
            ));
        } else {
            say(
                "no patch that reflects was reached by any walk: nothing is known of its light but upper bounds",
            );
        }
        for (apart, why) in [
            (precision.unhit, "that no walk has reached"),
            (precision.tiny, "each below a millionth of the area"),
        ] {
            if apart.patches > 0 {
                let area = percent(apart.area);
                say(&format!("told apart: {} patches {why}, {area} of the area in all", apart.patches));
            }
        }
        for line in summary.model.lines() {
            say(&format!("model: {line}"));
        }
        for check in summary.checks.iter().filter(|check| !check.ok) {
            say(&format!("note: {}", check.message));
        }
        if let Some(target) = &summary.target {
            let verdict = if target.reached { "reached" } else { "not reached" };
            say(&format!(
                "target {verdict}: {:.2} % of {} is within {}",
                100.0 * target.achieved,
                target::scope(target.patches.as_deref()),
                percent(target.relative_error)
            ));
            if let Some(paths) = target.paths_needed {
                let seconds = (paths - summary.paths as f64) / summary.paths_per_second;
                say(&format!(
                    "it takes about {} paths: {} more",
                    quantity(paths),
                    duration(seconds.max(0.0))
                ));
            }
            target.worst.iter().filter(|_| !target.reached).for_each(describe_worst);
        }
        if let Some(sensors) = &summary.sensors {
            describe_sensors(sensors);
        }
        say(&format!("written to {}", self.path().display()));
    }
}

/// What sensors read, as far as their tallies tell.
fn readings<'a>(settings: &Settings, estimates: &Estimates<'a>) -> Option<Readings<'a>> {
    let experiment = estimates.experiment();
    Readings::new(experiment, estimates.tally(), settings.sensor_level(experiment))
}

/// How well sensors are known.
fn describe_sensors(sensors: &SensorsSummary) {
    for SensorSummary { name, patches, relative_error, target } in &sensors.list {
        let known = match relative_error.is_finite() {
            true => format!("known within {}", percent(*relative_error)),
            false => "not known yet in every patch".into(),
        };
        let asked = target.map_or(String::new(), |asked| format!(", {} is asked for", percent(asked)));
        say(&format!("sensor {name:?} ({}): {known}{asked}", counted(*patches as u64, "patch")));
    }
    if let Some(reached) = sensors.reached {
        say(&format!("target of sensors {}", if reached { "reached" } else { "not reached" }));
    }
}

/// The errors at the looks of a run.
fn milestones(book: &Book, experiment: &Experiment) -> Vec<Milestone> {
    let milestone = |look: &Look| Milestone {
        paths: look.walks as f64 * experiment.paths_per_walk() as f64,
        median_relative_error: look.median_relative_error,
        max_relative_error: look.max_relative_error,
    };
    book.looks.iter().map(milestone).collect()
}

/// The command that makes the same numbers again.
fn command(settings: &Settings, summary: &Summary) -> String {
    format!("radwalk run {}.toml --seed {} --paths {}", settings.name, settings.seed, summary.paths)
}

/// One of the patches that keep a target from being reached.
fn describe_worst(worst: &WorstPatch) {
    let WorstPatch { words, relative_error, hits, paths_needed, .. } = worst;
    let needed = if paths_needed.is_finite() {
        format!("about {} paths", quantity(*paths_needed))
    } else {
        "nobody knows how many paths".into()
    };
    say(&format!("  {words}: {} after {hits} hits, takes {needed}", percent(*relative_error)));
}

fn facts(settings: &Settings, estimates: &Estimates, precision: &Precision, book: &Book) -> RunFacts {
    let (experiment, tally, scene) = (estimates.experiment(), estimates.tally(), estimates.scene());
    let paths = tally.counts.walks.saturating_mul(experiment.paths_per_walk());
    // A batch is a stream of its own.
    let stream_paths = experiment.batch_paths().unwrap_or(settings.stream_paths);
    let git = env!("RADWALK_GIT");
    RunFacts {
        version: env!("CARGO_PKG_VERSION").into(),
        git: (!git.starts_with("sources-")).then(|| git.into()),
        job_hash: job::job_hash(scene.hash(), &settings.method, &settings.sensors, settings.seed),
        seed: settings.seed,
        method: experiment.method().clone(),
        model: Model::new(scene, experiment.method(), tally.layout().moments, bounces(experiment)),
        paths,
        seconds: book.effort.seconds,
        cpu_seconds: book.effort.cpu_seconds,
        workers_seen: book.effort.workers_seen,
        workers_lost: book.effort.workers_lost,
        streams: paths.div_ceil(stream_paths),
        streams_reissued: book.effort.streams_reissued,
        target: settings.target.as_ref().map(|target| target::judge(target, estimates, paths)),
        sensors: readings(settings, estimates).map(|readings| {
            let goal = settings.sensor_goal(experiment);
            target::judge_sensors(goal.as_ref(), &readings, experiment, tally)
        }),
        import: settings.import.clone(),
        units: units(settings.light),
        checks: checks_of_result(estimates, settings.note.as_deref(), precision, book, settings.seed),
        confidence: settings.confidence,
        simultaneous: settings.simultaneous,
        provenance: provenance(book, experiment.paths_per_walk()),
    }
}

/// Whose walks these are, each counted as so many paths.
fn provenance(book: &Book, paths_per_walk: u64) -> Provenance {
    let worker = |worker: &Contributor| WorkerSummary {
        name: worker.name.clone(),
        paths: worker.walks.saturating_mul(paths_per_walk),
        leases: worker.leases,
    };
    let part = |part: &cluster::checkpoint::Part| PartSummary {
        seed: part.seed,
        first_path: part.first.saturating_mul(paths_per_walk),
        paths: part.walks().saturating_mul(paths_per_walk),
    };
    let session = |session: &cluster::checkpoint::Session| SessionSummary {
        host: session.host.clone(),
        build: session.build.clone(),
        began: session.began,
        ended: session.ended,
    };
    Provenance {
        parts: book.parts.iter().map(part).collect(),
        workers: book.workers.iter().map(worker).collect(),
        sessions: book.sessions.iter().map(session).collect(),
    }
}

/// The units of what a job's numbers measure.
pub fn units(light: Light) -> Units {
    match light {
        Light::Radiant => Units::RADIANT,
        Light::Luminous => Units::LUMINOUS,
    }
}
