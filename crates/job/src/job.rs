//! The job file, read and checked.

use std::path::{Path, PathBuf};

use import::{Format, Mesh, Options};
use radiosity::{IndexChoice, Scene, Space, groups::PatchGroup};

use crate::budget::{Budget, read_budget};
use crate::document::{KeyTable, Value};
use crate::error::{Error, SourceLocation, SourceSpot};
use crate::goals::{AskedGoals, DEFAULT_MIN_PATHS, Goals};
use crate::imports::{read_grouping, read_options};
use crate::keys::{BUDGET_KEYS, IMPORT_KEYS, JOB_KEYS, METHOD_KEYS, OUTPUT_KEYS, TARGET_KEYS, VIEW_KEYS};
use crate::method::{BasisKey, MethodTable, PatchPurpose, WalkKind, read_method};
use crate::output::{NamedView, View, read_output, read_view, read_views};
use crate::partition::{Auto, Forecast, Partition, Patches, misfit, read_scene_key};
use crate::scene::{SceneFile, is_toml, load_scene_with, unknown_format};
use crate::sensors::SensorTarget;
use crate::source::SourceText;
use crate::sources::read_groups;
use crate::target::{Target, TotalTarget};
use crate::vocabulary::{Light, OutputFile};
use crate::word::Keyword;

/// The seed of a job that names none: runs repeat unless asked not to.
pub const DEFAULT_SEED: u64 = 0;

/// The most walks of a scene that stands in place of a job.
pub const DEFAULT_PATHS: u64 = 10_000_000;

/// The total error at which such a scene is known well enough, where neither walks nor an accuracy are asked for.
pub const DEFAULT_TOTAL_ERROR: f64 = 0.05;

/// The level of every interval of a job that names none.
pub const DEFAULT_CONFIDENCE: f64 = 0.95;

/// All that a job file and its scene say, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// The path of the job file.
    pub path: PathBuf,
    /// Names the output folder; default: the file's name without extension.
    pub name: String,
    /// The scene that is solved.
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
    /// When noise and discretisation together are small enough; `None`: nothing is asked of them.
    pub total_target: Option<TotalTarget>,
    /// What the numbers measure. Default: luminous for a mesh whose format gives lumens, as MGF does, or whose light was assumed, and for a
    /// scene with a `[[lamp]]`, else radiant.
    pub light: Light,
    /// The files that are written beside the tally; `None`: the program chooses.
    pub files: Option<Vec<OutputFile>>,
    /// How the picture is taken.
    pub view: View,
    /// More views of the same size and exposure.
    pub views: Vec<NamedView>,
    /// Groups of emitters that are distinguished.
    pub sources: Vec<PatchGroup>,
    /// Materials whose influence is measured, each as the group of its patches.
    pub sensitivity: Vec<PatchGroup>,
    /// Whether the accuracy that ends the run is the default: a run that does not reach it has not failed.
    pub is_default_target: bool,
    /// Whether the program chooses the method, since the job names none.
    pub chooses_method: bool,
    /// What is left to the program before the job can be run; `None`: nothing.
    pub auto: Option<Auto>,
    /// What a pilot has predicted of the patches, where it has chosen them.
    pub forecast: Option<Forecast>,
    origin: JobOrigin,
}

impl Job {
    /// Builds the scene.
    ///
    /// # Errors
    /// As [`SceneFile::build`].
    pub fn build_scene(&self) -> Result<Scene, Error> {
        self.scene.build(IndexChoice::Auto)
    }

    /// The job with patches that are chosen, in place of all that its files say of them. The job file is read again with the overrides of
    /// [`load`], the scene is not.
    ///
    /// # Errors
    /// As [`load`], and a partition of another scene.
    pub fn cut(self, overrides: &[String], partition: &Partition) -> Result<Job, Error> {
        let Job { path, scene, origin, .. } = self;
        let source = read_source(&path, origin)?.with_overrides(overrides)?;
        read((&path, origin), &source, (Some(partition), Unsaid::Chosen), |_, _, _| Ok(scene))
    }

    /// [`Job::build_scene`], with what rays find surfaces by taken from a scene of the same surfaces, however they are cut there. Where the scene
    /// has other surfaces, all is built.
    ///
    /// # Errors
    /// As [`SceneFile::build`].
    pub fn build_scene_like(&self, other: Scene) -> Result<Scene, Error> {
        match other.has_surfaces_of(self.scene.spec()) {
            true => other.recut(self.scene.spec()).map_err(|error| self.scene.locate(error)),
            false => self.build_scene(),
        }
    }
}

