//! What is accepted, and what it means.

use std::path::{Path, PathBuf};

use crate::common::Folder;
use glam::{DVec3, dvec3};
use job::{
    Beside, Budget, FileKind, Job, MethodTable, Sampler, SensorTarget, Target, Unhit, WalkKind, file_kind,
    job_hash, load, load_scene,
};
use radiosity::{
    Birth, EstimatorKind, IndexChoice, Shape, Sides, Space, Spectrum,
    methods::InfiniteEnd,
    precision::Quantity,
    sensors::{SensorShape, SensorSpec},
};

const SCENE: &str = r#"
[material.white]
reflectance = 0.75         # in [0, 1); a number, or [r, g, b]
emittance   = 0.0          # W/m² (exitance), number or [r, g, b]

[[surface]]                # a parallelogram …
name     = "floor"
material = "white"
quad     = [[0,0,0], [1,0,0], [0,1,0]]   # corner c, c+u, c+v; the front faces u × v
patches  = [3, 3]          # cells along u, v; default [1, 1]; patch = first + iu * nv + iv
sides    = 1
emit     = [{ cell = [1, 1], emittance = 1.0 }]   # overrides per cell

[[surface]]                # … or a triangle, cut in k² congruent ones
material = "white"
triangle = [[0,0,0], [1,0,0], [0,1,0]]   # a, b, c; front by the right-hand rule
patches  = 4
"#;

const JOB: &str = r#"
name  = "cornell"          # optional, default: file stem
scene = "scenes/cornell.toml"   # relative to this file; .toml, .obj, .gltf/.glb, .mgf
seed  = 42
confidence = 0.95          # level of every interval; default 0.95

[method]
walk      = "shooting"     # shooting | gathering | jacobi | auto (more may come)
estimator = "collision"    # absorption | survival | collision | infinite
space     = "discrete"     # discrete | continuous
sampler   = "random"       # random (PCG) | sobol (randomised quasi-Monte Carlo)
infinite  = { end = "roulette", threshold = 0.001 }  # roulette | cutoff, with threshold; length, with length = 20
birth     = "area"         # gathering: area | uniform | { patches = [7, 12] } (then p = 1/how many)

[budget]
paths = 10_000_000         # total walks (jacobi: total rays)
stream_paths = 65_536      # walks per lease
wall_seconds = 3600        # optional

[target]                   # optional
relative_error = 0.01      # half-width of the interval over the estimate
fraction       = 0.99      # of patch area that must meet it
"#;

fn written(name: &str, job: &str) -> PathBuf {
    let folder = Folder::new(name);
    folder.write("scenes/cornell.toml", SCENE);
    folder.write("a job.toml", job)
}

fn load_with(path: &std::path::Path, overrides: &[&str]) -> Job {
    load(path, &overrides.iter().map(|typed| (*typed).to_owned()).collect::<Vec<_>>()).unwrap()
}

/// The budget of a job that only says how many walks.
fn budget(paths: u64) -> Budget {
    Budget {
        first_path: 0,
        paths,
        stream_paths: 65_536,
        wall_seconds: None,
        checkpoint_seconds: job::DEFAULT_CHECKPOINT_SECONDS,
    }
}

/// The target of a job that only says how accurate.
fn target(relative_error: f64) -> Target {
    Target {
        relative_error,
        fraction: 0.99,
        min_paths: 1024,
        min_hits: 10,
        unhit: Unhit::Infinite,
        patches: None,
        quantity: Quantity::Irradiance,
    }
}

#[test]
fn ranges_checkpoints_and_rules_of_the_stop() {
    let path = written("rules", JOB);
    let job = load_with(
        &path,
        &[
            "budget.first_path=5",
            "budget.checkpoint_seconds=0.5",
            "simultaneous=true",
            "target.min_paths=7",
            "target.min_hits=0",
            "target.unhit=ignore",
            "target.patches=[24, 3]",
            "target.quantity=net",
        ],
    );
    assert_eq!((job.budget.first_path, job.budget.checkpoint_seconds, job.simultaneous), (5, 0.5, true));
    let expected = Target {
        min_paths: 7,
        min_hits: 0,
        unhit: Unhit::Ignore,
        patches: Some(vec![24, 3]),
        quantity: Quantity::Net,
        ..target(0.01)
    };
    assert_eq!(job.target, Some(expected));
    assert!(!load_with(&path, &[]).simultaneous);
}

