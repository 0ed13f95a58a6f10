//! `radwalk run` and `radwalk coordinate`: a job from file to results.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use job::{Budget, Job, OutputFile};
use judge::target::looks;
use monitor::{Description, Gauge, Reports, Showing, TextPage, Watch};
use protocol::{Checkpoint, Coordinator, Ending, JobPlan, Look, Notice, Past};
use radiosity::{Experiment, Space, Tally};
use report::view_troubles;
use results::{Identity, Keeper, Latest, RunOutput, Settings};
use tracing::{info, warn};
use voice::{Phase, say};

use crate::args::{CoordinateArgs, LeadArgs, OutArgs, RunArgs, SessionArgs};
use crate::build::{BUILD, GIT};
use crate::choose;
use crate::fault::{Fault, Outcome};
use crate::lead::{Executor, Left, Remote, WorkerEntry, plan};
use crate::pilot::{Host, PilotWorkers};
use crate::progress::{Display, tell_notice};
use crate::{signals, summary};

/// Between tries to write the results of a run.
const FINAL_WAITS: [Duration; 4] =
    [Duration::from_secs(1), Duration::from_secs(2), Duration::from_secs(4), Duration::from_secs(8)];

/// The part of a wall time that walks have at least, however long their pilot took.
const WALKING: f64 = 0.1;

/// A worker takes a second or more to build a scene of more surfaces than this.
const SEARCHED_AHEAD: usize = 200_000;

/// Runs a job on worker processes of this machine.
pub(crate) fn run(args: &RunArgs) -> Result<Outcome, Fault> {
    let team = args.team.team();
    start(&args.work, &args.session, team.workers, &|_, _| Ok(Executor::Local(team)))
}

/// Coordinates workers that are started elsewhere.
pub(crate) fn coordinate(args: &CoordinateArgs) -> Result<Outcome, Fault> {
    let open = |scene_hash, folder: &Path| {
        let file = args.access.clone().unwrap_or_else(|| folder.join("access.json"));
        let address = (&*args.at.listen, args.at.advertise.as_deref());
        Ok(Executor::Remote(Remote::open(scene_hash, address, file)?))
    };
    start(&args.work, &args.session, 0, &open)
}

/// Opens what workers of a scene join, for a run in a folder.
type ExecutorOpener<'a> = &'a dyn Fn([u8; 32], &Path) -> Result<Executor, Fault>;

/// A run whose pilot may need its folder and workers.
struct Hosted<'a> {
    folder: &'a Path,
    replace: bool,
    exports: &'a [OutputFile],
    open: ExecutorOpener<'a>,
}

impl Host for Hosted<'_> {
    fn claim(&self) -> Result<RunOutput, Fault> {
        Ok(RunOutput::new(self.folder, self.replace, self.exports, GIT)?)
    }

    fn open(&self, scene_hash: [u8; 32]) -> Result<Executor, Fault> {
        (self.open)(scene_hash, self.folder)
    }
}

/// Prepares a job for workers, of which some are of this machine, and leads them through it.
fn start(
    args: &LeadArgs,
    session: &SessionArgs,
    workers: usize,
    open: ExecutorOpener,
) -> Result<Outcome, Fault> {
    signals::catch();
    let (prepared, executor) = match Prepared::new(args, session.resume, (workers, open)) {
        Err(Fault::Interrupted) => {
            warn!("interrupted; what the pilot has walked is kept, go on with --resume");
            return Ok(Outcome::Interrupted);
        }
        prepared => prepared?,
    };
    prepared.drive(executor, session, &args.out)
}

/// Says what was left out, changed or assumed of meshes, in ten lines at most.
fn tell_notes(job: &Job) {
    // Lines.
    const MOST: usize = 10;
    let notes = job.scene.notes();
    let shown = if notes.len() > MOST { MOST - 1 } else { notes.len() };
    notes[..shown].iter().for_each(|note| info!("note: {note}"));
    if shown < notes.len() {
        info!("note: and {} more, which `radwalk check` tells", notes.len() - shown);
    }
}

