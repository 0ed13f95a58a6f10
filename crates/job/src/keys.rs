//! The keys of files, and of the tables whose keys are taken for one another.

/// The keys of a job file.
pub(crate) const JOB_KEYS: &[&str] = &[
    "name",
    "scene",
    "seed",
    "confidence",
    "simultaneous",
    "light",
    "import",
    "method",
    "budget",
    "target",
    "tracing",
    "output",
    "view",
    "source",
    "sensitivity",
];

/// The keys at the top of a job that are lists of tables.
pub(crate) const JOB_LISTS: [&str; 1] = ["source"];

/// The keys of a `[[source]]`.
pub(crate) const SOURCE_KEYS: &[&str] = &["name", "surfaces", "materials", "patches", "lamps"];

/// The keys of `[sensitivity]`.
pub(crate) const SENSITIVITY_KEYS: &[&str] = &["materials"];

/// The keys of `[budget]`.
pub(crate) const BUDGET_KEYS: &[&str] =
    &["first_path", "paths", "stream_paths", "wall_seconds", "checkpoint_seconds"];

/// The keys of `[target]`.
pub(crate) const TARGET_KEYS: &[&str] = &[
    "relative_error",
    "fraction",
    "min_paths",
    "min_hits",
    "unhit",
    "patches",
    "quantity",
    "sensors",
    "total_error",
];

/// The keys of `[tracing]`.
pub(crate) const TRACING_KEYS: &[&str] = &["index"];

/// The keys of `[method]`.
pub(crate) const METHOD_KEYS: &[&str] = &[
    "walk",
    "estimator",
    "space",
    "sampler",
    "infinite",
    "birth",
    "mix",
    "basis",
    "batch_paths",
    "jacobi",
    "final_gather",
];

/// The keys of a scene file.
pub(crate) const SCENE_KEYS: &[&str] =
    &["material", "surface", "mesh", "sensor", "sky", "lamp", "plane", "points"];

/// The keys at the top of a scene that are lists of tables.
pub(crate) const LISTS: [&str; 6] = ["surface", "mesh", "sensor", "lamp", "plane", "points"];
