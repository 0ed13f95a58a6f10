//! The choice of a job's patches: a pilot walks the scene on a fine grid, with walks of its own, and a rule reads off what to cut.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use job::{Auto, Cut, Forecast, Job, Partition, WalkKind};
use judge::MOMENTS;
use judge::partition::{Basis, Candidates, Choice, Grid, MeshLight, PilotTallies, SurfaceLight, doublings};
use radiosity::{Birth, Direction, Estimator, Experiment, Overflow, Score, Sequence, Space, Tally, Walks};

use crate::error::Error;
use crate::meshes::{Cells, Meshes};

/// The pilot takes one of this many parts of the walks that it foretells, between [`LEAST`] and [`MOST`].
const SHARE: u64 = 5;

/// The least number of walks of a pilot.
const LEAST: u64 = 1 << 14;

/// The largest number of walks of a pilot: the pilot runs in one process, however many workers the job has.
const MOST: u64 = 1 << 24;

/// The pilot looks at the light first after one of this many parts of its walks: where the light is even, that is enough.
const FIRST_PART: u64 = 8;

/// Independent groups of the pilot's walks: products of what they find have no bias.
const GROUPS: u64 = 16;

/// From one group's first walk to the next one's, in the pilot's sequence.
const GROUP_STRIDE: u64 = 1 << 40;

/// Walks of the pilot for each of its cells.
const WALKS_PER_CELL: u64 = 16;

/// The fewest cells of a pilot, and the most, all surfaces together.
const CELLS: [u64; 2] = [1 << 8, 1 << 16];

/// The walks of the first look of a job with a total error.
const FIRST: u64 = 1 << 14;

/// The part of a total error that the choice aims at: what is foretold is not exact.
const AIM: f64 = 0.9;

/// Chooses the patches that a job leaves open, on some threads of this process. The choice is a function of the job, whatever the
/// threads. `None` for a job that leaves nothing open.
///
/// # Errors
/// Where the scene or the method is refused, or a sum overflows.
pub fn choose(job: &Job, threads: usize) -> Result<Option<Partition>, Error> {
    let Some(auto) = &job.auto else { return Ok(None) };
    if let Some(meshes) = many_faces(job, auto) {
        return choose_groups(job, auto, &meshes, threads).map(Some);
    }
    let grids = grids(job, &auto.surfaces);
    let mut pilot = Pilot::new(job, &grids, Score::Linear, None)?;
    let bases: Vec<Basis> = match job.total_target {
        // The error that a job may ask for is that of the means.
        Some(_) => vec![Basis::Constant],
        None => [(auto.constant, Basis::Constant), (auto.linear, Basis::Linear)]
            .into_iter()
            .filter_map(|(may, basis)| may.then_some(basis))
            .collect(),
    };
    let bases = if bases.is_empty() { vec![Basis::Constant] } else { bases };
    let budget = job.budget.paths;
    let mut walks = match job.total_target {
        Some(_) => LEAST.min(pilot_for(budget)),
        None => (pilot_for(budget) / FIRST_PART).max(LEAST.min(budget)),
    };
    loop {
        pilot.walk(walks, threads)?;
        let (lights, energy) = pilot.see();
        let candidates = Candidates::new(&lights, &bases);
        let choice = match &job.total_target {
            None => candidates.choose(budget as f64),
            Some(target) => {
                let aim = AIM * target.total_error;
                let error = aim * aim * energy.max(0.0);
                candidates.choose_for(error, FIRST as f64, budget as f64)
            }
        };
        let wanted = pilot_for(choice.walks as u64);
        // Where the light is even, the first look is enough.
        let enough = wanted <= walks || job.total_target.is_none() && candidates.are_even();
        if enough {
            return Ok(Some(pilot.tell(&choice, energy, auto.surfaces.len())));
        }
        walks = match job.total_target {
            None => wanted,
            // What is wanted follows from what is seen, the better the more walks there are.
            Some(_) => wanted.min(4 * walks),
        };
    }
}

/// The meshes of a job, where their faces are to be grouped. A total error is asked of patches whose spread is known, and that of groups
/// is not.
fn many_faces(job: &Job, auto: &Auto) -> Option<Meshes> {
    let paths = job.budget.paths;
    let cells = pilot_for(paths).clamp(CELLS[0], CELLS[1]);
    Meshes::new(job.scene.spec(), auto, paths, cells).filter(|_| job.total_target.is_none())
}

