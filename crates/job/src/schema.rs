//! JSON schemas of job and scene files, by which editors complete keys and mark mistakes.
//!
//! They are made of the tables of keys and words that the readers use, so that neither knows a key that the other does not.
//! What depends on several keys, such as which of them exclude each other, is left to the readers.

pub(crate) mod parts;

use serde_json::Value;

use self::parts::*;
use crate::keys::{JOB, SCENE};

/// The schema of job files.
pub fn job_schema() -> Value {
    titled("A radwalk job", table(&JOB))
}

/// The schema of scene files.
pub fn scene_schema() -> Value {
    titled("A radwalk scene", table(&SCENE))
}
