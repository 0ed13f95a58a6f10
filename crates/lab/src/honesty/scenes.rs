//! The scenes of the study.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use radiosity::{SceneSpec, Spectrum};

use super::Failure;

/// A scene and what is asked of it.
pub struct HonestyScene {
    pub name: String,
    /// The name of its file.
    pub file: String,
    pub what: String,
    /// The file of the scene or job.
    pub path: PathBuf,
    /// Whether it is one of the made scenes, whose solution is exact.
    pub made: bool,
    /// Whether its walks are so long that it gets a quarter of the seeds.
    pub slow: bool,
}

impl HonestyScene {
    /// A made scene, written to a folder.
    pub fn made(name: &str, what: &str, spec: &SceneSpec, folder: &Path) -> Result<Self, Failure> {
        let path = folder.join(format!("{name}.toml"));
        fs::write(&path, job::to_toml(spec))?;
        let scene = fs::canonicalize(&path)?;
        let job = folder.join(format!("{name}-job.toml"));
        fs::write(&job, format!("scene = {scene:?}\n[budget]\npaths = 1000\n"))?;
        let (file, slow) = (format!("{name}.toml"), name == "bright");
        Ok(HonestyScene { name: name.into(), file, what: what.into(), path: job, made: true, slow })
    }

    /// A room from elsewhere.
    pub fn room(path: &Path) -> Result<Self, Failure> {
        let file = path.file_name().ok_or("a room is a file")?.to_string_lossy().into_owned();
        let name = file.clone();
        Ok(HonestyScene {
            name,
            file,
            what: "a room from an archive".into(),
            path: path.into(),
            made: false,
            slow: false,
        })
    }
}

/// Twelve scenes, with a word on each.
pub fn made() -> Vec<(&'static str, &'static str, SceneSpec)> {
    let with = |mut spec: SceneSpec, change: &dyn Fn(usize, &mut radiosity::SurfaceSpec)| {
        spec.surfaces.iter_mut().enumerate().for_each(|(i, surface)| change(i, surface));
        spec
    };
    let white = |r: f64| with(scenes::cube(4), &|_, surface| surface.reflectance = r.into());
    let ceiling = |r: f64| {
        with(scenes::cube(4), &|i, surface| {
            surface.reflectance = r.into();
            surface.cell_emittance.clear();
            surface.emittance = if i == 1 { 1.0.into() } else { Spectrum::BLACK };
        })
    };
    let colour = with(scenes::cube(4), &|i, surface| {
        surface.reflectance = Spectrum::rgb([[0.7, 0.7, 0.7], [0.8, 0.2, 0.1], [0.1, 0.3, 0.8]][i % 3]);
        for (_, emittance) in &mut surface.cell_emittance {
            *emittance = Spectrum::rgb([3.0, 2.0, 1.0]);
        }
    });
    let open = {
        let mut spec = scenes::cube(4);
        spec.surfaces.remove(1);
        spec
    };
    let thin = scenes::moved(&scenes::cube(4), |p: DVec3| DVec3::new(10.0 * p.x, p.y, 0.2 * p.z));
    vec![
        ("cube54", "the cube of S97, 54 patches", scenes::cube(3)),
        ("furnace", "everything emits, R = 0.9, six patches", scenes::furnace(1, 0.9)),
        ("white-box", "a closed box of R = 0.95 with a small lamp", white(0.95)),
        ("lit-ceiling", "a closed box of R = 0.95 whose ceiling emits", ceiling(0.95)),
        ("bright", "a closed box of R = 0.99 with a small lamp", white(0.99)),
        ("two-rooms", "two rooms of R = 0.5 that share an opening", scenes::two_rooms(0.2, 0.5)),
        ("white-rooms", "two rooms of R = 0.95 that share an opening", scenes::two_rooms(0.2, 0.95)),
        ("corridor", "a corridor of 8 cubes, lit at one end", scenes::corridor(8)),
        ("slab", "a closed box of 50 : 5 : 1", thin),
        ("open", "a box without its ceiling", open),
        ("colour", "a closed box in colour", colour),
        ("halves", "two closed boxes, one of which is dark", scenes::unequal_rooms(0.0)),
    ]
}
