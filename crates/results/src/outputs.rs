//! What a run leaves behind: its output folder.

use std::borrow::Cow;
use std::io::{self, Write as _};
use std::path::Path;
use std::sync::Arc;

use job::{Beside, Forecast, Keyword, Light, NamedView, OutputFile, WalkKind};
use judge::{DiscretisedControl, bounces, checks_of_result, is_discretised, target};
use parallel::{on_all_cores, run_on_all_cores};
use protocol::{Book, Checkpoint, Contributor, Look, Session, WalkRange};
use radiosity::{
    Estimates, Experiment, Scene,
    precision::{Precision, Quantity},
    sensitivity::Influences,
    sensors::Readings,
};
use report::words::{counted, percent, quantity};
use report::{
    AccuracySummary, ChoiceSummary, Digits, DiscretisedSummary, Draft, Live, Milestone, Model, NamedShot,
    OutputFolder, Page, PartSummary, PartitionSummary, Photo, Provenance, RunFacts, SessionSummary, Shot,
    Smooth, Summary, TotalSummary, Units, WorkerSummary,
};

use crate::checkpoints::{
    self, CURRENT, ISOLUX, ISOLUX_PICTURE, Latest, PARTITION, PLANES, PREVIOUS, SENSITIVITIES, SENSORS,
    SOURCES, derived,
};
use crate::error::Error;
use crate::settings::Settings;
use crate::stored_run::StoredRun;
use crate::views;