/// Chooses patches where faces of meshes are grouped: constants, on other surfaces in grids.
fn choose_groups(job: &Job, auto: &Auto, meshes: &Meshes, threads: usize) -> Result<Partition, Error> {
    let others: Vec<usize> = auto.surfaces.iter().copied().filter(|&surface| !meshes.has(surface)).collect();
    let grids = grids(job, &others);
    let cells = meshes.pilot(&cuts_of(&grids));
    let mut pilot = Pilot::new(job, &grids, Score::Of, Some(&cells))?;
    pilot.walk(pilot_for(job.budget.paths), threads)?;
    let walks = job.budget.paths as f64;
    let tallies = pilot.tallies();
    let lights = pilot.lights(&tallies, |surface| !meshes.has(surface));
    let mut choice = Candidates::new(&lights, &[Basis::Constant]).choose(walks);
    let on_meshes =
        MeshLight::new(&pilot.experiment, &tallies, (&meshes.clusters, &meshes.finest), &cells.patch_of_part);
    let grouped = on_meshes.choose(walks);
    choice.noise += grouped.noise;
    choice.lost += grouped.lost;
    let energy = on_meshes.energy() + lights.iter().map(SurfaceLight::energy).sum::<f64>();
    let mut chosen = std::mem::take(&mut choice.cuts).into_iter();
    let cuts: Vec<Cut> = (0..grids.len())
        .map(|surface| match meshes.has(surface) {
            true => grids[surface].0.cut(),
            false => chosen.next().expect("a cut for each of the other surfaces"),
        })
        .collect();
    let cells = meshes.cells(&grouped.part_of_place, &cuts);
    choice.cuts = cells.cuts;
    let partition = pilot.tell(&choice, energy, auto.surfaces.len());
    Ok(Partition { groups: cells.patch_of_cell, ..partition })
}

/// For every surface its coarsest grid, and how often the pilot's doubles its cells where it is `open`.
type Grids = Vec<(Grid, Option<[u32; 2]>)>;

fn grids(job: &Job, open: &[usize]) -> Grids {
    let surfaces = &job.scene.spec().surfaces;
    let area: f64 = open.iter().map(|&surface| surfaces[surface].shape.area()).sum();
    let cells = (pilot_for(job.budget.paths) / WALKS_PER_CELL).clamp(CELLS[0], CELLS[1]);
    let mut grids: Grids = surfaces.iter().map(|surface| (Grid::of(&surface.shape), None)).collect();
    for &surface in open {
        let (base, top) = &mut grids[surface];
        *top = Some(doublings(&surfaces[surface].shape, *base, area / cells as f64));
    }
    grids
}

/// The cuts of the pilot's grids.
fn cuts_of(grids: &Grids) -> Vec<Cut> {
    grids.iter().map(|&(base, top)| top.map_or(base, |top| base.doubled(top)).cut()).collect()
}

/// The walks of a pilot of a run.
fn pilot_for(walks: u64) -> u64 {
    (walks / SHARE).clamp(LEAST.min(walks), MOST)
}

/// A pilot under way.
struct Pilot<'a> {
    job: &'a Job,
    experiment: Experiment,
    sequence: Sequence,
    grids: &'a Grids,
    /// The tallies of the groups.
    groups: Vec<Tally>,
}

impl<'a> Pilot<'a> {
    /// A pilot that keeps some kind of scores, on the cells of grids or on others.
    fn new(
        job: &'a Job,
        grids: &'a Grids,
        score: impl Fn(Estimator) -> Score,
        cells: Option<&Cells>,
    ) -> Result<Self, Error> {
        let scene = match cells {
            None => job.scene.build_cut((&cuts_of(grids), &[]), job.index)?,
            Some(cells) => job.scene.build_cut((&cells.cuts, &cells.patch_of_cell), job.index)?,
        };
        let direction = match job.method.walk {
            WalkKind::Gathering => Direction::Gathering(Birth::Area),
            WalkKind::Shooting | WalkKind::Jacobi | WalkKind::Auto => Direction::Shooting,
        };
        let score = score(job.method.estimator.ending(job.method.infinite));
        let experiment = Experiment::new(scene, Walks { direction, space: Space::Continuous, score })?;
        let groups = (0..GROUPS).map(|_| experiment.tally::<MOMENTS>()).collect();
        let sequence = Sequence::new(seed(job.seed));
        Ok(Pilot { job, experiment, sequence, grids, groups })
    }

