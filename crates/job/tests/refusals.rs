//! Every refusal says where, what, why and what to do.

use std::path::Path;

use crate::common::Folder;
use job::{load, load_scene};
use radiosity::IndexChoice;

const JOB: &str = "scene = \"s.toml\"\n[budget]\npaths = 10\n";
const SCENE: &str = "\
[material.white]
reflectance = 0.5
emittance = 1
[[surface]]
material = \"white\"
quad = [[0,0,0],[1,0,0],[0,1,0]]
";

/// Asserts that a message is one line without leftovers and holds every part.
fn assert_says(case: &str, message: &str, parts: &[&str]) {
    assert!(!message.contains('\n'), "{case}: more than one line: {message}");
    for part in parts {
        assert!(message.contains(part), "{case}: {part:?} is not in: {message}");
    }
}

fn job_message(folder: &Folder, overrides: &[String]) -> String {
    let path = folder.path().join("j.toml");
    match load(&path, overrides) {
        Ok(job) => job.build_scene().map(|_| "accepted".to_owned()).unwrap_or_else(|error| error.to_string()),
        Err(error) => error.to_string(),
    }
}

fn scene_message(path: &Path) -> String {
    match load_scene(path).and_then(|scene| scene.build(IndexChoice::Auto)) {
        Ok(_) => "accepted".into(),
        Err(error) => error.to_string(),
    }
}

const IMPORT_UNIT: &str = "scene = \"s.toml\"\n[budget]\npaths = 1\n[import]\nunit = 0\n";
const IMPORT_SIDES: &str = "scene = \"s.toml\"\n[budget]\npaths = 1\n[import]\nsides = \"both\"\n";
const IMPORT_POWER: &str =
    "scene = \"s.toml\"\n[budget]\npaths = 1\n[import.material.a]\nemittance = 1\npower = 1\n";

/// (job file, what the message holds)
const JOBS: &[(&str, &[&str])] = &[
    ("", &["j.toml: ", "empty", "scene = "]),
    (" \n\n", &["j.toml: ", "empty"]),
    ("# nothing\n", &["j.toml: budget.paths", "missing", "paths = 10_000_000"]),
    ("scene = \"s.toml\"\n", &["j.toml: budget.paths", "missing", "write [budget]"]),
    ("scene = \"s.toml\"\n\n[budget]\n", &["j.toml:3: budget.paths", "missing", "number of walks"]),
    (
        "scene = \"s.toml\"\n[budget]\npaths = 10\n[method]\nwalk = \"shooting\"\n[target]\ntotal_error = 0.02\n",
        &["j.toml:7: target.total_error", "too coarse", "basis = \"linear\""],
    ),
    ("[budget]\npaths = 1\n", &["j.toml: scene: ", "missing", "write scene = "]),
    ("scene = \n", &["j.toml:1", "not valid TOML", "correct the line"]),
    ("seed = 1\nseed = 2\n", &["j.toml:2", "not valid TOML", "duplicate key"]),
    ("seeed = 1\n", &["j.toml:1: seeed", "unknown key", "did you mean `seed`?", "known here"]),
    ("paths = 1\n", &["j.toml:1: paths", "unknown key", "did you mean `budget.paths`?"]),
    ("[target]\nestimator = 1\n", &["j.toml:2: target.estimator", "did you mean `method.estimator`?"]),
    ("xyzzy = 1\n", &["j.toml:1: xyzzy", "unknown key (nothing would read it); known here: name"]),
    ("\n[method]\nwalks = \"shooting\"\n", &["j.toml:3: method.walks", "unknown key", "walk, estimator"]),
    ("[budget]\npath = 1\n", &["j.toml:2: budget.path", "unknown key", "paths"]),
    ("[target]\nerror = 1\n", &["j.toml:2: target.error", "unknown key", "relative_error"]),
    ("[tracing]\nindex = \"tree\"\n", &["j.toml:1: tracing", "unknown key"]),
    ("[outputs]\n", &["j.toml:1: outputs", "unknown key"]),
    ("[output]\nfile = []\n", &["j.toml:2: output.file", "unknown key", "files"]),
    ("method = 3\n", &["j.toml:1: method", "the integer 3", "table"]),
    ("scene = 3\n[budget]\npaths = 1\n", &["j.toml:1: scene", "the integer 3", "string"]),
    (
        "scene = \"none.toml\"\n[budget]\npaths = 1\n",
        &["j.toml:1: scene", "no file", "none.toml", "relative"],
    ),
    ("scene = \".\"\n[budget]\npaths = 1\n", &["a folder"]),
    (
        "scene = \"chair.OBJ\"\n[budget]\npaths = 1\n",
        &["j.toml:1: scene", "no file", "chair.OBJ", "relative"],
    ),
    ("scene = \"room.fbx\"\n[budget]\npaths = 1\n", &["room.fbx", "unknown", "as .toml", ".obj"]),
    ("[import]\nunits = 1\n", &["j.toml:2: import.units", "unknown key", "unit"]),
    (IMPORT_UNIT, &["j.toml:5: import.unit", "0 is not above 0", "positive"]),
    (IMPORT_SIDES, &["j.toml:5: import.sides", "\"both\"", "\"file\", 1 or 2"]),
    (IMPORT_POWER, &["j.toml:6: import.material.a.power", "emittance", "one of them"]),
    ("scene = \"room\"\n[budget]\npaths = 1\n", &["room", "extension", "as .toml"]),
];