/// Files by name, written but not in their places.
type Drafts = Vec<(Cow<'static, str>, Draft)>;

/// The files that are written where a job names none.
const DEFAULT: [OutputFile; 4] =
    [OutputFile::Csv, OutputFile::Summary, OutputFile::Picture, OutputFile::Report];

/// A table of more rows than this goes to data frames, too, where a job names no files. Beside that, `patches.csv` is short.
const LONG_TABLE: usize = 20_000;

/// The digits of `patches.csv`, beside a table for data frames or alone.
fn digits(scene: &Scene, has_parquet: bool) -> Digits {
    if has_parquet && is_long(scene) { Digits::Rounded } else { Digits::All }
}

fn is_long(scene: &Scene) -> bool {
    scene.faces().len() > LONG_TABLE
}

/// The output folder of a run.
pub struct RunOutput {
    folder: Arc<OutputFolder>,
    exports: Vec<OutputFile>,
    /// The commit of the program, for the summary.
    git: &'static str,
}

impl RunOutput {
    /// Claims the folder for results of a program that was built from a commit.
    ///
    /// # Errors
    /// Where it holds results that may not be `replace`d.
    pub fn new(path: &Path, replace: bool, exports: &[OutputFile], git: &'static str) -> Result<Self, Error> {
        // A pilot alone is no result that would be lost.
        let files = [&[CURRENT, PREVIOUS][..], &derived()].concat();
        let folder = OutputFolder::claim(path, &files, replace)?.into();
        Ok(RunOutput { folder, exports: exports.into(), git })
    }

    /// The output folder that is written to.
    pub fn folder(&self) -> &Arc<OutputFolder> {
        &self.folder
    }

    /// The path of the output folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes what follows from the tally of some walks, which is kept before, and returns what that is. All files take their places when all are
    /// written, so that a full disk leaves those that were there. `now` hears what is being done.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn write(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        now: &dyn Fn(&'static str),
    ) -> Result<Summary, Error> {
        let (summary, drafts) = self.drafts(settings, experiment, checkpoint, now)?;
        self.place(drafts)?;
        Ok(summary)
    }

    /// Keeps a job with its tally alone. Where a run begins that is the tally of no walk, so that what a pilot has chosen is there when it is
    /// resumed; at its end, that of all walks, so that whatever befalls the pictures costs none.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn keep(&self, checkpoint: &Checkpoint, latest: Latest) -> Result<(), Error> {
        checkpoints::write(&self.folder, checkpoint, latest)
    }

    /// Makes what follows from a tally again: all files but the tally.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub fn rebuild(&self, kept: &StoredRun, now: &dyn Fn(&'static str)) -> Result<(), Error> {
        let (_, drafts) = self.drafts(&kept.settings, &kept.experiment, &kept.checkpoint, now)?;
        self.place(drafts)
    }

    /// Puts files in their places, and takes away those of an earlier result that this one does not have.
    fn place(&self, drafts: Drafts) -> Result<(), Error> {
        let (written, drafts): (Vec<Cow<'static, str>>, Vec<Draft>) = drafts.into_iter().unzip();
        let earlier_views = views::pictures_in(&self.folder);
        drafts.into_iter().try_for_each(Draft::place)?;
        let earlier = derived().into_iter().chain(earlier_views.iter().map(String::as_str));
        let others: Vec<&str> = earlier.filter(|name| !written.iter().any(|other| other == name)).collect();
        self.folder.remove(&others)?;
        Ok(self.folder.sync()?)
    }

    /// The files that a result has.
    fn files(&self, settings: &Settings, scene: &Scene) -> Vec<OutputFile> {
        let mut files = settings.files.clone().unwrap_or_else(|| DEFAULT.into());
        files.extend(&self.exports);
        files.extend((settings.files.is_none() && is_long(scene)).then_some(OutputFile::Parquet));
        OutputFile::ALL.iter().copied().filter(|file| files.contains(file)).collect()
    }

    /// The digits of `patches.csv`.
    pub(crate) fn digits(&self, settings: &Settings, scene: &Scene) -> Digits {
        digits(scene, self.files(settings, scene).contains(&OutputFile::Parquet))
    }

    /// The usual files that a job leaves out.
    pub(crate) fn left_out(&self, settings: &Settings) -> Vec<OutputFile> {
        let Some(named) = &settings.files else { return Vec::new() };
        let written = [&named[..], &self.exports].concat();
        DEFAULT.into_iter().filter(|file| !written.contains(file)).collect()
    }

    /// How surfaces are cut, where a pilot has chosen it.
    fn partition(&self, settings: &Settings, experiment: &Experiment) -> Result<Drafts, Error> {
        if settings.forecast.is_none() {
            return Ok(Drafts::new());
        }
        let faces = experiment.scene().faces();
        let text = settings.partition_of(faces.shapes(), faces.patch_of_cell()).to_toml();
        let draft = self.folder.draft(PARTITION, |writer| writer.write_all(text.as_bytes()))?;
        Ok(vec![(PARTITION.into(), draft)])
    }

    /// The pictures of views with names.
    fn views(&self, named: &[(NamedShot, Option<Photo>)], summary: &Summary) -> Result<Drafts, Error> {
        let mut drafts = Drafts::new();
        for (shot, photo) in named {
            let Some(photo) = photo else { continue };
            let name = views::picture_of(&shot.name, "png");
            let draft = self.folder.draft(&name, |writer| photo.picture.write_png(writer))?;
            drafts.push((name.into(), draft));
            if let Some(values) = &photo.values {
                let name = views::picture_of(&shot.name, "exr");
                let draft =
                    self.folder.draft(&name, |writer| values.write_exr(writer, summary.units.radiance))?;
                drafts.push((name.into(), draft));
            }
        }
        Ok(drafts)
    }

    /// What follows from the tally of a checkpoint, written but not in its place.
    fn drafts(
        &self,
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        now: &dyn Fn(&'static str),
    ) -> Result<(Summary, Drafts), Error> {
        now("estimating every patch");
        let scene = experiment.scene();
        let estimates = Estimates::new(experiment, &checkpoint.tally, settings.level(scene));
        let files = self.files(settings, scene);
        now("checking the result");
        let mut summary = summarise(settings, &estimates, &checkpoint.book, self.git, true);
        now("drawing the picture");
        let derived = TallyFiles::new(settings, &estimates, &files);
        let TallyFiles { view, readings, .. } = &derived;
        summary.picture = view.as_ref().map(RenderState::shot);
        let named = view.as_ref().map_or_else(Vec::new, |view| view.named(&estimates, settings));
        summary.views = named.iter().map(|(shot, _)| shot.clone()).collect();
        self.folder.keep_hold()?;
        now("writing the results");
        let mut drafts = self.partition(settings, experiment)?;
        for (name, write) in derived.beside() {
            drafts.push((name.into(), self.folder.draft(name, |writer| write(writer))?));
        }
        // Each file on a thread of its own: tables, pages and waiting for the disk overlap.
        let written = on_all_cores(files.len(), |number| {
            let file = files[number];
            self.folder.draft(file.name(), |writer| match (file, view) {
                (OutputFile::Summary, _) => summary.write(writer),
                (OutputFile::Report, Some(view)) => {
                    page(settings, &summary, &estimates, readings.as_ref(), &checkpoint.book, view)
                        .write(writer)
                }
                _ => derived.write(file, writer),
            })
        });
        for (file, draft) in files.iter().zip(written) {
            drafts.push((file.name().into(), draft?));
        }
        drafts.extend(self.views(&named, &summary)?);
        Ok((summary, drafts))
    }
}

/// How a file is written.
type FileWriter<'a> = Box<dyn Fn(&mut dyn io::Write) -> io::Result<()> + 'a>;

/// The files that follow from a tally and its job alone: all but the summary and the page, which tell of the run, too.
pub(crate) struct TallyFiles<'a> {
    settings: &'a Settings,
    estimates: &'a Estimates<'a>,
    readings: Option<Readings<'a>>,
    digits: Digits,
    /// `None` where no file needs it.
    view: Option<RenderState>,
}

