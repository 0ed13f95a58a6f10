//! Tests of every method and product to which everything happens that may: its files have the bytes of those that were made undisturbed.
//!
//! The faults are those of `chaos.rs`. A coordinator that a fault ends is started again with `--resume`, as one would by hand. A handful of faults for each product belong to
//! the everyday suite; `scripts/chaos.sh` causes many and keeps the log.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, SystemTime};

use protocol::Checkpoint;

use crate::sensors::SENSORS;
use crate::support::storm::{Cluster, Dice, Fault, Start, draw, faults};
use crate::support::{SMALL_PICTURE, TABLES, path, radwalk, summary, wait_for};
use tempfile::{TempDir, tempdir};

/// The faults for each product in the everyday suite.
const SHORT: usize = 4;

/// The most lives of a product that ends whenever something of it is kept.
const LIVES: usize = 400;

const CUBE: &str = "tests/data/cube54.toml";
const LAMPS: &str = "configs/scenes/lamps.toml";

const SOURCES: &str =
    "[[source]]\nname = \"left\"\nsurfaces = [\"lamp-left\"]\n[sensitivity]\nmaterials = \"all\"\n";
const PLANE: &str = "[[plane]]\nname = \"table\"\norigin = [0, 0, 0]\nu = [1, 0, 0]\nv = [0, 1, 0]\nspacing = 0.25\nheight = 0.5\n";
const OPENING: &str = "[material.wall]\nreflectance = 0.8\n[[surface]]\nname = \"wall\"\nmaterial = \"wall\"\nsides = 2\n\
    quad = [[0,3,0], [3,3,0], [0,3,2]]\n[[sensor]]\nname = \"desk\"\nquad = [[1,1,0.5], [2,1,0.5], [1,2,0.5]]\npatches = [2, 2]\n";

/// The bytes of files by name.
type Files = BTreeMap<&'static str, Vec<u8>>;

/// What is made, and how.
struct Product {
    name: &'static str,
    /// Its command and job; `{}` stands for the test's folder.
    words: &'static str,
    /// Whether workers join from elsewhere.
    is_shared: bool,
    /// The files whose bytes are a function of the job.
    files: &'static [&'static str],
}

/// The option of runs by which checkpoints are written as often as may be.
const OFTEN: [&str; 2] = ["--set", "budget.checkpoint_seconds=0.2"];

const fn run(name: &'static str, words: &'static str, files: &'static [&'static str]) -> Product {
    Product { name, words, is_shared: true, files }
}

const PRODUCTS: [Product; 16] = [
    run(
        "auto patches",
        "run LAMPS --set scene.patches=auto --paths 1500000",
        &["patches.csv", "partition.toml", "radiosity.png"],
    ),
    run(
        "auto patches with a total error",
        "run LAMPS --set scene.patches=auto --set target.total_error=0.06 --paths 2000000",
        &["patches.csv", "partition.toml"],
    ),
    run(
        "walks, picture and page",
        "run configs/cornell.toml --paths 1000000",
        &["patches.csv", "radiosity.png"],
    ),
    run("gathering", "run CUBE --set method.walk=gathering --paths 2000000", &["patches.csv"]),
    run("infinite paths", "run CUBE --set method.estimator=infinite --paths 2000000", &["patches.csv"]),
    run(
        "linear bases",
        "run CUBE --set method.basis=linear --paths 3000000",
        &["patches.csv", "radiosity.png"],
    ),
    run(
        "Sobol batches",
        "run CUBE --set method.sampler=sobol --set method.batch_paths=8192 --paths 1500000",
        &["patches.csv"],
    ),
    run(
        "chains of links",
        "run CUBE --set method.walk=jacobi --set method.batch_paths=50000 --paths 6000000",
        &["patches.csv"],
    ),
    run(
        "chains of iterations",
        "run CUBE --set method.walk=jacobi --set method.jacobi.solve=iterations --set method.batch_paths=50000 --paths 3000000",
        &["patches.csv"],
    ),
    run(
        "final gather",
        "run CUBE --set method.final_gather=[53,0] --set method.batch_paths=8192 --paths 1500000",
        &["patches.csv"],
    ),
    run(
        "sources and sensitivities",
        "run {}/sources.toml --paths 1500000",
        &["patches.csv", "sources.csv", "sensitivities.csv"],
    ),
    run(
        "sensors and planes",
        "run {}/sensors.toml --paths 1000000",
        &["patches.csv", "sensors.csv", "planes.csv", "planes.svg"],
    ),
    run("a target", "run CUBE --set target.relative_error=0.011 --paths 100000000", &["patches.csv"]),
    run(
        "factors, dense",
        "factors CUBE --reflections --tolerance 0.02 --paths 30000000",
        &["factors.csv", "groups.csv"],
    ),
    Product {
        name: "factors, sparse",
        words: "factors CUBE --sparse --reflections --rays 50000",
        is_shared: false,
        files: &["factors.mtx", "groups.csv"],
    },
    run(
        "daylight",
        "daylight {}/opening.toml --weather configs/weather/made.epw --tolerance 0.004 --paths 40000000",
        &["annual.csv", "annual.ill", "annual-error.ill", "coefficients.mtx"],
    ),
];

