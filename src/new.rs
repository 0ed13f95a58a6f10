//! `radwalk new`: a job and a scene to begin with.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use crate::args::{Kind, NewArgs};
use crate::console::say;
use crate::fault::{Fault, Outcome};

/// The name, the job and the scene of a kind.
fn files(kind: Kind) -> (&'static str, &'static str, &'static str) {
    match kind {
        Kind::Box => {
            ("box", include_str!("../configs/new/box.toml"), include_str!("../configs/new/scenes/box.toml"))
        }
        Kind::Room => (
            "room",
            include_str!("../configs/new/room.toml"),
            include_str!("../configs/new/scenes/room.toml"),
        ),
        Kind::Cornell => (
            "cornell",
            include_str!("../configs/cornell.toml"),
            include_str!("../configs/scenes/cornell.toml"),
        ),
    }
}

/// Writes a job and its scene, replacing nothing.
pub fn new(args: &NewArgs) -> Result<Outcome, Fault> {
    let (name, job, scene) = files(args.kind);
    let file = format!("{name}.toml");
    let (job_file, scene_file) = (args.out.join(&file), args.out.join("scenes").join(&file));
    if let Some(taken) = [&job_file, &scene_file].into_iter().find(|file| file.exists()) {
        return Err(Fault::Taken { path: taken.clone() });
    }
    write_new(&scene_file, scene)?;
    write_new(&job_file, job)?;
    say(&format!("wrote {} and {}", job_file.display(), scene_file.display()));
    say(&format!("run it with: radwalk run {}", job_file.display()));
    Ok(Outcome::Done)
}

/// Writes a file that is not there yet.
///
/// # Errors
/// Where it is, or cannot be written.
pub fn write_new(path: &Path, text: &str) -> Result<(), Fault> {
    let fault = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::AlreadyExists => Fault::Taken { path: path.into() },
        _ => Fault::NotWritten { path: path.into(), source },
    };
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(fault)?;
    }
    File::create_new(path).and_then(|mut file| file.write_all(text.as_bytes())).map_err(fault)
}
