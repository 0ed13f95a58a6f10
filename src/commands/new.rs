//! `radwalk new`: a job and a scene to begin with.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use voice::say;

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
/// that are there are not replaced.
pub(crate) fn new(args: &NewArgs) -> Result<Outcome, Fault> {
    let Some((name, job, scene)) = files(args.kind) else {
        write_schemas(&args.out)?;
        say(&format!("wrote {} and {}", JOB_SCHEMA, SCENE_SCHEMA));
        say(&format!("name them in the first line of a file: #:schema {JOB_SCHEMA}"));
        return Ok(Outcome::Done);
    };
    let file = format!("{name}.toml");
    let (job_file, scene_file) = (args.out.join(&file), args.out.join("scenes").join(&file));
    if let Some(taken) = [&job_file, &scene_file].into_iter().find(|file| file.exists()) {
        return Err(Fault::Taken { path: taken.clone() });
    }
    write_schemas(&args.out)?;
    write_new(&scene_file, &format!("#:schema ../{SCENE_SCHEMA}\n{scene}"))?;
    write_new(&job_file, &format!("#:schema {JOB_SCHEMA}\n{job}"))?;
    say(&format!("wrote {} and {}", job_file.display(), scene_file.display()));
    say(&format!("run it with: radwalk run {}", job_file.display()));
    Ok(Outcome::Done)
}

/// Writes the schemas of this version, in place of those of another one.
fn write_schemas(folder: &Path) -> Result<(), Fault> {
    for (file, schema) in [(JOB_SCHEMA, job::job_schema()), (SCENE_SCHEMA, job::scene_schema())] {
        let path = folder.join(file);
        let fault = |source| Fault::NotWritten { path: path.clone(), source };
        fs::create_dir_all(path.parent().unwrap_or(folder)).map_err(fault)?;
        fs::write(&path, format!("{schema:#}\n")).map_err(fault)?;
    }
    Ok(())
}

/// Writes a file that does not exist yet.
///
/// # Errors
/// Where it is, or cannot be written.
pub(crate) fn write_new(path: &Path, text: &str) -> Result<(), Fault> {
    let fault = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::AlreadyExists => Fault::Taken { path: path.into() },
        _ => Fault::NotWritten { path: path.into(), source },
    };
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(fault)?;
    }
    File::create_new(path).and_then(|mut file| file.write_all(text.as_bytes())).map_err(fault)
}
