//! `radwalk new`: a job and a scene to begin with.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use crate::args::{NewArgs, StarterKind};
use crate::fault::{Fault, Outcome};

/// The name, the job and the scene of a kind; `None` where it is the schemas alone.
fn files(kind: StarterKind) -> Option<(&'static str, &'static str, &'static str)> {
    Some(match kind {
        StarterKind::Box => (
            "box",
            include_str!("../../configs/new/box.toml"),
            include_str!("../../configs/new/scenes/box.toml"),
        ),
        StarterKind::Room => (
            "room",
            include_str!("../../configs/new/room.toml"),
            include_str!("../../configs/new/scenes/room.toml"),
        ),
        StarterKind::Cornell => (
            "cornell",
            include_str!("../../configs/cornell.toml"),
            include_str!("../../configs/scenes/cornell.toml"),
        ),
        StarterKind::Schema => return None,
    })
}

/// The lines by which editors find the schemas, from the folders of jobs and of scenes.
const JOB_SCHEMA: &str = "schema/job.json";
const SCENE_SCHEMA: &str = "schema/scene.json";

/// Writes a job and its scene with the schemas that editors complete their keys by, or the schemas alone. Jobs and scenes
/// that are there are replaced with `--force` alone.
pub(crate) fn new(args: &NewArgs) -> Result<Outcome, Fault> {
    let Some((name, job, scene)) = files(args.kind) else {
        write_schemas(&args.out)?;
        let [job, scene] = [JOB_SCHEMA, SCENE_SCHEMA].map(|file| args.out.join(file));
        let wrote = format!("wrote {} and {}", job.display(), scene.display());
        let line = format!("name them in the first line of a file: #:schema {}", job.display());
        args.told.tell(&args.out, &[wrote, line]);
        return Ok(Outcome::Done);
    };
    let file = format!("{name}.toml");
    let (job_file, scene_file) = (args.out.join(&file), args.out.join("scenes").join(&file));
    let taken = [&job_file, &scene_file].into_iter().find(|file| file.exists());
    if let Some(path) = taken.filter(|_| !args.force) {
        return Err(Fault::Taken { path: path.clone() });
    }
    let write = if args.force { write_over } else { write_new };
    write_schemas(&args.out)?;
    write(&scene_file, &format!("#:schema ../{SCENE_SCHEMA}\n{scene}"))?;
    write(&job_file, &format!("#:schema {JOB_SCHEMA}\n{job}"))?;
    let wrote = format!("wrote {} and {}", job_file.display(), scene_file.display());
    args.told.tell(&args.out, &[wrote, format!("run it with: radwalk run {}", job_file.display())]);
    Ok(Outcome::Done)
}

/// Writes the schemas of this version, in place of those of another one.
fn write_schemas(folder: &Path) -> Result<(), Fault> {
    for (file, schema) in [(JOB_SCHEMA, job::job_schema()), (SCENE_SCHEMA, job::scene_schema())] {
        write_over(&folder.join(file), &format!("{schema:#}\n"))?;
    }
    Ok(())
}

/// Writes a file in place of what is there.
fn write_over(path: &Path, text: &str) -> Result<(), Fault> {
    let fault = |source| Fault::NotWritten { path: path.into(), source };
    fs::create_dir_all(path.parent().unwrap_or(path)).map_err(fault)?;
    fs::write(path, text).map_err(fault)
}

/// Writes a file that does not exist yet.
///
/// # Errors
/// Where it is, or cannot be written.
pub(crate) fn write_new(path: &Path, text: &str) -> Result<(), Fault> {
    let fault = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::AlreadyExists => Fault::CopyTaken { path: path.into() },
        _ => Fault::NotWritten { path: path.into(), source },
    };
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(fault)?;
    }
    File::create_new(path).and_then(|mut file| file.write_all(text.as_bytes())).map_err(fault)
}
