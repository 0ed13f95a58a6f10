//! Runs on chosen patches and on patches that are given by hand.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use job::{Cut, Forecast, Job, Partition};
use radiosity::{Estimates, Experiment, Shape, Space, SurfaceSpec};

use super::truth::RoomReference;
use crate::clock::{children_seconds, thread_seconds as seconds};
pub(super) use crate::walking::walk;
use crate::walking::{Failure, advance};

/// Walks of chosen jobs.
const CHOSEN: [u64; 3] = [93_750, 375_000, 1_500_000];

/// Walks of jobs by hand, each of which goes on from one to the next.
const BY_HAND: [u64; 4] = [93_750, 375_000, 1_500_000, 6_000_000];

/// Chains take longer, and win nowhere: they have fewer.
const BY_CHAINS: u64 = 375_000;

/// The runs that are made in one room: chosen jobs and jobs by hand.
#[derive(Clone, Copy)]
pub struct TrialPlan {
    /// Choices and runs of each chosen job.
    pub seeds: u64,
    /// Longest edges of patches by hand [m].
    pub sizes: &'static [f64],
    /// Longest edges of patches of chains [m].
    pub of_chains: &'static [f64],
    /// The most walks of a job by hand.
    pub by_hand: u64,
}

impl TrialPlan {
    /// In a room of some thousand faces.
    pub const ROOM: TrialPlan =
        TrialPlan { seeds: 5, sizes: &SIZES, of_chains: &OF_CHAINS, by_hand: BY_HAND[3] };

    /// In a mesh of a million, whose faces are small without being cut, and where walks are a hundred rays long.
    pub const LONG: TrialPlan =
        TrialPlan { seeds: 1, sizes: &[1.0, 0.25], of_chains: &[], by_hand: BY_HAND[2] };
}

/// Longest edges of patches by hand [m].
const SIZES: [f64; 7] = [2.0, 1.0, 0.5, 0.35, 0.25, 0.18, 0.125];

/// Longest edges of patches of chains [m].
const OF_CHAINS: [f64; 3] = [1.0, 0.5, 0.25];

/// A scene, and what it is like.
pub struct ChoiceRoom {
    pub name: String,
    path: PathBuf,
    surfaces: Vec<SurfaceSpec>,
    is_mesh: bool,
    /// What whole commands took, by their keys: the page is written after each room.
    commands: RefCell<HashMap<Vec<String>, Option<f64>>>,
}

/// A job, and what its runs come to.
pub struct JobOutcome {
    pub what: String,
    pub patches: usize,
    /// What is set on the command that runs the job.
    pub keys: Vec<String>,
    /// The walks of the runs.
    pub walks: Vec<u64>,
    /// Processor time [s], pilot and building of the scene included, and both errors; of chosen jobs the mean and the root mean squares over
    /// the seeds.
    pub runs: Vec<[f64; 3]>,
    /// The processor time of the pilot [s], and the noise and discretisation that it predicts.
    pub predicted: Option<[f64; 3]>,
}

/// The chains of a command: the fewest that an interval comes from.
const CHAINS: u64 = 8;

impl JobOutcome {
    /// The keys of a command that takes this number of walks.
    pub fn keys_for(&self, walks: u64) -> Vec<String> {
        let of_walks = |key: &String| match key.starts_with("method.batch_paths=") {
            true => format!("method.batch_paths={}", walks / CHAINS),
            false => key.clone(),
        };
        self.keys.iter().map(of_walks).chain([format!("budget.paths={walks}")]).collect()
    }
}

impl ChoiceRoom {
    /// Reads a scene.
    pub fn new(path: &Path) -> Result<Self, Failure> {
        let is_mesh = path.extension().is_some_and(|extension| extension != "toml");
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let (surfaces, commands) = Default::default();
        let mut room = ChoiceRoom { name, path: path.into(), surfaces, is_mesh, commands };
        room.surfaces = job::load(path, &room.keys(&["budget.paths=1"]))?.scene.spec().surfaces.clone();
        Ok(room)
    }

    /// The keys of a job, which has the surfaces that a bare mesh has.
    fn keys(&self, keys: &[&str]) -> Vec<String> {
        let joined = self.is_mesh.then_some("import.join=true");
        keys.iter().copied().chain(joined).map(Into::into).collect()
    }

    /// The keys of a job without words, with these.
    fn keys_of_open(&self, keys: &[String]) -> Vec<String> {
        let auto = (!self.is_mesh).then(|| "scene.patches=auto".into());
        keys.iter().cloned().chain(auto).collect()
    }

