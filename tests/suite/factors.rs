//! `radwalk factors`: tables of exchange factors, the heat between groups, and a sky.
//!
//! Seeds are fixed; intervals of level 0.9999 that are held against the truth raise a false alarm once in 10,000.

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::thread::sleep;
use std::time::Duration;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::support::{columns, finish, numbers, path, radwalk, run, run_job, wait_for};

/// Two unit squares at a right angle, in the open: F = 0.20004 between their fronts.
pub const CORNER: &str = r#"
[material.floor]
reflectance = 0.5
[material.wall]
reflectance = 0.8

[[surface]]
name     = "floor"
material = "floor"
quad     = [[0,0,0], [1,0,0], [0,1,0]]
patches  = [2, 1]

[[surface]]
name     = "wall"
material = "wall"
quad     = [[0,0,0], [0,1,0], [0,0,1]]
"#;

const PERPENDICULAR: f64 = 0.200_043_776_075_403_16;

/// A folder with scene files.
fn scenes(files: &[(&str, &str)]) -> TempDir {
    let folder = tempdir().unwrap();
    files.iter().for_each(|(name, text)| fs::write(path(&folder, name), text).unwrap());
    folder
}

/// Counts factors; the exit code and what was said of it.
fn factors(folder: &TempDir, words: &str) -> (i32, String, String) {
    let words: Vec<String> = words
        .split(' ')
        .map(|word| match word.ends_with(".toml") || word.starts_with("out") {
            true => path(folder, word).to_str().unwrap().to_owned(),
            false => word.to_owned(),
        })
        .collect();
    run(&["factors"].into_iter().chain(words.iter().map(String::as_str)).collect::<Vec<_>>())
}

/// Factors with their intervals, by names.
fn table(out: &Path) -> HashMap<(String, String), [f64; 3]> {
    let table = columns(&out.join("factors.csv"));
    let values = ["factor", "ci_low", "ci_high"].map(|name| numbers(&table[name]));
    let names = table["from"].iter().cloned().zip(table["to"].iter().cloned());
    names.enumerate().map(|(row, names)| (names, values.each_ref().map(|column| column[row]))).collect()
}

fn summary(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("factors.json")).unwrap()).unwrap()
}

fn key(from: &str, to: &str) -> (String, String) {
    (from.into(), to.into())
}

#[test]
fn a_corner_has_the_factors_of_the_catalogue() {
    let folder = scenes(&[("corner.toml", CORNER)]);
    let (code, stdout, stderr) = factors(
        &folder,
        "corner.toml --groups by-surface --paths 1e6 --smooth --set confidence=0.9999 --out out --workers 2",
    );
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("form factors between 2 groups"), "{stdout}");
    let out = path(&folder, "out");
    let table = table(&out);
    assert_eq!(table.len(), 2 * 4);
    for (from, to, truth) in [
        ("floor", "wall", PERPENDICULAR),
        ("wall", "floor", PERPENDICULAR),
        ("floor", "floor", 0.0),
        ("wall", "escape", 1.0 - PERPENDICULAR),
        ("wall", "back", 0.0),
    ] {
        let [factor, low, high] = table[&key(from, to)];
        assert!(low <= truth && truth <= high && high - low < 0.01, "{from} {to}: {factor} {low} {high}");
    }
    // `escape` is the last column of each group, and rows add up to 1 to the last bit.
    let rows = columns(&out.join("factors.csv"));
    assert_eq!(rows["to"], ["floor", "wall", "back", "escape", "floor", "wall", "back", "escape"]);
    for row in numbers(&rows["factor"]).chunks(4) {
        assert_eq!(row.iter().sum::<f64>(), 1.0);
    }
    for row in numbers(&rows["smoothed"]).chunks(4) {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
    let smoothed = numbers(&rows["smoothed"]);
    assert!((smoothed[1] - smoothed[4]).abs() < 1e-12, "unit squares: {smoothed:?}");
    // What is exported is the table.
    let words = "corner.toml --groups by-surface --paths 1e6 --set confidence=0.9999 --out out2 --quiet --export npz,mtx";
    let (code, _, stderr) = factors(&folder, words);
    assert_eq!(code, 0, "{stderr}");
    let matrix = fs::read_to_string(path(&folder, "out2").join("factors.mtx")).unwrap();
    assert!(matrix.contains("\n2 4 4\n"), "{matrix}");
    let entry = matrix.lines().find_map(|line| line.strip_prefix("2 1 ")).unwrap();
    assert_eq!(entry.parse::<f64>().unwrap(), numbers(&rows["factor"])[4], "{matrix}");
    let arrays = fs::read(path(&folder, "out2").join("factors.npz")).unwrap();
    let bytes = numbers(&rows["factor"])[4].to_le_bytes();
    assert!(arrays.starts_with(b"PK") && arrays.windows(8).any(|window| window == bytes));
    let groups = columns(&out.join("groups.csv"));
    assert_eq!(
        (&groups["group"][..], &groups["faces"][..]),
        (&["floor".into(), "wall".into()][..], &["2".into(), "1".into()][..])
    );
    assert_eq!(numbers(&groups["absorptance"]), [0.5, 0.19999999999999996]);
    let walks: f64 = numbers(&groups["walks"]).iter().sum();
    assert_eq!(summary(&out)["walks"].as_f64().unwrap(), walks);
}