/// Reads a job file and its scene, or a scene with the default of every key of jobs. Each override is a `key=value`, its key dotted, its value TOML or, failing
/// that, a string without quotes; they replace keys of the job file before anything is checked.
///
/// # Errors
/// A file that cannot be read, is not TOML, or says what is unknown, missing, not allowed or not built yet.
pub fn load(path: &Path, overrides: &[String]) -> Result<Job, Error> {
    load_for(path, overrides, Unsaid::Chosen)
}

/// [`load`] for what is about given patches: a job that names no method, or no patches, leaves nothing to the program by that. Its method is the
/// default of every key of `[method]`, its patches are those of the scene.
///
/// # Errors
/// As [`load`].
pub fn load_as_written(path: &Path, overrides: &[String]) -> Result<Job, Error> {
    load_for(path, overrides, Unsaid::AsWritten)
}

/// [`load_as_written`] for what is about surfaces and not about their light: a mesh in which nothing emits is given no lamps, and a job needs no
/// budget. Such a mesh has a sky.
///
/// # Errors
/// As [`load`].
pub fn load_surfaces(path: &Path, overrides: &[String]) -> Result<Job, Error> {
    load_for(path, overrides, Unsaid::Light)
}

/// What a job is read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum JobOrigin {
    /// A job file.
    Job,
    /// A scene that stands in place of a job.
    Scene,
    /// A mesh in memory, whose faces are the patches, in their order, unless the overrides say otherwise.
    Arrays,
}

/// What a job means that does not say how it is solved.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Unsaid {
    /// The program chooses.
    Chosen,
    /// The default of every key of `[method]`, and the patches of the scene.
    AsWritten,
    /// The same, and light plays no part.
    Light,
}

fn read_source(path: &Path, origin: JobOrigin) -> Result<SourceText, Error> {
    match origin {
        JobOrigin::Job => match SourceText::read(path, "scene = \"…\" and a [budget]") {
            // What is no TOML by its name either is a mesh of another program.
            Err(Error::Empty { .. } | Error::NotText { .. }) if is_foreign(path) => Err(unknown_format(path)),
            Ok(source) if is_foreign(path) && source.parse().is_err() => Err(unknown_format(path)),
            source => source,
        },
        JobOrigin::Scene | JobOrigin::Arrays => Ok(SourceText::of_scene(path, "")),
    }
}

