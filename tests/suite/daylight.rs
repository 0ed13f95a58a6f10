//! `radwalk daylight` and `radwalk sky`: a year of daylight in a room with an opening, and skies in files.

use std::fs;
use std::path::Path;
use std::process::Stdio;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::support::{columns, finish, numbers, path, radwalk, run, wait_for};

/// A work plane in the open, and one below a roof that is black, with a reflecting wall at its side.
const SCENE: &str = r#"
[material.black]
reflectance = 0.0
[material.wall]
reflectance = 0.8

[[surface]]
name     = "roof"
material = "black"
sides    = 2
quad     = [[0,0,2], [3,0,2], [0,3,2]]

[[surface]]
name     = "wall"
material = "wall"
sides    = 2
quad     = [[0,3,0], [3,3,0], [0,3,2]]

[[sensor]]
name   = "open"
point  = [10, 0, 5]
normal = [0, 0, 1]

[[sensor]]
name    = "desk"
quad    = [[1,1,0.5], [2,1,0.5], [1,2,0.5]]
patches = [2, 2]

[[sensor]]
name   = "facade"
point  = [10, 0, 5]
normal = [0, -1, 0]
"#;

const WEATHER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/weather/made.epw");

/// The files whose bytes are a function of the job.
const FIGURES: [&str; 6] =
    ["annual.csv", "annual.ill", "annual-error.ill", "coefficients.mtx", "calendar.svg", "maps.svg"];

fn daylight(folder: &TempDir, out: &str, words: &str) -> (i32, String, String) {
    daylight_in(SCENE, folder, out, words)
}

fn daylight_in(text: &str, folder: &TempDir, out: &str, words: &str) -> (i32, String, String) {
    let (scene, out) = (path(folder, "scene.toml"), path(folder, out));
    fs::write(&scene, text).unwrap();
    let words = words.split_whitespace();
    let first = ["daylight", scene.to_str().unwrap(), "--weather", WEATHER, "--out", out.to_str().unwrap()];
    run(&first.into_iter().chain(words).collect::<Vec<_>>())
}

fn summary(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("daylight.json")).unwrap()).unwrap()
}

/// In the open the daylight factor is 100 %, within six standard errors; the light of dull hours is the product of both matrices, coefficients and skies, as `dctimestep`
/// would have it. Under the roof there is less, and ends of intervals enclose the figures. What faces up has a level.
#[test]
fn a_year_in_the_open_is_the_weather() {
    let folder = tempdir().unwrap();
    let (code, stdout, stderr) = daylight(&folder, "out", "--paths 4e6 --tolerance 0.03");
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("daylight of 6 places in 576 hours"), "{stdout}");
    let out = path(&folder, "out");
    let table = columns(&out.join("annual.csv"));
    let column = |name: &str| numbers(&table[name]);
    assert_eq!(table["sensor"], ["open", "desk", "desk", "desk", "desk", "facade"]);
    assert!((column("daylight_factor")[0] - 100.0).abs() < 2.0, "{:?}", column("daylight_factor"));
    for name in ["daylight_factor", "mean", "autonomy", "useful", "excess", "daylight_100", "daylight_750"] {
        let [low, value, high] = ["_low", "", "_high"].map(|end| column(&format!("{name}{end}")));
        assert!((0..6).all(|i| 0.0 <= low[i] && low[i] <= value[i] && value[i] <= high[i]), "{name}");
        assert!((1..5).all(|i| name == "useful" || value[i] <= value[0]), "{name}: {value:?}");
    }
    let lines = |name: &str| -> Vec<Vec<f64>> {
        let text = fs::read_to_string(out.join(name)).unwrap();
        text.lines().map(|line| line.split(' ').map(|x| x.parse().unwrap()).collect()).collect()
    };
    let (light, errors) = (lines("annual.ill"), lines("annual-error.ill"));
    let sky = path(&folder, "sky.mtx");
    let (code, _, stderr) =
        run(&["sky", "--weather", WEATHER, "--no-sun", "--ground", "0", "--out", sky.to_str().unwrap()]);
    assert_eq!(code, 0, "{stderr}");
    let numbers = mtx(&sky);
    assert_eq!((numbers.len(), numbers[0].len(), light.len(), light[0].len()), (146, 576, 6, 576));
    // Sky alone: hours without a beam are dull days of the file, the second half of each 48 hours.
    let factors = open_factors(&folder);
    for hour in (0..576).filter(|hour| hour % 48 >= 24) {
        let expected: f64 = (0..146).map(|j| 179.0 * factors[j] * numbers[j][hour]).sum();
        assert!(
            (light[0][hour] - expected).abs() < 0.02 + 1e-4 * expected,
            "{hour}: {} {expected}",
            light[0][hour]
        );
        assert!(
            (expected == 0.0) == (errors[0][hour] == 0.0) || expected < 1.0,
            "{hour}: {}",
            errors[0][hour]
        );
    }
    let summary = summary(&out);
    assert_eq!((summary["hours"].as_u64(), summary["patches"].as_u64()), (Some(576), Some(145)));
    assert_eq!((&summary["reached"], &summary["back"]), (&Value::Bool(true), &Value::from(0.0)));
    assert_eq!(mtx(&out.join("coefficients.mtx")).len(), 6);
    let levels = summary["levels"].as_array().unwrap();
    let planes: Vec<&Value> = levels.iter().map(|level| &level["sensor"]).collect();
    assert_eq!(planes, ["open", "desk"], "a facade has no level");
}

