//! The keys of files, and of the tables whose keys are taken for one another.

/// Of a job.
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
];

/// Of `[budget]`.
pub(crate) const BUDGET_KEYS: &[&str] =
    &["first_path", "paths", "stream_paths", "wall_seconds", "checkpoint_seconds"];

/// Of `[target]`.
pub(crate) const TARGET_KEYS: &[&str] =
    &["relative_error", "fraction", "min_paths", "min_hits", "unhit", "patches", "sensors", "total_error"];

/// Of `[tracing]`.
pub(crate) const TRACING_KEYS: &[&str] = &["index"];

/// Of `[method]`.
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

/// Of a scene.
pub(crate) const SCENE_KEYS: &[&str] = &["material", "surface", "mesh", "sensor", "sky"];

/// Those of them that are lists of tables.
pub(crate) const LISTS: [&str; 3] = ["surface", "mesh", "sensor"];
