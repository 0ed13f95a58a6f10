//! A stage of a pilot: walks in groups of as many each, taken by threads of this process or as a job of the cluster.

use std::sync::{Arc, Mutex, PoisonError};

use job::{Beside, Budget, Cut, Job, MethodTable, WalkKind};
use judge::partition::PilotTallies;
use radiosity::{Counts, Experiment, Overflow, Scene, Sequence, Space, Tally};

use crate::checkpoints::Identity;
use crate::error::Error;
use crate::settings::Settings;

/// Walks that a thread takes at once: the sums of more may not fit its board.
const PART: u64 = 1 << 18;

/// A stage of fewer walks, or of fewer of these for each surface, takes less time than workers take to join and to build the scene.
const FEW_WALKS: u64 = 1 << 18;
const FEW_WALKS_OF_SURFACE: u64 = 8;

/// The walks of one look of a pilot, on cells of its own. Group g has walks g·n … (g + 1)·n − 1 of the sequence.
pub struct PilotStage<'a> {
    pub(super) job: &'a Job,
    pub(super) experiment: Experiment,
    /// The cut of each surface, and the patch of each cell.
    cells: (Vec<Cut>, Vec<u32>),
    method: MethodTable,
    seed: u64,
    groups: u64,
    walks_of_group: u64,
}

/// The settings of a stage: its cells, its basis, and its walks.
pub(super) struct StageSpec {
    /// The cut of each surface, and the patch of each cell.
    pub(super) cells: (Vec<Cut>, Vec<u32>),
    /// Whether linear functions are fitted.
    pub(super) linear: bool,
    pub(super) seed: u64,
    pub(super) groups: u64,
    /// Walks of all groups together, at least.
    pub(super) walks: u64,
}

impl<'a> PilotStage<'a> {
    /// The stage of a task in its scene.
    pub(super) fn new(job: &'a Job, scene: Scene, task: StageSpec) -> Result<Self, Error> {
        let StageSpec { cells, linear, seed, groups, walks } = task;
        let method = method(job, linear);
        let experiment = Experiment::new(scene, method.walks())?;
        let walks_of_group = walks.div_ceil(groups);
        Ok(PilotStage { job, experiment, cells, method, seed, groups, walks_of_group })
    }

    /// The experiment whose walks they are.
    pub fn experiment(&self) -> &Experiment {
        &self.experiment
    }

    /// The walks of all groups.
    pub fn walks(&self) -> u64 {
        self.groups * self.walks_of_group
    }

    /// What they may cost.
    pub fn budget(&self) -> Budget {
        Budget { first_path: 0, paths: self.walks(), wall_seconds: None, ..self.job.budget }
    }

    /// The numbers of walks at which groups end.
    pub fn looks(&self) -> Vec<u64> {
        (1..=self.groups).map(|group| group * self.walks_of_group).collect()
    }

    /// Whether so few walks are best taken by this process.
    pub fn is_short(&self) -> bool {
        let surfaces = self.job.scene.spec().surfaces.len() as u64;
        self.walks() < FEW_WALKS.max(FEW_WALKS_OF_SURFACE * surfaces)
    }

    /// The job of these walks, as it travels.
    ///
    /// # Errors
    /// Where the scene is too large to be sent.
    pub fn identity(&self, build: &str) -> Result<Identity, Error> {
        let (cuts, groups) = &self.cells;
        let spec = self.job.scene.spec_cut((cuts, groups))?;
        Identity::of_walks((&spec, &self.settings()), &self.experiment, 0, build)
    }