/// (override, what the message holds)
const OVERRIDES: &[(&str, &[&str])] = &[
    ("seed", &["--set seed", "no `=`", "--set key=value"]),
    ("=1", &["--set =1", "empty"]),
    ("budget..paths=1", &["--set budget..paths=1", "empty"]),
    ("seed=1\nname=2", &["--set seed=1\\nname=2", "more than one line"]),
    ("seed=", &["--set seed=", "no value"]),
    ("\"seed=1", &["--set \"seed=1", "a quote in the key is not closed"]),
    ("import.material.\"a\"b.power=1", &["b.power=1: the key is not TOML's"]),
    ("import.material.\"a.b\".colour=1", &["import.material.a.b.colour: unknown key"]),
    ("scene.x=1", &["--set scene.x=1: scene.x", "unknown key", "file, patches"]),
    ("budget.paths.x=1", &["--set budget.paths.x=1", "`paths` has no keys"]),
    ("scene.patches=3", &["--set scene.patches=3: scene.patches", "the integer 3", "string"]),
    ("method.birth={ patches = [ }", &["--set method.birth=", "not valid TOML"]),
    ("budget.pahts=1", &["j.toml with --set budget.pahts=1: budget.pahts", "unknown key", "paths"]),
    ("colour=1", &["j.toml with --set colour=1: colour", "unknown key"]),
    ("name=a/b", &["--set name=a/b: name", "output folder", "without slashes"]),
    ("name=..", &["name", "output folder"]),
    ("name=\"\"", &["name", "output folder"]),
    ("name=\"a\\nb\"", &["name", "output folder", "control"]),
    ("name=7", &["name", "the integer 7", "string"]),
    ("seed=-1", &["j.toml with --set seed=-1: seed: -1", "out of range", "0 to 9223372036854775807"]),
    ("seed=9223372036854775808", &["seed", "out of range"]),
    ("seed=1.5", &["seed", "1.5", "integer"]),
    ("seed=many", &["seed", "\"many\"", "integer"]),
    ("confidence=1", &["confidence: 1", "[0.5, 1)", "0.95"]),
    ("confidence=0.05", &["confidence: 0.05", "[0.5, 1)", "such as 0.95"]),
    ("confidence=nan", &["confidence", "not a finite number"]),
    ("confidence=true", &["confidence", "boolean true", "a number"]),
    (
        "method.walk=Shooting",
        &["method.walk", "\"Shooting\"", "did you mean \"shooting\"?", "\"shooting\" or \"gathering\""],
    ),
    ("method={walk=\"jacobi\",space=\"continuous\"}", &["method.walk", "discrete", "\"shooting\""]),
    ("method={walk=\"jacobi\",estimator=\"absorption\"}", &["method.walk", "no estimators", "remove"]),
    ("method={walk=\"jacobi\",mix=true}", &["method.walk", "no mix", "remove"]),
    (
        "method={walk=\"jacobi\",basis=\"linear\",jacobi={solve=\"iterations\"}}",
        &["method.walk", "a linear basis with links alone", "`basis`", "shooting"],
    ),
    ("method={mix=true,estimator=\"direct\"}", &["method.estimator", "by collision", "remove one"]),
    ("method={mix=true,basis=\"linear\"}", &["method.basis", "no linear basis", "remove one"]),
    ("method={basis=\"quadratic\"}", &["method.basis", "constant", "linear"]),
    ("method={final_gather=[3],basis=\"linear\"}", &["method.final_gather", "`basis`"]),
    ("method={walk=\"jacobi\",batch_paths=32}", &["method.batch_paths", "0 batches of 32", "≤ 1"]),
    ("method.space=flat", &["method.space", "\"discrete\" or \"continuous\""]),
    ("method={walk=\"gathering\",sampler=\"sobol\"}", &["method.sampler", "gathered", "\"random\""]),
    ("method.sampler=halton", &["method.sampler", "\"random\" or \"sobol\""]),
    ("method.infinite.threshold=0.1", &["method.infinite.end", "missing", "roulette"]),
    ("method.infinite={end=\"never\"}", &["method.infinite.end", "\"never\"", "cutoff"]),
    ("method.infinite={end=\"cutoff\",threshold=0}", &["infinite.threshold", "(0, 1)", "choose"]),
    ("method.infinite={end=\"cutoff\",length=3}", &["infinite.length", "does not use", "remove"]),
    ("method.infinite={end=\"length\",length=0}", &["infinite.length", "out of range"]),
    ("method.infinite={end=\"length\",threshold=0.1}", &["infinite.threshold", "does not use"]),
    ("method.infinite={end=\"length\",size=1}", &["infinite.size", "unknown key"]),
    ("method.infinite=20", &["method.infinite", "the integer 20", "table"]),
    ("method.birth=everywhere", &["method.birth", "\"everywhere\"", "patches = "]),
    ("method.birth={}", &["method.birth.patches", "missing"]),
    ("method.birth={patches=[]}", &["method.birth.patches", "empty"]),
    ("method.birth={patches=[0,0]}", &["method.birth.patches[1]", "twice"]),
    ("method.birth={patches=[1]}", &["method.birth.patches[0]", "out of range", "0 to 0"]),
    ("method.birth={patches=3}", &["method.birth.patches", "array"]),
    (
        "method={walk=\"gathering\",final_gather=[0]}",
        &["method.final_gather", "walks that are shot", "remove it"],
    ),
    ("method={space=\"continuous\",final_gather=[0]}", &["method.final_gather", "discrete", "remove it"]),
    ("method.final_gather=[]", &["method.final_gather", "empty", "remove the key"]),
    ("method.final_gather=[1]", &["method.final_gather[0]", "out of range", "0 to 0"]),
    ("method={final_gather=[0],batch_paths=3}", &["method.batch_paths", "3 batches of 3 walks", "≤ 1"]),
    ("method.batch_paths=0", &["method.batch_paths", "out of range"]),
    ("budget.paths=0", &["j.toml with --set budget.paths=0: budget.paths: 0", "no estimate", "from 1"]),
    ("budget.paths=1.5e0", &["budget.paths", "1.5e0", "1_000_000"]),
    ("budget.paths=1e30", &["budget.paths", "out of range", "64 bits"]),
    ("budget.paths=10.0", &["budget.paths", "number 10", "1_000_000", "1e6"]),
    ("budget.paths=99999999999999999999", &["budget.paths", "out of range (integers in TOML have 64 bits"]),
    ("budget.stream_paths=0", &["budget.stream_paths", "out of range", "1 to 16777216"]),
    ("budget.stream_paths=16777217", &["budget.stream_paths", "out of range"]),
    ("budget.wall_seconds=0", &["budget.wall_seconds", "positive"]),
    ("budget.wall_seconds=inf", &["budget.wall_seconds", "not a finite number"]),
    ("budget.wall_seconds=1e300", &["budget.wall_seconds", "outside"]),
    ("target.fraction=0.5", &["target.relative_error", "missing", "remove [target]"]),
    ("target.relative_error=0", &["target.relative_error", "above 0", "0.01"]),
    ("target={relative_error=0.1,fraction=0}", &["target.fraction", "(0, 1]"]),
    ("target={relative_error=0.1,fraction=1.01}", &["target.fraction", "(0, 1]"]),
    (
        "target={relative_error=0.1,patches=[]}",
        &["target.patches", "empty", "list a patch", "remove the key"],
    ),
    ("target={relative_error=0.1,patches=[0,0]}", &["target.patches[1]", "twice"]),
    ("target={relative_error=0.1,patches=[1]}", &["target.patches[0]", "out of range", "0 to 0"]),
    ("target={relative_error=0.1,patches=3}", &["target.patches", "array"]),
    ("target=0.01", &["target", "the number 0.01", "table"]),
    ("target.sensors=0.05", &["target.sensors", "no sensors", "[[sensor]]", "remove the key"]),
    ("target={sensors=0.05,fraction=0.5}", &["target.relative_error", "missing"]),
];

