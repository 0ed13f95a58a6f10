//! The keys of job files.

use radiosity::{EstimatorKind, Space, methods::Sampler, precision::Quantity};
use serde_json::{Value, json};

use crate::key::{Key, names};
use crate::method::table::{BasisKey, WalkKind};
use crate::schema::parts::*;
use crate::vocabulary::{
    EndWord, FOV, Light, MAX_PIXELS, MAX_STREAM_PATHS, OutputFile, SolveWord, Unhit, Vantage,
};

/// The keys of a job file.
pub(crate) const JOB: [Key; 15] = [
    Key::new("name", text, "Names the output folder. Default: the file's name."),
    Key::new("scene", || json!({"anyOf": [text(), table(&SCENE_TABLE)]}), "The scene file, relative to this file: .toml, .obj, .gltf, .glb, .stl, .ply, .mgf, .xml, .vs3, .vtu, .vtp or .vtk. Or a table of the file and how it is cut.").required(),
    Key::new("seed", || integer(0, i64::MAX as u64), "The seed of all random numbers. Default: 0."),
    Key::new("confidence", || json!({"type": "number", "minimum": 0.5, "exclusiveMaximum": 1}), "The level of every interval. Default: 0.95."),
    Key::new("simultaneous", boolean, "Whether all intervals hold together. Default: false."),
    Key::new("light", word::<Light>, "What the numbers measure: W and W/m², or lm and lx. No number depends on it. Default: luminous for .mgf, with lamps, and where light is assumed; else radiant."),
    Key::new("import", || table(&IMPORT), "How meshes are read."),
    Key::new("method", || table(&METHOD), "How the scene is solved."),
    Key::new("budget", || table(&BUDGET), "What the run may cost.").required(),
    Key::new("target", target_table, "The accuracy at which the run ends. Default: the budget is spent."),
    Key::new("output", || table(&OUTPUT), "What is written beside tally.bin, which is always there."),
    Key::new("view", view, "How the picture is taken. What is absent is chosen from the scene."),
    Key::new(
        "views",
        || json!({"type": "object", "additionalProperties": table(&NAMED_VIEW)}),
        "More views by name, of letters, digits, - and _: each has a picture of its own, in the size and exposure of [view], and a button on the page.",
    ),
    Key::new("source", || list_of(source_table(), 0), "Groups of emitters. Those that no group holds are the source \"rest\"."),
    Key::new("sensitivity", || table(&SENSITIVITY), "How light depends on reflectances and emittances."),
];

pub(crate) const JOB_KEYS: &[&str] = &names(&JOB);

/// The tables of a job whose keys are taken for one another, with what stands before these.
pub(crate) const TABLES: [(&str, &[&str]); 6] = [
    ("method.", METHOD_KEYS),
    ("budget.", BUDGET_KEYS),
    ("target.", TARGET_KEYS),
    ("import.", IMPORT_KEYS),
    ("output.", OUTPUT_KEYS),
    ("view.", VIEW_KEYS),
];

/// The keys of the table `[scene]` of a job.
pub(crate) const SCENE_TABLE: [Key; 2] = [
    Key::new("file", text, "The scene file, relative to this file.").required(),
    Key::new(
        "patches",
        text,
        "\"auto\": a pilot chooses the cells of every surface. \"given\": those of the scene. Or the partition.toml of another run, relative to this file. Default: with [method] as \"given\", else a pilot chooses the cells that the scene does not say.",
    ),
];

pub(crate) const SCENE_TABLE_KEYS: &[&str] = &names(&SCENE_TABLE);

