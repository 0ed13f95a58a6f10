//! A key of a table, with all that is said of it.

use serde_json::Value;

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
    pub(crate) const fn new(name: &'static str, values: fn() -> Value, words: &'static str) -> Self {
        Key { name, values, words, is_required: false }
    }

    /// The same key, which its table must have.
    pub(crate) const fn required(self) -> Self {
        Key { is_required: true, ..self }
    }
}

/// The names of the keys of a table.
pub(crate) const fn names<const N: usize>(keys: &[Key; N]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut i = 0;
    while i < N {
        names[i] = keys[i].name;
        i += 1;
    }
    names
}
