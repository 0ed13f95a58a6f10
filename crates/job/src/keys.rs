//! The keys of files: each once, with the schema of its values, what it means, and whether its table must have it. Readers refuse other keys,
//! and editors' schemas and the reference are written from the same tables.

mod job;

use serde_json::Value;

pub(crate) use self::job::*;

/// A key of a table.
pub(crate) struct Key {
    /// Its name.
    pub name: &'static str,
    /// The schema of its values.
    pub values: fn() -> Value,
    /// What it means, and its default; empty where the table's own key says it.
    pub words: &'static str,
    /// Whether the table must have it.
    pub is_required: bool,
}

impl Key {
    /// A key that may be absent.
    const fn new(name: &'static str, values: fn() -> Value, words: &'static str) -> Self {
        Key { name, values, words, is_required: false }
    }

    /// The same key, which its table must have.
    const fn required(self) -> Self {
        Key { is_required: true, ..self }
    }
}

/// The names of the keys of a table.
const fn names<const N: usize>(keys: &[Key; N]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut i = 0;
    while i < N {
        names[i] = keys[i].name;
        i += 1;
    }
    names
}

/// The keys at the top of a job that are lists of tables.
pub(crate) const JOB_LISTS: [&str; 1] = ["source"];

/// The keys of a scene file.
pub(crate) const SCENE_KEYS: &[&str] = &["material", "surface", "mesh", "sensor", "sky"];

/// The keys at the top of a scene that are lists of tables.
pub(crate) const LISTS: [&str; 3] = ["surface", "mesh", "sensor"];
