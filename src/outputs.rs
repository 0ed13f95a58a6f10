//! What a run leaves behind: its output folder, and a few lines on screen.

use std::path::Path;
use std::sync::Arc;

use cluster::checkpoint::{Book, Checkpoint, Look};
use cluster::roster::Contributor;
use job::{Light, OutputFile, Word};
use judge::bounces::bounces;
use judge::checks::checks_of_result;
use judge::target;
use radiosity::{Estimates, Experiment, Precision};
use report::{
    Draft, Milestone, Model, OutputFolder, Page, PartSummary, Photo, Provenance, RunFacts, SessionSummary,
    Shot, Smooth, Summary, Units, WorkerSummary, WorstPatch,
};
use tracing::warn;

use crate::args::OutArgs;
use crate::checkpoints::{self, CURRENT, DERIVED, Latest, PREVIOUS};
use crate::console::{Phase, emit, say};
use crate::fault::Fault;
use crate::settings::Settings;
use report::words::{counted, duration, percent, quantity};

/// Above this many patches the page takes longer to open than most want to wait, and is written where it is asked for.
const PAGE_UP_TO: usize = 200_000;

/// The files that are written where a job names none; the page, while it opens quickly.
const DEFAULT: [OutputFile; 4] =
    [OutputFile::Csv, OutputFile::Summary, OutputFile::Picture, OutputFile::Report];

/// The output folder of a run.
pub struct RunOutput {
    folder: Arc<OutputFolder>,
    exports: Vec<OutputFile>,
}

impl RunOutput {
    /// Claims the folder.
    ///
    /// # Errors
    /// Where it holds results that may not be `replace`d.
    pub fn new(path: &Path, replace: bool, exports: &[OutputFile]) -> Result<Self, Fault> {
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
        self.place(drafts)?;
        drop(phase);
        if out.json {
            emit(&serde_json::json!({"event": "done", "out": self.path(), "paths": summary.paths}));
        } else if !out.quiet {
            self.describe(&summary, settings);
            self.describe_left_out(settings, experiment);
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
        self.place(drafts)
    }

    /// Puts files in their places, and takes away those of an earlier result that this one does not have.
    fn place(&self, drafts: Vec<(OutputFile, Draft)>) -> Result<(), Fault> {
        let written: Vec<OutputFile> = drafts.iter().map(|(file, _)| *file).collect();
        drafts.into_iter().try_for_each(|(_, draft)| draft.place())?;
        let others = OutputFile::ALL.iter().filter(|file| !written.contains(file));
        self.folder.remove(&others.map(|file| file.name()).collect::<Vec<_>>())?;
        Ok(self.folder.sync()?)
    }

    /// The files that a result of this many patches has.
    fn files(&self, settings: &Settings, patches: usize) -> Vec<OutputFile> {
        let is_quick = |file: &OutputFile| *file != OutputFile::Report || patches <= PAGE_UP_TO;
        let mut files =
            settings.files.clone().unwrap_or_else(|| DEFAULT.into_iter().filter(is_quick).collect());
        files.extend(&self.exports);
        OutputFile::ALL.iter().copied().filter(|file| files.contains(file)).collect()
    }

    /// What follows from the tally of a checkpoint, written but not in its place.
    fn drafts(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        phase: &Phase,
    ) -> Result<(Summary, Vec<(OutputFile, Draft)>), Fault> {
        let scene = experiment.scene();
        let estimates = Estimates::new(experiment, &checkpoint.tally, settings.level(scene));
        let files = self.files(settings, scene.faces().patch_count());
        phase.now("checking the result");
        let mut summary = summarise(settings, &estimates, &checkpoint.book);
        phase.now("drawing the picture");
        let view = Seen::of(&estimates, settings, &files);
        summary.view = view.as_ref().map(Seen::shot);
        self.folder.keep_hold()?;
        phase.now("writing the results");
        let mut drafts = Vec::new();
        for &file in &files {
            let draft = self.folder.draft(file.name(), |writer| match (file, &view) {
                (OutputFile::Csv, _) => report::write_patches(writer, &estimates),
                (OutputFile::Summary, _) => summary.write(writer),
                (OutputFile::Vtu, _) => report::write_vtu(writer, &estimates),
                (OutputFile::Parquet, _) => report::write_parquet(writer, &estimates),
                (OutputFile::Picture, Some(Seen::Drawn(_, photo))) => photo.picture.write_png(writer),
                (OutputFile::Exr, Some(Seen::Drawn(_, photo))) => {
                    photo.values.write_exr(writer, summary.units.radiosity)
                }
                (OutputFile::Glb, Some(view)) => report::write_glb(writer, &estimates, &view.shot()),
                (OutputFile::Report, Some(view)) => {
                    page(settings, &summary, &estimates, &checkpoint.book, view).write(writer)
                }
                (OutputFile::Picture | OutputFile::Exr | OutputFile::Glb | OutputFile::Report, _) => {
                    unreachable!("what needs a view has one")
                }
            });
            drafts.push((file, draft?));
        }
        Ok((summary, drafts))
    }

    /// What is not there because the job does not name it, and what that is needed for.
    fn describe_left_out(&self, settings: &Settings, experiment: &Experiment) {
        let patches = experiment.scene().faces().patch_count();
        let (written, usual) = (self.files(settings, patches), DEFAULT.into_iter());
        let left_out: Vec<OutputFile> = usual.filter(|file| !written.contains(file)).collect();
        if settings.files.is_none() || left_out.is_empty() {
            return;
        }
        let list = |of: fn(OutputFile) -> &'static str, between: &str| {
            left_out.iter().map(|&file| of(file)).collect::<Vec<_>>().join(between)
        };
        let needs = match (left_out.contains(&OutputFile::Csv), left_out.contains(&OutputFile::Summary)) {
            (true, true) => "; diff needs patches.csv, and status summary.json",
            (true, false) => "; diff needs patches.csv",
            (false, true) => "; status needs summary.json",
            (false, false) => "",
        };
        say(&format!(
            "left out: {}; radwalk report {} --export {} makes them. Resume, merge and audit need tally.bin alone{needs}",
            list(OutputFile::name, ", "),
            self.path().display(),
            list(OutputFile::word, ",")
        ));
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
        say(&format!("written to {}", self.path().display()));
    }
}