/// The keys of a `[[source]]`.
pub(crate) const SOURCE: [Key; 5] = [
    Key::new("name", text, "Names the source in outputs and for `radwalk combine`.").required(),
    Key::new(
        "surfaces",
        || json!({"type": "array", "items": {"anyOf": [text(), count(0)]}}),
        "Surfaces by name, * standing for any text, or by number.",
    ),
    Key::new(
        "materials",
        || json!({"type": "array", "items": text()}),
        "All surfaces of materials by name, * standing for any text.",
    ),
    Key::new("patches", patches, "Patches by number."),
    Key::new(
        "lamps",
        || json!({"type": "array", "items": {"anyOf": [text(), count(0)]}}),
        "Lamps without area by name, * standing for any text, or by number.",
    ),
];

pub(crate) const SOURCE_KEYS: &[&str] = &names(&SOURCE);

/// The keys of `[sensitivity]`.
pub(crate) const SENSITIVITY: [Key; 1] = [Key::new(
    "materials",
    || json!({"anyOf": [{"const": "all"}, list_of(text(), 1)]}),
    "The materials by name, * standing for any text, or \"all\".",
)
.required()];

pub(crate) const SENSITIVITY_KEYS: &[&str] = &names(&SENSITIVITY);

/// The keys of `[output]`.
pub(crate) const OUTPUT: [Key; 1] = [Key::new(
    "files",
    || json!({"type": "array", "items": word::<OutputFile>(), "uniqueItems": true}),
    "The files that are written. Default: csv, summary, picture, report, and parquet above 20,000 rows.",
)];

pub(crate) const OUTPUT_KEYS: &[&str] = &names(&OUTPUT);

/// The keys of `[view]`.
pub(crate) const VIEW: [Key; 7] = [
    Key::new(
        "from",
        word::<Vantage>,
        "Where the camera stands without an `eye`. Default: inside where people could stand or walls hide the inside.",
    ),
    Key::new("eye", point, "Where the camera stands [m]."),
    Key::new("look_at", point, "The point in the middle of the picture [m]."),
    Key::new("up", point, "The direction that is up in the picture. Default: that of the scene."),
    Key::new(
        "fov",
        || json!({"type": "number", "minimum": FOV[0], "maximum": FOV[1]}),
        "The angle between the lower and the upper edge [degrees]. Default: 40.",
    ),
    Key::new(
        "size",
        || exactly(integer(1, MAX_PIXELS), 2),
        "Width and height [pixels]. Default: 800 × 500 from inside, else 800 on the longer side.",
    ),
    Key::new("exposure", positive, "Light (1 is white paper) over radiosity. Default: by the middle pixel."),
];

pub(crate) const VIEW_KEYS: &[&str] = &names(&VIEW);

/// The keys of `[views.NAME]`.
pub(crate) const NAMED_VIEW: [Key; 4] = {
    let [_, eye, look_at, up, fov, _, _] = VIEW;
    [eye.required(), look_at.required(), up, fov]
};

pub(crate) const NAMED_VIEW_KEYS: &[&str] = &names(&NAMED_VIEW);

/// The keys of `[budget]`.
pub(crate) const BUDGET: [Key; 5] = [
    Key::new("first_path", || count(0), "The number of the first walk. Default: 0."),
    Key::new("paths", || count(1), "Walks of the whole job (jacobi: rays).").required(),
    Key::new("stream_paths", || integer(1, MAX_STREAM_PATHS), "Walks of a lease. Default: 65536."),
    Key::new(
        "wall_seconds",
        positive,
        "The run ends after this many seconds, with its pilot; a tenth is left to walk.",
    ),
    Key::new("checkpoint_seconds", positive, "Seconds between checkpoints. Default: 60."),
];

pub(crate) const BUDGET_KEYS: &[&str] = &names(&BUDGET);