/// (text of the scene, its replacement, what the message holds)
const SCENES: &[(&str, &str, &[&str])] = &[
    (SCENE, "", &["s.toml: ", "empty", "[[surface]]"]),
    (SCENE, "# no surface\n", &["s.toml: ", "no surface", "add"]),
    (
        "emittance = 1",
        "emitance = 1",
        &["s.toml:3: material.white.emitance", "unknown key", "mean `material.white.emittance`?"],
    ),
    (
        "[material.white]",
        "scene = 1\n[material.white]",
        &["s.toml:1: scene", "unknown key", "one of jobs", "surface"],
    ),
    ("[[surface]]", "[[surface]]\ncolor = 1", &["s.toml:5: surface 0: color", "unknown key", "material"]),
    ("[[surface]]", "[[surfaces]]", &["s.toml:4: surfaces", "unknown key"]),
    ("[[surface]]", "[surface]", &["s.toml:4: surface", "single brackets", "write [[surface]]"]),
    (
        "[[surface]]",
        "[surface]\nmaterial = \"white\"\n[surface]",
        &["s.toml:6: ", "single brackets", "write [[surface]]"],
    ),
    ("[[surface]]", "[mesh]\nfile = \"x.obj\"\n[[surface]]", &["s.toml:4: mesh", "write [[mesh]]"]),
    (
        "[[surface]]",
        "[[mesh]]\nfile = \"x.obj\"\n[[surface]]",
        &["s.toml:5: mesh 0: file", "no file", "x.obj", "relative to the scene"],
    ),
    ("[[surface]]", "[sensor]\npoint = [0,0,1]\n[[surface]]", &["s.toml:4: sensor", "write [[sensor]]"]),
    (
        "[[surface]]",
        "[[sensor]]\nname = \"desk\"\n[[surface]]",
        &["s.toml:4: sensor 0 (\"desk\"): quad", "missing", "or point"],
    ),
    ("[[surface]]", "[[sensor]]\nname = \" \"\n[[surface]]", &["s.toml:5: sensor 0: name", "visible"]),
    (
        "[[surface]]",
        "[[sensor]]\npoint = [0,0,1]\n[[surface]]",
        &["s.toml:4: sensor 0 (\"0\"): normal", "missing", "[0, 0, 1]"],
    ),
    (
        "[[surface]]",
        "[[sensor]]\npoint = [0,0,1]\nnormal = [0,0,0]\n[[surface]]",
        &["s.toml:6: sensor 0 (\"0\"): normal", "no direction"],
    ),
    (
        "[[surface]]",
        "[[sensor]]\npoint = [0,0,1]\nnormal = [0,0,1]\npatches = [1, 1]\n[[surface]]",
        &["s.toml:7: sensor 0 (\"0\"): patches", "one place", "write a quad"],
    ),
    (
        "[[surface]]",
        "[[sensor]]\nquad = [[0,0,0],[1,0,0],[2,0,0]]\n[[surface]]",
        &["s.toml:5: sensor 0 (\"0\"): quad", "no area"],
    ),
    (
        "[[surface]]",
        "[[sensor]]\nquad = [[0,0,0],[1,0,0],[0,1,0]]\nnormal = [0,0,1]\n[[surface]]",
        &["s.toml:6: sensor 0 (\"0\"): normal", "u × v", "swap"],
    ),
    (
        "[[surface]]",
        "[[sensor]]\nquad = [[0,0,0],[1,0,0],[0,1,0]]\npoint = [0,0,1]\n[[surface]]",
        &["s.toml:6: sensor 0 (\"0\"): point", "a quad too", "two [[sensor]]"],
    ),
    (
        "[[surface]]",
        "[[sensor]]\nname = \"1\"\npoint = [0,0,1]\nnormal = [0,0,1]\n[[sensor]]\npoint = [0,0,1]\nnormal = [0,0,1]\n[[surface]]",
        &["s.toml:8: sensor 1: name", "called \"1\"", "of its own"],
    ),
    (
        "[[surface]]",
        "[[sensor]]\ncolour = 1\n[[surface]]",
        &["s.toml:5: sensor 0: colour", "unknown key", "normal"],
    ),
    (
        "reflectance = 0.5",
        "reflectance = 1",
        &["s.toml:2: material.white.reflectance, used by surface 0", "[0, 1)"],
    ),
    ("reflectance = 0.5", "reflectance = -0.1", &["s.toml:2: material.white.reflectance", "[0, 1)"]),
    ("reflectance = 0.5", "reflectance = nan", &["s.toml:2: material.white.reflectance", "not a finite"]),
    ("reflectance = 0.5", "reflectance = \"0.5\"", &["s.toml:2: material.white.reflectance", "a number"]),
    ("reflectance = 0.5", "reflectance = [0.5, 0.5]", &["s.toml:2: material.white.reflectance", "[r, g, b]"]),
    ("reflectance = 0.5", "reflectance = [0.5, 1.5, 0.4]", &["s.toml:2: ", "1.5", "[0, 1)"]),
    ("emittance = 1", "emittance = [1, 1, -2]", &["s.toml:3: material.white.emittance", "-2", "≥ 0"]),
    ("emittance = 1", "emittance = -1", &["s.toml:3: material.white.emittance", "negative", "≥ 0"]),
    ("emittance = 1", "emittance = inf", &["s.toml:3: material.white.emittance", "not a finite"]),
    ("emittance = 1", "emittance = 1e999", &["s.toml:3: material.white.emittance", "not a finite"]),
    ("emittance = 1", "emittance = 0", &["s.toml: ", "no emitter", "emittance"]),
    ("[material.white]", "[material]\nwhite = 1\n[material.grey]", &["s.toml:2: material.white", "table"]),
    ("[material.white]", "[material.grey]", &["s.toml:5: surface 0: material", "\"white\"", "defines grey"]),
    ("[material.white]", "[material.whiet]", &["surface 0: material", "\"white\"", "mean \"whiet\"?"]),
    (
        "[material.white]\nreflectance = 0.5\nemittance = 1\n",
        "",
        &["s.toml:2: surface 0: material", "\"white\"", "defines none"],
    ),
    ("material = \"white\"\n", "", &["s.toml:4: surface 0: material", "missing", "NAME"]),
    ("material = \"white\"\n", "material = 1\n", &["s.toml:5: surface 0: material", "string"]),
    ("[[surface]]", "[[surface]]\nname = \"\"", &["s.toml:5: surface 0: name", "visible"]),
    ("[[surface]]", "[[surface]]\nname = \"a\\tb\"", &["s.toml:5: surface 0: name", "one line"]),
    ("quad = [[0,0,0],[1,0,0],[0,1,0]]", "", &["s.toml:4: surface 0: quad", "missing", "or triangle"]),
    (
        "quad = ",
        "triangle = [[0,0,0],[1,0,0],[0,1,0]]\nquad = ",
        &["s.toml:6: surface 0: triangle", "a quad too", "two [[surface]]"],
    ),
    ("[0,1,0]]", "[0,1,0],[1,1,0]]", &["s.toml:6: surface 0: quad", "an array of 4", "three corners"]),
    ("[0,1,0]]", "[0,1]]", &["s.toml:6: surface 0: quad[2]", "an array of 2", "[x, y, z]"]),
    ("[0,1,0]]", "[0,nan,0]]", &["s.toml:6: surface 0: quad[2][1]", "not a finite"]),
    ("[0,1,0]]", "[0,\"1\",0]]", &["s.toml:6: surface 0: quad[2][1]", "\"1\"", "a number"]),
    ("[0,1,0]]", "[2,0,0]]", &["s.toml:6: surface 0: quad", "no area", "move a corner"]),
    (
        "[[surface]]",
        "[[surface]]\nname = \"floor\"\npatches = [0, 1]",
        &["s.toml:6: surface 0 (\"floor\"): patches[0]", "out of range", "from 1"],
    ),
    ("[[surface]]", "[[surface]]\npatches = 3", &["s.toml:5: surface 0: patches", "integer 3", "[nu, nv]"]),
    ("[[surface]]", "[[surface]]\npatches = [1, 2.0]", &["s.toml:5: surface 0: patches[1]", "integer"]),
    (
        "[[surface]]",
        "[[surface]]\npatches = [65536, 65536]",
        &["s.toml:5: surface 0: patches", "too many", "fewer"],
    ),
    ("[[surface]]", "[[surface]]\npatches = [65535, 65535]", &["s.toml:5: surface 0: patches", "use fewer"]),
    ("quad", "patches = [1, 1]\ntriangle", &["s.toml:6: surface 0: patches", "one integer k"]),
    ("quad", "patches = 0\ntriangle", &["s.toml:6: surface 0: patches", "out of range"]),
    ("quad", "patches = 65536\ntriangle", &["s.toml:6: surface 0: patches", "32 bits"]),
    ("[[surface]]", "[[surface]]\nsides = 3", &["s.toml:5: surface 0: sides", "1 to 2"]),
    ("[[surface]]", "[[surface]]\nsides = \"both\"", &["s.toml:5: surface 0: sides", "integer"]),
    ("[[surface]]", "[[surface]]\nemit = 1", &["s.toml:5: surface 0: emit", "array"]),
    ("[[surface]]", "[[surface]]\nemit = [1]", &["s.toml:5: surface 0: emit[0]", "table"]),
    ("[[surface]]", "[[surface]]\nemit = [{ cell = [0, 0] }]", &["emit[0].emittance", "missing"]),
    ("[[surface]]", "[[surface]]\nemit = [{ emittance = 1 }]", &["emit[0].cell", "missing"]),
    (
        "[[surface]]",
        "[[surface]]\nemit = [{ cel = [0, 0] }]",
        &["s.toml:5: surface 0: emit[0].cel", "unknown"],
    ),
    (
        "[[surface]]",
        "[[surface]]\nemit = [{ cell = [0, 1], emittance = 1 }]",
        &["s.toml:5: surface 0: emit[0].cell[1]", "out of range", "0 to 0"],
    ),
    (
        "quad",
        "patches = 2\nemit = [{ cell = [0, 1], emittance = 1 }]\ntriangle",
        &["s.toml:7: surface 0: emit[0].cell[1]", "out of range", "0 to 0"],
    ),
    (
        "[[surface]]",
        "[[surface]]\nemit = [{ cell = [0, 0], emittance = 1 }, { cell = [0, 0], emittance = 2 }]",
        &["s.toml:5: surface 0: emit[1]", "[0, 0] is listed twice", "once"],
    ),
    (
        "[[surface]]",
        "[[surface]]\nemit = [{ cell = [0, 0], emittance = -1 }]",
        &["s.toml:5: surface 0: emit: ", "≥ 0"],
    ),
];

