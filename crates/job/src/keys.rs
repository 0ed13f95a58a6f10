//! The keys of files: each once, with the schema of its values, what it means, and whether its table must have it. Readers refuse other keys,
//! and editors' schemas and the reference are written from the same tables.

mod job;
mod scene;

pub(crate) use self::job::*;
pub(crate) use self::scene::*;

/// The keys at the top of a job that are lists of tables.
pub(crate) const JOB_LISTS: [&str; 1] = ["source"];

/// The keys at the top of a scene that are lists of tables.
pub(crate) const LISTS: [&str; 7] = ["surface", "mesh", "sensor", "lamp", "plane", "points", "pane"];
