//! The choice of a job's patches: a pilot walks the scene on a fine grid, with walks of its own, and a rule reads off what to cut.

mod arrivals;
mod books;
mod stage;
mod steps;

use job::{Auto, Cut, Forecast, Job, MethodTable, Partition};
use judge::partition::{
    Basis, Choice, CutCandidates, Grid, Grouped, MeshLight, SurfaceLight, doublings, fewest, shared_noise,
};
use radiosity::{Experiment, IndexChoice, Scene, Space};

pub(crate) use self::arrivals::ARRIVALS;
pub use self::books::{PILOT, PilotBooks, is_being_replaced};
use self::stage::StageSpec;
pub use self::stage::{EndedGroups, PilotStage, StageResult};
pub use self::steps::PilotRunner;
pub(crate) use self::steps::Steps;
use crate::error::Error;
use crate::meshes::{FirstLook, Meshes, add_patches};

/// The pilot takes one of this many parts of the walks that it predicts, between [`LEAST`] and [`MOST`].
const SHARE: u64 = 10;

/// The least number of walks of a pilot.
const LEAST: u64 = 1 << 14;

/// The largest number of walks of a pilot.
const MOST: u64 = 1 << 24;

/// The pilot looks at the light first after one of this many parts of its walks: where the light is even, that is enough.
const FIRST_PART: u64 = 8;

/// A first look has one in this many of the cells that its walks allow: coarse cells resolve even light.
const FIRST_CELLS: u64 = 8;

/// A first look that has not this many times fewer walks and cells than the pilot saves nothing.
const FEW: u64 = 4;

/// Independent groups of the pilot's walks: products of what they find have no bias.
const GROUPS: u64 = 4;

/// Walks of the pilot for each of its cells.
const WALKS_PER_CELL: u64 = 16;

/// Cells of the first look at meshes, where their faces are large.
const LOOK_CELLS: f64 = 2048.0;

/// The fewest cells of a pilot, and the most, all surfaces together.
const CELLS: [u64; 2] = [1 << 8, 1 << 16];

/// A face of more than one of this many parts of the area is in no group.
const LARGE: f64 = 512.0;

/// Groups are tried as they would be chosen for one of this many parts of the walks: what is expected of single cuts is too much where most of them
/// gain little, which all of them together tell.
const COARSENING: [f64; 4] = [1.0, 2.0, 4.0, 8.0];

/// Walks that the first pilot is for, in a job with a total error.
const FIRST_PLAN: u64 = 1 << 16;

/// The first pilot is for this many walks a surface at least: fewer take less time than a scene of as many surfaces takes to build.
const FIRST_WALKS_OF_SURFACE: u64 = 8;

/// A pilot is large enough for this many times the walks that it was planned for.
pub(crate) const ENOUGH: u64 = 2;

/// A pilot is followed by one of this many times its walks at the most: what few walks tell of the walks that are needed is not exact, and where its cells
/// are too coarse for the error that is asked for it tells nothing.
const GROWTH: u64 = 4;

/// Groups of faces are tried as they would be chosen for one of this many parts of the walks.
const TRIAL: u64 = 4;

/// The part of a total error that the choice aims at: what is predicted is not exact.
const AIM: f64 = 0.9;

/// The partition that a pilot chose for a job, and the scene of the pilot.
#[derive(Debug)]
pub struct Chosen {
    /// The patches.
    pub partition: Partition,
    /// The scene of the pilot.
    pub(crate) scene: Scene,
}

impl Chosen {
    /// What is predicted of it.
    pub(crate) fn forecast(&self) -> Forecast {
        self.partition.forecast.expect("a pilot predicts")
    }

    /// Builds the scene of the job that has been read again with the partition: rays find its surfaces by what the pilot's found them by.
    ///
    /// # Errors
    /// As [`Job::build_scene`].
    pub fn build_scene(self, job: &Job) -> Result<Scene, job::Error> {
        job.build_scene_like(self.scene)
    }
}

/// Chooses the patches that a job leaves open, on some threads of this process. The choice is a function of the job, whatever the
/// threads. `None` for a job that leaves nothing open.
///
/// # Errors
/// Where the scene or the method is refused, or a sum overflows.
pub fn choose(job: &Job, threads: usize) -> Result<Option<Chosen>, Error> {
    choose_by(job, threads, &mut |stage: &PilotStage| stage.walk_here(threads))
}