#[test]
fn job_files() {
    for (number, (text, parts)) in JOBS.iter().enumerate() {
        let folder = Folder::new(&format!("refused-job-{number}"));
        folder.write("j.toml", text);
        folder.write("s.toml", SCENE);
        assert_says(text, &job_message(&folder, &[]), parts);
    }
}

#[test]
fn overrides() {
    let folder = Folder::new("refused-overrides");
    folder.write("j.toml", JOB);
    folder.write("s.toml", SCENE);
    assert_eq!(job_message(&folder, &[]), "accepted");
    for (typed, parts) in OVERRIDES {
        assert_says(typed, &job_message(&folder, &[(*typed).into()]), parts);
    }
}

#[test]
fn scene_files() {
    let folder = Folder::new("refused-scenes");
    for (old, new, parts) in SCENES {
        assert!(SCENE.contains(old), "{old:?} is not in the scene");
        let path = folder.write("s.toml", SCENE.replacen(old, new, 1));
        assert_says(new, &scene_message(&path), parts);
    }
}

#[test]
fn unreadable_files() {
    let folder = Folder::new("refused-files");
    let missing = folder.path().join("missing.toml");
    assert_says(
        "missing",
        &load(&missing, &[]).unwrap_err().to_string(),
        &["missing.toml: ", "no such file", "path"],
    );
    assert_says(
        "missing",
        &load_scene(&missing).unwrap_err().to_string(),
        &["missing.toml: ", "no such file"],
    );
    let is_folder = load(folder.path(), &[]).unwrap_err().to_string();
    assert_says("folder", &is_folder, &["refused-files: ", "a folder", "name the file"]);
    let latin = folder.write("latin.toml", b"seed = 1\nname = \"caf\xe9\"\n");
    assert_says(
        "latin",
        &load(&latin, &[]).unwrap_err().to_string(),
        &["latin.toml:2: ", "not UTF-8", "save"],
    );
}