/// The keys of `[target]`.
pub(crate) const TARGET: [Key; 9] = [
    Key::new("relative_error", positive, "Half of an interval's width over its estimate."),
    Key::new(
        "fraction",
        || json!({"type": "number", "exclusiveMinimum": 0, "maximum": 1}),
        "The part of the patch area that must meet it. Default: 0.99.",
    ),
    Key::new(
        "min_paths",
        || count(0),
        "Walks before which no look is taken. Default, and the least that counts: 1024.",
    ),
    Key::new("min_hits", || count(0), "Scores without which a patch does not meet it. Default: 10."),
    Key::new("unhit", word::<Unhit>, "What a patch counts for that no walk has hit. Default: infinite."),
    Key::new("patches", patches, "The patches that it is about. Default: all."),
    Key::new(
        "quantity",
        word::<Quantity>,
        "What must be known so well: the irradiance of all patches, the radiosity of those that reflect, or the net flux, what leaves less what is absorbed. Default: irradiance.",
    ),
    Key::new(
        "sensors",
        || {
            json!({"anyOf": [positive(), {
                "type": "object",
                "additionalProperties": positive(),
                "minProperties": 1,
            }]})
        },
        "Half of an interval's width over its estimate: of all sensors, or of some by name.",
    ),
    Key::new(
        "total_error",
        positive,
        "The relative error over the area, noise and discretisation together. For basis = \"linear\".",
    ),
];

pub(crate) const TARGET_KEYS: &[&str] = &names(&TARGET);

/// The keys of `[method]`.
pub(crate) const METHOD: [Key; 11] = [
    Key::new("walk", word::<WalkKind>, "Which way walks run, and from where. Default: shooting."),
    Key::new("estimator", word::<EstimatorKind>, "What a walk scores. Default: collision."),
    Key::new(
        "space",
        word::<Space>,
        "Where a walk goes on from: the patch, or the point hit. Default: discrete.",
    ),
    Key::new("sampler", word::<Sampler>, "Where walks take their numbers from. Default: random."),
    Key::new(
        "infinite",
        || table(&INFINITE),
        "How the infinite estimator's walks end. Default: roulette below 0.001.",
    ),
    Key::new(
        "birth",
        || json!({"anyOf": [{"enum": ["area", "uniform"]}, table(&BIRTH)]}),
        "Where gathering walks are born. Default: area.",
    ),
    Key::new(
        "mix",
        boolean,
        "Whether collision walks are scored by absorption and survival, too. Default: false.",
    ),
    Key::new(
        "basis",
        word::<BasisKey>,
        "What is estimated on a patch: the mean light, or also two gradients and the spread. Default: constant.",
    ),
    Key::new(
        "batch_paths",
        || integer(1, u32::MAX.into()),
        "Rays of a chain, or walks that share a Sobol sequence.",
    ),
    Key::new("jacobi", || table(&SOLVE), "What chains make of their rays. Default: links."),
    Key::new("final_gather", patches, "Patches that gather their light by rays of their own. Default: none."),
];

pub(crate) const METHOD_KEYS: &[&str] = &names(&METHOD);

/// The keys of `method.infinite`.
pub(crate) const INFINITE: [Key; 3] = [
    Key::new("end", word::<EndWord>, "roulette or cutoff below `threshold`, or after `length` hits.")
        .required(),
    Key::new(
        "threshold",
        || json!({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}),
        "The weight, 1 at birth. Default: 0.001.",
    ),
    Key::new("length", || integer(1, u32::MAX.into()), "Hits. Default: 20."),
];

pub(crate) const INFINITE_KEYS: &[&str] = &names(&INFINITE);

/// The keys of `method.birth`.
pub(crate) const BIRTH: [Key; 1] = [Key::new("patches", patches, "Patches by number.").required()];

pub(crate) const BIRTH_KEYS: &[&str] = &names(&BIRTH);

/// The keys of `method.jacobi`.
pub(crate) const SOLVE: [Key; 1] = [Key::new(
    "solve",
    word::<SolveWord>,
    "links: every ray serves every bounce; iterations: as Bekaert and Seidel.",
)
.required()];

pub(crate) const SOLVE_KEYS: &[&str] = &names(&SOLVE);

