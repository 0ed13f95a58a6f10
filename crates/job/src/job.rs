//! The job file.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use import::{Format, Mesh, Options};
use radiosity::{Birth, IndexChoice, Scene, SensorSpec};
use serde::{Deserialize, Serialize};

use crate::document::{Table, Value};
use crate::error::Error;
use crate::imports::{IMPORT_KEYS, read_options};
use crate::method::{METHOD_KEYS, MethodTable, WalkKind, Word, read_method, read_patches};
use crate::output::{OUTPUT_KEYS, OutputFile, VIEW_KEYS, View, read_output, read_view};
use crate::scene::{SceneFile, is_toml, load_scene_with};
use crate::sensors::{SensorTarget, read_sensor_errors};
use crate::source::Source;

/// The seed of a job that names none: runs repeat unless asked not to.
pub const DEFAULT_SEED: u64 = 0;

/// Walks of a scene that stands in place of a job.
pub const DEFAULT_PATHS: u64 = 10_000_000;

/// The level of every interval of a job that names none.
pub const DEFAULT_CONFIDENCE: f64 = 0.95;

/// Walks per lease of a job that names no number.
pub const DEFAULT_STREAM_PATHS: u64 = 65_536;

/// The part of the patch area that must meet a target that names none.
const DEFAULT_FRACTION: f64 = 0.99;

/// The largest lease: lost with its worker, it would be traced again whole.
pub(crate) const MAX_STREAM_PATHS: u64 = 1 << 24;

/// Seconds between checkpoints of a job that names none.
pub const DEFAULT_CHECKPOINT_SECONDS: f64 = 60.0;

/// Fewer walks than this say little about how little they say: the first look at a target.
const DEFAULT_MIN_PATHS: u64 = 1 << 10;

/// Fewer scores on a patch than this say little about their own spread.
const DEFAULT_MIN_HITS: u64 = 10;

/// The longest wall time [s], some 30 years: what clocks can add to the present.
const MAX_WALL_SECONDS: f64 = 1e9;

/// What the numbers of a job measure. It changes labels and units, and no number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Light {
    /// Power in W, radiosity and irradiance in W/m².
    #[default]
    Radiant,
    /// Luminous flux in lm, luminous exitance in lm/m², illuminance in lx.
    Luminous,
}

impl Word for Light {
    const ALL: &'static [Self] = &[Self::Radiant, Self::Luminous];

    fn word(self) -> &'static str {
        match self {
            Light::Radiant => "radiant",
            Light::Luminous => "luminous",
        }
    }
}

/// All that a job file and its scene say, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// The job file.
    pub path: PathBuf,
    /// Names the output folder; default: the file's name without extension.
    pub name: String,
    /// What is solved.
    pub scene: SceneFile,
    /// In [0, 2⁶³); default [`DEFAULT_SEED`].
    pub seed: u64,
    /// The level of every interval, in [0.5, 1); default [`DEFAULT_CONFIDENCE`].
    pub confidence: f64,
    /// Whether `confidence` is that of all intervals together; default false: of each.
    pub simultaneous: bool,
    /// How it is solved.
    pub method: MethodTable,
    /// What of the method is not done as asked, and why.
    pub note: Option<String>,
    /// What it may cost.
    pub budget: Budget,
    /// When its patches are known well enough; `None`: nothing is asked of them.
    pub target: Option<Target>,
    /// When its sensors are; `None`: nothing is asked of them. Where nothing is asked of either, the budget is spent whole.
    pub sensor_target: Option<SensorTarget>,
    /// How rays look for surfaces; the answer is the same with each.
    pub index: IndexChoice,
    /// What the numbers measure. Default: luminous for a scene in MGF, whose format gives lm/m², else radiant.
    pub light: Light,
    /// The files that are written beside the tally; `None`: the program chooses.
    pub files: Option<Vec<OutputFile>>,
    /// How the picture is taken.
    pub view: View,
}

/// The table `[budget]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// The number of the first walk (Jacobi: ray); default 0. Runs of other ranges of one job can be merged.
    pub first_path: u64,
    /// Walks of the whole job (Jacobi: rays), at least 1.
    pub paths: u64,
    /// Walks per lease, in [1, 2²⁴]; default [`DEFAULT_STREAM_PATHS`].
    pub stream_paths: u64,
    /// Wall time in seconds, above 0 and at most 10⁹.
    pub wall_seconds: Option<f64>,
    /// Seconds between checkpoints, above 0 and at most 10⁹; default [`DEFAULT_CHECKPOINT_SECONDS`].
    pub checkpoint_seconds: f64,
}