/// In a box every reflection ends on the six walls: B_ij against `exact`, whose table has the same names.
#[test]
fn gebharts_factors_are_those_of_exact() {
    let folder = tempdir().unwrap();
    let job = "configs/cube6-r90.toml";
    let [out, exact] = ["out", "exact"].map(|name| path(&folder, name).to_str().unwrap().to_owned());
    let (code, _, stderr) = run(&[
        "factors",
        job,
        "--reflections",
        "--paths",
        "2e6",
        "--set",
        "confidence=0.9999",
        "--quiet",
        "--out",
        &out,
    ]);
    assert_eq!(code, 0, "{stderr}");
    let (code, _, stderr) = run(&["exact", job, "--quiet", "--out", &exact]);
    assert_eq!(code, 0, "{stderr}");
    let table = table(Path::new(&out));
    let truth = columns(&Path::new(&exact).join("exact-factors.csv"));
    let absorbed = numbers(&truth["absorbed"]);
    let names = truth["from"].iter().zip(&truth["to"]);
    let mut compared = 0;
    for ((from, to), truth) in names.zip(absorbed) {
        let [factor, low, high] = table[&key(from, to)];
        let slack = if to == "escape" { 1e-9 } else { 0.0 };
        assert!(low - slack <= truth && truth <= high + slack, "{from} {to}: {factor} {low} {high}, {truth}");
        compared += 1;
    }
    assert_eq!(compared, 6 * 7);
}

/// The same bytes for any workers and threads, and after an interruption: what a look has kept is gone on from.
#[test]
fn the_answer_is_a_function_of_the_job() {
    let folder = scenes(&[("corner.toml", CORNER)]);
    let job = "corner.toml --reflections --tolerance 0.02 --paths 1e8 --quiet";
    for (out, how) in
        [("out1", "--workers 1"), ("out2", "--workers 3 --threads 2 --set budget.stream_paths=777")]
    {
        let (code, _, stderr) = factors(&folder, &format!("{job} --out {out} {how}"));
        assert_eq!(code, 0, "{stderr}");
    }
    let read = |out: &str, file: &str| fs::read(path(&folder, out).join(file)).unwrap();
    for file in ["factors.csv", "groups.csv"] {
        assert!(read("out1", file) == read("out2", file), "{file}");
    }
    // As if the run had ended at its first look: 4096 walks of each group, as here an eighth of the budget allows.
    let first = "corner.toml --reflections --paths 98304 --tolerance 0.9 --quiet --out out3";
    let (code, _, stderr) = factors(&folder, first);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(summary(&path(&folder, "out3"))["walks"], 3 * 4096);
    let (code, _, stderr) = factors(&folder, &format!("{job} --out out3 --resume"));
    assert_eq!(code, 0, "{stderr}");
    assert!(read("out1", "factors.csv") == read("out3", "factors.csv"));
    assert_eq!(summary(&path(&folder, "out3"))["tolerance"]["reached"], true);
    // Counts of another question are refused.
    let (code, _, stderr) = factors(&folder, &format!("{job} --out out3 --resume --seed 7"));
    assert!(code == 2 && stderr.contains("other surfaces, groups, seed"), "{stderr}");
}