impl Product {
    /// The command in a folder that has the scenes.
    fn command(&self, scenes: &Path, out: &Path) -> Command {
        let mut command = radwalk();
        let folder = scenes.to_str().unwrap();
        let words = self.words.replace("CUBE", CUBE).replace("LAMPS", LAMPS).replace("{}", folder);
        command.args(words.split(' ')).arg("--quiet").arg("--out").arg(out);
        if words.starts_with("run") {
            let is_drawn = self.files.contains(&"radiosity.png");
            command.args(OFTEN).args(if is_drawn { SMALL_PICTURE } else { TABLES });
        }
        command
    }

    /// The command whose workers join from elsewhere, and that goes on from what is there.
    fn shared(&self, scenes: &Path) -> Start {
        let (scenes, product) = (scenes.to_path_buf(), Product { ..*self });
        Box::new(move |out, access| {
            let alone = product.command(&scenes, out);
            let mut command = radwalk();
            let coordinates = alone.get_args().next().is_some_and(|word| word == "run");
            command.arg(if coordinates { "coordinate".as_ref() } else { alone.get_args().next().unwrap() });
            command.args(alone.get_args().skip(1)).arg("--resume");
            if product.is_shared {
                command.args(["--listen", "127.0.0.1:0", "--access"]).arg(access);
            }
            command
        })
    }

    /// The bytes of its files, and the digest of its tally where it has one.
    fn read(&self, out: &Path) -> Files {
        let file =
            |name: &&'static str| (*name, fs::read(out.join(name)).unwrap_or_else(|_| panic!("{name}")));
        let mut files: BTreeMap<_, _> = self.files.iter().map(file).collect();
        if out.join("summary.json").exists() {
            files.insert("tally", summary(out)["tally_hash"].to_string().into_bytes());
        }
        files
    }

    /// Makes it undisturbed.
    fn calm(&self, scenes: &Path) -> Files {
        let out = scenes.join(format!("calm-{}", self.name));
        let status = self.command(scenes, &out).stdout(Stdio::null()).status().unwrap();
        assert!(status.success(), "{}", self.name);
        self.read(&out)
    }
}

/// Each product, with the files of an undisturbed one: they are made once, for the test that asks first.
fn products(scenes: &Path) -> impl Iterator<Item = (&'static Product, &'static Files)> {
    static CALM: [OnceLock<Files>; PRODUCTS.len()] = [const { OnceLock::new() }; PRODUCTS.len()];
    let all: &'static [Product] = &PRODUCTS;
    all.iter().zip(&CALM).map(|(product, calm)| (product, calm.get_or_init(|| product.calm(scenes))))
}

/// A folder with the scenes that are made here.
fn scenes() -> TempDir {
    let folder = tempdir().unwrap();
    let write = |name: &str, text: String| fs::write(path(&folder, name), text).unwrap();
    let read = |name: &str| fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    write("lamps.toml", read(LAMPS));
    let job = |scene: &str| format!("scene = \"{scene}\"\nseed = 42\n[method]\nwalk = \"shooting\"\n");
    write("sources.toml", job("lamps.toml") + SOURCES);
    write("cube.toml", read("configs/scenes/cube54.toml") + SENSORS + PLANE);
    write("sensors.toml", job("cube.toml"));
    write("opening.toml", OPENING.to_owned());
    folder
}

/// Storms over one product until it is made. The faults that there were, how many coordinators there were, and how many a fault ended.
struct Storm {
    faults: BTreeMap<&'static str, usize>,
    coordinators: usize,
    ended: usize,
}

/// Makes a product under some faults at most.
fn storm(
    product: &Product,
    folder: &TempDir,
    start: Start,
    dice: &mut Dice,
    most: usize,
) -> (PathBuf, Storm) {
    let all = if product.is_shared { &Fault::ALL[..] } else { &Fault::ALONE };
    let mut cluster = Cluster::start(folder, 0, start);
    let (mut left, mut totals) = (Vec::new(), Storm { faults: BTreeMap::new(), coordinators: 1, ended: 0 });
    let mut caused = 0;
    loop {
        // What is made within a second is hit early and late.
        thread::sleep(Duration::from_millis(30 + dice.below(100)));
        cluster.tend();
        match cluster.ended() {
            Some(status) if status.success() => break,
            Some(_) => {
                (totals.coordinators, totals.ended) = (totals.coordinators + 1, totals.ended + 1);
                assert!(totals.ended < 100, "{} gets nowhere", product.name);
                cluster.restart();
            }
            None if caused < most => {
                let fault = draw(&mut left, all, dice);
                // It would take longer than all else.
                if fault == Fault::StuckForLong {
                    continue;
                }
                cluster.strike(fault, dice);
                caused += 1;
                *totals.faults.entry(fault.name()).or_default() += 1;
                totals.coordinators += usize::from(fault == Fault::CoordinatorKilled);
            }
            None => {}
        }
    }
    (cluster.out.clone(), totals)
}