/// The table `[target]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Half-width of the interval over the estimate, above 0.
    pub relative_error: f64,
    /// The part of the patch area that must meet it, in (0, 1]; default 0.99.
    pub fraction: f64,
    /// Walks (Jacobi: rays) before which no look is taken; default 1024.
    pub min_paths: u64,
    /// Effective scores without which a patch does not meet it; default 10.
    pub min_hits: u64,
    /// What a reflecting patch counts for that no walk has hit.
    pub unhit: Unhit,
    /// The patches that it is about, by number, whether they emit or not; `None`: all that do not.
    pub patches: Option<Vec<u32>>,
}

/// What a target makes of patches that no walk has hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unhit {
    /// Their error is infinite.
    #[default]
    Infinite,
    /// They are left out.
    Ignore,
}

impl Word for Unhit {
    const ALL: &'static [Self] = &[Self::Infinite, Self::Ignore];

    fn word(self) -> &'static str {
        match self {
            Unhit::Infinite => "infinite",
            Unhit::Ignore => "ignore",
        }
    }
}

impl Job {
    /// Builds the scene with the job's index.
    ///
    /// # Errors
    /// As [`SceneFile::build`].
    pub fn build_scene(&self) -> Result<Scene, Error> {
        self.scene.build(self.index)
    }
}

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

pub(crate) const BUDGET_KEYS: &[&str] =
    &["first_path", "paths", "stream_paths", "wall_seconds", "checkpoint_seconds"];

pub(crate) const TARGET_KEYS: &[&str] =
    &["relative_error", "fraction", "min_paths", "min_hits", "unhit", "patches", "sensors"];

pub(crate) const TRACING_KEYS: &[&str] = &["index"];

/// Reads a job file and its scene, or a scene with the default of every key of jobs. Each override is a `key=value`, its key dotted, its value TOML or, failing
/// that, a string without quotes; they replace keys of the job file before anything is checked.
///
/// # Errors
/// A file that cannot be read, is not TOML, or says what is unknown, missing, not allowed or not built yet.
pub fn load(path: &Path, overrides: &[String]) -> Result<Job, Error> {
    let bare = is_bare_scene(path);
    let source = match bare {
        true => default_job(path),
        false => Source::read(path, "scene = \"…\" and a [budget]")?,
    };
    read(path, &source.with_overrides(overrides)?, |named, table, options| match named {
        None if bare => load_scene_with(path, options),
        named => read_scene(named, table, path, options),
    })
}

/// Makes a job of a mesh in memory with the default of every key, but for the overrides, which are those of [`load`]. `name`
/// stands for the job file and the scene in messages, and names the job.
///
/// # Errors
/// As [`load`], and a job that names another scene.
pub fn load_mesh(name: &Path, mesh: Mesh, overrides: &[String]) -> Result<Job, Error> {
    let source = default_job(name).with_overrides(overrides)?;
    read(name, &source, |named, _, options| match named {
        None => SceneFile::of_mesh(name, mesh, options),
        Some(value) => Err(value.refuse(
            "the scene is given already".into(),
            "a job solves one scene",
            "leave the key out, or give the path of a scene in place of arrays",
        )),
    })
}

/// A job with the default of every key, for a scene that stands in place of it.
fn default_job(scene: &Path) -> Source {
    Source::of_scene(scene, &format!("[budget]\npaths = {DEFAULT_PATHS}\n"))
}

/// Reads a job; `read_scene` hears what the job names as its scene, and how meshes are read.
fn read(
    path: &Path,
    source: &Source,
    read_scene: impl FnOnce(Option<Value<'_>>, &Table<'_>, &Options) -> Result<SceneFile, Error>,
) -> Result<Job, Error> {
    let mut table = Table::root(source, JOB_KEYS)?;
    // Every table is opened, and its keys known, before the scene is read: that may take long.
    let mut import = table.table("import", IMPORT_KEYS)?;
    let repair = import.take("repair").map(|value| value.boolean()).transpose()?.unwrap_or(false);
    let options = read_options(import)?;
    let method = table.table("method", METHOD_KEYS)?;
    let budget = table.table("budget", BUDGET_KEYS)?;
    let target = table.take("target").map(|value| value.table(TARGET_KEYS)).transpose()?;
    let index = table.table("tracing", TRACING_KEYS)?.take("index");
    let files = read_output(table.table("output", OUTPUT_KEYS)?)?;
    let view = read_view(table.table("view", VIEW_KEYS)?)?;
    let budget = read_budget(budget)?;
    let target = target.map(Goals::read).transpose()?.unwrap_or_default();
    let index = index.map(|value| value.word()).transpose()?.unwrap_or_default();
    let name = read_name(&mut table, path)?;
    let seed = table.take("seed").map(|value| read_seed(&value)).transpose()?.unwrap_or(DEFAULT_SEED);
    let confidence = table.take("confidence").map(|value| read_confidence(&value)).transpose()?;
    let simultaneous = table.take("simultaneous").map(|value| value.boolean()).transpose()?.unwrap_or(false);
    let light = table.take("light").map(|value| value.word()).transpose()?;
    let mut scene = read_scene(table.take("scene"), &table, &options)?;
    if repair {
        scene.turn_flipped()?;
    }
    let light = light.unwrap_or_else(|| match Format::of(scene.path()) {
        Some(Format::Mgf) => Light::Luminous,
        _ => Light::Radiant,
    });
    let (method, note) = read_method(method, scene.patch_count(), &budget)?;
    let (target, sensor_target) = target.about(scene.patch_count(), &method, scene.sensors())?;
    let confidence = confidence.unwrap_or(DEFAULT_CONFIDENCE);
    Ok(Job {
        path: path.into(),
        name,
        scene,
        seed,
        confidence,
        simultaneous,
        method,
        note,
        budget,
        target,
        sensor_target,
        index,
        light,
        files,
        view,
    })
}