/// [`choose`] by a pilot whose walks are taken, and whose steps are kept, elsewhere.
///
/// # Errors
/// As [`choose`], and those of the runner.
pub fn choose_by<E: From<Error>>(
    job: &Job,
    threads: usize,
    runner: &mut dyn PilotRunner<E>,
) -> Result<Option<Chosen>, E> {
    let Some(auto) = &job.auto else { return Ok(None) };
    let most = job.budget.paths;
    let scene = scene_of_parts(job)?;
    let steps = Steps::new((job, auto), runner);
    let mut pilots = Pilots { job, threads, steps, scene, counted: [0, 0] };
    let Some(target) = &job.total_target else {
        let chosen = pilots.choose(auto, Plan { walks: most, most, aim: 0.0 })?;
        return Ok(Some(chosen.controlled((job, auto), threads, &mut pilots.steps)?));
    };
    // The pilot grows with the walks that it, and then the control, finds to be needed.
    let surfaces = job.scene.spec().surfaces.len() as u64;
    let mut walks = FIRST_PLAN.max(FIRST_WALKS_OF_SURFACE * surfaces).min(most);
    let mut open = auto.clone();
    loop {
        let chosen = pilots.choose(&open, Plan { walks, most, aim: AIM * target.total_error })?;
        let needed = chosen.forecast().for_paths;
        if needed > ENOUGH * walks && walks < most {
            walks = needed.min(GROWTH * walks);
            pilots.scene = Some(chosen.scene);
            continue;
        }
        let of_pilot = chosen.partition.linear;
        let chosen = chosen.controlled((job, auto), threads, &mut pilots.steps)?;
        // Light that a control has found to vary is not taken for even again.
        open.constant &= chosen.partition.linear == of_pilot;
        let forecast = chosen.forecast();
        if forecast.paths_to(target.total_error) <= (ENOUGH * needed) as f64 || needed >= most {
            return Ok(Some(chosen));
        }
        pilots.counted = [forecast.paths, forecast.rays];
        pilots.scene = Some(chosen.scene);
        // Of k patches after n walks the noise is as k/n, what linear fits leave out as 1/k²: with the best k both together are as n^(−2/3).
        let growth = (forecast.total() / target.total_error).powi(3) as u64;
        walks = most.min(needed.saturating_mul(growth.clamp(GROWTH, GROWTH * GROWTH)));
    }
}

/// The scene of a job that has sensors or groups of patches, by which the pilot's is built: what the scene cannot have of them is refused before
/// a walk is taken.
fn scene_of_parts(job: &Job) -> Result<Option<Scene>, Error> {
    let sensors = job.scene.sensors();
    if sensors.is_empty() && job.sources.is_empty() && job.sensitivity.is_empty() {
        return Ok(None);
    }
    let experiment = Experiment::new(job.build_scene()?, MethodTable::default().walks())?
        .with_sensors(sensors)?
        .with_groups(&job.sources, &job.sensitivity)?;
    Ok(Some(experiment.scene().clone()))
}

/// What a pilot is for.
#[derive(Clone, Copy)]
struct Plan {
    /// The walks that it is large enough for.
    walks: u64,
    /// The walks of the job at the most.
    most: u64,
    /// The total error that is aimed at: the choice is for the fewest walks, of `walks` and its doubles, that are predicted to reach it. 0: for `walks`.
    aim: f64,
}

/// The pilots of a job, one after the other.
struct Pilots<'a, 'c, E> {
    job: &'a Job,
    /// The threads of controls.
    threads: usize,
    steps: Steps<'c, E>,
    /// The scene of the latest, by which rays find surfaces.
    scene: Option<Scene>,
    /// Walks and rays of all of them.
    counted: [u64; 2],
}