/// A job that is ready to be shot. Its surfaces are those of the experiment: as they were read they are given up.
struct Prepared {
    /// The name of the job.
    name: String,
    budget: Budget,
    /// Whether the target is one that the job does not name.
    is_default_target: bool,
    settings: Settings,
    experiment: Experiment,
    output: RunOutput,
    identity: Identity,
    past: Past,
    /// The workers of earlier sessions.
    workers_before: u64,
    /// What the latest tally of the output folder is to this run.
    latest: Latest,
}

impl Prepared {
    /// `workers` is how many will work on this machine. They may have joined already, to walk a pilot.
    fn new(
        args: &LeadArgs,
        resume: bool,
        (workers, open): (usize, ExecutorOpener),
    ) -> Result<(Self, Executor), Fault> {
        let LeadArgs { job: asked, out, export } = args;
        let phase = Phase::begin("reading the scene");
        let job = choose::read(asked)?;
        let folder = out.out.clone().unwrap_or_else(|| default_folder(&job));
        // A result that stands beside the pilot of this job is the one that the job replaces.
        let resume_walks = resume && !results::is_being_replaced(&folder, &job)?;
        let kept = match resume_walks && job.auto.is_some() {
            true => results::stored_partition(&folder)?,
            false => None,
        };
        let host = Hosted { folder: &folder, replace: out.force || resume, exports: &export.export, open };
        let mut pilot = PilotWorkers::new(&host, resume, &phase);
        let began = Instant::now();
        let read = choose::choose_for(job, asked, &phase, (kept, &mut pilot));
        let pilot_seconds = began.elapsed().as_secs_f64();
        let (output, executor) = pilot.leave(read.is_ok());
        let read = read?;
        tell_notes(&read.job);
        results::check_memory(&read.job, workers)?;
        phase.now("building the scene");
        let is_chosen = read.is_chosen();
        let (scene, job) = read.build()?;
        let experiment = Experiment::new(scene, job.method.walks())?
            .with_sensors(job.scene.sensors())?
            .with_groups(&job.sources, &job.sensitivity)?;
        phase.now("following light from the lamps");
        // What is wrong with the light comes before all that is made of it.
        doctor::warnings(experiment.scene()).iter().for_each(|warning| warn!("{warning}"));
        judge::sensor_warnings(&experiment).iter().for_each(|warning| warn!("{warning}"));
        judge::plan::idle_workers(&experiment, job.budget.paths, workers as u64)
            .iter()
            .for_each(|idle| warn!("{idle}"));
        let settings = Settings::of(&job);
        view_troubles(experiment.scene(), &settings.view, &settings.views)
            .iter()
            .for_each(|trouble| warn!("{trouble}"));
        let identity = Identity::new(&job, &settings, &experiment, BUILD)?;
        let output = output.map_or_else(|| host.claim(), Ok)?;
        let past = Past::none(experiment.tally());
        let mut budget = job.budget;
        if is_chosen {
            budget.wall_seconds = budget.wall_seconds.map(|wall| (wall - pilot_seconds).max(WALKING * wall));
        }
        let mut prepared = Prepared {
            name: job.name,
            budget,
            is_default_target: job.is_default_target,
            settings,
            experiment,
            output,
            identity,
            past,
            workers_before: 0,
            latest: Latest::Foreign,
        };
        if resume_walks {
            phase.now("reading the checkpoint");
            prepared.resume()?;
        }
        if is_chosen {
            phase.now("keeping the chosen patches");
            prepared.keep_choice();
        }
        let executor = executor.map_or_else(|| host.open(prepared.identity.scene_hash), Ok)?;
        Ok((prepared, executor))
    }

    /// Goes on from the latest usable checkpoint; from the beginning, where there is none yet.
    fn resume(&mut self) -> Result<(), Fault> {
        let job = (&self.settings, &self.experiment);
        let (folder, budget) = (self.output.path(), self.budget.paths);
        let Some(resumed) = results::resume(folder, &mut self.identity, job, budget, BUILD)? else {
            warn!("there is no checkpoint to resume from; the run begins at its first walk");
            return Ok(());
        };
        if let Some(error) = resumed.passed_over {
            warn!("{error}; the previous checkpoint is used instead");
        }
        info!("resumed after {} paths", resumed.paths);
        (self.past, self.latest) = (resumed.past, resumed.latest);
        self.workers_before = self.past.effort.workers_seen;
        Ok(())
    }