/// π·p of the plane in the open, patch by patch: π in all.
fn open_factors(folder: &TempDir) -> Vec<f64> {
    let coefficients = mtx(&path(folder, "out").join("coefficients.mtx"));
    let sum: f64 = coefficients[0].iter().sum();
    assert!((sum - std::f64::consts::PI).abs() < 1e-5, "{sum}");
    coefficients[0].clone()
}

/// The rows of a matrix in text, one of its three components.
fn mtx(file: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(file).unwrap();
    let (head, body) = text.split_once("\n\n").unwrap();
    let size = |key: &str| -> usize {
        head.lines().find_map(|line| line.strip_prefix(key)).unwrap().parse().unwrap()
    };
    let numbers: Vec<f64> = body.split_whitespace().step_by(3).map(|x| x.parse().unwrap()).collect();
    assert_eq!(numbers.len(), size("NROWS=") * size("NCOLS="));
    numbers.chunks(size("NCOLS=")).map(<[f64]>::to_vec).collect()
}

/// Numbers are those of any number of workers and threads, another seed has others, and results are not replaced unasked.
#[test]
fn workers_and_threads_play_no_part() {
    let folder = tempdir().unwrap();
    for (out, words) in [
        ("one", "--workers 1"),
        ("three", "--workers 3 --threads 2 --set budget.stream_paths=777"),
        ("seed", "--workers 1 --seed 9"),
    ] {
        let (code, _, stderr) = daylight(&folder, out, &format!("--paths 2e5 --tolerance 0.2 {words}"));
        assert_eq!(code, 0, "{stderr}");
    }
    let bytes = |out: &str, file: &str| fs::read(path(&folder, out).join(file)).unwrap();
    for file in FIGURES {
        assert!(bytes("one", file) == bytes("three", file), "{file}");
    }
    assert!(bytes("one", "annual.csv") != bytes("seed", "annual.csv"));
    let (code, _, stderr) = daylight(&folder, "one", "--paths 2e5");
    assert!(code == 2 && stderr.contains("--force"), "{code}: {stderr}");
}

