//! Whether a file is a job or a scene.

use std::path::Path;

use crate::error::Error;
use crate::keys::JOB_KEYS;
use crate::scene::is_toml;
use crate::source::SourceText;

/// The kind of a file: a job or a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A job: for [`crate::load`].
    Job,
    /// A scene: for [`crate::load_scene`].
    Scene,
}

/// Tells a job from a scene: by the file's name where that is not `.toml`, else by the tables that only scenes have,
/// else by the keys of jobs, none of which a scene has.
///
/// # Errors
/// A `.toml` file that cannot be read or is not TOML.
pub fn file_kind(path: &Path) -> Result<FileKind, Error> {
    if !is_toml(path) {
        return Ok(FileKind::Scene);
    }
    let source = SourceText::read(path, "a job or a scene")?;
    if source.holds_scene() {
        return Ok(FileKind::Scene);
    }
    let is_job = source.parse()?.keys().any(|key| JOB_KEYS.contains(&key.as_ref().as_ref()));
    Ok(if is_job { FileKind::Job } else { FileKind::Scene })
}