impl<'a, E: From<Error>> Pilots<'a, '_, E> {
    /// Walks a stage on grids, whose cells are those of the task.
    fn look(&mut self, grids: Grids, task: StageSpec) -> Result<Pilot<'a>, E> {
        let cells = (&task.cells.0[..], &task.cells.1[..]);
        let scene = self.build(cells)?;
        self.scene = Some(scene.clone());
        let stage = PilotStage::new(self.job, scene, task)?;
        let walked = self.steps.walk(&stage)?;
        self.counted[0] += walked.all.counts.walks;
        self.counted[1] += walked.all.counts.rays;
        Ok(Pilot { stage, grids, walked })
    }

    /// A pilot that fits linear functions, on as many cells as some walks allow.
    fn look_linear(&mut self, auto: &Auto, walks: u64, fewer: u64) -> Result<Pilot<'a>, E> {
        let grids = grids(self.job, &auto.surfaces, walks / fewer);
        let cells = (cuts_of(&grids), Vec::new());
        self.look(grids, StageSpec { cells, linear: true, seed: seed(self.job.seed), groups: GROUPS, walks })
    }

    /// The choice for the walks of a job. It has the scene of the pilot alone: one of a million surfaces has room for no second one.
    fn choose(&mut self, auto: &Auto, plan: Plan) -> Result<Chosen, E> {
        let are_grouped = match Meshes::are_many(auto, self.job.budget.paths) {
            Some(are_many) => are_many,
            None => self.groups_pay(auto, plan)?,
        };
        self.step(|pilots| match are_grouped {
            true => pilots.choose_in_groups(auto, plan),
            false => pilots.choose_by_surface(auto, plan),
        })
    }

    /// The next step, which chooses patches. Its scene is the only one.
    fn step(&mut self, choose: impl FnOnce(&mut Self) -> Result<Chosen, E>) -> Result<Chosen, E> {
        let Some(partition) = self.steps.kept::<Partition>()? else {
            let chosen = choose(self);
            self.scene = None;
            let chosen = chosen?;
            self.steps.keep(&chosen.partition)?;
            return Ok(chosen);
        };
        let cells = (&partition.cuts[..], &partition.groups[..]);
        let scene = self.build(cells)?;
        let chosen = Chosen { partition, scene };
        self.counted = [chosen.forecast().paths, chosen.forecast().rays];
        Ok(chosen)
    }

    /// The scene cut into some cells, by what the latest one has built.
    fn build(&mut self, cells: (&[Cut], &[u32])) -> Result<Scene, E> {
        let scene = match self.scene.take() {
            Some(scene) => self.job.scene.recut(scene, cells),
            None => self.job.scene.build_cut(cells, IndexChoice::Auto),
        };
        Ok(scene.map_err(Error::from)?)
    }

    /// Whether groups of the faces of meshes pay, by a trial among fewer walks.
    fn groups_pay(&mut self, auto: &Auto, plan: Plan) -> Result<bool, E> {
        let plan = Plan { walks: (plan.walks / TRIAL).max(1), aim: 0.0, ..plan };
        let trial = self.step(|pilots| pilots.choose_in_groups(auto, plan))?;
        let (pay, counted, scene) = trial.groups_pay((self.job, auto), self.threads, &mut self.steps)?;
        self.counted = counted;
        self.scene = Some(scene);
        Ok(pay)
    }

    /// The choice where each surface is cut by itself.
    fn choose_by_surface(&mut self, auto: &Auto, Plan { walks, most, aim }: Plan) -> Result<Chosen, E> {
        let bases = open_bases(auto);
        let wanted = pilot_for(walks);
        let first = (wanted / FIRST_PART).max(LEAST.min(walks));
        let choose = |candidates: &CutCandidates, energy: f64| match aim > 0.0 {
            true => candidates.choose_for(aim * aim * energy.max(0.0), walks as f64, most as f64),
            false => candidates.choose(walks as f64),
        };
        let cells = |walks: u64| grids_cells(&grids(self.job, &auto.surfaces, walks));
        if first * FEW <= wanted && cells(first / FIRST_CELLS) * FEW <= cells(wanted) {
            // Where the light is even this is enough.
            let pilot = self.look_linear(auto, first, FIRST_CELLS)?;
            let (lights, energy) = pilot.see();
            let candidates = CutCandidates::new(&lights, shared_noise(&lights), &bases);
            if candidates.are_surely_even() {
                return Ok(pilot.tell(&choose(&candidates, energy), energy, self.counted));
            }
        }
        let pilot = self.look_linear(auto, wanted, 1)?;
        let (lights, energy) = pilot.see();
        let candidates = CutCandidates::new(&lights, shared_noise(&lights), &bases);
        Ok(pilot.tell(&choose(&candidates, energy), energy, self.counted))
    }

    /// The choice where faces of meshes are grouped: of the bases that the job leaves open the better one, for all surfaces.
    fn choose_in_groups(&mut self, auto: &Auto, plan: Plan) -> Result<Chosen, E> {
        let job = self.job;
        let auto = &without_large_kinds(job, auto);
        if auto.kinds.iter().all(Option::is_none) {
            return self.choose_by_surface(auto, plan);
        }
        let looked = (pilot_for(plan.walks) / FIRST_PART).max(1);
        let walks = (pilot_for(plan.walks) - looked).max(1);
        let look = self.first_look(auto, looked, walks)?;
        let (meshes, clusters) = Meshes::new(job.scene.spec(), auto, &look);
        let others: Vec<usize> =
            auto.surfaces.iter().copied().filter(|&surface| !meshes.has(surface)).collect();
        let grids = grids(job, &others, walks);
        let finest =
            (0..).zip(&clusters.parts).filter(|(_, part)| part.halves.is_none()).map(|(number, _)| number);
        let part_of_cell = clusters.part_of_cell(finest, meshes.cell_count());
        let cells = meshes.cells(&part_of_cell, &cuts_of(&grids), &[]);
        let patch_of_part = cells.patch_of_part;
        let cells = (cells.cuts, cells.patch_of_cell);
        let task = StageSpec { cells, linear: auto.linear, seed: seed(job.seed), groups: GROUPS, walks };
        let mut pilot = self.look(grids, task)?;
        let tallies = pilot.walked.tallies();
        let lights = pilot.lights(|surface| !meshes.has(surface));
        let mut on_meshes = MeshLight::new(&pilot.stage.experiment, &tallies, clusters, &patch_of_part);
        // Tallies of a million triangles take as much memory as the choice.
        pilot.walked.groups = Vec::new();
        drop(patch_of_part);
        let energy = on_meshes.energy() + lights.iter().map(SurfaceLight::energy).sum::<f64>();
        let shared = shared_noise(&lights) + on_meshes.shared();
        let candidates = CutCandidates::new(&lights, shared, &open_bases(auto));
        let (mut choice, grouped) =
            best_in_groups(&candidates, (&mut on_meshes, meshes.cell_count()), (plan, energy));
        let mut of_others =
            std::mem::take(&mut choice.cuts).into_iter().zip(std::mem::take(&mut choice.patches));
        let cut = |(surface, &(base, _)): (usize, &(Grid, Option<[u32; 2]>))| match meshes.has(surface) {
            true => (base.cut(), None),
            false => of_others.next().expect("a cut for each of the other surfaces"),
        };
        let (cuts, others): (Vec<Cut>, Vec<_>) = pilot.grids.iter().enumerate().map(cut).unzip();
        let cells = meshes.cells(&grouped.part_of_cell, &cuts, &others);
        choice.cuts = cells.cuts;
        let mut chosen = pilot.tell(&choice, energy, self.counted);
        chosen.partition.groups = cells.patch_of_cell;
        let forecast = chosen.partition.forecast.iter_mut();
        forecast.for_each(|forecast| forecast.surfaces = auto.surfaces.len() as u64);
        Ok(chosen)
    }

    /// What a look of few walks tells of the light on meshes, for a pilot of more walks: on cells that are no smaller than need be, one patch each.
    fn first_look(&mut self, auto: &Auto, looked: u64, walks: u64) -> Result<FirstLook, E> {
        let surfaces = &self.job.scene.spec().surfaces;
        let area: f64 = auto.surfaces.iter().map(|&surface| surfaces[surface].shape.area()).sum();
        let mut grids: Vec<Grid> = surfaces.iter().map(|surface| Grid::of(&surface.shape)).collect();
        for ((grid, surface), _) in
            grids.iter_mut().zip(surfaces).zip(&auto.kinds).filter(|(_, kind)| kind.is_some())
        {
            *grid = grid.doubled(doublings(&surface.shape, *grid, area / LOOK_CELLS));
        }
        let cells = (grids.iter().map(|grid| grid.cut()).collect(), Vec::new());
        // Other walks than those of the pilot, which is thereby independent of the cells that are chosen for it.
        let seed = seed(seed(self.job.seed));
        let task = StageSpec { cells, linear: false, seed, groups: 1, walks: looked };
        let pilot = self.look(grids.iter().map(|&grid| (grid, None)).collect(), task)?;
        Ok(FirstLook { grids, scores: pilot.scores(walks as f64 / looked as f64) })
    }
}