#[test]
fn the_documented_job() {
    let job = load_with(&written("documented", JOB), &[]);
    assert_eq!(job.name, "cornell");
    assert_eq!((job.seed, job.confidence), (42, 0.95));
    assert_eq!(job.method, MethodTable::default());
    assert_eq!(job.budget, Budget { wall_seconds: Some(3600.0), ..budget(10_000_000) });
    assert_eq!(job.target, Some(target(0.01)));
    assert_eq!(job.build_scene().unwrap().faces().len(), 25);
}

#[test]
fn the_documented_scene() {
    let folder = Folder::new("documented-scene");
    let scene = load_scene(&folder.write("s.toml", SCENE)).unwrap();
    assert_eq!(scene.patch_count(), 25);
    let [floor, lid] = &scene.spec().surfaces[..] else { panic!("two surfaces") };
    assert_eq!(floor.name.as_deref(), Some("floor"));
    let shape = Shape::Parallelogram {
        corner: dvec3(0.0, 0.0, 0.0),
        corner_u: dvec3(1.0, 0.0, 0.0),
        corner_v: dvec3(0.0, 1.0, 0.0),
        cells: [3, 3],
    };
    assert_eq!(floor.shape, shape);
    assert_eq!(
        (floor.sides, floor.reflectance, floor.emittance),
        (Sides::Front, 0.75.into(), Spectrum::BLACK)
    );
    assert_eq!(floor.cell_emittance, [(4, 1.0.into())]);
    assert_eq!((lid.name.as_deref(), lid.sides), (None, Sides::Front));
    assert!(matches!(lid.shape, Shape::Triangle { rows: 4, .. }));
}

#[test]
fn defaults() {
    let job = load_with(&written("defaults", "scene = \"scenes/cornell.toml\"\nbudget.paths = 1\n"), &[]);
    assert_eq!((job.name.as_str(), job.seed, job.confidence), ("a job", 0, 0.95));
    assert_eq!(job.method.walk, WalkKind::Shooting);
    assert_eq!(job.method.estimator, EstimatorKind::Collision);
    // A job that says no method gets continuous walks, and linear fits.
    assert_eq!((job.method.space, job.method.beside), (Space::Continuous, Beside::Slopes));
    assert_eq!(job.method.sampler, Sampler::Random);
    assert_eq!(job.method.infinite, InfiniteEnd::Roulette { threshold: 0.001 });
    assert_eq!((job.method.birth, job.method.batch_paths), (Birth::Area, None));
    assert_eq!(job.budget, budget(1));
    assert_eq!(job.target, None);
    // All cells of its scene are written.
    assert_eq!((job.auto, job.chooses_method, job.total_target), (None, true, None));
}

/// What is left to the program, by what a job and its scene say.
#[test]
fn what_nobody_says_is_left_to_the_program() {
    let folder = Folder::new("unsaid");
    let scene = "[material.w]\nreflectance = 0.5\nemittance = 1\n\
        [[surface]]\nmaterial = \"w\"\nquad = [[0,0,0],[1,0,0],[0,1,0]]\npatches = [2, 2]\n\
        [[surface]]\nmaterial = \"w\"\nquad = [[0,0,1],[0,1,1],[1,0,1]]\n";
    let bare = folder.write("s.toml", scene);
    let job = folder.write("j.toml", "scene = \"s.toml\"\n[budget]\npaths = 1000\n");
    let by_hand = folder.write("h.toml", "scene = \"s.toml\"\n[budget]\npaths = 1000\n[method]\n");
    let open = |path: &Path, set: &[&str]| {
        let set: Vec<String> = set.iter().map(|&set| set.into()).collect();
        let job = load(path, &set).unwrap();
        let asked = job.total_target.map(|target| target.total_error);
        (job.auto.map(|auto| auto.surfaces), job.method.space, asked)
    };
    let (unsaid, default) = (Some(vec![1]), Some(job::DEFAULT_TOTAL_ERROR));
    assert_eq!(open(&bare, &[]), (unsaid.clone(), Space::Continuous, default));
    assert_eq!(open(&bare, &["budget.paths=9"]), (unsaid.clone(), Space::Continuous, None));
    assert_eq!(open(&bare, &["target.relative_error=0.1"]), (unsaid.clone(), Space::Continuous, None));
    assert_eq!(open(&bare, &["scene.patches=given"]), (None, Space::Continuous, None));
    assert_eq!(open(&bare, &["scene.patches=auto"]).0, Some(vec![0, 1]));
    // A method by hand leaves a bare scene's patches to the program, and nothing of a job.
    assert_eq!(open(&bare, &["method.walk=shooting"]), (unsaid.clone(), Space::Discrete, None));
    assert_eq!(open(&bare, &["target={relative_error=0.1,patches=[0]}"]).0, None);
    assert_eq!(open(&job, &[]), (unsaid, Space::Continuous, None));
    assert_eq!(open(&by_hand, &[]), (None, Space::Discrete, None));
    assert_eq!(open(&job, &["method.walk=shooting"]), (None, Space::Discrete, None));
    // Links follow Sobol sequences: random numbers are those of walks.
    let random = load(&by_hand, &["method.walk=auto".into(), "method.sampler=random".into()]).unwrap();
    assert_eq!(random.method.walk, WalkKind::Shooting);
    let spaced = load(&by_hand, &[" budget . paths = 7".into()]).unwrap();
    assert_eq!(spaced.budget.paths, 7);
    let written = job::load_as_written(&bare, &[]).unwrap();
    assert_eq!((written.auto, written.method, written.total_target), (None, MethodTable::default(), None));
}

