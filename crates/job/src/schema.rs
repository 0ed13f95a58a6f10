//! JSON schemas of job and scene files, by which editors complete keys and mark mistakes.
//!
//! They are made of the lists of keys and words that the readers use, so that neither knows a key that the other does not.
//! What depends on several keys, such as which of them exclude each other, is left to the readers.

mod parts;
mod scene;

use radiosity::{EstimatorKind, IndexChoice, Quantity, RayBirths, Sampler, Space};
use serde_json::{Value, json};

use self::parts::*;
use crate::budget::MAX_STREAM_PATHS;
use crate::imports::{IMPORT_KEYS, OVERRIDE_KEYS};
use crate::job::Light;
use crate::keys::{
    BUDGET_KEYS, JOB_KEYS, METHOD_KEYS, SENSITIVITY_KEYS, SOURCE_KEYS, TARGET_KEYS, TRACING_KEYS,
};
use crate::method::{BIRTH_KEYS, Basis, EndWord, INFINITE_KEYS, SOLVE_KEYS, SolveWord, WalkKind};
use crate::output::{FOV, MAX_PIXELS, OUTPUT_KEYS, OutputFile, VIEW_KEYS, Vantage};
use crate::partition::SCENE_TABLE_KEYS;
use crate::target::Unhit;
pub use scene::scene_schema;

/// The schema of job files.
pub fn job_schema() -> Value {
    titled("A radwalk job", table(JOB_KEYS, &["scene", "budget"], job_key))
}

/// A target asks for something, and what is about patches goes with an error of theirs.
fn target_table() -> Value {
    let mut schema = table(TARGET_KEYS, &[], target_key);
    schema["anyOf"] =
        json!([{"required": ["relative_error"]}, {"required": ["sensors"]}, {"required": ["total_error"]}]);
    schema["dependencies"] = json!({"fraction": ["relative_error"], "min_hits": ["relative_error"], "patches": ["relative_error"], "quantity": ["relative_error"]});
    schema
}

fn scene_table_key(key: &str) -> Value {
    match key {
        "file" => told(text(), "The scene file, relative to this file."),
        "patches" => told(
            text(),
            "\"auto\": a pilot chooses the cells of every surface. \"given\": cells are those of the scene. Or the partition.toml of another run, relative to this file. Default: with [method] as \"given\"; else, and where a scene stands in place of a job, a pilot chooses the cells that the scene does not say.",
        ),
        _ => json!({}),
    }
}

fn job_key(key: &str) -> Value {
    match key {
        "name" => told(text(), "Names the output folder. Default: the file's name."),
        "scene" => told(
            json!({"anyOf": [text(), table(SCENE_TABLE_KEYS, &["file"], scene_table_key)]}),
            "The scene file, relative to this file: .toml, .obj, .gltf, .glb, .stl, .ply or .mgf. Or a table of the file and how it is cut.",
        ),
        "seed" => told(integer(0, i64::MAX as u64), "The seed of all random numbers. Default: 0."),
        "confidence" => told(
            json!({"type": "number", "minimum": 0.5, "exclusiveMaximum": 1}),
            "The level of every interval. Default: 0.95.",
        ),
        "simultaneous" => told(boolean(), "Whether all intervals hold together. Default: false."),
        "light" => told(
            word::<Light>(),
            "What the numbers measure: W and W/m², or lm and lx. No number depends on it. Default: luminous for .mgf, where light is assumed and with a [[lamp]], else radiant.",
        ),
        "import" => told(table(IMPORT_KEYS, &[], import_key), "How meshes are read."),
        "method" => told(table(METHOD_KEYS, &[], method_key), "How the scene is solved."),
        "budget" => told(table(BUDGET_KEYS, &["paths"], budget_key), "What the run may cost."),
        "target" => told(target_table(), "The accuracy at which the run ends. Default: the budget is spent."),
        "tracing" => told(table(TRACING_KEYS, &[], tracing_key), "How rays look for surfaces."),
        "output" => told(
            table(OUTPUT_KEYS, &[], output_key),
            "What is written beside tally.bin, which is always there.",
        ),
        "view" => told(view(), "How the picture is taken. What is absent is chosen from the scene."),
        "source" => told(
            list_of(source_table(), 0),
            "Groups of emitters that are told apart. Those that no group holds are the source \"rest\".",
        ),
        "sensitivity" => told(
            table(SENSITIVITY_KEYS, &["materials"], sensitivity_key),
            "How light depends on reflectances and emittances.",
        ),
        _ => json!({}),
    }
}

/// A source holds something.
fn source_table() -> Value {
    let mut schema = table(SOURCE_KEYS, &["name"], source_key);
    schema["anyOf"] =
        json!([{"required": ["surfaces"]}, {"required": ["materials"]}, {"required": ["patches"]}]);
    schema
}

