//! The limits of what an experiment's walks can come to, for the cluster to refuse impossible results.

use protocol::{Limits, MaterialLimits, SensorLimits};
use radiosity::{Estimator, Experiment, methods::InfiniteEnd};

/// The factor above what theory says: if an honest worker broke a limit, its work would end.
const MARGIN: f64 = 4.0;

/// The exponent of certainty: one walk lasts longer than the limit with probability 2^−128, so that none of all that can
/// ever be shot does.
const CERTAINTY: f64 = 128.0;

/// The most units of one ray's fixed-point score: 2⁴⁰ for the largest score, times weights of channels below 2⁸.
const FIXED_POINT: u128 = 1 << 48;

/// The limits of an experiment.
pub fn limits(experiment: &Experiment) -> Limits {
    let limits = match experiment.unit().batch() {
        Some(paths) => of_batches(experiment, paths),
        None => of_walks(experiment),
    };
    Limits { sensors: of_sensors(experiment), materials: of_materials(experiment, &limits), ..limits }
}

/// The limits of a sensor's sample. A sample scores H over the largest radiosity there can be: at most as if all light
/// under way left one patch for the sensor, by rays of both kinds. A patch may look brighter than it is, the more so
/// the fewer walks reach it. The limit leaves room for the rays of a sample, too.
fn of_sensors(experiment: &Experiment) -> Option<SensorLimits> {
    let sensors = experiment.sensors()?;
    let scene = experiment.scene();
    let paths = experiment.unit().batch().unwrap_or(sensors.sample_walks());
    let least_area = scene.faces().iter().map(|face| face.area).fold(f64::INFINITY, f64::min);
    let brightest = |c: usize| {
        let largest = experiment.largest_at_sensors(c);
        1.0 + scene.total_power(c) / (1.0 - scene.max_reflectance()[c]) / least_area / largest
    };
    let brightest = (0..scene.channels()).map(brightest).fold(1.0, f64::max);
    let sample = (FIXED_POINT as f64 * brightest * MARGIN * paths as f64) as u128;
    Some(SensorLimits { first_row: experiment.first_row_of_sensors(), sample })
}

/// Each score of a walk counts once for every reflection before it, and once for the face that it is on.
fn of_materials(experiment: &Experiment, limits: &Limits) -> Option<MaterialLimits> {
    let materials = experiment.groups().map_or(0, |groups| groups.materials().len());
    let first_row = experiment.rows() - materials * experiment.scene().faces().len();
    let walk_score = limits.walk_score.saturating_mul(limits.rays.into());
    (materials > 0).then_some(MaterialLimits { first_row, walk_score })
}

fn of_walks(experiment: &Experiment) -> Limits {
    let rays = longest_walk(experiment);
    let ray_score = match (experiment.layout().events, experiment.method().is_mix()) {
        (true, _) => FIXED_POINT,
        // The best mix also counts the sum of two scores.
        (false, true) => 2,
        (false, false) => 1,
    };
    Limits {
        ends: 1,
        rays,
        ray_score,
        walk_score: ray_score.saturating_mul(rays.into()),
        sensors: None,
        materials: None,
    }
}

/// The limits of a batch. A batch scores H over the largest radiosity there can be, at most as if all light under way
/// met one patch.
fn of_batches(experiment: &Experiment, paths: u64) -> Limits {
    let tally = experiment.tally();
    let scene = experiment.scene();
    let channels = || 0..scene.channels();
    let largest = (0..scene.faces().len())
        .flat_map(|patch| channels().map(move |c| (patch, c)))
        .filter_map(|(patch, c)| experiment.meaning(patch, c, &tally))
        .map(|meaning| meaning.ratio_bound / meaning.unit)
        .fold(1.0, f64::max);
    let longest = if experiment.unit().is_chain() { 1 } else { longest_walk(experiment) };
    // The rays of a final gather are added.
    let rays = paths.saturating_mul(longest).saturating_mul(MARGIN as u64);
    // A float that is too large becomes the largest integer.
    let walk_score = (largest * MARGIN * 1024.0 * longest as f64) as u128;
    Limits { ends: paths, rays, ray_score: u128::MAX, walk_score, sensors: None, materials: None }
}