#[test]
fn overrides_replace_and_add() {
    let path = written("overrides", JOB);
    let typed = [
        "name=box 7",
        "seed = 7",
        "seed=0x10",
        "confidence=0.5",
        "method.space=continuous",
        "method.infinite={ end = \"length\", length = 20 }",
        "method.birth.patches=[7, 12]",
        "method.batch_paths=4096",
        "budget.paths=123",
        "budget.wall_seconds=0.5",
        "target.relative_error=1",
    ];
    // A word has no keys of its own: what replaces it replaces it whole.
    assert!(load(&path, &["method.birth.patches=[7, 12]".into()]).is_err());
    let typed = typed.map(|typed| typed.replace("birth.patches=[7, 12]", "birth={ patches = [7, 12] }"));
    let job = load(&path, &typed).unwrap();
    assert_eq!((job.name.as_str(), job.seed, job.confidence), ("box 7", 16, 0.5));
    assert_eq!(job.method.space, Space::Continuous);
    assert_eq!(job.method.infinite, InfiniteEnd::Length { length: 20 });
    assert_eq!(job.method.birth, Birth::Patches(vec![7, 12]));
    assert_eq!(job.method.batch_paths, Some(4096));
    assert_eq!(job.budget, Budget { wall_seconds: Some(0.5), ..budget(123) });
    assert_eq!(job.target, Some(target(1.0)));
}

#[test]
fn overrides_heal_the_file_before_it_is_checked() {
    let path = written("healed", "scene = 3\n[budget]\npaths = 0\n");
    let job = load_with(&path, &["scene=scenes/cornell.toml", "budget.paths=5"]);
    assert_eq!(job.budget.paths, 5);
}

#[test]
fn grey_triples_and_integers_are_numbers() {
    let folder = Folder::new("grey");
    let text =
        SCENE.replace("0.75 ", "[0.5, 0.5, 0.5]").replace("emittance   = 0.0", "emittance = [2, 2, 2.0]");
    let scene = load_scene(&folder.write("s.toml", text)).unwrap();
    let floor = &scene.spec().surfaces[0];
    assert_eq!((floor.reflectance, floor.emittance), (0.5.into(), 2.0.into()));
    assert_eq!(scene.spec().channels(), 1);
}

#[test]
fn triples_are_red_green_blue() {
    let folder = Folder::new("colour");
    let text = SCENE.replace("0.75 ", "[0.5, 0, 0.25]").replace("emittance = 1.0", "emittance = [1, 2.5, 0]");
    let scene = load_scene(&folder.write("s.toml", text)).unwrap();
    let floor = &scene.spec().surfaces[0];
    assert_eq!(floor.reflectance, Spectrum::rgb([0.5, 0.0, 0.25]));
    assert_eq!(floor.cell_emittance, [(4, Spectrum::rgb([1.0, 2.5, 0.0]))]);
    assert_eq!(scene.spec().channels(), 3);
}

#[test]
fn windows_line_ends_and_a_byte_order_mark() {
    let folder = Folder::new("crlf");
    let scene =
        load_scene(&folder.write("s.toml", format!("\u{feff}{}", SCENE.replace('\n', "\r\n")))).unwrap();
    assert_eq!(scene.patch_count(), 25);
}