    /// The digest of these walks and their groups, for what is kept of them.
    pub(super) fn hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.settings().job_hash(self.experiment.scene().hash(), self.seed));
        hasher.update(&self.groups.to_le_bytes()).update(&self.walks_of_group.to_le_bytes());
        hasher.finalize().into()
    }

    fn settings(&self) -> Settings {
        Settings {
            method: self.method.clone(),
            seed: self.seed,
            paths: self.walks(),
            target: None,
            total_target: None,
            ..Settings::of_patches(self.job)
        }
    }

    /// Walks them on some threads of this process, one group after the other.
    ///
    /// # Errors
    /// Where a sum overflows.
    pub fn walk_here(&self, threads: usize) -> Result<StageResult, Error> {
        let (experiment, sequence) = (&self.experiment, Sequence::new(self.seed));
        let part = self.walks_of_group.div_ceil(threads as u64).clamp(1, PART);
        let (all, mut groups) = (Mutex::new(experiment.tally()), EndedGroups::none(self));
        for end in self.looks() {
            let parts: Vec<u64> = (end - self.walks_of_group..end).step_by(part as usize).collect();
            let boards = || experiment.board();
            let walked = parallel::on_threads(threads, parts.len(), boards, |board, i| {
                experiment.walk(&sequence, parts[i]..end.min(parts[i] + part), board);
                board.add_to(&mut all.lock().unwrap_or_else(PoisonError::into_inner))
            });
            walked.into_iter().collect::<Result<(), Overflow>>().map_err(|_| Error::Overflow)?;
            groups.end_next(&all.lock().unwrap_or_else(PoisonError::into_inner));
        }
        Ok(StageResult::new(groups, all.into_inner().unwrap_or_else(PoisonError::into_inner).into()))
    }
}

/// The method of a job's pilot.
fn method(job: &Job, linear: bool) -> MethodTable {
    MethodTable {
        walk: match job.method.walk {
            WalkKind::Gathering => WalkKind::Gathering,
            WalkKind::Shooting | WalkKind::Jacobi | WalkKind::Auto => WalkKind::Shooting,
        },
        estimator: job.method.estimator,
        infinite: job.method.infinite,
        space: Space::Continuous,
        beside: if linear { Beside::Slopes } else { Beside::Nothing },
        ..MethodTable::default()
    }
}

/// The tallies of the walks of a stage: of each group, and of all groups together.
pub struct StageResult {
    /// The sums of each group, without squares.
    pub(super) groups: Vec<Tally>,
    /// All groups together.
    pub(super) all: Arc<Tally>,
}

impl StageResult {
    /// What the groups say together, of which all have ended.
    pub fn new(groups: EndedGroups, all: Arc<Tally>) -> Self {
        StageResult { groups: groups.ended, all }
    }

    pub(super) fn tallies(&self) -> PilotTallies<'_> {
        PilotTallies { groups: &self.groups, all: &self.all }
    }
}

/// The groups of a stage that have ended, while its walks go on.
pub struct EndedGroups {
    pub(super) ended: Vec<Tally>,
    /// The sums of all of them.
    sum: Tally,
}

impl EndedGroups {
    /// No group of a stage.
    pub fn none(stage: &PilotStage) -> Self {
        let layout = stage.experiment.layout().without_squares();
        EndedGroups { ended: Vec::new(), sum: Tally::new(stage.experiment.rows(), layout) }
    }

    /// Groups that have ended.
    pub(super) fn of(stage: &PilotStage, ended: Vec<Tally>) -> Option<Self> {
        let mut groups = EndedGroups::none(stage);
        ended.iter().try_for_each(|group| groups.sum.merge(group)).ok()?;
        groups.ended = ended;
        Some(groups)
    }

    /// Takes the tally of all walks up to the end of the next group.
    ///
    /// # Panics
    /// Where these are not walks of the stage.
    pub fn end_next(&mut self, prefix: &Tally) {
        let mut sum = Tally::new(prefix.patches(), prefix.layout().without_squares());
        sum.add_without_squares(prefix).expect("a tally of the stage, which fits where it was");
        self.ended.push(beyond(&sum, &self.sum).expect("more walks than before"));
        self.sum = sum;
    }
}

/// The walks that a tally has beyond a part of them.
fn beyond(whole: &Tally, part: &Tally) -> Option<Tally> {
    let (mut counts, before) = (whole.counts.to_array(), part.counts.to_array());
    for (count, before) in counts.iter_mut().zip(before) {
        *count = count.checked_sub(before)?;
    }
    let sums = whole.sums().iter().zip(part.sums());
    let sums = sums.map(|(whole, part)| whole.checked_sub(*part)).collect::<Option<_>>()?;
    Tally::from_parts(Counts::from_array(counts)?, whole.patches(), whole.layout(), sums).ok()
}