/// The best choice of a basis, of cuts of some surfaces and of groups of the cells of meshes, of which there are some.
fn best_in_groups(
    candidates: &CutCandidates,
    (on_meshes, cells): (&mut MeshLight, usize),
    (plan, energy): (Plan, f64),
) -> (Choice, Grouped) {
    let error = plan.aim * plan.aim * energy.max(0.0);
    let choose = |walks: f64| {
        let of_basis = |basis| COARSENING.map(|coarser| (basis, coarser));
        // Where light varies on large faces, constants lose more than their laws predict.
        let choices = candidates.bases().flat_map(of_basis).map(|(basis, coarser)| {
            let mut choice = candidates.choose_basis(basis, walks);
            // As fine as pays among fewer walks; the noise is that of all.
            let mut grouped = on_meshes.choose(basis, walks / coarser, cells);
            grouped.noise /= coarser;
            choice.noise += grouped.noise;
            choice.lost += grouped.lost;
            (choice, grouped)
        });
        choices.min_by(|(a, _), (b, _)| a.error().total_cmp(&b.error())).expect("some basis may be chosen")
    };
    let most = if plan.aim == 0.0 { plan.walks } else { plan.most };
    fewest([plan.walks, most].map(|walks| walks as f64), error, |(choice, _)| choice, choose)
}