/// A coordinator that is killed goes on from the counts of its last round, with workers that were started elsewhere: the bytes are those of a run that
/// was let alone. Counts of another question are refused.
#[test]
fn a_killed_count_goes_on() {
    let folder = tempdir().unwrap();
    let words = "--paths 2e7 --tolerance 1e-4";
    let (code, _, stderr) = daylight(&folder, "whole", words);
    assert_eq!(code, 1, "the budget ends it: {stderr}");
    let (out, access) = (path(&folder, "killed"), path(&folder, "access.json"));
    let start = |more: &[&str]| {
        let mut command = radwalk();
        command.arg("daylight").arg(path(&folder, "scene.toml")).args(["--weather", WEATHER, "--quiet"]);
        command.args(words.split(' ')).args(["--listen", "127.0.0.1:0", "--access"]).arg(&access);
        command.arg("--out").arg(&out).args(more);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let work =
        || radwalk().args(["work", "--quiet", "--wait", "60", "--access"]).arg(&access).spawn().unwrap();
    let mut coordinator = start(&[]);
    wait_for("the access file", || access.exists().then_some(()));
    let workers = [work(), work()];
    let counts = out.join("daylight.counts.json");
    wait_for("the first round", || counts.exists().then_some(()));
    coordinator.kill().unwrap();
    coordinator.wait().unwrap();
    assert!(!out.join("annual.csv").exists(), "the coordinator was killed too late");
    let coordinator = start(&["--resume"]);
    assert_eq!(finish(coordinator).0, 1);
    workers.into_iter().for_each(|worker| _ = finish(worker));
    for file in FIGURES {
        let [whole, killed] = ["whole", "killed"].map(|out| fs::read(path(&folder, out).join(file)).unwrap());
        assert!(whole == killed, "{file}");
    }
    let (code, _, stderr) = daylight(&folder, "killed", &format!("{words} --resume --seed 7"));
    assert!(code == 2 && stderr.contains("other surfaces, sensors, seed"), "{stderr}");
    fs::write(&counts, fs::read_to_string(&counts).unwrap().replacen('[', "[1,", 1)).unwrap();
    let (code, _, stderr) = daylight(&folder, "killed", &format!("{words} --resume"));
    assert!(code == 2 && stderr.contains("not those of the places"), "{stderr}");
}

/// Counts are gone on with for a closer tolerance, from more paths, or under another weather; a place inside of a box, which no sky reaches, is told and keeps no
/// tolerance from being met.
#[test]
fn counts_serve_other_questions_of_the_same_walks() {
    let folder = tempdir().unwrap();
    let side = |quad: &str| format!("[[surface]]\nmaterial = \"black\"\nsides = 2\nquad = {quad}\n");
    let box_around_a_point = [
        side("[[4,4,0], [5,4,0], [4,5,0]]"),
        side("[[4,4,1], [5,4,1], [4,5,1]]"),
        side("[[4,4,0], [5,4,0], [4,4,1]]"),
        side("[[4,5,0], [5,5,0], [4,5,1]]"),
        side("[[4,4,0], [4,5,0], [4,4,1]]"),
        side("[[5,4,0], [5,5,0], [5,4,1]]"),
    ];
    let inside = "[[sensor]]\nname = \"inside\"\npoint = [4.5, 4.5, 0.5]\nnormal = [0, 0, 1]\n";
    let scene = [SCENE, &box_around_a_point.concat(), inside].concat();
    let count = |words: &str| daylight_in(&scene, &folder, "out", words);
    let (code, _, stderr) = count("--paths 3e5 --tolerance 0.3");
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains(
            "1 place has less than 1 % of the median's light, the darkest at [4.500, 4.500, 0.500]"
        ),
        "{stderr}"
    );
    let walks = || summary(&path(&folder, "out"))["walks"].as_u64().unwrap();
    let few = walks();
    let (code, _, stderr) = count("--paths 3e5 --tolerance 0.01 --resume");
    assert!(code == 1 && stderr.contains("give more --paths, with --resume"), "{stderr}");
    let (code, _, stderr) = count("--paths 1e7 --tolerance 0.01 --resume");
    assert!(code == 0 && walks() > 2 * few, "{stderr}");
    let all = walks();
    let (code, _, stderr) = count("--paths 1e7 --tolerance 0.3 --resume --ground 0.5");
    assert!(code == 0 && walks() == all, "{stderr}");
}

/// A blind below the sky passes a part of it on: the daylight factor of a place below a wide one is its transmittance, within four standard errors of 262,144
/// walks, wherever it looks from. Other commands refuse it, and so do surfaces that cannot be.
#[test]
fn a_blind_passes_diffuse_light() {
    let folder = tempdir().unwrap();
    let scene = |sides: u32, transmittance: f64| {
        format!(
            r#"
            [material.blind]
            reflectance   = 0.5
            transmittance = {transmittance}
            emittance     = 1.0
            [[surface]]
            name     = "blind"
            material = "blind"
            sides    = {sides}
            quad     = [[-1e6,-1e6,2], [1e6,-1e6,2], [-1e6,1e6,2]]
            [[sensor]]
            name   = "below"
            point  = [0, 0, 0]
            normal = [0, 0, 1]
            "#
        )
    };
    let file = path(&folder, "blind.toml");
    let file = file.to_str().unwrap();
    fs::write(file, scene(2, 0.3)).unwrap();
    let out = path(&folder, "out");
    let words =
        ["--weather", WEATHER, "--paths", "262144", "--tolerance", "1e-4", "--ground", "0", "--quiet"];
    let words = [&["daylight", file, "--out", out.to_str().unwrap()][..], &words].concat();
    let (code, _, stderr) = run(&[&words[..], &["--export", "npz,parquet,float-mtx"]].concat());
    assert_eq!(code, 1, "{stderr}");
    let factor = numbers(&columns(&out.join("annual.csv"))["daylight_factor"])[0];
    // Three of ten walks see the sky; each brings L/(7/9) with L = (1 + 2 sin γ)/3, whose mean square is 51/49.
    assert!((factor - 30.0).abs() < 4.0 * 100.0 * (0.3_f64 * 51.0 / 49.0 / 262_144.0).sqrt(), "{factor}");
    assert!(fs::read(out.join("daylight.npz")).unwrap().starts_with(b"PK"));
    assert!(fs::read(out.join("daylight.parquet")).unwrap().starts_with(b"PAR1"));
    let [text, binary] = ["coefficients.mtx", "coefficients.float.mtx"]
        .map(|name| sky::Matrix::read(&fs::read(out.join(name)).unwrap()).unwrap());
    assert_eq!((text.rows, text.columns), (1, 146));
    assert_eq!((text.rows, text.columns), (binary.rows, binary.columns));
    assert!(text.numbers.iter().zip(&binary.numbers).all(|(a, b)| *a as f32 == *b as f32));
    for command in ["run", "exact", "factors"] {
        let out = path(&folder, command);
        let (code, _, stderr) = run(&[command, file, "--out", out.to_str().unwrap()]);
        assert!(code == 2 && stderr.contains("remove `transmittance`"), "{command}: {code} {stderr}");
    }
    for (sides, transmittance, said) in
        [(1, 0.3, "write sides = 2"), (2, 0.5, "add up to 1"), (2, -0.1, "[0, 1)")]
    {
        fs::write(file, scene(sides, transmittance)).unwrap();
        let (code, _, stderr) = run(&[&words[..], &["--force"]].concat());
        assert!(code == 2 && stderr.contains(said), "{stderr}");
    }
}