    /// The processor time of `radwalk run` on a job from reading the mesh to the last file, picture and page among them [s]; `None` where the scene is no mesh,
    /// or the system does not tell.
    pub fn whole_command(&self, keys: &[String]) -> Result<Option<f64>, Failure> {
        if !self.is_mesh {
            return Ok(None);
        }
        if let Some(known) = self.commands.borrow().get(keys) {
            return Ok(*known);
        }
        let program = std::env::current_exe()?.with_file_name("radwalk");
        let folder = tempfile::tempdir()?;
        let mut command = Command::new(&program);
        command.args([
            "run".as_ref(),
            self.path.as_os_str(),
            "--out".as_ref(),
            folder.path().join("out").as_os_str(),
        ]);
        command.args(["--quiet", "--workers", "1"]).args(keys.iter().flat_map(|key| ["--set", key]));
        let before = children_seconds();
        let output = command.stdout(Stdio::null()).stderr(Stdio::piped()).output();
        let output =
            output.map_err(|error| format!("{} is run beside this program: {error}", program.display()))?;
        // 1: the target is not reached.
        if !matches!(output.status.code(), Some(0 | 1)) {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
        }
        let took = before.zip(children_seconds()).map(|(before, after)| after - before);
        self.commands.borrow_mut().insert(keys.to_vec(), took);
        Ok(took)
    }

    /// Cells whose edges are no longer than this.
    pub fn even(&self, size: f64, linear: bool) -> Partition {
        let steps = |length: f64| (length / size).ceil().clamp(1.0, 4096.0) as u32;
        let cut = |surface: &SurfaceSpec| {
            let (_, u, v) = surface.shape.edges();
            match surface.shape {
                Shape::Triangle { .. } => Cut::Rows(steps(u.length().max(v.length()).max((u - v).length()))),
                _ => Cut::Grid([u, v].map(|edge| steps(edge.length()))),
            }
        };
        let cuts = self.surfaces.iter().map(cut).collect();
        Partition { cuts, groups: Vec::new(), linear, space: Space::Continuous, forecast: None }
    }
}

/// The method of a job on given patches, and the processor time of building its scene [s].
pub fn experiment(
    room: &ChoiceRoom,
    partition: Partition,
    keys: &[&str],
) -> Result<(Experiment, f64), Failure> {
    let keys = room.keys(&[&["budget.paths=100000000"], keys].concat());
    let job = job::load(&room.path, &keys).and_then(|job| job.cut(&keys, &partition))?;
    let start = seconds();
    let scene = job.build_scene()?;
    Ok((Experiment::new(scene, job.method.walks())?, seconds() - start))
}

/// What jobs by hand come to.
pub fn given(
    room: &ChoiceRoom,
    truth: &RoomReference,
    effort: TrialPlan,
) -> Result<Vec<JobOutcome>, Failure> {
    let mut found = Vec::new();
    for (linear, basis) in [(true, "linear"), (false, "constant")] {
        for &size in effort.sizes {
            let keys = [format!("method.basis={basis}"), "method.space=continuous".into()];
            found.push(run(
                room,
                (size, linear),
                &format!("{basis} walks, {size} m"),
                &keys,
                (truth, effort.by_hand),
            )?);
        }
        for &size in effort.of_chains {
            let patches = room.even(size, linear).cuts.iter().map(Cut::cells).sum::<u64>();
            let rays = BY_HAND[0].max(64 * patches);
            let keys = [
                format!("method.basis={basis}"),
                "method.walk=jacobi".into(),
                format!("method.batch_paths={rays}"),
            ];
            found.push(run(
                room,
                (size, linear),
                &format!("{basis} chains, {size} m"),
                &keys,
                (truth, BY_CHAINS),
            )?);
        }
    }
    Ok(found)
}

fn run(
    room: &ChoiceRoom,
    (size, linear): (f64, bool),
    what: &str,
    keys: &[String],
    (truth, most): (&RoomReference, u64),
) -> Result<JobOutcome, Failure> {
    let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
    let (experiment, building) = experiment(room, room.even(size, linear), &keys)?;
    let unit = experiment.unit().paths();
    let (mut time, mut tally, mut done) = (building, experiment.tally(), 0);
    let by_hand = [format!("import.patch_size={size}"), "import.join=true".into()];
    let mut found = JobOutcome {
        what: what.into(),
        patches: experiment.scene().faces().patch_count(),
        keys: keys.iter().map(|&key| key.into()).chain(by_hand).collect(),
        walks: Vec::new(),
        runs: Vec::new(),
        predicted: None,
    };
    for walks in BY_HAND.into_iter().filter(|&walks| walks <= most) {
        let walks = (walks / unit).max(2);
        if walks <= done {
            continue;
        }
        let start = seconds();
        advance(&experiment, 1, walks, &mut tally);
        (time, done) = (time + seconds() - start, walks);
        let [all, placewise] = truth.errors(&Estimates::new(&experiment, &tally, 0.95));
        found.walks.push(walks * unit);
        found.runs.push([time, all, placewise]);
    }
    eprintln!("{}: {what}, {} patches: {:.3?}", room.name, found.patches, found.runs);
    Ok(found)
}

