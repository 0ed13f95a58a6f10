//! The schema of scene files.

use serde_json::{Value, json};

use super::parts::*;
use crate::emit::EMIT_KEYS;
use crate::keys::SCENE_KEYS;
use crate::material::MATERIAL_KEYS;
use crate::partition::AUTO;
use crate::scene::{MESH_KEYS, SURFACE_KEYS};
use crate::sensors::SENSOR_KEYS;
use crate::sky::SKY_KEYS;

/// The schema of scene files.
pub fn scene_schema() -> Value {
    titled("A radwalk scene", table(SCENE_KEYS, &[], scene_key))
}

fn scene_key(key: &str) -> Value {
    match key {
        "material" => told(
            json!({"type": "object", "additionalProperties": table(MATERIAL_KEYS, &[], material_key)}),
            "Materials by name.",
        ),
        "surface" => told(
            list_of(table(SURFACE_KEYS, &["material"], surface_key), 0),
            "Flat surfaces, in the order of their patches.",
        ),
        "mesh" => told(
            list_of(table(MESH_KEYS, &["file"], mesh_key), 0),
            "Meshes, whose surfaces follow all others.",
        ),
        "sensor" => told(
            list_of(table(SENSOR_KEYS, &[], sensor_key), 0),
            "Places where light is measured that block none.",
        ),
        "sky" => told(
            table(SKY_KEYS, &["emittance"], sky_key),
            "A uniform environment that lights the scene: six black surfaces around everything, behind all others.",
        ),
        _ => json!({}),
    }
}

fn sky_key(key: &str) -> Value {
    match key {
        "emittance" => told(
            light(),
            "What a horizontal plane receives from all of the sky [W/m²]; a number, or [red, green, blue].",
        ),
        _ => json!({}),
    }
}

fn material_key(key: &str) -> Value {
    match key {
        "reflectance" => told(reflectance(), "In [0, 1); a number, or [red, green, blue]. Default: 0."),
        "emittance" => told(light(), "Emitted power per area; a number, or [red, green, blue]. Default: 0."),
        _ => json!({}),
    }
}

fn surface_key(key: &str) -> Value {
    let cells = || integer(1, u32::MAX.into());
    match key {
        "name" => told(text(), "Shown in the rows of its patches. Default: its number."),
        "material" => told(text(), "The name of a material."),
        "quad" => told(corners(), "A parallelogram: corner c, c + u, c + v; the front faces u × v."),
        "triangle" => told(
            corners(),
            "A triangle: a, b, c; the front by the right-hand rule. A surface has either a quad or a triangle.",
        ),
        "patches" => told(
            json!({"anyOf": [exactly(cells(), 2), integer(1, u16::MAX.into()), {"enum": [AUTO]}]}),
            "Cells along u and v of a quad; k for the k² cells of a triangle; \"auto\" for cells that a pilot chooses. Default: one patch.",
        ),
        "sides" => {
            told(json!({"enum": [1, 2]}), "1: the front reflects and emits; 2: both sides. Default: 1.")
        }
        "emit" => told(
            list_of(table(EMIT_KEYS, EMIT_KEYS, emit_key), 0),
            "Emittances of single cells, in place of the material's.",
        ),
        _ => json!({}),
    }
}

fn sensor_key(key: &str) -> Value {
    match key {
        "name" => told(text(), "Shown in the rows of its patches. Default: its number."),
        "quad" => told(corners(), "A parallelogram: corner c, c + u, c + v; it faces u × v."),
        "patches" => {
            told(exactly(integer(1, u32::MAX.into()), 2), "Cells of the quad along u and v. Default: one.")
        }
        "point" => told(point(), "A point, in place of a quad [m]."),
        "normal" => told(point(), "The direction that the point faces, of any length."),
        _ => json!({}),
    }
}

fn emit_key(key: &str) -> Value {
    match key {
        "cell" => exactly(count(0), 2),
        "emittance" => light(),
        _ => json!({}),
    }
}

fn mesh_key(key: &str) -> Value {
    match key {
        "file" => told(text(), "The mesh, relative to this file."),
        "material" => told(text(), "The material of all its faces. Default: the file's own."),
        "max_patch_area" => told(positive(), "Triangles are cut until no patch is larger [m²]."),
        _ => json!({}),
    }
}
