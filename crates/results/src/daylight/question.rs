//! What is asked of the daylight of a job.

use std::path::Path;

use job::{Job, MethodTable};
use radiosity::{
    Experiment, Scene, Unfit,
    daylight::{Coefficients, DaylightSpec, Segment, SkyPatches},
};
use sky::{Dome, SkyUnit, Wanted, Weather, Year};

use super::count::FEWEST;
use crate::error::Error;

/// What a user asks for, beside the job.
#[derive(Clone, Debug)]
pub struct Wished<'a> {
    /// The weather file.
    pub weather: &'a Path,
    /// The division of the sky.
    pub patches: SkyPatches,
    /// The reflectance of the ground, where a scene has none.
    pub ground: f64,
    /// Of a scene in colour: the channel whose reflectances hold.
    pub channel: Option<usize>,
    /// The half-width of the interval of the yearly mean, over this mean, at which the walks of a sensor end.
    pub tolerance: f64,
    /// What is asked of the hours; the level of intervals is that of the job.
    pub wanted: Wanted,
}

/// What is to be counted, and what the counts are held against.
pub struct DaylightQuestion {
    /// The job.
    pub job: Job,
    /// The scene of the job, in one channel.
    pub scene: Scene,
    /// The weather.
    pub weather: Weather,
    /// What the job has, and what has no part in daylight.
    pub ignored: Vec<&'static str>,
    pub(super) coefficients: Coefficients,
    pub(super) dome: Dome,
    pub(super) year: Year,
    /// The sky vector of the mean hour, and its sun.
    pub(super) mean: (Vec<f64>, Vec<(usize, f64)>),
    pub(super) tolerance: f64,
    pub(super) wanted: Wanted,
    pub(super) ground: f64,
}

impl DaylightQuestion {
    /// The question about the sensors of a job; reads the weather.
    ///
    /// # Errors
    /// Where the weather or the scene is refused, and where there is nothing to count.
    pub fn of(mut job: Job, wished: &Wished<'_>) -> Result<Self, Error> {
        let weather = job::load_weather(wished.weather)?;
        let channels = job.scene.spec().channels();
        if channels > 1 && wished.channel.is_none() {
            return Err(Error::DaylightChannel);
        }
        let ignored = ignored(&job);
        job.scene = job.scene.for_daylight(wished.channel.unwrap_or(0));
        let sky = wished.patches.clone();
        // Coefficients are counted by single walks, from places that sensors are asked for by themselves.
        job.method = MethodTable::default();
        (job.budget.first_path, job.budget.wall_seconds) = (0, None);
        (job.sources, job.sensitivity) = (Vec::new(), Vec::new());
        let scene = job.build_scene()?;
        let coefficients = Coefficients::new(scene.clone(), job.scene.sensors(), sky.clone())?;
        let cells = coefficients.sensors().cell_count() as u64;
        if job.budget.paths / cells < FEWEST {
            return Err(Error::FewDaylightWalks { paths: job.budget.paths, cells, fewest: FEWEST });
        }
        let dome = Dome::new(sky);
        let year = Year::new(&weather, &dome, SkyUnit::Illuminance, wished.ground);
        let wanted = Wanted { confidence: job.confidence, ..wished.wanted.clone() };
        Ok(DaylightQuestion {
            mean: year.mean(&dome),
            tolerance: wished.tolerance,
            ground: wished.ground,
            ignored,
            job,
            scene,
            weather,
            coefficients,
            dome,
            year,
            wanted,
        })
    }

    /// How many places are measured.
    pub(super) fn cells(&self) -> usize {
        self.coefficients.sensors().cell_count()
    }

    /// What walks of cells count.
    pub(super) fn spec(&self, segments: Vec<Segment>) -> DaylightSpec {
        DaylightSpec {
            sensors: self.job.scene.sensors().to_vec(),
            patches: self.dome.patches().count() as u32,
            segments,
        }
    }

    /// The experiment of these walks.
    ///
    /// # Errors
    /// Where a segment is not one of the cells.
    pub fn experiment(&self, segments: Vec<Segment>) -> Result<Experiment, Unfit> {
        Experiment::of_daylight(self.scene.clone(), self.spec(segments))
    }

    /// The most walks of a place: its part of the budget, down to a power of two.
    pub(super) fn most_walks(&self) -> u64 {
        1 << (self.job.budget.paths / self.cells() as u64).ilog2()
    }
}

/// What a job asks for in vain.
fn ignored(job: &Job) -> Vec<&'static str> {
    let has_target = job.target.is_some() && !job.is_default_target;
    let parts = [
        ("[[lamp]]", !job.scene.spec().lamps.list.is_empty()),
        ("demands of sensors", !job.scene.demands().is_empty()),
        ("targets", has_target || job.sensor_target.is_some() || job.total_target.is_some()),
    ];
    parts.into_iter().filter(|(_, is_there)| *is_there).map(|(part, _)| part).collect()
}