fn source_key(key: &str) -> Value {
    match key {
        "name" => told(text(), "Names the source in outputs and for `radwalk combine`."),
        "surfaces" => told(
            json!({"type": "array", "items": {"anyOf": [text(), count(0)]}}),
            "Surfaces by name, * standing for any text, or by number.",
        ),
        "materials" => told(
            json!({"type": "array", "items": text()}),
            "All surfaces of materials by name, * standing for any text.",
        ),
        "patches" => told(patches(), "Patches by number."),
        "lamps" => told(
            json!({"type": "array"}),
            "Lamps without area by name, `*` standing for any text, or by number.",
        ),
        _ => json!({}),
    }
}

fn sensitivity_key(key: &str) -> Value {
    match key {
        "materials" => told(
            json!({"anyOf": [{"const": "all"}, list_of(text(), 1)]}),
            "The materials by name, * standing for any text, or \"all\".",
        ),
        _ => json!({}),
    }
}

fn output_key(key: &str) -> Value {
    match key {
        "files" => told(
            json!({"type": "array", "items": word::<OutputFile>(), "uniqueItems": true}),
            "The files that are written. Default: csv, summary, picture and report.",
        ),
        _ => json!({}),
    }
}

/// An eye looks at something; without one nothing is said of how it looks.
fn view() -> Value {
    let mut view = table(VIEW_KEYS, &[], view_key);
    view["dependencies"] = json!({"eye": ["look_at"], "look_at": ["eye"], "up": ["eye"], "fov": ["eye"]});
    view
}

fn view_key(key: &str) -> Value {
    match key {
        "from" => told(
            word::<Vantage>(),
            "Where the camera stands, if no eye says it. Default: inside where people could stand or walls hide the inside.",
        ),
        "eye" => told(point(), "Where the camera stands [m]."),
        "look_at" => told(point(), "The point in the middle of the picture [m]."),
        "up" => told(point(), "The direction that is up in the picture. Default: that of the scene."),
        "fov" => told(
            json!({"type": "number", "minimum": FOV[0], "maximum": FOV[1]}),
            "The angle between the lower and the upper edge [degrees]. Default: 40.",
        ),
        "size" => told(
            exactly(integer(1, MAX_PIXELS), 2),
            "Width and height [pixels]. Default: 800 × 500 from inside, else 800 on the longer side.",
        ),
        "exposure" => told(
            positive(),
            "The light of the picture, 1 being white paper, over the radiosity. Default: by the middle pixel.",
        ),
        _ => json!({}),
    }
}

fn tracing_key(key: &str) -> Value {
    match key {
        "index" => told(word::<IndexChoice>(), "The answer is the same with each. Default: auto."),
        _ => json!({}),
    }
}

fn budget_key(key: &str) -> Value {
    match key {
        "paths" => told(count(1), "Walks of the whole job (jacobi: rays)."),
        "first_path" => told(count(0), "The number of the first walk. Default: 0."),
        "stream_paths" => told(integer(1, MAX_STREAM_PATHS), "Walks of a lease. Default: 65536."),
        "wall_seconds" => told(positive(), "The run ends after this many seconds."),
        "checkpoint_seconds" => told(positive(), "Seconds between checkpoints. Default: 60."),
        _ => json!({}),
    }
}

fn target_key(key: &str) -> Value {
    match key {
        "relative_error" => told(positive(), "Half of an interval's width over its estimate."),
        "fraction" => told(
            json!({"type": "number", "exclusiveMinimum": 0, "maximum": 1}),
            "The part of the patch area that must meet it. Default: 0.99.",
        ),
        "min_paths" => told(count(0), "Walks before which no look is taken. Default: 1024."),
        "min_hits" => told(count(0), "Scores without which a patch does not meet it. Default: 10."),
        "quantity" => told(
            word::<Quantity>(),
            "What must be known so well. Irradiance: of all patches. Radiosity: of those that reflect. Net: what leaves less what is absorbed. Default: irradiance.",
        ),
        "unhit" => told(word::<Unhit>(), "What a patch counts for that no walk has hit. Default: infinite."),
        "patches" => told(patches(), "The patches that it is about. Default: all."),
        "sensors" => told(
            json!({"anyOf": [positive(), {
                "type": "object",
                "additionalProperties": positive(),
                "minProperties": 1,
            }]}),
            "Half of an interval's width over its estimate: of all sensors, or of some by name.",
        ),
        "total_error" => told(
            positive(),
            "The relative error over the area, noise and discretisation together. For basis = \"linear\".",
        ),
        _ => json!({}),
    }
}