    /// Keeps what the pilot has chosen before the first walk, so that a run that is stopped early resumes without another pilot. The result of
    /// another run is not replaced by the tally of no walk: `pilot.bin` keeps the choice until there are walks. A disk that is full may have room again
    /// by the first checkpoint.
    fn keep_choice(&mut self) {
        if self.latest == Latest::Foreign && results::has_tally(self.output.path()) {
            return;
        }
        let nothing = Past::none(self.experiment.tally());
        match self.output.keep(&self.identity.checkpoint(nothing), self.latest) {
            Ok(()) => self.latest = Latest::Good,
            Err(error) => warn!("{error}; the run goes on without its patches being kept"),
        }
    }

    fn plan(&self) -> Result<JobPlan, Fault> {
        let mut observer = self.settings.observer(&self.experiment).going_on_from(&self.past.tally);
        let walks = self.budget.paths / self.experiment.unit().paths();
        let judge = Box::new(move |tally: &Tally, seen: &[Look]| observer.look(tally, seen));
        plan(&self.identity, &self.budget, &self.experiment, looks(&self.experiment, walks), judge)
    }

    /// What status files say of the job itself.
    fn description(&self) -> Description {
        Description { job: self.name.clone(), paths_per_walk: self.experiment.unit().paths() }
    }

    /// The page that follows the run, where one is wanted.
    fn showing(&self, session: &SessionArgs, out: &OutArgs) -> Result<Option<Showing>, Fault> {
        let Some(address) = &session.watch else { return Ok(None) };
        let showing = Showing::open(address, GIT, &self.experiment, &self.settings)?;
        // A port or a key that was drawn is known from here alone.
        match out.quiet {
            true => say(&format!("the result so far is at {}", showing.url())),
            false => info!(event = "watch", "the result so far is at {}", showing.url()),
        }
        Ok(Some(showing))
    }

    /// Leads workers through the job to its end, and writes what came of it.
    fn drive(self, executor: Executor, session: &SessionArgs, out: &OutArgs) -> Result<Outcome, Fault> {
        let station = executor.station(&self.identity, &self.experiment)?;
        self.search_ahead(&executor);
        let page = session.metrics.as_deref().map(open_page).transpose()?;
        let reports = Reports::new(self.description(), self.output.path(), executor.access_file(), page);
        let showing = self.showing(session, out)?;
        self.serve((executor, station), out, (reports, showing))
    }

    /// Searches for what light reaches while workers of this machine start and build a large scene: every look at such a scene asks for it.
    fn search_ahead(&self, executor: &Executor) {
        let scene = self.experiment.scene();
        let is_asked = self.experiment.method().space() == Space::Continuous;
        if is_asked && scene.surfaces().len() > SEARCHED_AHEAD && matches!(executor, Executor::Local(_)) {
            let scene = scene.clone();
            std::thread::spawn(move || scene.search_for_light(&parallel::run_on_all_cores));
        }
    }

    /// Serves the job to its end and writes what came of it.
    fn serve(
        mut self,
        (executor, station): (Executor, WorkerEntry),
        out: &OutArgs,
        (reports, showing): (Reports, Option<Showing>),
    ) -> Result<Outcome, Fault> {
        let plan = self.plan()?;
        let nothing = Past::none(Tally::new(0, self.past.tally.layout()));
        let past = std::mem::replace(&mut self.past, nothing);
        let mut coordinator = Coordinator::new(plan, past);
        let mut watch = self.watch(&coordinator, reports, showing)?;
        let mut display = Display::new(out);
        let turn = |coordinator: &Coordinator, notices: &[Notice]| {
            notices.iter().for_each(tell_notice);
            let looked = watch.look(coordinator, notices, display.is_due());
            looked.status.iter().for_each(|status| display.show(status));
            looked.trouble.iter().for_each(|trouble| warn!("{trouble}"));
            looked.goes_on
        };
        let left = station.lead(&mut coordinator, turn)?;
        // No one is there to answer workers that come while results are written.
        drop(executor);
        display.finish();
        let (identity, latest) = watch.finish();
        let checkpoint = identity.checkpoint(coordinator.into_past());
        // After an overflow the sums are no longer those of any walks.
        if left.ending != Ending::Overflow {
            self.write(&checkpoint, latest, out)?;
        }
        self.outcome(left, &checkpoint)
    }

