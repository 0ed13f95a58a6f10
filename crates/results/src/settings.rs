//! All that reporting a result needs beside the walks and their scene: it travels with the job and stays in
//! `tally.bin`.

use job::{
    Beside, Cut, Finishes, Forecast, Job, Light, MethodTable, NamedView, OutputFile, Partition, PlaneTarget,
    SensorTarget, Target, TotalTarget, View,
};
use judge::target::{Observer, SensorGoal, judge, total_is_met};
use radiosity::{
    Estimates, Experiment, Scene, Shape, Tally,
    daylight::DaylightSpec,
    exchange::ExchangeSpec,
    groups::{Groups, PatchGroup},
    sensors::SensorSpec,
};
use serde::{Deserialize, Serialize};

/// The settings of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The name of the job, which names the run.
    pub name: String,
    /// How it is solved.
    pub method: MethodTable,
    /// The seed of the job.
    pub seed: u64,
    /// Walks of the whole job (Jacobi: rays).
    pub paths: u64,
    /// The number of walks in a stream.
    pub stream_paths: u64,
    /// The level of every interval, or of all together.
    pub confidence: f64,
    /// Whether the intervals hold all together.
    pub simultaneous: bool,
    /// The accuracy that is asked for.
    pub target: Option<Target>,
    /// What of the method is not done as asked, and why.
    pub note: Option<String>,
    /// What was left out, changed or assumed of meshes, a sentence each.
    pub import: Vec<String>,
    /// What the numbers measure.
    pub light: Light,
    /// Places where light is measured.
    pub sensors: Vec<SensorSpec>,
    /// The accuracy that is asked of them.
    pub sensor_target: Option<SensorTarget>,
    /// The files that are written beside the tally; `None`: the program chooses.
    pub files: Option<Vec<OutputFile>>,
    /// How the picture is taken.
    pub view: View,
    /// What the surfaces are made of.
    pub finishes: Finishes,
    /// Exchange factors that are counted in place of light.
    pub exchange: Option<ExchangeSpec>,
    /// Groups of emitters that are distinguished.
    pub sources: Vec<PatchGroup>,
    /// Materials whose influence is measured.
    pub sensitivity: Vec<PatchGroup>,
    /// A factor for the emittance of each source, where it is a mixture of them that is estimated.
    pub mixture: Vec<f64>,
    /// What is asked of noise and discretisation together.
    pub total_target: Option<TotalTarget>,
    /// What a pilot has predicted of the patches, where it has chosen them.
    pub forecast: Option<Forecast>,
    /// Whether the program chose the method. It travels behind the groups of cells.
    #[serde(skip)]
    pub chooses_method: bool,
    /// What is demanded of planes. It travels behind panes.
    #[serde(skip)]
    pub demands: Vec<PlaneTarget>,
    /// Views beside [`Settings::view`]. They travel behind the openings of luminaires.
    #[serde(skip)]
    pub views: Vec<NamedView>,
    /// Daylight coefficients that are counted in place of light. They travel behind the views.
    #[serde(skip)]
    pub daylight: Option<DaylightSpec>,
}

impl Settings {
    /// The settings of a job.
    pub fn of(job: &Job) -> Self {
        Settings {
            name: job.name.clone(),
            method: job.method.clone(),
            seed: job.seed,
            paths: job.budget.paths,
            stream_paths: job.budget.stream_paths,
            confidence: job.confidence,
            simultaneous: job.simultaneous,
            target: job.target.clone(),
            note: job.note.clone(),
            import: job.scene.notes().to_vec(),
            light: job.light,
            sensors: job.scene.sensors().to_vec(),
            sensor_target: job.sensor_target.clone(),
            files: job.files.clone(),
            view: job.view,
            finishes: job.scene.finishes().clone(),
            exchange: None,
            sources: job.sources.clone(),
            sensitivity: job.sensitivity.clone(),
            mixture: Vec::new(),
            total_target: job.total_target,
            forecast: job.forecast,
            chooses_method: job.chooses_method,
            demands: job.scene.demands().to_vec(),
            views: job.views.clone(),
            daylight: None,
        }
    }

    /// What a job asks of patches alone: nothing of sensors, sources and sensitivities.
    pub fn of_patches(job: &Job) -> Self {
        Settings {
            sensors: Vec::new(),
            sensor_target: None,
            demands: Vec::new(),
            sources: Vec::new(),
            sensitivity: Vec::new(),
            ..Settings::of(job)
        }
    }

    /// The digest of the job with another seed, in a scene.
    pub fn job_hash(&self, scene_hash: [u8; 32], seed: u64) -> [u8; 32] {
        job::job_hash(scene_hash, &self.method, &self.sensors, [&self.sources, &self.sensitivity], seed)
    }