fn load_for(path: &Path, overrides: &[String], unsaid: Unsaid) -> Result<Job, Error> {
    let bare = is_bare_scene(path);
    let origin = if bare { JobOrigin::Scene } else { JobOrigin::Job };
    let source = read_source(path, origin)?.with_overrides(overrides)?;
    read((path, origin), &source, (None, unsaid), |named, table, options| match named {
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
    let source = SourceText::of_scene(name, "").with_overrides(overrides)?;
    read((name, JobOrigin::Arrays), &source, (None, Unsaid::Chosen), |named, _, options| match named {
        // Arrays are what a program means: nothing of them has to be guessed.
        None => SceneFile::of_mesh(name, mesh, &Options { strict: true, ..options.clone() }),
        Some(value) => Err(value.refuse(
            "the scene is given already".into(),
            "a job solves one scene",
            "leave the key out, or give the path of a scene in place of arrays",
        )),
    })
}

/// Reads a job, cut as a `partition` says if there is one; `read_scene` hears what the job names as its scene, and how meshes are
/// read.
fn read(
    (path, origin): (&Path, JobOrigin),
    source: &SourceText,
    (partition, unsaid): (Option<&Partition>, Unsaid),
    read_scene: impl FnOnce(Option<Value<'_>>, &KeyTable<'_>, &Options) -> Result<SceneFile, Error>,
) -> Result<Job, Error> {
    let mut table = KeyTable::root(source, JOB_KEYS)?;
    // Every table is opened, and its keys known, before the scene is read: that may take long.
    let mut import = table.table("import", IMPORT_KEYS)?;
    let repair = import.take("repair").map(|value| value.boolean()).transpose()?.unwrap_or(false);
    let about_meshes = import.first();
    let grouping = read_grouping(&mut import)?;
    let says_join = import.has_any(&["join"]);
    let mut options = read_options(import)?;
    if unsaid == Unsaid::Light {
        options.sky.get_or_insert(1.0.into());
    }
    let chooses_method = unsaid == Unsaid::Chosen && !table.has_any(&["method"]);
    let method = table.table("method", METHOD_KEYS)?;
    let budget = table.table("budget", BUDGET_KEYS)?;
    let target = table.take("target").map(|value| value.table(TARGET_KEYS)).transpose()?;
    let asks_nothing =
        origin == JobOrigin::Scene && chooses_method && target.is_none() && !budget.has_any(&["paths"]);
    let by_number = target.as_ref().is_some_and(|target| target.has_any(&["patches"]));
    let files = read_output(table.table("output", OUTPUT_KEYS)?)?;
    let view = read_view(table.table("view", VIEW_KEYS)?)?;
    let views = table.take("views").map(read_views).transpose()?.unwrap_or_default();
    let budget =
        read_budget(budget, (origin != JobOrigin::Job || unsaid == Unsaid::Light).then_some(DEFAULT_PATHS))?;
    let target = target.map(Goals::read).transpose()?.unwrap_or_default();
    let name = read_name(&mut table, path)?;
    let seed = table.take("seed").map(|value| read_seed(&value)).transpose()?.unwrap_or(DEFAULT_SEED);
    let confidence = table.take("confidence").as_ref().map_or(Ok(DEFAULT_CONFIDENCE), read_confidence)?;
    let simultaneous = table.take("simultaneous").map(|value| value.boolean()).transpose()?.unwrap_or(false);
    let light = table.take("light").map(|value| value.word()).transpose()?;
    let (named, patches) = read_scene_key(table.take("scene"), path)?;
    // Where the program cuts a mesh, its rectangles are whole.
    let says_faces = says_join || options.patch_size.is_some() || grouping.is_some() || by_number;
    let is_mesh = origin == JobOrigin::Scene && Format::of(path).is_some();
    options.join |= is_mesh && chooses_method && !says_faces && !matches!(patches, Patches::AsWritten);
    let mut scene = read_scene(named, &table, &options)?;
    if let Some(place) = about_meshes.filter(|_| !scene.has_mesh()) {
        return Err(Error::Refused {
            place,
            problem: "the scene has no mesh".into(),
            why: "this key is about files of meshes, and would change nothing",
            remedy: "remove it, and change the scene file itself".into(),
        });
    }
    scene.prepare(repair, grouping.as_ref())?;
    // Patches that the job names by number are those of the scene.
    let chooses_patches = match origin {
        JobOrigin::Job => chooses_method,
        JobOrigin::Scene => unsaid == Unsaid::Chosen,
        JobOrigin::Arrays => false,
    };
    let patches = match patches {
        Patches::Unsaid if chooses_patches && !by_number && !names_patches(&method, &table) => {
            Patches::WhereUnsaid
        }
        patches => patches,
    };
    let partition = cut(&mut scene, patches, partition)?;
    let light = light.unwrap_or_else(|| usual_light(&scene));
    let (open, cutting) = left_open(&scene, partition.as_ref(), &table, &method, chooses_method);
    let (method, note) = read_method(method, &cutting, &budget)?;
    let forecast = partition.and_then(|partition| partition.forecast);
    // A pilot tells how light is spread over patches.
    let has_pilot = open.is_some() || forecast.is_some();
    let AskedGoals { target, sensor_target, mut total_target } =
        target.about((cutting.patches, has_pilot), &method, scene.sensors())?;
    let is_default_target = asks_nothing && has_pilot;
    if is_default_target {
        total_target = Some(TotalTarget { total_error: DEFAULT_TOTAL_ERROR, min_paths: DEFAULT_MIN_PATHS });
    }
    let [sources, sensitivity] = read_groups(&mut table, &scene)?;
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
        total_target,
        light,
        files,
        view,
        views,
        sources,
        sensitivity,
        is_default_target,
        chooses_method,
        auto: open,
        forecast,
        origin,
    })
}

/// What the numbers of a scene measure, where its job does not say it.
fn usual_light(scene: &SceneFile) -> Light {
    if scene.is_luminous() { Light::Luminous } else { Light::Radiant }
}

/// Cuts a scene by the partition at hand, or as the job says, after its repair: what is turned round has its u and v changed. Returns
/// the partition that it is cut by, if any.
fn cut(
    scene: &mut SceneFile,
    patches: Patches,
    partition: Option<&Partition>,
) -> Result<Option<Partition>, Error> {
    let file = scene.path().to_owned();
    let is_grouped = !scene.spec().patch_of_cell.is_empty();
    let patches = if is_grouped { patches.unless_unsaid() } else { patches };
    let is_cut = partition.is_some() || !patches.are_written() || !scene.auto().is_empty();
    if is_cut && is_grouped {
        return Err(Error::Refused {
            place: SourceLocation { file, spot: SourceSpot::File, key: "patches".into() }.into(),
            problem: "faces of the scene are groups, and its cells are to be chosen".into(),
            why: "a group is one patch, whatever its cells",
            remedy: "remove group_size from [import], or patches".into(),
        });
    }
    match (partition, patches) {
        (Some(partition), _) => {
            scene
                .cut(&partition.cuts, &partition.groups)
                .map_err(|problem| misfit(problem, SourceSpot::File, &file, "patches"))?;
            Ok(Some(partition.clone()))
        }
        (None, Patches::Given(file, place)) => {
            let partition = Partition::read(&file, &place)?;
            scene
                .cut(&partition.cuts, &partition.groups)
                .map_err(|problem| misfit(problem, SourceSpot::File, &file, "surfaces"))?;
            Ok(Some(partition))
        }
        (None, Patches::Auto) => {
            scene.leave_cells();
            Ok(None)
        }
        (None, Patches::WhereUnsaid) => {
            scene.leave_unsaid_cells();
            Ok(None)
        }
        (None, Patches::Unsaid | Patches::AsWritten) => Ok(None),
    }
}