fn read_name(table: &mut Table<'_>, path: &Path) -> Result<String, Error> {
    let place = table.place("name");
    let (name, place) = match table.take("name") {
        Some(value) => (value.string()?.to_owned(), value.place()),
        None => (path.file_stem().unwrap_or_default().to_string_lossy().into_owned(), place),
    };
    let unsafe_character = |c: char| c.is_control() || matches!(c, '/' | '\\' | char::REPLACEMENT_CHARACTER);
    if name.trim().is_empty() || matches!(name.as_str(), "." | "..") || name.contains(unsafe_character) {
        return Err(Error::Refused {
            place,
            problem: format!("{name:?} cannot name a job"),
            why: "the output folder takes its name",
            remedy: "write a name without slashes and control characters".into(),
        });
    }
    Ok(name)
}

fn read_seed(value: &Value<'_>) -> Result<u64, Error> {
    value.integer(0..=i64::MAX as u64, "seeds are TOML integers without sign")
}

fn read_confidence(value: &Value<'_>) -> Result<f64, Error> {
    let confidence = value.number()?;
    if (0.5..1.0).contains(&confidence) {
        return Ok(confidence);
    }
    let remedy = if confidence > 0.0 && confidence < 0.5 {
        format!("choose 0.5 ≤ confidence < 1, such as {}", 1.0 - confidence)
    } else {
        "choose 0.5 ≤ confidence < 1, such as 0.95".into()
    };
    Err(value.refuse(
        format!("{confidence} is outside [0.5, 1)"),
        "it is the probability that an interval covers the truth: less is no assurance, 1 no finite interval",
        remedy,
    ))
}

/// Whether a file is a scene in place of a job: a mesh by its name, or TOML with the tables of scenes and none of jobs.
fn is_bare_scene(path: &Path) -> bool {
    let holds_scene = || Source::read(path, "").is_ok_and(|source| source.holds_scene());
    Format::of(path).is_some() || (is_toml(path) && holds_scene())
}

fn read_scene(
    named: Option<Value<'_>>,
    table: &Table<'_>,
    job: &Path,
    options: &Options,
) -> Result<SceneFile, Error> {
    let value = named.ok_or_else(|| Error::MissingKey {
        place: table.place("scene"),
        why: "a job solves one scene",
        remedy: "scene = \"….toml\", relative to the job file".into(),
    })?;
    let path = job.parent().unwrap_or(Path::new("")).join(value.string()?);
    load_scene_with(&path, options).map_err(|error| match error {
        Error::Missing { file } if file == path => value.refuse(
            format!("there is no file {}", file.display()),
            "scenes are looked for relative to the job file",
            "correct the path",
        ),
        error => error,
    })
}

fn read_budget(mut table: Table<'_>) -> Result<Budget, Error> {
    let paths = table.require(
        "paths",
        "it bounds the work, also where a target may end the job earlier",
        "[budget] paths = 10_000_000, the number of walks",
    )?;
    let paths = paths.integer(1..=i64::MAX as u64, "without a walk there is no estimate")?;
    let first_path = table.take("first_path").map(|value| read_first_path(&value, paths)).transpose()?;
    let stream_paths = table.take("stream_paths").map(|value| read_stream_paths(&value)).transpose()?;
    let checkpoint_seconds =
        table.take("checkpoint_seconds").map(|value| read_seconds(&value)).transpose()?;
    Ok(Budget {
        first_path: first_path.unwrap_or(0),
        paths,
        stream_paths: stream_paths.unwrap_or(DEFAULT_STREAM_PATHS),
        wall_seconds: table.take("wall_seconds").map(|value| read_seconds(&value)).transpose()?,
        checkpoint_seconds: checkpoint_seconds.unwrap_or(DEFAULT_CHECKPOINT_SECONDS),
    })
}

fn read_first_path(value: &Value<'_>, paths: u64) -> Result<u64, Error> {
    value.integer(0..=i64::MAX as u64 - paths, "walks are numbered from 0 to 2⁶³ − 1")
}

