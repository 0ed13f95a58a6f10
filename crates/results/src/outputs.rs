//! What a run leaves behind: its output folder.

use std::path::Path;
use std::sync::Arc;

use job::Light;
use judge::bounces::bounces;
use judge::checks::checks_of_result;
use judge::target;
use protocol::checkpoint::{Book, Checkpoint, Look, Part, Session};
use protocol::roster::Contributor;
use radiosity::{Estimates, Experiment, Precision, Readings};
use report::{
    Draft, Export, Milestone, Model, OutputFolder, Page, PartSummary, Provenance, RunFacts, SessionSummary,
    Smooth, Summary, Units, WorkerSummary,
};

use crate::checkpoints::{self, CURRENT, DERIVED, Latest, PAGE, PREVIOUS, SENSORS};
use crate::error::Error;
use crate::kept::Kept;
use crate::settings::Settings;

/// Above this many patches the page takes longer to open than most want to wait, and is not written.
const PAGE_UP_TO: usize = 200_000;

/// The output folder of a run.
pub struct RunOutput {
    folder: Arc<OutputFolder>,
    exports: Vec<Export>,
    /// The commit of the program, for the summary.
    git: &'static str,
}

impl RunOutput {
    /// Claims the folder for results of a program that was built from a commit.
    ///
    /// # Errors
    /// Where it holds results that may not be `replace`d.
    pub fn new(path: &Path, replace: bool, exports: &[Export], git: &'static str) -> Result<Self, Error> {
        let files = [&[CURRENT, PREVIOUS][..], &DERIVED].concat();
        let folder = OutputFolder::claim(path, &files, replace)?.into();
        Ok(RunOutput { folder, exports: exports.into(), git })
    }

    /// The folder itself.
    pub fn folder(&self) -> &Arc<OutputFolder> {
        &self.folder
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes the results of some walks, and returns what they are. All files take their places when all are written, so
    /// that a full disk leaves those that were there. `now` hears what is being done.
    ///
    /// # Errors
    /// Where the books do not balance or a file cannot be written.
    pub fn write(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        latest: Latest,
        now: &dyn Fn(&'static str),
    ) -> Result<Summary, Error> {
        let (summary, drafts) = self.drafts(settings, experiment, checkpoint, now)?;
        checkpoints::write(&self.folder, checkpoint, latest)?;
        drafts.into_iter().try_for_each(Draft::place)?;
        self.folder.sync()?;
        Ok(summary)
    }

    /// Makes what follows from a tally again: all files but the tally.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn rebuild(&self, kept: &Kept, now: &dyn Fn(&'static str)) -> Result<(), Error> {
        let (_, drafts) = self.drafts(&kept.settings, &kept.experiment, &kept.checkpoint, now)?;
        drafts.into_iter().try_for_each(Draft::place)?;
        Ok(self.folder.sync()?)
    }

    /// What follows from the tally of a checkpoint, written but not in its place.
    fn drafts(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        now: &dyn Fn(&'static str),
    ) -> Result<(Summary, Vec<Draft>), Error> {
        now("estimating every patch");
        let scene = experiment.scene();
        let estimates = Estimates::new(experiment, &checkpoint.tally, settings.level(scene));
        let precision = estimates.precision();
        now("checking the result");
        let facts = self.facts(settings, &estimates, &precision, &checkpoint.book);
        let summary = Summary::new(scene, &checkpoint.tally, precision, facts);
        now("drawing the picture");
        let smooth = Smooth::new(&estimates);
        let (picture, shot) = report::Picture::shoot(&estimates, &smooth);
        let readings = readings(settings, &estimates);
        self.folder.keep_hold()?;
        now("writing the results");
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
        for export in Export::ALL {
            let file = export.file();
            if !self.exports.contains(&export) {
                self.folder.remove(&[file])?;
                continue;
            }
            drafts.push(self.folder.draft(file, |writer| export.write(writer, &estimates, &shot))?);
        }
        Ok((summary, drafts))
    }

    /// What a summary says of a run beside its numbers.
    fn facts(
        &self,
        settings: &Settings,
        estimates: &Estimates,
        precision: &Precision,
        book: &Book,
    ) -> RunFacts {
        let (experiment, tally, scene) = (estimates.experiment(), estimates.tally(), estimates.scene());
        let paths = tally.counts.walks.saturating_mul(experiment.paths_per_walk());
        // A batch is a stream of its own.
        let stream_paths = experiment.batch_paths().unwrap_or(settings.stream_paths);
        RunFacts {
            version: env!("CARGO_PKG_VERSION").into(),
            git: (!self.git.starts_with("sources-")).then(|| self.git.into()),
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
}

/// What sensors read, where there are any.
fn readings<'a>(settings: &Settings, estimates: &Estimates<'a>) -> Option<Readings<'a>> {
    let experiment = estimates.experiment();
    Readings::new(experiment, estimates.tally(), settings.sensor_level(experiment))
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

/// The workers, seeds and sessions of the walks; a walk counts as `paths_per_walk` paths.
fn provenance(book: &Book, paths_per_walk: u64) -> Provenance {
    let worker = |worker: &Contributor| WorkerSummary {
        name: worker.name.clone(),
        paths: worker.walks.saturating_mul(paths_per_walk),
        leases: worker.leases,
    };
    let part = |part: &Part| PartSummary {
        seed: part.seed,
        first_path: part.first.saturating_mul(paths_per_walk),
        paths: part.walks().saturating_mul(paths_per_walk),
    };
    let session = |session: &Session| SessionSummary {
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
