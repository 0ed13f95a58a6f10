//! The schema of scene files.

use serde_json::{Value, json};

use super::parts::*;
use crate::emit::EMIT_KEYS;
use crate::keys::SCENE_KEYS;
use crate::lamps::LAMP_KEYS;
use crate::material::MATERIAL_KEYS;
use crate::partition::AUTO;
use crate::planes::{PLANE_KEYS, POINTS_KEYS};
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
        "lamp" => told(
            list_of(table(LAMP_KEYS, &[], lamp_key), 0),
            "Lamps without area: luminaires from files, or a number of candelas. They make the unit of light the lumen.",
        ),
        "plane" => told(
            list_of(table(PLANE_KEYS, &["origin", "u", "v", "spacing"], plane_key), 0),
            "Grids of points at which light is measured: work planes.",
        ),
        "points" => told(
            list_of(table(POINTS_KEYS, &["file"], points_key), 0),
            "Points of files at which light is measured.",
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

fn lamp_key(key: &str) -> Value {
    let number = || json!({"type": "number"});
    match key {
        "name" => told(text(), "Sources tell lamps by it. Default: its number."),
        "file" => told(text(), "A luminaire, .ies or .ldt, relative to this file."),
        "intensity" => told(
            light(),
            "In place of a file: the same in every direction [cd]; a number, or [red, green, blue].",
        ),
        "cone" => told(
            exactly(number(), 2),
            "With `intensity`: a spot, full up to the first angle from its axis and dark from the second on [°].",
        ),
        "illuminance" => told(
            light(),
            "In place of a file: light from far away, on a plane across its way [lx]; a number, or [red, green, blue].",
        ),
        "diameter" => {
            told(positive(), "With `illuminance`: the angle that the lamp takes up [°]. Default: 0.")
        }
        "position" => told(point(), "The centre of its luminous opening [m]."),
        "aim" => told(point(), "The direction of γ = 0, of any length. Default: down."),
        "rotation" => told(
            number(),
            "By which it is turned about its axis [°]: of a lamp that is aimed down, counter-clockwise as seen from above. Default: 0.",
        ),
        "factor" => told(light(), "Its light is multiplied by it: maintenance, dimming, colour. Default: 1."),
        _ => json!({}),
    }
}

fn plane_key(key: &str) -> Value {
    match key {
        "name" => told(text(), "Its figures are shown by it. Default: `plane` and its number."),
        "origin" => told(point(), "A corner of the plane [m]."),
        "u" | "v" => told(point(), "A side of the plane, from its corner [m]."),
        "spacing" => {
            told(positive(), "The distance of the points, about [m]: they are the middles of equal cells.")
        }
        "height" => {
            told(json!({"type": "number"}), "By which the plane is raised along its normal [m]. Default: 0.")
        }
        "normal" => told(point(), "The direction that the points face. Default: across u and v, upwards."),
        _ => json!({}),
    }
}

fn points_key(key: &str) -> Value {
    match key {
        "name" => told(text(), "Their figures are shown by it. Default: the name of the file."),
        "file" => told(text(), "A point a line, x y z dx dy dz, relative to this file."),
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