    /// Goes on to a number of walks.
    fn walk(&mut self, walks: u64, threads: usize) -> Result<(), Error> {
        let Pilot { experiment, sequence, groups, .. } = self;
        let each = walks.div_ceil(GROUPS);
        let count = groups.len();
        let groups: Vec<Mutex<&mut Tally>> = groups.iter_mut().map(Mutex::new).collect();
        let next = AtomicUsize::new(0);
        let shoot = || -> Result<(), Overflow> {
            let mut board = experiment.board::<MOMENTS>();
            loop {
                let group = next.fetch_add(1, Ordering::Relaxed);
                let Some(tally) = groups.get(group) else { return Ok(()) };
                let mut tally = tally.lock().unwrap_or_else(PoisonError::into_inner);
                let first = group as u64 * GROUP_STRIDE;
                let range = first + tally.counts.walks..first + each.max(tally.counts.walks);
                experiment.walk(sequence, range, &mut board);
                board.add_to(&mut tally)?;
            }
        };
        thread::scope(|scope| {
            let spawned: Vec<_> = (1..threads.clamp(1, count)).map(|_| scope.spawn(shoot)).collect();
            let here = shoot();
            let others = spawned.into_iter().map(|thread| thread.join().expect("walks do not panic"));
            others.fold(here, Result::and)
        })
        .map_err(|Overflow| Error::Overflow)
    }

    /// What was seen of every surface, and the energy of all the light.
    fn see(&self) -> (Vec<SurfaceLight>, f64) {
        let lights = self.lights(&self.tallies(), |_| true);
        let energy = lights.iter().map(SurfaceLight::energy).sum();
        (lights, energy)
    }

    /// The tallies of the groups, and their sum.
    fn tallies(&self) -> PilotTallies {
        let mut all = self.experiment.tally::<MOMENTS>();
        for group in &self.groups {
            all.merge(group).expect("tallies of one experiment, far from their limits");
        }
        PilotTallies { groups: self.groups.clone(), all }
    }

    /// What was seen of some surfaces.
    fn lights(&self, tallies: &PilotTallies, of: impl Fn(usize) -> bool) -> Vec<SurfaceLight> {
        let shapes = self.job.scene.spec().surfaces.iter().map(|surface| &surface.shape).enumerate();
        shapes
            .zip(self.grids)
            .filter(|((surface, _), _)| of(*surface))
            .map(|(surface, &grid)| SurfaceLight::new(&self.experiment, tallies, surface, grid))
            .collect()
    }

    /// The partition that was chosen.
    fn tell(&self, choice: &Choice, energy: f64, surfaces: usize) -> Partition {
        let counts = self.groups.iter().map(|group| &group.counts);
        let [paths, rays] =
            counts.fold([0, 0], |[walks, rays], counts| [walks + counts.walks, rays + counts.rays]);
        let part = |of: f64| if energy > 0.0 { (of / energy).sqrt() } else { 0.0 };
        let linear = choice.basis == Basis::Linear;
        let forecast = Forecast {
            surfaces: surfaces as u64,
            paths,
            rays,
            linear,
            for_paths: choice.walks as u64,
            noise: part(choice.noise),
            discretisation: part(choice.lost),
        };
        Partition {
            cuts: choice.cuts.clone(),
            groups: Vec::new(),
            linear: linear || self.job.total_target.is_some(),
            space: Space::Continuous,
            forecast: Some(forecast),
        }
    }
}

/// The seed of a job's pilot, whose walks are independent of the job's: what is chosen by them does not bend what the job finds.
fn seed(of_job: u64) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"radwalk pilot");
    hasher.update(&of_job.to_le_bytes());
    let digest = *hasher.finalize().as_bytes();
    u64::from_le_bytes(digest[..8].try_into().expect("eight bytes"))
}

/// The threads that this machine has room for.
pub fn all_threads() -> usize {
    thread::available_parallelism().map_or(1, NonZeroUsize::get)
}
