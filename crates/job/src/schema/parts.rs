//! What schemas are made of: tables of known keys, words, numbers and lists.

use serde_json::{Value, json};

use crate::key::Key;
use crate::word::Keyword;

/// The dialect that the schemas are written in.
const DIALECT: &str = "http://json-schema.org/draft-07/schema#";

/// The schema of a file: a table with a title.
pub(crate) fn titled(title: &str, mut schema: Value) -> Value {
    schema["$schema"] = json!(DIALECT);
    schema["title"] = json!(title);
    schema
}

/// A table of known keys.
pub(crate) fn table(keys: &[Key]) -> Value {
    let described = |key: &Key| match key.words {
        "" => (key.values)(),
        words => with_description((key.values)(), words),
    };
    let properties: serde_json::Map<String, Value> =
        keys.iter().map(|key| (key.name.to_owned(), described(key))).collect();
    let required: Vec<&str> = keys.iter().filter(|key| key.is_required).map(|key| key.name).collect();
    json!({
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

/// A schema with the sentence that editors show beside the key.
pub(crate) fn with_description(mut schema: Value, description: &str) -> Value {
    schema["description"] = json!(description);
    schema
}

pub(crate) fn word<W: Keyword>() -> Value {
    json!({"enum": W::ALL.iter().map(|choice| choice.word()).collect::<Vec<_>>()})
}

pub(crate) fn integer(least: u64, most: u64) -> Value {
    json!({"type": "integer", "minimum": least, "maximum": most})
}

pub(crate) fn count(least: u64) -> Value {
    json!({"type": "integer", "minimum": least})
}

pub(crate) fn positive() -> Value {
    json!({"type": "number", "exclusiveMinimum": 0})
}

pub(crate) fn list_of(items: Value, least: usize) -> Value {
    json!({"type": "array", "items": items, "minItems": least})
}

pub(crate) fn exactly(items: Value, n: usize) -> Value {
    json!({"type": "array", "items": items, "minItems": n, "maxItems": n})
}

pub(crate) fn patches() -> Value {
    json!({"type": "array", "items": count(0), "minItems": 1, "uniqueItems": true})
}

/// A number, or three.
pub(crate) fn spectrum(channel: Value) -> Value {
    json!({"anyOf": [channel.clone(), exactly(channel, 3)]})
}

pub(crate) fn reflectance() -> Value {
    spectrum(json!({"type": "number", "minimum": 0, "exclusiveMaximum": 1}))
}

pub(crate) fn light() -> Value {
    spectrum(json!({"type": "number", "minimum": 0}))
}

pub(crate) fn boolean() -> Value {
    json!({"type": "boolean"})
}

pub(crate) fn text() -> Value {
    json!({"type": "string", "minLength": 1})
}

pub(crate) fn corners() -> Value {
    exactly(point(), 3)
}

pub(crate) fn point() -> Value {
    exactly(json!({"type": "number"}), 3)
}