impl<'a> TallyFiles<'a> {
    /// What is needed to write `files`.
    pub(crate) fn new(settings: &'a Settings, estimates: &'a Estimates<'a>, files: &[OutputFile]) -> Self {
        TallyFiles {
            settings,
            estimates,
            readings: readings(settings, estimates),
            digits: digits(estimates.scene(), files.contains(&OutputFile::Parquet)),
            view: RenderState::of(estimates, settings, files),
        }
    }

    /// Writes one of the files that it was made for.
    pub(crate) fn write(&self, file: OutputFile, writer: impl io::Write + Send) -> io::Result<()> {
        let estimates = self.estimates;
        match (file, &self.view) {
            (OutputFile::Csv, _) => report::write_patches(writer, estimates, self.digits),
            (OutputFile::Vtu, _) => report::write_vtu(writer, estimates),
            (OutputFile::Parquet, _) => report::write_parquet(writer, estimates),
            (OutputFile::Glb, Some(view)) => {
                report::write_glb(writer, estimates, self.readings.as_ref(), &view.shot())
            }
            (OutputFile::Picture, Some(RenderState::Drawn(_, photo))) => photo.picture.write_png(writer),
            (OutputFile::Exr, Some(RenderState::Drawn(_, photo))) => {
                let values = photo.values.as_ref().expect("the file asked for them");
                values.write_exr(writer, units(self.settings.light).radiance)
            }
            (OutputFile::Picture | OutputFile::Exr | OutputFile::Glb, _) => {
                unreachable!("what needs a view has one")
            }
            (OutputFile::Summary | OutputFile::Report, _) => unreachable!("they tell of the run"),
        }
    }

    /// The tables of sensors, sources and sensitivities, where the job asks for them, by name.
    pub(crate) fn beside(&self) -> Vec<(&'static str, FileWriter<'_>)> {
        let (experiment, tally) = (self.estimates.experiment(), self.estimates.tally());
        let mut files: Vec<(&'static str, FileWriter<'_>)> = Vec::new();
        if let Some(readings) = &self.readings {
            if has_cells(readings) {
                files.push((SENSORS, Box::new(|writer| report::write_sensors(writer, readings))));
            }
            if has_planes(readings) {
                files.push((PLANES, Box::new(|writer| report::write_planes(writer, readings))));
                let unit = units(self.settings.light).irradiance;
                if let Some(lines) = report::isolux_svg(readings, unit) {
                    files.push((ISOLUX, Box::new(move |writer| writer.write_all(lines.as_bytes()))));
                }
                if let Some(picture) = report::isolux_picture(readings, unit) {
                    files.push((ISOLUX_PICTURE, Box::new(move |writer| picture.write_png(writer))));
                }
            }
        }
        if experiment.groups().is_some_and(|groups| !groups.sources().is_empty()) {
            let level = self.settings.source_level(experiment);
            files.push((
                SOURCES,
                Box::new(move |writer| report::write_sources(writer, experiment, tally, level)),
            ));
        }
        if let Some(influences) = influences(self.settings, self.estimates) {
            files.push((
                SENSITIVITIES,
                Box::new(move |writer| report::write_sensitivities(writer, &influences)),
            ));
        }
        files
    }
}