/// The most rays of a walk. It survives with the largest reflectance of the scene; infinite walks go on while their
/// weight is above a threshold, or for a fixed length.
fn longest_walk(experiment: &Experiment) -> u64 {
    let scene = experiment.scene();
    let decay = -scene.max_reflectance().max().ln();
    let end = experiment.method().estimator().and_then(Estimator::infinite_end);
    let (weakest, length) = match end {
        Some(InfiniteEnd::Roulette { threshold } | InfiniteEnd::Cutoff { threshold }) => {
            (-threshold.ln(), 0.0)
        }
        Some(InfiniteEnd::Length { length }) => (0.0, f64::from(length)),
        None => (0.0, 0.0),
    };
    let by_chance = (CERTAINTY * std::f64::consts::LN_2 + weakest) / decay;
    (MARGIN * (by_chance + length + 2.0)).min(1e15) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use job::Job;
    use radiosity::{
        Sequence,
        groups::PatchGroup,
        sensors::{SensorShape, SensorSpec},
    };

    /// What breaks a limit, if anything does: in a job with a sensor, and in one with groups, if the method allows for them.
    fn breach(job: &Job) -> Option<&'static str> {
        let middle = SensorShape::Point { point: [0.5, 0.5, 0.4].into(), normal: [0.3, 0.1, -1.0].into() };
        let sensor = SensorSpec { name: "middle".into(), shape: middle };
        let experiment = Experiment::new(job.build_scene().unwrap(), job.method.walks()).unwrap();
        let groups = |experiment: &Experiment| {
            let patches = vec![(0, job.scene.patch_count() as u32 - 1)];
            let all = [PatchGroup { name: "all".into(), patches }];
            let first = experiment.scene().faces().iter().take(1);
            let even = experiment
                .scene()
                .faces()
                .iter()
                .all(|face| first.clone().all(|f| f.reflectance == face.reflectance));
            experiment.clone().with_groups(&all, if even { &all } else { &[] }).ok()
        };
        let of_groups = groups(&experiment).and_then(|experiment| breach_of(job, &experiment));
        let sensors: &[SensorSpec] = if experiment.is_biased() { &[] } else { &[sensor] };
        of_groups.or_else(|| breach_of(job, &experiment.with_sensors(sensors).unwrap()))
    }

    /// The tally of some walks, and whether it keeps the limits.
    fn breach_of(job: &Job, experiment: &Experiment) -> Option<&'static str> {
        let mut board = experiment.board();
        let walks = job.budget.paths / experiment.unit().paths();
        experiment.walk(&Sequence::new(7), 0..walks, &mut board);
        let tally = board.take().unwrap();
        let limits = limits(experiment);
        let sums = tally.sums().iter().copied();
        limits
            .breach_of_counts(&tally.counts)
            .or_else(|| limits.breach_of_sums(&tally.counts, tally.layout(), sums))
    }

    const METHODS: [&str; 22] = [
        "walk=shooting estimator=absorption",
        "walk=shooting estimator=survival",
        "walk=shooting estimator=collision",
        "walk=shooting estimator=collision space=continuous",
        "walk=shooting estimator=infinite",
        "walk=shooting estimator=infinite infinite.end=cutoff",
        "walk=shooting estimator=infinite infinite.end=length infinite.length=20",
        "walk=shooting estimator=direct",
        "walk=shooting mix=true",
        "walk=gathering estimator=absorption",
        "walk=gathering estimator=survival",
        "walk=gathering estimator=collision",
        "walk=gathering estimator=infinite",
        "walk=gathering mix=true",
        "walk=shooting basis=linear",
        "walk=shooting basis=linear estimator=infinite",
        "walk=gathering basis=linear",
        "walk=shooting basis=linear sampler=sobol",
        "walk=shooting sampler=sobol",
        "walk=jacobi",
        "walk=jacobi jacobi.solve=iterations",
        "walk=jacobi final_gather=[3,4]",
    ];

    /// If an honest worker broke a limit, every job of that kind would end.
    #[test]
    fn walks_of_every_kind_keep_the_limits() {
        let files = ["cube54", "cube6-r90", "cornell", "furnace", "two-rooms"];
        let jobs: Vec<_> =
            files.iter().flat_map(|file| METHODS.iter().map(move |method| (*file, *method))).collect();
        let tried = parallel::on_all_cores(jobs.len(), |i| {
            let (file, method) = jobs[i];
            let set = method.split(' ').map(|set| format!("method.{set}"));
            let set: Vec<String> = set.chain(["budget.paths=50000".into()]).collect();
            let path = format!("{}/../../configs/{file}.toml", env!("CARGO_MANIFEST_DIR"));
            // Some methods do not fit some scenes.
            let Ok(job) = job::load(path.as_ref(), &set) else { return false };
            let Ok(scene) = job.build_scene() else { return false };
            if Experiment::new(scene, job.method.walks()).is_err() {
                return false;
            }
            assert_eq!(breach(&job), None, "{file}: {method}");
            true
        });
        let tried = tried.iter().filter(|&&tried| tried).count();
        assert!(tried > 60, "{tried} jobs");
    }
}