    /// What is done while the job is walked.
    fn watch(
        &self,
        coordinator: &Coordinator,
        reports: Reports,
        showing: Option<Showing>,
    ) -> Result<Watch<'_>, Fault> {
        let interval = Duration::from_secs_f64(self.budget.checkpoint_seconds);
        let walks = coordinator.progress().walks;
        let folder = self.output.folder().clone();
        let keeper = Keeper::new(folder, interval, self.identity.clone(), walks, self.latest)?;
        let gauge = Gauge::new(&self.experiment, &self.settings, self.budget.wall_seconds);
        Ok(Watch::new(gauge, (reports, showing), (&self.identity, keeper)))
    }

    /// Keeps the tally, and writes the results that follow from it. A disk may be full for a moment only, and it would be a pity of the walks: both are
    /// tried for a while.
    fn write(&self, checkpoint: &Checkpoint, latest: Latest, out: &OutArgs) -> Result<(), Fault> {
        let Self { output, settings, experiment, .. } = self;
        let mut waits = FINAL_WAITS.into_iter();
        let has_walked = checkpoint.tally.counts.walks > 0;
        if has_walked {
            try_for_a_while(&mut waits, || Ok(output.keep(checkpoint, latest)?))?;
        }
        let joined = checkpoint.book.effort.workers_seen.saturating_sub(self.workers_before);
        let write = || summary::write(output, (settings, Some(joined)), experiment, checkpoint, out);
        try_for_a_while(&mut waits, write).map_err(|fault| match is_of_a_disk(&fault) && has_walked {
            true => Fault::TallyAlone { fault: Box::new(fault), out: output.path().into() },
            false => fault,
        })
    }

    fn outcome(&self, left: Left, checkpoint: &Checkpoint) -> Result<Outcome, Fault> {
        match left.ending {
            Ending::NoWorkers => Err(Fault::NoWorkers(left.trouble)),
            Ending::Overflow => Err(Fault::Overflow),
            Ending::Stuck => Err(Fault::Stuck { out: self.output.path().into() }),
            Ending::Interrupted => Ok(Outcome::Interrupted),
            Ending::TargetReached => Ok(Outcome::Done),
            // The clock ran out before anything was known.
            Ending::WallClock if checkpoint.tally.counts.walks == 0 => Ok(Outcome::TargetMissed),
            Ending::BudgetSpent | Ending::WallClock => {
                let missed = self.settings.target_missed(&self.experiment, &checkpoint.tally);
                Ok(if missed && !self.is_default_target { Outcome::TargetMissed } else { Outcome::Done })
            }
        }
    }
}

/// Tries to write something again after each of some waits, where a disk is what refuses.
fn try_for_a_while(
    waits: &mut impl Iterator<Item = Duration>,
    mut write: impl FnMut() -> Result<(), Fault>,
) -> Result<(), Fault> {
    loop {
        let fault = match write() {
            Err(fault) if is_of_a_disk(&fault) => fault,
            done => return done,
        };
        let Some(wait) = waits.next() else { return Err(fault) };
        warn!("{fault}; it is tried again in {} s", wait.as_secs());
        std::thread::sleep(wait);
    }
}

fn is_of_a_disk(fault: &Fault) -> bool {
    matches!(fault, Fault::Results(results::Error::Report(report::Error::Io { .. })))
}

/// Opens a page of metrics, and prints its address.
fn open_page(address: &str) -> Result<TextPage, Fault> {
    let (page, bound) = monitor::open_metrics(address)?;
    info!(event = "metrics", "metrics are at http://{bound}/metrics");
    Ok(page)
}

/// The default output folder: out/<job name>.
pub(crate) fn default_folder(job: &Job) -> PathBuf {
    Path::new("out").join(&job.name)
}
