//! Scenes that a choice must survive: even light, high reflectance, no light, a half that no light reaches, one small lamp, a million triangles.
//!
//! `radwalk-lab survival FOLDER [quick]` writes `survival.md` into the folder; `quick` leaves out the million triangles.

use std::fs;
use std::path::{Path, PathBuf};

use job::Forecast;
use radiosity::SceneSpec;
use report::words::{counted, percent};

use super::page;
use super::runs::{ChoiceRoom, TrialPlan, chosen, given, on_chosen};
use super::truth::RoomReference;
use crate::walking::Failure;

/// Walks of a reference.
const WALKS: u64 = 1_000_000;

/// The side of a lamp in a unit cube, 10⁻⁵ of whose area it is [m].
const SMALL_LAMP: f64 = 0.007_746;

pub(crate) fn run(words: &[String]) -> Result<(), Failure> {
    let (folder, rest) = words.split_first().ok_or("usage: survival FOLDER [quick]")?;
    let (to, work) = ((Path::new(folder), !rest.is_empty()), tempfile::tempdir()?);
    let mut files = Vec::new();
    for (name, spec) in made() {
        let path = work.path().join(format!("{name}.toml"));
        fs::write(&path, job::to_toml(&spec))?;
        files.push((name, path, if name == "bright" { TrialPlan::LONG } else { TrialPlan::ROOM }));
    }
    if rest.is_empty() {
        files.push(("million", write_million(work.path())?, TrialPlan::LONG));
    }
    let (mut cases, mut studied) = (Vec::new(), Vec::new());
    for (name, path, effort) in files {
        let room = ChoiceRoom::new(&path)?;
        let (experiment, forecast, _) = match on_chosen(&room, &[]) {
            Ok(chosen) => chosen,
            Err(refusal) => {
                let words = refusal.to_string().replace(&*path.to_string_lossy(), name);
                cases.push((name, format!("refused: {words}")));
                continue;
            }
        };
        let patches = experiment.scene().faces().patch_count();
        cases.push((name, in_words(&forecast, patches)));
        let truth = RoomReference::cached(&room, WALKS, work.path())?;
        let (chosen, given) = (chosen(&room, &truth, effort)?, given(&room, &truth, effort)?);
        studied.push((room, chosen, given));
        page::write_survival(to, &cases, &studied)?;
    }
    page::write_survival(to, &cases, &studied)
}

/// What is chosen, and why.
fn in_words(forecast: &Forecast, patches: usize) -> String {
    let fits = if forecast.linear { "linear fits" } else { "means" };
    format!(
        "{fits} on {}, after {} walks of pilot and control: of all patches and bases that were tried the pilot predicts the least error for these, {} (noise {}, discretisation {}), \
         after {} walks",
        counted(patches as u64, "patch"),
        forecast.paths,
        percent(forecast.total()),
        percent(forecast.noise),
        percent(forecast.discretisation),
        forecast.for_paths
    )
}

/// The small scenes. No cells are written but those that emit.
pub(crate) fn made() -> [(&'static str, SceneSpec); 5] {
    let mut bright = scenes::cube_with_tile(0.1, 0.99);
    bright.surfaces[0].emittance = 1.0.into();
    let mut small = scenes::cube_with_tile(SMALL_LAMP, 0.5);
    small.surfaces[0].emittance = 1.0.into();
    [
        ("even", scenes::furnace(1, 0.5)),
        ("bright", bright),
        ("night", scenes::cube_with_tile(0.1, 0.5)),
        ("halves", scenes::unequal_rooms(0.0)),
        ("small-lamp", small),
    ]
}

/// An interior of a million triangles as a mesh.
fn write_million(folder: &Path) -> Result<PathBuf, Failure> {
    let [obj, mtl] = scenes::interior_obj(1_000_000);
    let path = folder.join("million.obj");
    fs::write(&path, obj)?;
    fs::write(folder.join("interior.mtl"), mtl)?;
    Ok(path)
}