/// What a job leaves open, but for groups with large faces: these are cut as surfaces by themselves, into cells with straight edges.
fn without_large_kinds(job: &Job, auto: &Auto) -> Auto {
    let surfaces = &job.scene.spec().surfaces;
    let area: f64 = auto.surfaces.iter().map(|&surface| surfaces[surface].shape.area()).sum();
    let is_small = |surface: usize| surfaces[surface].shape.area() * LARGE < area;
    let kinds = auto.kinds.iter().enumerate();
    let kinds = kinds.map(|(surface, kind)| kind.filter(|_| is_small(surface))).collect();
    Auto { kinds, ..auto.clone() }
}

/// The bases that a job leaves open; the constant one where its method has no other.
fn open_bases(auto: &Auto) -> Vec<Basis> {
    let may = [(auto.constant || !auto.linear, Basis::Constant), (auto.linear, Basis::Linear)];
    may.into_iter().filter_map(|(may, basis)| may.then_some(basis)).collect()
}

/// For every surface its coarsest grid, and how often the pilot's doubles its cells where it is open.
type Grids = Vec<(Grid, Option<[u32; 2]>)>;

/// The grids of a pilot of some walks: on open surfaces as many cells as these allow.
fn grids(job: &Job, open: &[usize], walks: u64) -> Grids {
    let surfaces = &job.scene.spec().surfaces;
    let area: f64 = open.iter().map(|&surface| surfaces[surface].shape.area()).sum();
    let cells = (walks / WALKS_PER_CELL).clamp(CELLS[0], CELLS[1]);
    let mut grids: Grids = surfaces.iter().map(|surface| (Grid::of(&surface.shape), None)).collect();
    for &surface in open {
        let (base, top) = &mut grids[surface];
        *top = Some(doublings(&surfaces[surface].shape, *base, area / cells as f64));
    }
    grids
}

/// The number of the pilot's cells.
fn grids_cells(grids: &Grids) -> u64 {
    cuts_of(grids).iter().map(Cut::cells).sum()
}

/// The cuts of the pilot's grids.
fn cuts_of(grids: &Grids) -> Vec<Cut> {
    grids.iter().map(|&(base, top)| top.map_or(base, |top| base.doubled(top)).cut()).collect()
}