/// Counts of two seeds are one: the sums of both, in whatever order, with rows that add up to exactly 1 though no power of two of walks
/// is behind them. The answer is that to the question of the first: an enclosure, smoothed factors, matrices.
#[test]
fn counts_of_several_seeds_are_merged() {
    let heat = "environment = 280.0\n[[group]]\nname = \"*\"\ntemperature = 300.0\n";
    let folder = scenes(&[("corner.toml", CORNER), ("heat.toml", heat)]);
    let job = "corner.toml --groups by-surface --temperatures heat.toml --smooth --quiet --export npz,mtx";
    for (out, seed, paths) in [("out1", 1, 20_000), ("out2", 2, 40_000), ("out3", 3, 90_000)] {
        let (code, _, stderr) = factors(&folder, &format!("{job} --seed {seed} --paths {paths} --out {out}"));
        assert_eq!(code, 0, "{stderr}");
    }
    let at = |out: &str| path(&folder, out).to_str().unwrap().to_owned();
    let merge = |runs: &[&str], out: &str| {
        let runs: Vec<String> = runs.iter().map(|run| at(run)).collect();
        let words = ["merge"].into_iter().chain(runs.iter().map(String::as_str));
        run(&words.chain(["--out", &at(out)]).collect::<Vec<_>>())
    };
    let (code, stdout, stderr) = merge(&["out1", "out2", "out3"], "out-a");
    assert!(code == 0 && stdout.contains("factors of absorption"), "{stdout}{stderr}");
    for (runs, out) in [(&["out1", "out2"][..], "out-b"), (&["out-b", "out3"], "out-c")] {
        assert_eq!(merge(runs, out).0, 0);
    }
    let read = |out: &str, file: &str| fs::read(path(&folder, out).join(file)).unwrap();
    for file in ["factors.csv", "groups.csv", "thermal.csv", "factors.mtx", "factors.npz"] {
        assert!(read("out-a", file) == read("out-c", file), "{file}");
    }
    let result = summary(&path(&folder, "out-a"));
    assert_eq!(result["seeds"], serde_json::json!([1, 2, 3]));
    let walks = |out: &str| numbers(&columns(&path(&folder, out).join("groups.csv"))["walks"]);
    let (merged, parts) = (walks("out-a"), ["out1", "out2", "out3"].map(walks));
    assert!(merged.iter().any(|walks| !(*walks as u64).is_power_of_two()), "{merged:?}");
    let tables = ["out1", "out2", "out3"].map(|out| table(&path(&folder, out)));
    let rows = columns(&path(&folder, "out-a").join("factors.csv"));
    for (group, row) in numbers(&rows["factor"]).chunks(4).enumerate() {
        assert_eq!(row.iter().sum::<f64>(), 1.0);
        for (column, factor) in row.iter().enumerate() {
            let pair = key(&rows["from"][4 * group + column], &rows["to"][4 * group + column]);
            let hits: f64 = (0..3).map(|part| tables[part][&pair][0] * parts[part][group]).sum();
            assert!((factor - hits / merged[group]).abs() < 1e-15, "{pair:?}");
        }
    }
    // What does not go together is refused, and nothing is written.
    let (code, _, stderr) = factors(&folder, "corner.toml --paths 20000 --seed 4 --quiet --out out4");
    assert_eq!(code, 0, "{stderr}");
    fs::create_dir(path(&folder, "out5")).unwrap();
    for (runs, words) in [
        (["out1", "out1"], "seed 1 are in two of the folders"),
        (["out-a", "out2"], "seed 2 are in two of the folders"),
        (["out1", "out4"], "another scene, other groups or another kind"),
        (["out1", "out5"], "give output folders of `radwalk factors`"),
    ] {
        let (code, _, stderr) = merge(&runs, "out-d");
        assert!(code == 2 && stderr.contains(words), "{stderr}");
    }
    assert!(!path(&folder, "out-d").join("factors.csv").exists());
    let (code, _, stderr) = factors(&folder, &format!("{job} --seed 1 --paths 1e6 --out out-a --resume"));
    assert!(code == 2 && stderr.contains("merged from several seeds"), "{stderr}");
}