/// A result from where the picture is taken, as far as its files need it.
pub enum Seen {
    /// Aimed at, and not drawn.
    Aimed(Smooth, Shot),
    /// Drawn.
    Drawn(Smooth, Box<Photo>),
}

impl Seen {
    /// `None` where no file needs it.
    fn of(estimates: &Estimates, settings: &Settings, files: &[OutputFile]) -> Option<Self> {
        let needs = |some: &[OutputFile]| some.iter().any(|file| files.contains(file));
        if needs(&[OutputFile::Picture, OutputFile::Exr]) {
            let smooth = Smooth::new(estimates);
            let photo = Photo::shoot(estimates, &smooth, &settings.view);
            return Some(Seen::Drawn(smooth, photo.into()));
        }
        needs(&[OutputFile::Report, OutputFile::Glb]).then(|| Seen::aimed(estimates, settings))
    }

    /// Aimed at alone.
    pub fn aimed(estimates: &Estimates, settings: &Settings) -> Self {
        let shot = Shot::aim(estimates, &settings.view);
        Seen::Aimed(Smooth::new(estimates), shot)
    }

    fn smooth(&self) -> &Smooth {
        match self {
            Seen::Aimed(smooth, _) | Seen::Drawn(smooth, _) => smooth,
        }
    }

    /// How it is seen.
    pub fn shot(&self) -> Shot {
        match self {
            Seen::Aimed(_, shot) => *shot,
            Seen::Drawn(_, photo) => photo.shot,
        }
    }
}

/// The summary of a tally, but for the view.
pub fn summarise(settings: &Settings, estimates: &Estimates, book: &Book) -> Summary {
    let precision = estimates.precision();
    let facts = facts(settings, estimates, &precision, book);
    Summary::new(estimates.scene(), estimates.tally(), precision, facts)
}

/// The page that shows a tally.
pub fn page<'a>(
    settings: &'a Settings,
    summary: &'a Summary,
    estimates: &'a Estimates<'a>,
    book: &Book,
    view: &'a Seen,
) -> Page<'a> {
    Page {
        name: &settings.name,
        summary,
        estimates,
        milestones: milestones(book, estimates.experiment()),
        command: command(settings, summary),
        shot: view.shot(),
        smooth: view.smooth(),
        materials: &settings.finishes,
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
        job_hash: job::job_hash(scene.hash(), &settings.method, settings.seed),
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