/// A mesh of another program, given in place of a job: empty, bytes, or text.
#[test]
fn meshes_that_no_reader_exists_for_are_named() {
    let folder = Folder::new("foreign");
    for (name, content) in
        [("a.ifc", &b""[..]), ("b.blend", b"\xff\xfe"), ("c.rad", b"void plastic white\n0\n")]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        let message =
            load(&path, &[]).map(|_| "accepted".to_owned()).unwrap_or_else(|error| error.to_string());
        assert_says(name, &message, &[&name[1..], "scenes are unknown", ".glb"]);
    }
    // A job may have any name.
    folder.write("s.toml", SCENE);
    folder.write("job.txt", JOB);
    load(&folder.path().join("job.txt"), &[]).unwrap();
}

#[test]
fn the_line_is_that_of_the_second_surface() {
    let folder = Folder::new("refused-second");
    let second = "[[surface]]\nname = \"lid\"\nmaterial = \"white\"\ntriangle = [[0,0,0],[0,0,0],[1,0,0]]\n";
    let path = folder.write("s.toml", SCENE.to_owned() + second);
    assert_says("second", &scene_message(&path), &["s.toml:10: surface 1 (\"lid\"): triangle: ", "no area"]);
}

/// A line of points holds six numbers and nothing more, but a comment.
#[test]
fn lines_of_points_are_six_numbers() {
    let folder = Folder::new("refused-points");
    let path = folder.write("s.toml", SCENE.to_owned() + "[[points]]\nfile = \"desk.pts\"\n");
    for (line, parts) in [
        ("0 0 1 0 0 1 # desk", &["accepted"][..]),
        ("0 0 1 0 0 1 junk", &["desk.pts:1: ", "six numbers"]),
        ("0 0 1 0 0 1 1", &["desk.pts:1: ", "six numbers"]),
        ("0 0 1 0 0", &["desk.pts:1: ", "six numbers"]),
    ] {
        folder.write("desk.pts", line);
        assert_says(line, &scene_message(&path), parts);
    }
}