/// The walks of a pilot of a run.
fn pilot_for(walks: u64) -> u64 {
    (walks / SHARE).clamp(LEAST.min(walks), MOST)
}

/// A pilot that has walked.
struct Pilot<'a> {
    stage: PilotStage<'a>,
    grids: Grids,
    walked: StageResult,
}

impl Pilot<'_> {
    /// What was seen of every surface, and the energy of all the light.
    fn see(&self) -> (Vec<SurfaceLight>, f64) {
        let lights = self.lights(|_| true);
        let energy = lights.iter().map(SurfaceLight::energy).sum();
        (lights, energy)
    }

    /// By cell of a scene without groups, the scores that a number of times the walks are expected to find there: as many of one size as tell
    /// what these do, on both sides, in the brightest channel. One score alone is chance.
    fn scores(&self, times: f64) -> Vec<f64> {
        let (all, experiment) = (&self.walked.all, &self.stage.experiment);
        let faces = experiment.scene().faces();
        let of_face = |face: u32| {
            let channels = 0..experiment.scene().channels();
            let fits = channels.filter_map(|channel| experiment.fit(all, face as usize, channel));
            let ratios =
                fits.filter(|fit| fit.mean_variance > 0.0).map(|fit| fit.mean * fit.mean / fit.mean_variance);
            (ratios.fold(0.0, f64::max) - 1.0).max(0.0)
        };
        let of_patch = |patch: u32| times * faces.of_patch(patch).map(of_face).sum::<f64>();
        (0..faces.patch_count() as u32).map(of_patch).collect()
    }

    /// What was seen of some surfaces.
    fn lights(&self, of: impl Fn(usize) -> bool) -> Vec<SurfaceLight> {
        let PilotStage { job, experiment, .. } = &self.stage;
        let tallies = self.walked.tallies();
        let shapes = job.scene.spec().surfaces.iter().map(|surface| &surface.shape).enumerate();
        let wanted = shapes.zip(&self.grids).filter(|((surface, _), _)| of(*surface));
        let lights = wanted.map(|(surface, &grid)| SurfaceLight::new(experiment, &tallies, surface, grid));
        let can_be_grouped = job.auto.as_ref().is_some_and(|auto| !auto.kinds.is_empty());
        match can_be_grouped {
            true => lights.collect(),
            false => lights.map(SurfaceLight::without_groups).collect(),
        }
    }

    /// The partition that was chosen after some walks and rays.
    fn tell(&self, choice: &Choice, energy: f64, [paths, rays]: [u64; 2]) -> Chosen {
        let part = |of: f64| if energy > 0.0 { (of / energy).sqrt() } else { 0.0 };
        let linear = choice.basis == Basis::Linear;
        let forecast = Forecast {
            surfaces: self.grids.iter().filter(|(_, top)| top.is_some()).count() as u64,
            paths,
            rays,
            linear,
            for_paths: choice.walks as u64,
            noise: part(choice.noise),
            discretisation: part(choice.lost),
        };
        let partition = Partition {
            cuts: choice.cuts.clone(),
            groups: groups(choice),
            linear,
            space: Space::Continuous,
            forecast: Some(forecast),
        };
        Chosen { partition, scene: self.stage.experiment.scene().clone() }
    }
}

/// The patch of each cell; empty where every cell is a patch.
fn groups(choice: &Choice) -> Vec<u32> {
    let mut patch_of_cell = Vec::new();
    if choice.patches.iter().any(Option::is_some) {
        let mut first = 0;
        for (cut, own) in choice.cuts.iter().zip(&choice.patches) {
            first += add_patches(&mut patch_of_cell, first, (cut, own.as_deref()));
        }
    }
    patch_of_cell
}

/// The seed of a job's pilot, whose walks are independent of the job's: what is chosen by them does not bend what the job finds.
pub(crate) fn seed(of_job: u64) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"radwalk pilot");
    hasher.update(&of_job.to_le_bytes());
    let digest = *hasher.finalize().as_bytes();
    u64::from_le_bytes(digest[..8].try_into().expect("eight bytes"))
}