fn method_key(key: &str) -> Value {
    match key {
        "walk" => told(word::<WalkKind>(), "Which way walks run, and from where. Default: shooting."),
        "estimator" => told(word::<EstimatorKind>(), "What a walk scores. Default: collision."),
        "space" => told(
            word::<Space>(),
            "Where a walk goes on from: the patch, or the point hit. Default: discrete.",
        ),
        "sampler" => told(word::<Sampler>(), "Where walks take their numbers from. Default: random."),
        "infinite" => told(
            table(INFINITE_KEYS, &["end"], infinite_key),
            "How the infinite estimator's walks end. Default: roulette below 0.001.",
        ),
        "birth" => told(
            json!({"anyOf": [{"enum": ["area", "uniform"]}, table(BIRTH_KEYS, &["patches"], birth_key)]}),
            "Where gathering walks are born. Default: area.",
        ),
        "mix" => told(
            boolean(),
            "Whether collision walks are scored by absorption and survival, too. Default: false.",
        ),
        "basis" => told(
            word::<Basis>(),
            "What is estimated of the light on a patch: its mean, or two gradients and its spread, too. Default: constant.",
        ),
        "batch_paths" => {
            told(integer(1, u32::MAX.into()), "Rays of a chain, or walks that share a Sobol sequence.")
        }
        "jacobi" => {
            told(table(SOLVE_KEYS, &["solve"], solve_key), "What chains make of their rays. Default: links.")
        }
        "final_gather" => told(patches(), "Patches whose light rays of their own gather. Default: none."),
        _ => json!({}),
    }
}

fn infinite_key(key: &str) -> Value {
    match key {
        "end" => word::<EndWord>(),
        "threshold" => json!({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}),
        "length" => integer(1, u32::MAX.into()),
        _ => json!({}),
    }
}

fn birth_key(key: &str) -> Value {
    match key {
        "patches" => patches(),
        _ => json!({}),
    }
}

fn solve_key(key: &str) -> Value {
    match key {
        "solve" => word::<SolveWord>(),
        "births" => word::<RayBirths>(),
        "regular" => count(1),
        _ => json!({}),
    }
}

fn sides() -> Value {
    json!({"enum": ["file", 1, 2]})
}

fn import_key(key: &str) -> Value {
    match key {
        "up" => told(
            word::<import::Axis>(),
            "The file's up axis, which becomes z. Default: y for glTF and OBJ, no turn for others.",
        ),
        "unit" => told(positive(), "Metres of a unit of the file. Default: 1."),
        "sides" => told(sides(), "Which sides reflect and emit. Default: as the file says, else both."),
        "patch_size" => {
            told(positive(), "Faces are cut until no edge is longer [m]. Default: one patch a face.")
        }
        "group_size" => told(
            positive(),
            "Neighbouring faces of one object that face one way become one patch, in boxes of this size [m]. Default: no groups.",
        ),
        "group_angle" => told(
            json!({"type": "number", "minimum": 0, "maximum": 90}),
            "How far faces of a group may turn away from its first one [degrees]. Default: 20.",
        ),
        "faults" => told(
            word::<import::Faults>(),
            "Degenerate and doubled triangles: left out and told, or refused. Default: report.",
        ),
        "repair" => told(boolean(), "Whether flipped surfaces are turned round in memory. Default: false."),
        "join" => told(
            boolean(),
            "Whether triangles that form a parallelogram become one. Default: false; true where a mesh stands in place of a job and the program cuts it.",
        ),
        "reflectance_limit" => told(
            json!({"type": "number", "minimum": 0, "exclusiveMaximum": 1}),
            "Reflectances are clamped to it. Default: 0.95 where some are 1 and more, else none.",
        ),
        "strict" => told(
            boolean(),
            "Whether a mesh is refused where something has to be assumed: reflectances of 1 and more, and light. Default: false.",
        ),
        "sky" => told(
            light(),
            "The emittance of a uniform sky around the mesh, per area. Default: one only where no light is found.",
        ),
        "curve_error" => told(
            json!({"type": "number", "minimum": 1e-6, "maximum": 0.3}),
            "How far facets of curved surfaces may lie inside them, in parts of the radius. Default: 0.0125.",
        ),
        "material" => told(
            json!({"type": "object", "additionalProperties": table(OVERRIDE_KEYS, &[], override_key)}),
            "Changes of materials by name or, where no material has it, of parts; * stands for any text, later entries win.",
        ),
        _ => json!({}),
    }
}

fn override_key(key: &str) -> Value {
    match key {
        "reflectance" => told(reflectance(), "Replaces the file's reflectance."),
        "emittance" => told(light(), "Replaces the file's emittance, per area."),
        "power" => {
            told(light(), "Replaces the emittance by a power over the active sides of all matching faces.")
        }
        "sides" => told(sides(), "Replaces the file's sides."),
        "leave_out" => told(boolean(), "Whether its faces are left out, as those of window panes."),
        _ => json!({}),
    }
}
