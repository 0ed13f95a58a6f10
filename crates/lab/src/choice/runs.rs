//! Runs on chosen patches and on patches that are given by hand.

use std::path::{Path, PathBuf};

use job::{Cut, Partition};
use radiosity::{Estimates, Experiment, Shape, Space, SurfaceSpec};

use super::truth::RoomReference;
use crate::clock::thread_seconds as seconds;
pub(super) use crate::walking::walk;
use crate::walking::{Failure, advance};

/// Jobs have one of these many parts of the walks of a reference. Each of those by hand goes on from one to the next.
const PARTS: [u64; 3] = [64, 16, 4];

/// Longest edges of patches by hand [m].
const SIZES: [f64; 5] = [1.0, 0.5, 0.35, 0.25, 0.125];

/// Longest edges of patches of chains [m].
const OF_CHAINS: [f64; 2] = [0.5, 0.25];

/// A scene, and what it is like.
pub struct ChoiceRoom {
    pub name: String,
    path: PathBuf,
    surfaces: Vec<SurfaceSpec>,
    /// Of one side of all surfaces [m²].
    pub area: f64,
    is_mesh: bool,
}

/// A job, and what its runs come to.
pub struct JobOutcome {
    pub what: String,
    pub patches: usize,
    /// Processor time [s], pilot included, and both errors.
    pub runs: Vec<[f64; 3]>,
    /// The processor time of the pilot [s], and the noise and discretisation that it foretells.
    pub foretold: Option<[f64; 3]>,
}

impl ChoiceRoom {
    /// Reads a scene.
    pub fn new(path: &Path) -> Result<Self, Failure> {
        let is_mesh = path.extension().is_some_and(|extension| extension != "toml");
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let mut room = ChoiceRoom { name, path: path.into(), surfaces: Vec::new(), area: 0.0, is_mesh };
        room.surfaces = job::load(path, &room.keys(&["budget.paths=1"]))?.scene.spec().surfaces.clone();
        room.area = room.surfaces.iter().map(|surface| surface.shape.area()).sum();
        Ok(room)
    }

    /// The keys of a job, which has the surfaces that a bare mesh has.
    fn keys(&self, keys: &[&str]) -> Vec<String> {
        let joined = self.is_mesh.then_some("import.join=true");
        keys.iter().copied().chain(joined).map(Into::into).collect()
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
pub fn given(room: &ChoiceRoom, truth: &RoomReference) -> Result<Vec<JobOutcome>, Failure> {
    let mut found = Vec::new();
    for (linear, basis) in [(true, "linear"), (false, "constant")] {
        for size in SIZES {
            let keys = [format!("method.basis={basis}"), "method.space=continuous".into()];
            found.push(run(room, (size, linear), &format!("{basis} walks, {size} m"), &keys, truth)?);
        }
        for size in OF_CHAINS {
            let patches = room.even(size, linear).cuts.iter().map(Cut::cells).sum::<u64>();
            let rays = (truth.walks / PARTS[0]).max(64 * patches);
            let keys = [
                format!("method.basis={basis}"),
                "method.walk=jacobi".into(),
                format!("method.batch_paths={rays}"),
            ];
            found.push(run(room, (size, linear), &format!("{basis} chains, {size} m"), &keys, truth)?);
        }
    }
    Ok(found)
}

fn run(
    room: &ChoiceRoom,
    (size, linear): (f64, bool),
    what: &str,
    keys: &[String],
    truth: &RoomReference,
) -> Result<JobOutcome, Failure> {
    let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
    let (experiment, building) = experiment(room, room.even(size, linear), &keys)?;
    let unit = experiment.unit().paths();
    let (mut time, mut tally, mut done) = (building, experiment.tally::<2>(), 0);
    let mut found = JobOutcome {
        what: what.into(),
        patches: experiment.scene().faces().patch_count(),
        runs: Vec::new(),
        foretold: None,
    };
    for walks in PARTS.map(|part| (truth.walks / part / unit).max(2)) {
        if walks <= done {
            continue;
        }
        let start = seconds();
        advance(&experiment, 1, walks, &mut tally);
        (time, done) = (time + seconds() - start, walks);
        let [all, placewise] = truth.errors(&Estimates::new(&experiment, &tally, 0.95));
        found.runs.push([time, all, placewise]);
    }
    eprintln!("{}: {what}, {} patches: {:.3?}", room.name, found.patches, found.runs);
    Ok(found)
}

/// What the program's choice comes to, for each number of walks, and without words.
pub fn chosen(room: &ChoiceRoom, truth: &RoomReference) -> Result<Vec<JobOutcome>, Failure> {
    let budgets = PARTS.map(|part| format!("budget.paths={}", truth.walks / part));
    let mut found = Vec::new();
    for keys in budgets.iter().map(|key| vec![key.clone()]).chain([Vec::new()]) {
        let keys: Vec<String> =
            keys.into_iter().chain((!room.is_mesh).then(|| "scene.patches=auto".into())).collect();
        let open = job::load(&room.path, &keys)?;
        let start = seconds();
        let Some(chosen) = results::choose(&open, 1)? else { return Err("nothing is open".into()) };
        let choosing = seconds() - start;
        let job = job::load(&room.path, &keys).and_then(|job| job.cut(&keys, &chosen.partition))?;
        let forecast = job.forecast.ok_or("no forecast")?;
        let experiment = Experiment::new(chosen.build_scene(&job)?, job.method.walks())?;
        let tally = walk(&experiment, 1, forecast.for_paths.min(job.budget.paths));
        let told = Estimates::new(&experiment, &tally, 0.95);
        let time = seconds() - start;
        let [all, placewise] = truth.errors(&told);
        let patches = experiment.scene().faces().patch_count();
        let basis = if forecast.linear { "linear" } else { "constant" };
        found.push(JobOutcome {
            what: format!("{basis}, {} walks, {} of the pilot", forecast.for_paths, forecast.paths),
            patches,
            runs: vec![[time, all, placewise]],
            foretold: Some([choosing, forecast.noise, forecast.discretisation]),
        });
        let JobOutcome { what, runs, foretold, .. } = &found[found.len() - 1];
        eprintln!("{}: chosen {what}, {patches} patches: {runs:.3?} {foretold:.4?}", room.name);
    }
    Ok(found)
}
