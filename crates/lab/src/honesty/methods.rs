//! The methods of the study, and runs of them.

use radiosity::{Experiment, IndexChoice, Scene};
use results::{StoredRun, choose, walk_here};

use super::Failure;
use super::scenes::HonestyScene;

/// A method, with the keys of a job that select it.
pub struct HonestyMethod {
    pub name: &'static str,
    /// The keys that choose it.
    set: &'static [&'static str],
    /// The seeds of a made scene.
    pub seeds: usize,
    /// Whether it is tried in rooms from elsewhere.
    pub in_rooms: bool,
    /// Paths of a run over those of the plainest.
    longer: u64,
}

const SHOOTING: &str = "method.walk=shooting";
const GIVEN: &str = "scene.patches=given";

/// The first is the plainest: its hits say which class a patch is in.
pub const METHODS: [HonestyMethod; 12] = [
    HonestyMethod {
        name: "collision",
        set: &[SHOOTING, "method.estimator=collision"],
        seeds: 200,
        in_rooms: true,
        longer: 1,
    },
    HonestyMethod {
        name: "continuous",
        set: &[SHOOTING, "method.space=continuous"],
        seeds: 200,
        in_rooms: true,
        longer: 1,
    },
    HonestyMethod {
        name: "absorption",
        set: &[SHOOTING, "method.estimator=absorption"],
        seeds: 200,
        in_rooms: false,
        longer: 1,
    },
    HonestyMethod {
        name: "survival",
        set: &[SHOOTING, "method.estimator=survival"],
        seeds: 200,
        in_rooms: false,
        longer: 1,
    },
    HonestyMethod {
        name: "infinite, roulette",
        set: &[SHOOTING, "method.estimator=infinite"],
        seeds: 100,
        in_rooms: false,
        longer: 1,
    },
    HonestyMethod {
        name: "infinite, cut off",
        set: &[
            SHOOTING,
            "method.estimator=infinite",
            "method.infinite.end=cutoff",
            "method.infinite.threshold=0.01",
        ],
        seeds: 100,
        in_rooms: false,
        longer: 1,
    },
    HonestyMethod {
        name: "gathering",
        set: &["method.walk=gathering"],
        seeds: 100,
        in_rooms: false,
        longer: 4,
    },
    HonestyMethod {
        name: "sobol",
        set: &[SHOOTING, "method.sampler=sobol"],
        seeds: 100,
        in_rooms: false,
        longer: 1,
    },
    HonestyMethod { name: "chains", set: &["method.walk=jacobi"], seeds: 100, in_rooms: true, longer: 0 },
    HonestyMethod {
        name: "linear",
        set: &[SHOOTING, "method.basis=linear", "method.space=continuous"],
        seeds: 100,
        in_rooms: false,
        longer: 1,
    },
    HonestyMethod {
        name: "auto patches",
        set: &["scene.patches=auto"],
        seeds: 16,
        in_rooms: false,
        longer: 4,
    },
    HonestyMethod { name: "default", set: &[], seeds: 16, in_rooms: true, longer: 4 },
];

/// Walks of the plainest runs; in rooms, at least, and for each of their faces.
const WALKS: u64 = 4096;
const WALKS_PER_FACE: u64 = 5;

/// The rays of the shortest chains that a job takes, for each face.
const CHAIN_RAYS: u64 = 8 * 32;

impl HonestyMethod {
    /// The paths of its runs in a scene with this number of faces.
    pub fn paths(&self, site: &HonestyScene, faces: usize) -> u64 {
        let plain = if site.made { WALKS } else { WALKS.max(WALKS_PER_FACE * faces as u64) };
        if self.longer == 0 { CHAIN_RAYS * faces as u64 } else { self.longer * plain }
    }

    pub fn seeds(&self, site: &HonestyScene) -> usize {
        match (site.made, site.slow) {
            // Where walks are long, the noise of all patches goes together, so that fewer seeds would tell nothing of a total.
            (true, true) if self.chooses() => 4 * self.seeds,
            (true, false) => self.seeds,
            (true, true) => self.seeds.div_ceil(4),
            (false, _) => 10,
        }
    }

    /// Whether a pilot chooses the patches.
    pub fn chooses(&self) -> bool {
        matches!(self.name, "auto patches" | "default")
    }

    /// What a job is changed by.
    fn overrides(&self, paths: u64, seed: u64, more: &[String]) -> Vec<String> {
        let plain = [format!("budget.paths={paths}"), format!("seed={seed}")];
        let given = if self.chooses() { None } else { Some(GIVEN.into()) };
        self.set
            .iter()
            .map(|set| (*set).into())
            .chain(plain)
            .chain(given)
            .chain(more.iter().cloned())
            .collect()
    }

    /// One run in this thread.
    pub fn run(
        &self,
        site: &HonestyScene,
        paths: u64,
        seed: u64,
        more: &[String],
    ) -> Result<StoredRun, Failure> {
        let overrides = self.overrides(paths, seed, more);
        let mut job = job::load(&site.path, &overrides)?;
        if let Some(chosen) = choose(&job, 1.try_into().expect("not 0"))? {
            job = job::load(&site.path, &overrides).and_then(|job| job.cut(&overrides, &chosen.partition))?;
        }
        let scene = job.build_scene()?;
        let experiment = Experiment::new(scene, job.method.walks())?;
        let done = walk_here(&job, experiment, 1, "study", &mut |_| true)?;
        Ok(done.ok_or("the run was given up")?.0)
    }
}

/// The scene of a site with its given patches.
pub fn scene(site: &HonestyScene) -> Result<(radiosity::SceneSpec, Scene), Failure> {
    let job = job::load(&site.path, &[SHOOTING.into(), GIVEN.into()])?;
    let spec = job.scene.spec().clone();
    let scene = Scene::build(&spec, IndexChoice::Auto)?;
    Ok((spec, scene))
}