#[test]
fn no_fault_leaves_a_trace_in_any_product() {
    let scenes = scenes();
    let mut dice = Dice(0x1234_5678_9ABC_DEF1);
    for (product, calm) in products(scenes.path()) {
        let mut totals = Storm { faults: BTreeMap::new(), coordinators: 0, ended: 0 };
        let (most, mut times) = (faults(SHORT), 0);
        let count = |totals: &Storm| totals.faults.values().sum::<usize>();
        while times == 0 || count(&totals) < most && most > SHORT {
            let folder = tempdir().unwrap();
            let start = product.shared(scenes.path());
            let (out, more) = storm(product, &folder, start, &mut dice, most - count(&totals));
            assert!(product.read(&out) == *calm, "{}: {:?}", product.name, more.faults);
            more.faults.into_iter().for_each(|(fault, n)| *totals.faults.entry(fault).or_default() += n);
            (totals.coordinators, totals.ended, times) =
                (totals.coordinators + more.coordinators, totals.ended + more.ended, times + 1);
        }
        println!(
            "{}: made {times} times under {} faults by {} coordinators, of which a fault ended {}",
            product.name,
            count(&totals),
            totals.coordinators,
            totals.ended
        );
        totals.faults.iter().for_each(|(fault, n)| println!("    {n} × {fault}"));
        println!("    the bytes of {} are those of the undisturbed one", product.files.join(", "));
    }
}

/// When the files of a folder that hold what goes on were written last.
fn written(out: &Path) -> Vec<(OsString, SystemTime)> {
    let about = |file: fs::DirEntry| Some((file.file_name(), file.metadata().ok()?.modified().ok()?));
    let mut files: Vec<_> = fs::read_dir(out).into_iter().flatten().flatten().filter_map(about).collect();
    files.sort();
    files
}

/// What a folder holds of what goes on: the walks of the tally, the lengths of files that grow, and digests of those that are replaced.
fn kept(out: &Path) -> Vec<(PathBuf, u64)> {
    let about = |file: fs::DirEntry| {
        let (path, name) = (file.path(), file.file_name().into_string().ok()?);
        let about = match &*name {
            // A process that finds all walks done writes it once more.
            "tally.bin" => Checkpoint::read(&path).ok()?.tally.counts.walks,
            "pilot.arrivals.bin" | "factors.rows" => file.metadata().ok()?.len(),
            "pilot.bin" | "round.bin" | "factors.counts.json" | "daylight.counts.json" => {
                let mut hasher = DefaultHasher::new();
                fs::read(&path).ok()?.hash(&mut hasher);
                hasher.finish()
            }
            _ => return None,
        };
        // What is empty holds nothing.
        (about > 0).then_some((path, about))
    };
    let mut files: Vec<_> = fs::read_dir(out).into_iter().flatten().flatten().filter_map(about).collect();
    files.sort();
    files
}

/// Each process is killed as soon as it has kept something new, until all walks are done: the next goes on from there, and the product is made by a bounded number of
/// them. What keeps nothing before its end is made by the first.
#[test]
fn every_product_makes_progress_though_each_process_is_killed() {
    let scenes = scenes();
    let mut killed = 0;
    for (product, calm) in products(scenes.path()) {
        let out = scenes.path().join(format!("killed-{}", product.name));
        let mut lives = 1;
        loop {
            let mut command = product.command(scenes.path(), &out);
            command.args(["--resume", "--workers", "1", "--threads", "1"]);
            let (before, mut seen) = (kept(&out), written(&out));
            let mut child: Child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            let ended = wait_for("something that is kept", || {
                let ended = child.try_wait().unwrap();
                // Long files are read only where something was written: this look has a core to share with the process.
                let now = written(&out);
                let is_new = std::mem::replace(&mut seen, now) != seen && kept(&out) != before;
                (ended.is_some() || is_new).then_some(ended)
            });
            if let Some(status) = ended {
                assert!(status.success(), "{} after {lives} lives", product.name);
                break;
            }
            child.kill().unwrap();
            child.wait().unwrap();
            lives += 1;
            assert!(lives < LIVES, "{} gets nowhere", product.name);
        }
        println!("{}: made by {lives} processes, of which all but the last were killed", product.name);
        assert!(product.read(&out) == *calm, "{}", product.name);
        killed += usize::from(lives > 1);
    }
    assert!(2 * killed > PRODUCTS.len(), "{killed} products were killed on their way");
}