/// A result from where the picture is taken, as far as its files need it.
enum RenderState {
    /// Aimed at, and not drawn.
    Aimed(Smooth, Shot),
    /// The picture is drawn.
    Drawn(Smooth, Box<Photo>),
}

impl RenderState {
    /// `None` where no file needs it.
    fn of(estimates: &Estimates, settings: &Settings, files: &[OutputFile]) -> Option<Self> {
        let needs = |some: &[OutputFile]| some.iter().any(|file| files.contains(file));
        if needs(&[OutputFile::Picture, OutputFile::Exr]) {
            let smooth = Smooth::new(estimates);
            let photo = Photo::shoot(estimates, &smooth, &settings.view, needs(&[OutputFile::Exr]));
            return Some(RenderState::Drawn(smooth, photo.into()));
        }
        needs(&[OutputFile::Report, OutputFile::Glb]).then(|| RenderState::aimed(estimates, settings))
    }

    fn aimed(estimates: &Estimates, settings: &Settings) -> Self {
        let shot = Shot::aim(estimates, &settings.view);
        RenderState::Aimed(Smooth::new(estimates), shot)
    }

    /// The views with names, drawn where the first one is.
    fn named(&self, estimates: &Estimates, settings: &Settings) -> Vec<(NamedShot, Option<Photo>)> {
        let of = |named: &NamedView| {
            let view = settings.view.from_stand(named.stand);
            let photo = match self {
                RenderState::Drawn(smooth, first) => {
                    Some(Photo::shoot(estimates, smooth, &view, first.values.is_some()))
                }
                RenderState::Aimed(..) => None,
            };
            let shot = photo.as_ref().map_or_else(|| Shot::aim(estimates, &view), |photo| photo.shot);
            (NamedShot { name: named.name.clone(), shot }, photo)
        };
        settings.views.iter().map(of).collect()
    }

    fn smooth(&self) -> &Smooth {
        match self {
            RenderState::Aimed(smooth, _) | RenderState::Drawn(smooth, _) => smooth,
        }
    }

    fn shot(&self) -> Shot {
        match self {
            RenderState::Aimed(_, shot) => *shot,
            RenderState::Drawn(_, photo) => photo.shot,
        }
    }
}

/// The page of a run that goes on.
pub struct LivePage {
    /// Paths of the tally.
    pub paths: u64,
    /// The whole page, as HTML.
    pub page: String,
    /// What changes from one page to the next.
    pub news: String,
}

impl LivePage {
    /// The page of a tally, by a program that was built from a commit.
    ///
    /// # Errors
    /// Where the parts of the page cannot be packed.
    pub fn of(
        settings: &Settings,
        experiment: &Experiment,
        checkpoint: &Checkpoint,
        git: &'static str,
    ) -> io::Result<Self> {
        let level = settings.level(experiment.scene());
        let estimates = Estimates::new(experiment, &checkpoint.tally, level);
        let mut summary = summarise(settings, &estimates, &checkpoint.book, git, false);
        let view = RenderState::aimed(&estimates, settings);
        summary.picture = Some(view.shot());
        summary.views = view.named(&estimates, settings).into_iter().map(|(shot, _)| shot).collect();
        let readings = readings(settings, &estimates);
        let page = page(settings, &summary, &estimates, readings.as_ref(), &checkpoint.book, &view);
        let live = Live { paths_total: settings.paths };
        let [page, news] = page.render_live(live)?;
        Ok(LivePage { paths: summary.paths, page, news })
    }
}

impl StoredRun {
    /// The summary but for the view, by a program that was built from a commit.
    pub fn summary(&self, git: &str) -> Summary {
        summarise(&self.settings, &self.estimates(), &self.checkpoint.book, git, true)
    }
}

/// The summary of a tally, but for the view. `examine`: whether the discretised system is examined, which takes walks.
fn summarise(settings: &Settings, estimates: &Estimates, book: &Book, git: &str, examine: bool) -> Summary {
    let quantity = settings.target.as_ref().map_or_else(Quantity::default, |target| target.quantity);
    let precision = estimates.precision(quantity, &run_on_all_cores);
    let facts = RunFacts {
        discretised: is_discretised(estimates.experiment().method())
            .then(|| if examine { distance(settings, estimates) } else { None }),
        ..facts(settings, estimates, &precision, book, git)
    };
    Summary::new(estimates.scene(), estimates.tally(), precision, facts)
}