/// What a job leaves to the program, and what its method takes from the partition.
fn left_open(
    scene: &SceneFile,
    partition: Option<&Partition>,
    table: &KeyTable<'_>,
    method: &KeyTable<'_>,
    chooses_method: bool,
) -> (Option<Auto>, PatchPurpose) {
    let open = Auto {
        surfaces: scene.auto().to_vec(),
        kinds: if can_be_grouped(table, method) { open_kinds(scene) } else { Vec::new() },
        constant: !method.says("basis", BasisKey::Linear.word()),
        linear: can_be_linear(table, method),
    };
    let cutting = PatchPurpose {
        patches: scene.known_patch_count(),
        linear: partition.map_or(chooses_method, |partition| partition.linear) && open.linear,
        space: match chooses_method {
            true => Space::Continuous,
            false => partition.map_or(Space::default(), |partition| partition.space),
        },
        walks_only: !scene.spec().lamps.list.is_empty() || !scene.spec().panes.is_empty(),
    };
    (Some(open).filter(|open| !open.surfaces.is_empty()), cutting)
}

/// The kinds of the surfaces that are left to the program.
fn open_kinds(scene: &SceneFile) -> Vec<Option<u32>> {
    let mut kinds = scene.kinds();
    let mut open = vec![false; kinds.len()];
    scene.auto().iter().for_each(|&surface| open[surface] = true);
    kinds.iter_mut().zip(open).filter(|(_, open)| !open).for_each(|(kind, _)| *kind = None);
    kinds
}

/// Whether a job has patches that are groups of faces: what is asked of them is asked of means, and not of single faces.
fn can_be_grouped(table: &KeyTable<'_>, method: &KeyTable<'_>) -> bool {
    !table.has_any(&["source", "sensitivity"]) && !method.has_any(&["final_gather"])
}

/// Whether the method of a job has a linear basis, and the job does not refuse it.
fn can_be_linear(table: &KeyTable<'_>, method: &KeyTable<'_>) -> bool {
    !table.has_any(&["source", "sensitivity"])
        && !method.has_any(&["final_gather"])
        && !method.is_true("mix")
        && !method.says("basis", BasisKey::Constant.word())
        && !method.says("walk", WalkKind::Jacobi.word())
}

/// Whether a job names patches by number.
fn names_patches(method: &KeyTable<'_>, table: &KeyTable<'_>) -> bool {
    method.has_any(&["final_gather"])
        || method.holds("birth", "patches")
        || table.list_holds("source", "patches")
}

fn read_name(table: &mut KeyTable<'_>, path: &Path) -> Result<String, Error> {
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

/// Whether a file has an extension that is not that of TOML.
fn is_foreign(path: &Path) -> bool {
    path.extension().is_some() && !is_toml(path)
}

/// Whether a file is a scene in place of a job: a mesh by its name, or TOML with the tables of scenes and none of jobs.
fn is_bare_scene(path: &Path) -> bool {
    let holds_scene = || SourceText::read(path, "").is_ok_and(|source| source.holds_scene());
    Format::of(path).is_some() || (is_toml(path) && holds_scene())
}

fn read_scene(
    named: Option<Value<'_>>,
    table: &KeyTable<'_>,
    job: &Path,
    options: &Options,
) -> Result<SceneFile, Error> {
    let value = named.ok_or_else(|| Error::MissingKey {
        place: table.place("scene"),
        why: "a job solves one scene",
        remedy: "scene = \"….toml\", relative to the job file".into(),
    })?;
    let written = value.string()?;
    if written.is_empty() {
        return Err(value.refuse(
            "no file is named".into(),
            "a job solves one scene",
            "write the path of a scene",
        ));
    }
    let path = job.parent().unwrap_or(Path::new("")).join(written);
    load_scene_with(&path, options).map_err(|error| match error {
        Error::Missing { file } if file == path => value.refuse(
            format!("there is no file {}", file.display()),
            "scenes are looked for relative to the job file",
            "correct the path",
        ),
        error => error,
    })
}