    /// The discretisation of the answer that a pilot predicted, if it chose the patches for the fits of this method.
    pub fn predicted(&self) -> Option<f64> {
        let linear = self.method.beside == Beside::Slopes;
        self.forecast.filter(|forecast| forecast.linear == linear).map(|forecast| forecast.discretisation)
    }

    /// The level of each single interval. Where all are to hold together, each of the m unknown irradiances may miss
    /// with m-th part of the probability (Bonferroni's inequality, true whatever their dependence).
    pub fn level(&self, scene: &Scene) -> f64 {
        if !self.simultaneous {
            return self.confidence;
        }
        self.level_of_each(scene.channels() * scene.faces().len())
    }

    /// The level of each interval of sensors, which hold all together by themselves: those of patches do not depend on where
    /// light is measured besides.
    pub fn sensor_level(&self, experiment: &Experiment) -> f64 {
        if !self.simultaneous {
            return self.confidence;
        }
        let cells = experiment.sensors().map_or(0, |sensors| sensors.cell_count());
        self.level_of_each(cells * experiment.scene().channels())
    }

    /// The level of each interval of the light of sources, which hold all together by themselves.
    pub fn source_level(&self, experiment: &Experiment) -> f64 {
        self.level_of_groups(experiment, |groups| groups.sources().len())
    }

    /// The level of each interval of a derivative, by reflectances and by emittances, which hold all together by themselves.
    pub fn sensitivity_level(&self, experiment: &Experiment) -> f64 {
        self.level_of_groups(experiment, |groups| 2 * groups.materials().len())
    }

    /// The level of each of `tables` numbers for every channel of every face.
    fn level_of_groups(&self, experiment: &Experiment, tables: impl Fn(&Groups) -> usize) -> f64 {
        if !self.simultaneous {
            return self.confidence;
        }
        let scene = experiment.scene();
        let tables = experiment.groups().map_or(0, tables);
        self.level_of_each(tables * scene.faces().len() * scene.channels())
    }

    fn level_of_each(&self, unknown: usize) -> f64 {
        // No number distinguishes levels this near to 1: the largest number below 1 stands for them.
        (1.0 - (1.0 - self.confidence) / unknown.max(1) as f64).min(1.0_f64.next_down())
    }

    /// What is asked of sensors.
    pub fn sensor_goal(&self, experiment: &Experiment) -> Option<SensorGoal> {
        let target = self.sensor_target.clone()?;
        Some(SensorGoal { target, level: self.sensor_level(experiment) })
    }

    /// The partition of surfaces that are cut so, and what the job's method makes of them.
    pub(crate) fn partition_of<'a>(
        &self,
        shapes: impl Iterator<Item = &'a Shape>,
        patch_of_cell: Vec<u32>,
    ) -> Partition {
        Partition {
            cuts: shapes.map(Cut::of).collect(),
            groups: patch_of_cell,
            forecast: self.forecast,
            linear: self.method.beside == Beside::Slopes,
            space: self.method.space,
        }
    }

    /// The observer of an experiment, which looks at its prefixes and ends it at its targets.
    pub fn observer(&self, experiment: &Experiment) -> Observer {
        Observer::new(experiment.clone(), self.level(experiment.scene()), self.target.clone())
            .with_sensors(self.sensor_goal(experiment))
            .with_total(self.total_target, self.predicted())
    }

    /// Whether there is a target that these walks do not meet.
    pub fn target_missed(&self, experiment: &Experiment, tally: &Tally) -> bool {
        let goal = self.sensor_goal(experiment);
        if goal.is_some_and(|goal| !goal.is_met(experiment, tally)) {
            return true;
        }
        let Settings { target, total_target, .. } = self;
        if target.is_none() && total_target.is_none() {
            return false;
        }
        let walks = tally.counts.walks;
        let paths = walks * experiment.unit().paths();
        let estimates = Estimates::new(experiment, tally, self.level(experiment.scene()));
        let total_missed =
            total_target.is_some_and(|total| !total_is_met(&total, self.predicted(), &estimates, paths));
        walks == 0 || total_missed || target.as_ref().is_some_and(|t| !judge(t, &estimates, paths).reached)
    }

    /// A digest of the target, which distinguishes looks at different targets.
    pub fn goal(&self) -> [u8; 32] {
        let goal = (&self.target, self.confidence, self.simultaneous);
        let goal = match &self.sensor_target {
            None => serde_json::to_vec(&goal),
            Some(of_sensors) => serde_json::to_vec(&(goal, of_sensors)),
        };
        let goal = match &self.total_target {
            None => goal,
            Some(total) => goal.and_then(|goal| serde_json::to_vec(&(goal, total))),
        };
        *blake3::hash(&goal.expect("numbers and words")).as_bytes()
    }
}