/// How far the discretised system's answer is from the integral equation's; `None` where too little was walked to tell.
fn distance(settings: &Settings, estimates: &Estimates) -> Option<DiscretisedSummary> {
    let control = DiscretisedControl::new(estimates, settings.seed)?;
    let groups = on_all_cores(DiscretisedControl::GROUPS, |group| control.group(group));
    control.distance(estimates, &groups, settings.confidence)
}

/// The page that shows a tally.
fn page<'a>(
    settings: &'a Settings,
    summary: &'a Summary,
    estimates: &'a Estimates<'a>,
    readings: Option<&'a Readings<'a>>,
    book: &Book,
    view: &'a RenderState,
) -> Page<'a> {
    Page {
        name: &settings.name,
        summary,
        estimates,
        readings,
        milestones: milestones(book, estimates.experiment()),
        command: command(settings, summary),
        shot: view.shot(),
        level: settings.level(estimates.experiment().scene()),
        smooth: view.smooth(),
        materials: &settings.finishes,
    }
}

/// The facts of a summary beside its numbers.
fn facts(
    settings: &Settings,
    estimates: &Estimates,
    precision: &Precision,
    book: &Book,
    git: &str,
) -> RunFacts {
    let (experiment, tally) = (estimates.experiment(), estimates.tally());
    let paths = tally.counts.walks.saturating_mul(experiment.unit().paths());
    // A batch is a stream of its own.
    let stream_paths = experiment.unit().batch().unwrap_or(settings.stream_paths);
    RunFacts {
        version: env!("CARGO_PKG_VERSION").into(),
        git: (!git.starts_with("sources-")).then(|| git.into()),
        job_hash: settings.job_hash(experiment.scene().hash(), settings.seed),
        seed: settings.seed,
        method: experiment.method().clone(),
        // Reflections are counted in the scene that is walked in.
        model: Model::new(
            estimates.scene(),
            experiment.method(),
            experiment.mixture().map_or_else(|| bounces(experiment), |_| None),
        ),
        paths,
        seconds: book.effort.seconds,
        cpu_seconds: book.effort.cpu_seconds,
        workers_seen: book.effort.workers_seen,
        workers_lost: book.effort.workers_lost,
        streams: paths.div_ceil(stream_paths),
        streams_reissued: book.effort.streams_reissued,
        target: settings.target.as_ref().map(|target| target::judge(target, estimates, paths)),
        discretised: None,
        predicted: settings.forecast.map(|forecast| AccuracySummary {
            answer: if forecast.linear { "linear" } else { "means" },
            noise: forecast.noise,
            discretisation: forecast.discretisation,
            total: forecast.total(),
            asked: None,
        }),
        accuracy: estimates.answer_error(settings.predicted()).map(|error| {
            let asked = settings.total_target.map(|target| TotalSummary {
                target: target.total_error,
                reached: target::total_is_met(&target, settings.predicted(), estimates, paths),
            });
            AccuracySummary::new(error, asked)
        }),
        choice: settings.chooses_method.then(|| chosen_method(settings, experiment)),
        partition: settings.forecast.map(|forecast| partition_summary(&forecast, estimates)),
        sensors: readings(settings, estimates).map(|readings| {
            let goal = settings.sensor_goal(experiment);
            target::judge_sensors(goal.as_ref(), &readings, experiment, tally)
        }),
        planes: readings(settings, estimates).map_or_else(Vec::new, |readings| {
            let goal = settings.sensor_goal(experiment);
            let sources = experiment.groups().map_or(&[][..], |groups| groups.sources());
            let demanded = |sensor| {
                let of_sensor =
                    settings.demands.iter().filter(move |demand| demand.sensor as usize == sensor);
                of_sensor.map(|demand| (demand.figure, demand.least))
            };
            report::plane_summaries(&readings, sources, |sensor| goal.as_ref()?.asked_of(sensor), demanded)
        }),
        sources: report::source_summaries(experiment, tally, settings.source_level(experiment)),
        sensitivities: influences(settings, estimates)
            .as_ref()
            .map_or_else(Vec::new, report::sensitivity_summaries),
        import: settings.import.clone(),
        units: units(settings.light),
        checks: checks_of_result(
            estimates,
            settings.note.as_deref(),
            precision,
            book,
            (settings.seed, settings.forecast.as_ref()),
        ),
        confidence: settings.confidence,
        simultaneous: settings.simultaneous,
        provenance: provenance(book, experiment.unit().paths()),
    }
}