#[test]
fn jobs_and_scenes_are_told_apart() {
    let folder = Folder::new("kinds");
    assert_eq!(file_kind(&folder.write("j.toml", JOB)).unwrap(), FileKind::Job);
    assert_eq!(file_kind(&folder.write("half.toml", "[budget]\n")).unwrap(), FileKind::Job);
    assert_eq!(file_kind(&folder.write("s.toml", SCENE)).unwrap(), FileKind::Scene);
    assert_eq!(file_kind(&folder.path().join("chair.obj")).unwrap(), FileKind::Scene);
    assert!(file_kind(&folder.path().join("missing.toml")).is_err());
}

#[test]
fn the_hash_covers_scene_method_and_seed() {
    let scene = [7; 32];
    let shooting = MethodTable::default();
    let base = job_hash(scene, &shooting, &[], [&[]; 2], 1);
    assert_eq!(base, job_hash(scene, &shooting.clone(), &[], [&[]; 2], 1));
    assert_ne!(base, job_hash([8; 32], &shooting, &[], [&[]; 2], 1));
    assert_ne!(base, job_hash(scene, &shooting, &[], [&[]; 2], 2));
    let others = [
        MethodTable { walk: WalkKind::Gathering, ..shooting.clone() },
        MethodTable { estimator: EstimatorKind::Survival, ..shooting.clone() },
        MethodTable { space: Space::Continuous, ..shooting.clone() },
        MethodTable { sampler: Sampler::Sobol, ..shooting.clone() },
        MethodTable { final_gather: vec![3], ..shooting.clone() },
        MethodTable { beside: Beside::Mix, ..shooting.clone() },
        MethodTable { beside: Beside::Slopes, ..shooting.clone() },
        MethodTable { final_gather: vec![4], ..shooting.clone() },
    ];
    for other in &others {
        assert_ne!(base, job_hash(scene, other, &[], [&[]; 2], 1), "{other:?}");
    }
}

#[test]
fn sensors_and_what_is_asked_of_them() {
    let folder = Folder::new("sensors");
    let scene = format!(
        "{SCENE}\n[[sensor]]\nname = \"desk\"\nquad = [[0, 0, 1], [1, 0, 1], [0, 1, 1]]\npatches = [3, 2]\n\
         [[sensor]]\npoint = [0.5, 0, 1]\nnormal = [0, 0, -2]\n"
    );
    folder.write("s.toml", scene);
    let path = folder.write("j.toml", "scene = \"s.toml\"\n[budget]\npaths = 1000\n");
    let job = load_with(&path, &[]);
    let quad = SensorShape::Quad {
        corner: DVec3::Z,
        corner_u: DVec3::new(1.0, 0.0, 1.0),
        corner_v: DVec3::new(0.0, 1.0, 1.0),
        cells: [3, 2],
    };
    let point = SensorShape::Point { point: DVec3::new(0.5, 0.0, 1.0), normal: -2.0 * DVec3::Z };
    let sensor = |name: &str, shape| SensorSpec { name: name.into(), shape };
    assert_eq!(job.scene.sensors(), [sensor("desk", quad), sensor("1", point)]);
    assert_eq!((&job.target, &job.sensor_target), (&None, &None));
    let asked = |set: &[&str]| load_with(&path, set).sensor_target.unwrap();
    let all = asked(&["target.sensors=0.05"]);
    let expected =
        SensorTarget { sensors: vec![(0, 0.05), (1, 0.05)], min_paths: 1024, unhit: Unhit::Infinite };
    assert_eq!(all, expected);
    let some = asked(&["target.sensors.1=0.1", "target.min_paths=7", "target.unhit=ignore"]);
    assert_eq!(some, SensorTarget { sensors: vec![(1, 0.1)], min_paths: 7, unhit: Unhit::Ignore });
    let both = load_with(&path, &["target.sensors=0.05", "target.relative_error=0.01"]);
    assert_eq!((both.target, both.sensor_target), (Some(target(0.01)), Some(all)));
    let unknown = load(&path, &["target.sensors.desc=0.1".into()]).unwrap_err().to_string();
    for part in ["target.sensors.desc", "no sensor \"desc\"", "did you mean \"desk\"", "desk, 1"] {
        assert!(unknown.contains(part), "{unknown}");
    }
    // Sensors are no part of the scene.
    let plain = folder.write("plain.toml", SCENE);
    let bare = job::load_scene(&plain).unwrap();
    let [with, without] = [&job.scene, &bare].map(|scene| scene.build(IndexChoice::Auto).unwrap().hash());
    assert_eq!(with, without);
    let hash = |sensors: &[SensorSpec]| job_hash(with, &job.method, sensors, [&[]; 2], 0);
    assert_ne!(hash(&[]), hash(job.scene.sensors()));
}