/// Workers elsewhere stay from look to look. Some are killed, others come, and the coordinator is killed and goes on from its
/// counts: the bytes are those of workers here.
#[test]
fn workers_elsewhere_leave_no_trace() {
    let folder = scenes(&[("corner.toml", CORNER)]);
    let job = "corner.toml --reflections --tolerance 0.005 --paths 1e8 --quiet";
    let (code, _, stderr) = factors(&folder, &format!("{job} --out out1 --workers 2"));
    assert_eq!(code, 0, "{stderr}");
    let (corner, out, access) =
        (path(&folder, "corner.toml"), path(&folder, "out2"), path(&folder, "access.json"));
    let start = |more: &[&str]| {
        let mut command = radwalk();
        command.arg("factors").arg(&corner).args(["--reflections", "--tolerance", "0.005", "--paths", "1e8"]);
        command.args(["--quiet", "--listen", "127.0.0.1:0", "--out"]).arg(&out).arg("--access").arg(&access);
        command.args(more).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let work = |access: &Path| {
        radwalk().args(["work", "--quiet", "--wait", "60", "--access"]).arg(access).spawn().unwrap()
    };
    let mut coordinator = start(&[]);
    wait_for("the access file", || access.exists().then_some(()));
    let [mut victim, others @ ..] = [(); 3].map(|()| work(&access));
    // The second look is much longer than the first, and the workers have not found it yet.
    wait_for("the first look", || out.join("factors.counts.json").exists().then_some(()));
    coordinator.kill().unwrap();
    coordinator.wait().unwrap();
    assert!(!out.join("factors.csv").exists(), "the coordinator was killed too late");
    let stale = fs::read(&access).unwrap();
    let coordinator = start(&["--resume"]);
    // This worker does not see that the coordinator removes its access file, and has to be told of the end.
    let copy = path(&folder, "copy.json");
    let fresh = wait_for("the other access file", || fs::read(&access).ok().filter(|file| *file != stale));
    fs::write(&copy, fresh).unwrap();
    let late = work(&copy);
    // By now the others have found the coordinator again.
    sleep(Duration::from_millis(800));
    victim.kill().unwrap();
    victim.wait().unwrap();
    assert_eq!(finish(coordinator).0, 0);
    assert_eq!(finish(late).0, 0, "the worker was not told of the end");
    others.into_iter().for_each(|worker| _ = finish(worker));
    assert!(!access.exists());
    for file in ["factors.csv", "groups.csv"] {
        let [here, elsewhere] = ["out1", "out2"].map(|out| fs::read(path(&folder, out).join(file)).unwrap());
        assert!(here == elsewhere, "{file}");
    }
}

#[test]
fn a_tolerance_on_a_pair_gives_its_rays_to_its_row() {
    let folder = scenes(&[("corner.toml", CORNER)]);
    let job = "corner.toml --groups by-surface --quiet --out";
    let (code, _, stderr) =
        factors(&folder, &format!("{job} out --tolerance 0.01 --pairs wall:floor --paths 1e7"));
    assert_eq!(code, 0, "{stderr}");
    let out = path(&folder, "out");
    let [factor, low, high] = table(&out)[&key("wall", "floor")];
    assert!(0.5 * (high - low) <= 0.01 * factor, "{factor} {low} {high}");
    let walks = numbers(&columns(&out.join("groups.csv"))["walks"]);
    assert!(walks[1] >= 16.0 * walks[0], "{walks:?}");
    let tolerance = &summary(&out)["tolerance"];
    assert_eq!(
        (tolerance["reached"].clone(), tolerance["pairs"][0][1].clone()),
        (true.into(), "floor".into())
    );
    // A factor that is 0 is never known relative to itself: the budget ends it.
    let (code, _, stderr) =
        factors(&folder, &format!("{job} out2 --tolerance 0.1 --pairs floor:floor --paths 100000"));
    assert_eq!(code, 1, "{stderr}");
}

/// Groups by a file: surfaces by pattern, materials, patches; what is left is `rest`. Escape is what a group of nothing sees.
#[test]
fn groups_come_from_a_file() {
    let groups =
        "[[group]]\nname = \"west\"\npatches = [0]\n[[group]]\nname = \"walls\"\nsurfaces = [\"wa*\"]\n";
    let folder = scenes(&[("corner.toml", CORNER), ("groups.toml", groups)]);
    let (code, _, stderr) =
        factors(&folder, "corner.toml --groups groups.toml --paths 1e5 --quiet --out out");
    assert_eq!(code, 0, "{stderr}");
    let named = columns(&path(&folder, "out").join("groups.csv"));
    assert_eq!(named["group"], ["west", "walls", "rest"]);
    assert_eq!(numbers(&named["area"]), [0.5, 1.0, 0.5]);
    let (code, _, stderr) =
        factors(&folder, "corner.toml --groups by-material --paths 1e5 --quiet --out out2");
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(columns(&path(&folder, "out2").join("groups.csv"))["group"], ["floor", "wall"]);
}

/// A cube of which one wall is hot, one is cold, and the rest are insulated: the closed form is in `exchange`'s tests.
#[test]
fn heat_flows_from_hot_to_cold() {
    let heat = "environment = 280.0\n[[group]]\nname = \"*\"\nflux = 0.0\n\
                [[group]]\nname = \"z0\"\ntemperature = 400.0\nemissivity = 0.8\n\
                [[group]]\nname = \"z1\"\ntemperature = 300.0\nemissivity = 0.5\n";
    let folder = scenes(&[("heat.toml", heat)]);
    let (heat, out) = (path(&folder, "heat.toml"), path(&folder, "out"));
    let [heat, named] = [&heat, &out].map(|path| path.to_str().unwrap());
    let (code, _, stderr) = run(&[
        "factors",
        "configs/cube6-r90.toml",
        "--groups",
        "by-surface",
        "--temperatures",
        heat,
        "--paths",
        "4e6",
        "--quiet",
        "--set",
        "confidence=0.9999",
        "--out",
        named,
    ]);
    assert_eq!(code, 0, "{stderr}");
    let table = columns(&out.join("thermal.csv"));
    let sigma = 5.670374419e-8;
    let [hot, cold] = [400.0_f64, 300.0].map(|t| sigma * t.powi(4));
    let opposed = 0.199_824_895_698_387_46;
    let between = 1.0 / (opposed + 0.5 * (1.0 - opposed));
    let net = (hot - cold) / (0.2 / 0.8 + between + 0.5 / 0.5);
    let [low, high] = ["flux_low", "flux_high"].map(|name| numbers(&table[name][..2]));
    assert!(low[0] < net && net < high[0] && high[0] - low[0] < 0.02 * net, "{low:?} {high:?}: {net}");
    assert!(low[1] < -net && -net < high[1], "{low:?} {high:?}: {net}");
    let middle = numbers(&table["temperature"]);
    assert!((340.0..380.0).contains(&middle[2]) && table["flux_error"][2].is_empty(), "{table:?}");
    assert!(table["temperature_error"][0].is_empty() && !table["temperature_error"][2].is_empty());
}

/// A surface's flux is that of all its patches together, which share it by area, whether they are groups of their own or one.
#[test]
fn patches_share_the_flux_of_their_surface() {
    let heat = "environment = 280.0\n[[group]]\nname = \"*\"\ntemperature = 300.0\n\
                [[group]]\nname = \"z0\"\nflux = 250.0\n";
    let folder = scenes(&[("heat.toml", heat)]);
    let heat = path(&folder, "heat.toml");
    for (groups, patches) in [("by-surface", 1), ("by-patch", 9)] {
        let out = path(&folder, groups);
        let words =
            ["factors", "configs/cube54.toml", "--sparse", "--rays", "2e3", "--quiet", "--groups", groups];
        let rest = ["--temperatures", heat.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let (code, _, stderr) = run(&[&words[..], &rest].concat());
        assert_eq!(code, 0, "{stderr}");
        let table = columns(&out.join("thermal.csv"));
        let rows = table["group"].iter().zip(&table["flux"]).filter(|(group, _)| group.starts_with("z0"));
        let fluxes: Vec<f64> = rows.map(|(_, flux)| flux.parse().unwrap()).collect();
        assert_eq!(fluxes.len(), patches, "{table:?}");
        assert!(fluxes.iter().all(|flux| (flux - 250.0 / patches as f64).abs() < 1e-9), "{fluxes:?}");
    }
}

/// The shipped oven: two grey plates joined by insulated walls, whose closed form the guide gives.
#[test]
fn the_oven_heats_its_load() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let words =
        ["factors", "configs/oven.toml", "--groups", "by-surface", "--quiet", "--set", "confidence=0.9999"];
    let rest = ["--temperatures", "configs/heat/oven.toml", "--out", out.to_str().unwrap()];
    let (code, _, stderr) = run(&[&words[..], &rest].concat());
    assert_eq!(code, 0, "{stderr}");
    let table = columns(&out.join("thermal.csv"));
    assert_eq!(table["group"], ["load", "heater", "walls"]);
    let [low, high, warm_low, warm_high] =
        ["flux_low", "flux_high", "temperature_low", "temperature_high"].map(|name| numbers(&table[name]));
    let heat = 17_629.0;
    assert!(low[1] < heat && heat < high[1] && high[1] - low[1] < 0.01 * heat, "{low:?} {high:?}");
    assert!(low[0] < -heat && -heat < high[0], "{low:?} {high:?}");
    assert!(warm_low[2] < 775.9 && 775.9 < warm_high[2], "{warm_low:?} {warm_high:?}");
}

/// A plate at 310 K whose back and front see an environment at 200 K, in a scene with a sky that shines, which is no part of heat: 2εAσ(T⁴ − T₀⁴). A run
/// without temperatures leaves none of an earlier one behind.
#[test]
fn what_leaves_the_scene_meets_the_environment() {
    let plate = "[material.m]\nreflectance = 0.5\n[sky]\nemittance = 1.0\n[[surface]]\nname = \"plate\"\nmaterial = \"m\"\n\
                 quad = [[0,0,0], [1,0,0], [0,1,0]]\nsides = 2\n";
    let heat = "environment = 200.0\n[[group]]\nname = \"*\"\ntemperature = 310.0\n";
    let folder = scenes(&[("plate.toml", plate), ("heat.toml", heat)]);
    let words = "plate.toml --groups by-surface --paths 4096 --quiet --out out";
    let (code, _, stderr) = factors(&folder, &format!("{words} --temperatures heat.toml"));
    assert_eq!(code, 0, "{stderr}");
    let out = path(&folder, "out");
    let flux = numbers(&columns(&out.join("thermal.csv"))["flux"]);
    let truth = 5.670374419e-8 * (310.0_f64.powi(4) - 200.0_f64.powi(4));
    assert!((flux[0] - truth).abs() < 1e-9 * truth, "{flux:?}: {truth}");
    let (code, _, stderr) = factors(&folder, &format!("{words} --reflections --resume"));
    assert!(code == 0 && !out.join("thermal.csv").exists(), "{stderr}");
}

/// A box of a mesh has no lamp of the program's own among its groups.
#[test]
fn a_mesh_has_no_groups_but_its_own() {
    let ground = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nusemtl floor\nf 1 2 3 4\nusemtl wall\nf 1 5 6 2\n";
    let folder = scenes(&[("ground.obj", ground), ("job.toml", "scene = \"ground.obj\"\n")]);
    let (code, _, stderr) = factors(&folder, "job.toml --groups by-material --paths 4096 --quiet --out out");
    assert_eq!(code, 0, "{stderr}");
    let groups = columns(&path(&folder, "out/groups.csv"));
    assert_eq!(groups["group"], ["floor", "wall"], "{groups:?}");
}

#[test]
fn what_cannot_be_counted_is_refused() {
    let coloured = CORNER.replace("reflectance = 0.8", "reflectance = [0.8, 0.2, 0.1]");
    let doubled = "[[group]]\nname = \"a\"\nsurfaces = [\"floor\"]\n[[group]]\nname = \"b\"\npatches = [1]\n";
    let cold = "[[group]]\nname = \"*\"\ntemperature = -3.0\n";
    let left_out = "[[group]]\nname = \"wall\"\ntemperature = 300.0\n";
    let adiabatic = "[[group]]\nname = \"*\"\nflux = -5.0\n";
    let named_back = CORNER.replace("name     = \"wall\"", "name = \"back\"");
    let folder = scenes(&[
        ("corner.toml", CORNER),
        ("coloured.toml", &coloured),
        ("doubled.toml", doubled),
        ("cold.toml", cold),
        ("left-out.toml", left_out),
        ("adiabatic.toml", adiabatic),
        ("back.toml", &named_back),
    ]);
    for (words, message) in [
        ("coloured.toml --reflections", "choose --channel"),
        ("coloured.toml --sparse --export view3d", "one emissivity for each row; choose --channel"),
        ("corner.toml --groups doubled.toml", "patch 1 is in group \"a\" and in group \"b\""),
        ("corner.toml --groups missing.toml", "choose by-patch, by-surface, by-material"),
        ("corner.toml --groups by-surface --temperatures cold.toml", "write kelvin"),
        (
            "corner.toml --groups by-surface --temperatures left-out.toml",
            "nothing is given of group \"floor\"",
        ),
        ("corner.toml --groups by-surface --temperatures adiabatic.toml", "below 0 K"),
        ("corner.toml --tolerance 0.1 --pairs 0:7", "no pair of groups"),
        ("corner.toml --tolerance 2", "between 0 and 1"),
        ("corner.toml --pairs 0:1", "--tolerance"),
        ("corner.toml --paths 2", "has none for each of the 3 groups"),
        ("back.toml --groups by-surface", "rename the surface"),
    ] {
        let paths = if words.contains("--paths") { "" } else { " --paths 4096" };
        let (code, _, stderr) = factors(&folder, &format!("{words}{paths} --quiet --force --out out"));
        assert!(code == 2 && stderr.contains(message), "{words}: {code} {stderr}");
    }
    // Without reflections colour plays no part.
    let (code, _, stderr) = factors(&folder, "coloured.toml --paths 4096 --quiet --out out --force");
    assert_eq!(code, 0, "{stderr}");
}

/// Under a uniform sky a floor receives its emittance, less the part that a black wall hides: by every method, and at a sensor.
#[test]
fn a_sky_lights_an_open_scene() {
    let scene = CORNER.replace("patches  = [2, 1]", "").replace("reflectance = 0.8", "reflectance = 0.0")
        + "[sky]\nemittance = 100.0\n[[sensor]]\nname = \"desk\"\nquad = [[0.2,0.2,3], [0.8,0.2,3], [0.2,0.8,3]]\n";
    let folder = scenes(&[("open.toml", &scene)]);
    let job = path(&folder, "open.toml");
    let truth = 100.0 * (1.0 - PERPENDICULAR);
    for (name, set) in [
        ("shooting", "method.walk=shooting"),
        ("gathering", "method.walk=gathering"),
        ("sobol", "method.sampler=sobol"),
        ("jacobi", "method.walk=jacobi"),
    ] {
        let out = path(&folder, name);
        let given = ["--set", "scene.patches=given", "--set", "confidence=0.9999"];
        run_job(job.to_str().unwrap(), &out, &[&["--paths", "2e6", "--set", set][..], &given].concat());
        let table = columns(&out.join("patches.csv"));
        assert_eq!(table["surface"], ["floor", "wall", "sky", "sky", "sky", "sky", "sky", "sky"]);
        // The floor reflects half.
        let [low, high] = ["ci_low", "ci_high"].map(|column| numbers(&table[column])[0]);
        assert!(low <= 0.5 * truth && 0.5 * truth <= high, "{name}: {low} {high} {truth}");
        assert!(high - low < 0.03 * truth, "{name}: {low} {high}");
        let sensor = columns(&out.join("sensors.csv"));
        let [low, high] = ["ci_low", "ci_high"].map(|column| numbers(&sensor[column])[0]);
        assert!(low <= 100.0 && 100.0 <= high && high - low < 3.0, "{name}: {low} {high}");
    }
    let exact = path(&folder, "exact");
    let (code, _, stderr) =
        run(&["exact", job.to_str().unwrap(), "--quiet", "--out", exact.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let table = columns(&exact.join("exact.csv"));
    let [b, error] = ["radiosity", "radiosity_error"].map(|name| numbers(&table[name])[0]);
    assert!((b - 0.5 * truth).abs() <= error && error < 1e-3 * truth, "{b} {error} {truth}");
    let dark = scene.replace("emittance = 100.0", "emittance = 0.0");
    fs::write(&job, dark).unwrap();
    let (code, _, stderr) = run(&["check", job.to_str().unwrap()]);
    assert!(code == 2 && stderr.contains("the sky does not emit"), "{stderr}");
}