#[test]
fn what_cannot_be_is_refused_in_words() {
    let folder = tempdir().unwrap();
    let refused = |words: &str, said: &str| {
        let (code, _, stderr) = daylight(&folder, "out", words);
        assert!(code == 2 && stderr.contains(said), "{words}: {code}, {stderr}");
    };
    refused("--sky-patches 146", "145, 577 or 2305");
    refused("--paths 1000", "give more --paths");
    let broken = path(&folder, "broken.epw");
    let text = fs::read_to_string(WEATHER).unwrap().replacen("2001,2,10,13", "2001,2,31,13", 1);
    fs::write(&broken, text).unwrap();
    let scene = path(&folder, "scene.toml");
    let (code, _, stderr) =
        run(&["daylight", scene.to_str().unwrap(), "--weather", broken.to_str().unwrap()]);
    assert!(code == 2 && stderr.contains("broken.epw:69: there is no day 31 in month 2"), "{stderr}");
    let cut = fs::read_to_string(WEATHER).unwrap().lines().take(100).collect::<Vec<_>>().join("\n");
    fs::write(&broken, cut).unwrap();
    let out = path(&folder, "cut");
    let (code, _, stderr) = run(&[
        "daylight",
        scene.to_str().unwrap(),
        "--weather",
        broken.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
        "--paths",
        "1e5",
        "--tolerance",
        "0.5",
        "--set",
        "target.relative_error=0.5",
    ]);
    assert!(code < 2 && stderr.contains("its header says 12/20"), "{code} {stderr}");
    assert!(stderr.contains("has no part in daylight: targets"), "{stderr}");
    let (code, _, stderr) = run(&["sky", "--cie", "17"]);
    assert!(code == 2 && stderr.contains("17"), "{stderr}");
    let (code, _, stderr) = run(&["sky", "--weather", WEATHER, "--altitude", "30", "--out", "x"]);
    assert!(code == 2 && stderr.contains("cannot be used with"), "{stderr}");
}

/// The commands of the guide run as they stand, and the first prints what the page says but for the time it takes.
#[test]
fn the_guide_of_daylight_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/guide/daylight.md")).unwrap();
    let blocks = |language: &str| -> Vec<String> {
        let fence = format!("```{language}\n");
        page.split(&*fence).skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
    };
    let folder = tempdir().unwrap();
    let mut printed = Vec::new();
    let commands: Vec<String> = blocks("sh").concat().lines().map(str::to_owned).collect();
    for (number, line) in commands.iter().enumerate() {
        let out = path(&folder, &format!("out{number}"));
        let mut words: Vec<&str> = line.split_whitespace().skip(1).collect();
        words.truncate(words.iter().position(|word| *word == "--out").unwrap_or(words.len()));
        let (code, stdout, stderr) = run(&[&words[..], &["--out", out.to_str().unwrap()]].concat());
        assert_eq!(code, 0, "{line}: {stderr}");
        printed.push(stdout);
    }
    let timeless = |text: &str| -> Vec<String> {
        text.lines().map(|line| line.split(" walks in ").next().unwrap().to_owned()).collect()
    };
    let expected = timeless(&blocks("text")[0]);
    assert_eq!(commands.len(), 3);
    assert_eq!(timeless(&printed[0])[..expected.len()], expected);
}