/// Whether there are sensors beside planes of points.
fn has_cells(readings: &Readings) -> bool {
    readings.sensors().specs().iter().any(|spec| !spec.shape.is_plane())
}

/// Whether there are planes of points.
fn has_planes(readings: &Readings) -> bool {
    readings.sensors().planes().next().is_some()
}

/// What sensors read, where there are any.
fn readings<'a>(settings: &Settings, estimates: &Estimates<'a>) -> Option<Readings<'a>> {
    let experiment = estimates.experiment();
    Readings::new(experiment, estimates.tally(), settings.sensor_level(experiment))
}

/// What materials do, where that is asked for.
fn influences<'a>(settings: &Settings, estimates: &Estimates<'a>) -> Option<Influences<'a>> {
    let experiment = estimates.experiment();
    Influences::new(experiment, estimates.tally(), settings.sensitivity_level(experiment))
}

/// The errors at the looks of a run.
fn milestones(book: &Book, experiment: &Experiment) -> Vec<Milestone> {
    let milestone = |look: &Look| Milestone {
        paths: look.walks as f64 * experiment.unit().paths() as f64,
        median_relative_error: look.median_relative_error,
        max_relative_error: look.max_relative_error,
    };
    book.looks.iter().map(milestone).collect()
}

/// The command that makes the same numbers again.
fn command(settings: &Settings, summary: &Summary) -> String {
    format!("radwalk run JOB --seed {} --paths {}", settings.seed, summary.paths)
}

/// The workers, seeds and sessions of the walks; a walk counts as `paths_per_walk` paths.
fn provenance(book: &Book, paths_per_walk: u64) -> Provenance {
    let worker = |worker: &Contributor| WorkerSummary {
        name: worker.name.clone(),
        paths: worker.walks.saturating_mul(paths_per_walk),
        leases: worker.leases,
    };
    let part = |part: &WalkRange| PartSummary {
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

/// What the program chose where the job says no method.
fn chosen_method(settings: &Settings, experiment: &Experiment) -> ChoiceSummary {
    let Settings { method, forecast, .. } = settings;
    let basis = if method.beside == Beside::Slopes { "linear" } else { "constant" };
    let patches = experiment.scene().faces().patch_count() as u64;
    let why = match forecast {
        None => "the job says no method and all patches: continuous walks carry light from where it arrived, so that only the fits depend on the patches".into(),
        Some(forecast) => format!(
            "of all patches and bases that were tried, a pilot of {} paths predicted the least error of {basis} fits on {}: {} after {} paths; \
             partition.toml as [scene] patches, the seed and budget.paths make the same again",
            quantity(forecast.paths as f64),
            counted(patches, "patch"),
            percent(forecast.total()),
            quantity(forecast.for_paths as f64)
        ),
    };
    let walk = match method.walk {
        WalkKind::Auto => WalkKind::Shooting.word(),
        walk => walk.word(),
    };
    let kind = format!("{} {walk} by {}", method.space.word(), method.estimator.word());
    ChoiceSummary { method: kind, basis, sampler: method.sampler.word().into(), why }
}

/// Patches that a pilot has chosen.
fn partition_summary(forecast: &Forecast, estimates: &Estimates) -> PartitionSummary {
    PartitionSummary {
        surfaces: forecast.surfaces,
        grouped: estimates.scene().faces().are_grouped(),
        patches: estimates.scene().faces().patch_count() as u64,
        basis: if forecast.linear { "linear" } else { "constant" },
        pilot_paths: forecast.paths,
        pilot_rays: forecast.rays,
        for_paths: forecast.for_paths,
        noise: forecast.noise,
        discretisation: forecast.discretisation,
        total: forecast.total(),
    }
}

/// The units of what a job's numbers measure.
pub fn units(light: Light) -> Units {
    match light {
        Light::Radiant => Units::RADIANT,
        Light::Luminous => Units::LUMINOUS,
    }
}