/// What the program's choice comes to, for each number of walks, and without words.
pub fn chosen(
    room: &ChoiceRoom,
    truth: &RoomReference,
    effort: TrialPlan,
) -> Result<Vec<JobOutcome>, Failure> {
    let budgets = CHOSEN.map(|walks| Some(format!("budget.paths={walks}")));
    budgets.into_iter().chain([None]).map(|budget| chosen_for((room, truth), budget, effort.seeds)).collect()
}

/// One row of the page: choices and runs of all seeds.
fn chosen_for(
    (room, truth): (&ChoiceRoom, &RoomReference),
    budget: Option<String>,
    seeds: u64,
) -> Result<JobOutcome, Failure> {
    let runs: Vec<ChosenRun> = (1..=seeds)
        .map(|seed| {
            let keys: Vec<String> = budget.iter().cloned().chain([format!("seed={seed}")]).collect();
            chosen_run(room, truth, &keys)
        })
        .collect::<Result<_, _>>()?;
    let mean = |of: &dyn Fn(&ChosenRun) -> f64| runs.iter().map(of).sum::<f64>() / seeds as f64;
    let root = |of: &dyn Fn(&ChosenRun) -> f64| mean(&|run| of(run) * of(run)).sqrt();
    let of_first = &runs[0].forecast;
    let basis = if of_first.linear { "linear" } else { "constant" };
    let found = JobOutcome {
        what: format!(
            "{basis}, {:.0} walks, {:.0} of the pilot",
            mean(&|run| run.forecast.for_paths as f64),
            mean(&|run| run.forecast.paths as f64)
        ),
        patches: mean(&|run| run.patches as f64) as usize,
        keys: budget.iter().cloned().chain(["seed=1".into()]).collect(),
        walks: vec![mean(&|run| run.forecast.for_paths as f64) as u64],
        runs: vec![[mean(&|run| run.time), root(&|run| run.errors[0]), root(&|run| run.errors[1])]],
        predicted: Some([
            mean(&|run| run.choosing),
            root(&|run| run.forecast.noise),
            root(&|run| run.forecast.discretisation),
        ]),
    };
    let each: Vec<[f64; 2]> = runs.iter().map(|run| run.errors).collect();
    let JobOutcome { what, patches, runs, predicted, .. } = &found;
    eprintln!("{}: chosen {what}, {patches} patches: {runs:.3?} {predicted:.4?} {each:.3?}", room.name);
    Ok(found)
}

/// A choice and a run on it.
struct ChosenRun {
    /// Processor time of all, and of choosing [s].
    time: f64,
    choosing: f64,
    errors: [f64; 2],
    patches: usize,
    forecast: Forecast,
}

fn chosen_run(room: &ChoiceRoom, truth: &RoomReference, keys: &[String]) -> Result<ChosenRun, Failure> {
    let open = open(room, keys)?;
    let start = seconds();
    let (experiment, forecast, job) = choose(open, room, keys)?;
    let choosing = seconds() - start;
    let tally = walk(&experiment, job.seed, forecast.for_paths.min(job.budget.paths));
    let estimates = Estimates::new(&experiment, &tally, 0.95);
    let time = seconds() - start;
    let patches = experiment.scene().faces().patch_count();
    Ok(ChosenRun { time, choosing, errors: truth.errors(&estimates), patches, forecast })
}

/// A job without words.
fn open(room: &ChoiceRoom, keys: &[String]) -> Result<Job, Failure> {
    Ok(job::load(&room.path, &room.keys_of_open(keys))?)
}

/// The method of an open job on patches that are chosen for it.
fn choose(open: Job, room: &ChoiceRoom, keys: &[String]) -> Result<(Experiment, Forecast, Job), Failure> {
    let Some(chosen) = results::choose(&open, 1)? else { return Err("nothing is open".into()) };
    let job = open.cut(&room.keys_of_open(keys), &chosen.partition)?;
    let forecast = job.forecast.ok_or("no forecast")?;
    Ok((Experiment::new(chosen.build_scene(&job)?, job.method.walks())?, forecast, job))
}

/// The method of a job without words on patches that are chosen for it.
pub fn on_chosen(room: &ChoiceRoom, keys: &[String]) -> Result<(Experiment, Forecast, Job), Failure> {
    choose(open(room, keys)?, room, keys)
}