#[test]
fn the_hash_covers_only_what_the_method_uses() {
    let hash = |method: MethodTable| job_hash([0; 32], &method, &[], [&[]; 2], 0);
    let ends = [InfiniteEnd::Cutoff { threshold: 0.1 }, InfiniteEnd::Length { length: 3 }];
    let births = [Birth::Uniform, Birth::Patches(vec![1]), Birth::Patches(vec![2])];
    for infinite in ends {
        let unused = MethodTable { infinite, ..MethodTable::default() };
        assert_eq!(hash(unused.clone()), hash(MethodTable::default()));
        let plain = MethodTable { estimator: EstimatorKind::Infinite, ..MethodTable::default() };
        assert_ne!(hash(MethodTable { estimator: EstimatorKind::Infinite, ..unused }), hash(plain));
    }
    for birth in births {
        let unused = MethodTable { birth, ..MethodTable::default() };
        assert_eq!(hash(unused.clone()), hash(MethodTable::default()));
        let plain = MethodTable { walk: WalkKind::Gathering, ..MethodTable::default() };
        assert_ne!(hash(MethodTable { walk: WalkKind::Gathering, ..unused }), hash(plain));
    }
    let unused = MethodTable { batch_paths: Some(8), ..MethodTable::default() };
    assert_eq!(hash(unused.clone()), hash(MethodTable::default()));
    let plain = MethodTable { sampler: Sampler::Sobol, ..MethodTable::default() };
    assert_ne!(hash(MethodTable { sampler: Sampler::Sobol, ..unused }), hash(plain));
}

#[test]
fn methods_are_written_in_the_words_of_the_file() {
    let written = serde_json::to_value(MethodTable::default()).unwrap();
    for (key, word) in
        [("walk", "shooting"), ("estimator", "collision"), ("space", "discrete"), ("sampler", "random")]
    {
        assert_eq!(written[key], word);
    }
    assert_eq!(serde_json::from_value::<MethodTable>(written).unwrap(), MethodTable::default());
}

/// Each of 250,000 patches that a target is about is looked up among as many that walks are born on. One by one, that would take
/// 3·10¹⁰ comparisons.
#[test]
fn a_target_may_be_about_very_many_patches() {
    let folder = crate::common::Folder::new("very-many-chosen");
    let scene = "[material.w]\nreflectance = 0.5\nemittance = 1\n[[surface]]\nmaterial = \"w\"\n\
                 quad = [[0,0,0],[1,0,0],[0,1,0]]\npatches = [500, 500]\n";
    folder.write("s.toml", scene);
    let all: Vec<String> = (0..250_000).map(|patch| patch.to_string()).collect();
    let all = all.join(", ");
    let job = format!(
        "scene = \"s.toml\"\n[method]\nwalk = \"gathering\"\nbirth = {{ patches = [{all}] }}\n\
         [budget]\npaths = 1000\n\
         [target]\nrelative_error = 0.1\npatches = [{all}]\n"
    );
    let job = load(&folder.write("j.toml", job), &[]).unwrap();
    assert_eq!(job.target.unwrap().patches.unwrap().len(), 250_000);
}

#[test]
fn integers_may_have_exponents() {
    let path = written("exponents", JOB);
    assert_eq!(load_with(&path, &["budget.paths=1e6"]).budget.paths, 1_000_000);
    assert_eq!(load_with(&path, &["budget.paths=2.5E3"]).budget.paths, 2500);
    assert_eq!(load_with(&path, &["budget.paths=1e18"]).budget.paths, 1_000_000_000_000_000_000);
}

/// No line of it opens a table that only scenes have.
#[test]
fn a_scene_of_dotted_keys_stands_in_place_of_a_job() {
    let scene = "material.m = { reflectance = 0.5, emittance = 1 }\n\
                 surface = [{ material = \"m\", quad = [[0,0,0],[1,0,0],[0,1,0]] }]\n";
    let path = written("dotted", scene);
    assert_eq!(file_kind(&path).unwrap(), FileKind::Scene);
    assert_eq!(load_with(&path, &[]).budget.paths, job::DEFAULT_PATHS);
}