/// The keys of `[import]`.
pub(crate) const IMPORT: [Key; 14] = [
    Key::new(
        "up",
        word::<import::UpAxis>,
        "The file's up axis, which becomes z. Default: y for glTF, OBJ and Mitsuba, no turn for others.",
    ),
    Key::new("unit", positive, "Metres of a unit of the file. Default: 1."),
    Key::new("sides", sides, "Which sides reflect and emit. Default: as the file says, else both."),
    Key::new("patch_size", positive, "Faces are cut until no edge is longer [m]. Default: one patch a face."),
    Key::new(
        "group_size",
        positive,
        "Neighbouring faces that face one way become one patch, in boxes of this size [m]. Default: no groups.",
    ),
    Key::new(
        "group_angle",
        || json!({"type": "number", "minimum": 0, "maximum": 90}),
        "How far faces of a group may turn from its first one [degrees]. Default: 20.",
    ),
    Key::new(
        "faults",
        word::<import::Faults>,
        "Degenerate and doubled triangles: left out and listed, or refused. Default: report.",
    ),
    Key::new("repair", boolean, "Whether flipped surfaces are turned round in memory. Default: false."),
    Key::new(
        "join",
        boolean,
        "Whether triangles that form a parallelogram become one. Default: false; true where a mesh stands in place of a job and the program cuts it.",
    ),
    Key::new(
        "reflectance_limit",
        || json!({"type": "number", "minimum": 0, "exclusiveMaximum": 1}),
        "Reflectances are clamped to it. Default: 0.95 where some are 1 and more, else none.",
    ),
    Key::new(
        "strict",
        boolean,
        "Whether reflectances of 1 and more and missing light are refused, not assumed. Default: false.",
    ),
    Key::new(
        "sky",
        light,
        "The emittance of a uniform sky, per area. Default: one only where no light is found.",
    ),
    Key::new(
        "curve_error",
        || json!({"type": "number", "minimum": 1e-6, "maximum": 0.3}),
        "How far facets of curved surfaces may lie inside them, in parts of the radius. Default: 0.0125.",
    ),
    Key::new(
        "material",
        || json!({"type": "object", "additionalProperties": table(&OVERRIDE)}),
        "Changes of materials by name, else of parts; * stands for any text, later entries win.",
    ),
];

pub(crate) const IMPORT_KEYS: &[&str] = &names(&IMPORT);

/// The keys of `[import.material.NAME]`.
pub(crate) const OVERRIDE: [Key; 5] = [
    Key::new("reflectance", reflectance, "Replaces the file's reflectance."),
    Key::new("emittance", light, "Replaces the file's emittance, per area."),
    Key::new("power", light, "Replaces the emittance: a power over the active sides of all matching faces."),
    Key::new("sides", sides, "Replaces the file's sides."),
    Key::new("leave_out", boolean, "Whether its faces are left out, such as window panes."),
];

pub(crate) const OVERRIDE_KEYS: &[&str] = &names(&OVERRIDE);

/// A target asks for something, and what is about patches goes with an error of theirs.
fn target_table() -> Value {
    let mut schema = table(&TARGET);
    schema["anyOf"] =
        json!([{"required": ["relative_error"]}, {"required": ["sensors"]}, {"required": ["total_error"]}]);
    schema["dependencies"] = json!({"fraction": ["relative_error"], "min_hits": ["relative_error"], "patches": ["relative_error"], "quantity": ["relative_error"]});
    schema
}

/// A source holds something.
fn source_table() -> Value {
    let mut schema = table(&SOURCE);
    schema["anyOf"] = json!([{"required": ["surfaces"]}, {"required": ["materials"]}, {"required": ["patches"]}, {"required": ["lamps"]}]);
    schema
}

/// An eye looks at something; without one nothing is said of how it looks.
fn view() -> Value {
    let mut view = table(&VIEW);
    view["dependencies"] = json!({"eye": ["look_at"], "look_at": ["eye"], "up": ["eye"], "fov": ["eye"]});
    view
}

fn sides() -> Value {
    json!({"enum": ["file", 1, 2]})
}