fn read_stream_paths(value: &Value<'_>) -> Result<u64, Error> {
    value.integer(
        1..=MAX_STREAM_PATHS,
        "a lease holds at least one walk, and a lost one is traced again whole",
    )
}

fn read_seconds(value: &Value<'_>) -> Result<f64, Error> {
    let seconds = value.number()?;
    if seconds > 0.0 && seconds <= MAX_WALL_SECONDS {
        return Ok(seconds);
    }
    Err(value.refuse(
        format!("{seconds} s is outside (0, {MAX_WALL_SECONDS}]"),
        "a run takes time, and clocks end",
        "choose a positive number of seconds, or remove the key",
    ))
}

/// The table `[target]` before the scene is read: which patches and sensors there are is known only then.
#[derive(Default)]
struct Goals<'a> {
    patches: Option<Value<'a>>,
    sensors: Option<Value<'a>>,
    of_patches: Option<Target>,
    min_paths: u64,
    unhit: Unhit,
}

impl<'a> Goals<'a> {
    fn read(mut table: Table<'a>) -> Result<Self, Error> {
        let [patches, sensors] = ["patches", "sensors"].map(|key| table.take(key));
        let relative_error =
            match sensors.is_some() && !table.has_any(&["fraction", "min_hits"]) && patches.is_none() {
                true => table.take("relative_error"),
                false => Some(table.require(
                    "relative_error",
                    "a target is an accuracy",
                    "relative_error = 0.01, or remove [target]",
                )?),
            };
        let fraction = table.take("fraction").map(|value| read_fraction(&value)).transpose()?;
        let mut count = |key: &str, default: u64, why: &'static str| {
            table.take(key).map_or(Ok(default), |value| value.integer(0..=i64::MAX as u64, why))
        };
        let min_paths = count("min_paths", DEFAULT_MIN_PATHS, "it is a number of walks")?;
        let min_hits = count("min_hits", DEFAULT_MIN_HITS, "it is a number of scores")?;
        let relative_error = relative_error.map(|value| read_relative_error(&value)).transpose()?;
        let unhit = table.take("unhit").map(|value| value.word()).transpose()?.unwrap_or_default();
        let of_patches = relative_error.map(|relative_error| Target {
            relative_error,
            fraction: fraction.unwrap_or(DEFAULT_FRACTION),
            min_paths,
            min_hits,
            unhit,
            patches: None,
        });
        Ok(Goals { patches, sensors, of_patches, min_paths, unhit })
    }

    /// What is asked of patches and of sensors.
    fn about(
        self,
        patch_count: u64,
        method: &MethodTable,
        sensors: &[SensorSpec],
    ) -> Result<(Option<Target>, Option<SensorTarget>), Error> {
        let Goals { patches, min_paths, unhit, .. } = self;
        let patches = patches.map(|value| read_target_patches(value, patch_count, method)).transpose()?;
        let target = self.of_patches.map(|target| Target { patches, ..target });
        let errors = self.sensors.map(|value| read_sensor_errors(value, sensors)).transpose()?;
        Ok((target, errors.map(|sensors| SensorTarget { sensors, min_paths, unhit })))
    }
}

/// The patches that a target is about. Their number is known only when the scene is read.
fn read_target_patches(value: Value<'_>, patch_count: u64, method: &MethodTable) -> Result<Vec<u32>, Error> {
    let place = value.place();
    let patches =
        read_patches(value, patch_count, "a target is about some patch", "remove the key: all count")?;
    let (WalkKind::Gathering, Birth::Patches(born)) = (method.walk, &method.birth) else {
        return Ok(patches);
    };
    let born: HashSet<u32> = born.iter().copied().collect();
    match patches.iter().find(|patch| !born.contains(patch)) {
        None => Ok(patches),
        Some(patch) => Err(Error::Refused {
            place,
            problem: format!("no walk is born on patch {patch}"),
            why: "gathering walks tell of the patch that they are born on, and of no other",
            remedy: format!("add {patch} to method.birth.patches, or take it out here"),
        }),
    }
}

pub(crate) fn read_relative_error(value: &Value<'_>) -> Result<f64, Error> {
    let relative_error = value.number()?;
    if relative_error > 0.0 {
        return Ok(relative_error);
    }
    Err(value.refuse(
        format!("{relative_error} is not above 0"),
        "no finite number of walks is exact",
        "choose relative_error > 0, such as 0.01",
    ))
}

fn read_fraction(value: &Value<'_>) -> Result<f64, Error> {
    let fraction = value.number()?;
    if fraction > 0.0 && fraction <= 1.0 {
        return Ok(fraction);
    }
    Err(value.refuse(
        format!("{fraction} is outside (0, 1]"),
        "it is the part of the patch area that must meet the target",
        "choose 0 < fraction ≤ 1",
    ))
}
