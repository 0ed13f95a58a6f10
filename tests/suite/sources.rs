//! Sources, mixtures and sensitivities as users meet them: tables, workers that come and go, and what is refused.

use std::path::{Path, PathBuf};

use crate::support::{answer, columns, numbers, path, run, run_job, storms_leave_no_trace};
use tempfile::{TempDir, tempdir};

/// A coloured room with two two-sided lamps, and a cell of the ceiling that emits.
const ROOM: &str = include_str!("../../configs/scenes/lamps.toml");

const SOURCES: &str = r#"
[[source]]
name = "left"
surfaces = ["lamp-left"]
[[source]]
name = "right"
surfaces = ["*-right"]
"#;

const SENSITIVITY: &str = "
[sensitivity]
materials = \"all\"
";

/// The room, in a job with these tables.
fn room(folder: &TempDir, tables: &str) -> PathBuf {
    let scene = folder.path().join("scene.toml");
    std::fs::write(scene, ROOM).unwrap();
    let job = "scene = \"scene.toml\"\nseed = 42\n[method]\nwalk = \"shooting\"\n[budget]\npaths = 200_000\nstream_paths = 5000\n";
    let path = folder.path().join("room.toml");
    std::fs::write(&path, format!("{job}{tables}")).unwrap();
    path
}

fn shot(job: &Path, out: &Path, args: &[&str]) -> serde_json::Value {
    run_job(job.to_str().unwrap(), out, args)
}

/// What must not depend on how a job was run, with the tables of sources and sensitivities.
fn all(out: &Path) -> (String, [Vec<u8>; 3]) {
    let (hash, patches) = answer(out);
    let table = |name| std::fs::read(out.join(name)).unwrap();
    (hash, [patches, table("sources.csv"), table("sensitivities.csv")])
}

fn done(args: &[&str]) {
    let (code, _, stderr) = run(args);
    assert_eq!(code, 0, "{args:?}: {stderr}");
}

#[test]
fn workers_leave_no_trace_in_sources_nor_sources_in_patches() {
    let folder = tempdir().unwrap();
    let plain = path(&folder, "plain");
    for estimator in ["collision", "infinite"] {
        let set = ["--set", &format!("method.estimator={estimator}")];
        shot(&room(&folder, ""), &plain, &[&set[..], &["--force"]].concat());
        let job = room(&folder, &format!("{SOURCES}{SENSITIVITY}"));
        let [one, many, part, later, both] = ["one", "many", "part", "later", "both"]
            .map(|name| path(&folder, &format!("{name}-{estimator}")));
        let summary = shot(&job, &one, &[&set[..], &["--workers", "1"]].concat());
        assert!(answer(&plain).1 == answer(&one).1, "{estimator}: patches.csv");
        let names: Vec<&str> =
            (0..3).map(|source| summary["sources"][source]["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["left", "right", "rest"]);
        assert_eq!(summary["sensitivities"].as_array().unwrap().len(), 3, "{summary}");

        // Other leases, more workers, a run in two parts, and two runs that are merged.
        let leases = ["--workers", "3", "--set", "budget.stream_paths=1777"];
        shot(&job, &many, &[&set[..], &leases].concat());
        assert!(all(&many) == all(&one), "{estimator}: 3 workers");
        shot(&job, &part, &[&set[..], &["--paths", "80000"]].concat());
        shot(&job, &later, &[&set[..], &["--paths", "120000", "--set", "budget.first_path=80000"]].concat());
        done(&[
            "merge",
            part.to_str().unwrap(),
            later.to_str().unwrap(),
            "--out",
            both.to_str().unwrap(),
            "--quiet",
        ]);
        assert!(all(&both).1 == all(&one).1, "{estimator}: merged");
        shot(&job, &part, &[&set[..], &["--resume"]].concat());
        assert!(all(&part) == all(&one), "{estimator}: resumed");
        done(&["audit", part.to_str().unwrap(), "--share", "1", "--quiet"]);

        // The same files from the tally alone; a table that was changed is found.
        for file in ["sources.csv", "sensitivities.csv"] {
            let table = std::fs::read(one.join(file)).unwrap();
            std::fs::write(one.join(file), &table[1..]).unwrap();
            let (code, _, stderr) = run(&["audit", one.to_str().unwrap(), "--share", "0.01", "--quiet"]);
            assert!(code == 3 && stderr.contains(file), "{code} {stderr}");
            done(&["report", one.to_str().unwrap(), "--quiet"]);
            assert!(std::fs::read(one.join(file)).unwrap() == table, "{file}");
        }
    }
}

#[test]
fn workers_killed_at_random_leave_no_trace_in_sources() {
    let folder = tempdir().unwrap();
    let job = room(&folder, &format!("{SOURCES}{SENSITIVITY}"));
    storms_leave_no_trace(job.to_str().unwrap(), &["--paths", "3000000"]);
}

/// A sky is the source named `sky`: a lamp and a sky light a floor in the open, each alone as much as it does in a scene without
/// the other.
#[test]
fn the_sky_is_a_source() {
    let folder = tempdir().unwrap();
    let scene = "[material.floor]\nreflectance = 0.5\n[material.lamp]\nreflectance = 0.0\nemittance = 300.0\n\
        [[surface]]\nname = \"floor\"\nmaterial = \"floor\"\nquad = [[0,0,0], [1,0,0], [0,1,0]]\n\
        [[surface]]\nname = \"lamp\"\nmaterial = \"lamp\"\nquad = [[0,0,0], [0,1,0], [0,0,1]]\n\
        [sky]\nemittance = 100.0\n";
    std::fs::write(path(&folder, "scene.toml"), scene).unwrap();
    let job = "scene = \"scene.toml\"\nseed = 42\nconfidence = 0.9999\n[[source]]\nname = \"sky\"\nsurfaces = [\"sky\"]\n\
        [method]\nwalk = \"shooting\"\n[budget]\npaths = 2_000_000\n";
    std::fs::write(path(&folder, "job.toml"), job).unwrap();
    let out = path(&folder, "out");
    let summary = shot(&path(&folder, "job.toml"), &out, &[]);
    let names: Vec<&str> =
        (0..2).map(|source| summary["sources"][source]["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["sky", "rest"]);
    let table = columns(&out.join("sources.csv"));
    let perpendicular = 0.200_043_776_075_403_16;
    for (name, truth) in [("sky", 50.0 * (1.0 - perpendicular)), ("rest", 150.0 * perpendicular)] {
        let row = table["source"].iter().position(|source| source == name).unwrap();
        assert_eq!(table["patch"][row], "0");
        let [low, high] = ["ci_low", "ci_high"].map(|column| numbers(&table[column][row..=row])[0]);
        assert!(low <= truth && truth <= high, "{name}: {low} {high}, {truth}");
        assert!(high - low < 0.05 * truth, "{name}: {low} {high}, {truth}");
    }
}

/// Rows of a patch add up to its row in `patches.csv`, and the column of sides is there.
#[test]
fn the_tables_have_a_row_for_each_source_and_face() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    shot(&room(&folder, &format!("{SOURCES}{SENSITIVITY}")), &out, &[]);
    let (patches, sources) = (columns(&out.join("patches.csv")), columns(&out.join("sources.csv")));
    let faces = patches["patch"].len();
    assert_eq!(sources["source"].len(), 3 * faces);
    assert_eq!(sources["side"][..faces], patches["side"]);
    for channel in ["r", "g", "b"] {
        for column in ["emittance", "radiosity", "irradiance"] {
            let name = format!("{column}_{channel}");
            let (whole, parts) = (numbers(&patches[&name]), numbers(&sources[&name]));
            for (face, whole) in whole.iter().enumerate() {
                let sum: f64 = (0..3).map(|source| parts[source * faces + face]).sum();
                assert!((sum - whole).abs() <= 1e-12 * whole, "{name} of face {face}: {sum}, {whole}");
            }
        }
    }
    let text = std::fs::read_to_string(out.join("sensitivities.csv")).unwrap();
    assert!(
        text.starts_with("material,property,patch,side,derivative_r,derivative_g,derivative_b,std_error_r,")
    );
    let table = columns(&out.join("sensitivities.csv"));
    // Three materials by reflectance; by emittance the lamps, and the ceiling, whose one cell emits.
    assert_eq!(table["property"].iter().filter(|word| *word == "reflectance").count(), 3 * faces);
    assert_eq!(table["property"].iter().filter(|word| *word == "emittance").count(), 2 * faces);
    let [low, value, high] = ["ci_low_g", "derivative_g", "ci_high_g"].map(|column| numbers(&table[column]));
    for row in 0..value.len() {
        assert!(0.0 <= low[row] && low[row] <= value[row] && value[row] <= high[row], "row {row}");
    }
}

/// A mixture against a run of its scene: 34 faces in 3 channels, whose z² have a mean of 1 ± 0.14 were they independent.
#[test]
fn a_mixture_is_a_run_of_its_scene() {
    let folder = tempdir().unwrap();
    let (out, mix, fresh) = (path(&folder, "out"), path(&folder, "out-mix"), path(&folder, "fresh"));
    let job = room(&folder, SOURCES);
    shot(&job, &out, &["--paths", "400000"]);
    done(&["combine", out.to_str().unwrap(), "--set", "left=0.25", "--set", "rest=3", "--quiet"]);

    // The same scene by hand. Both lamps are of one material, so that the left one gets its own.
    let dimmed = ROOM
        .replace("emittance = 5.0", "emittance = 15.0")
        .replacen(
            "[material.lamp]",
            "[material.dim]\nreflectance = 0.2\nemittance = [2.25, 2, 1.75]\n[material.lamp]",
            1,
        )
        .replacen("\"lamp-left\"\nmaterial    = \"lamp\"", "\"lamp-left\"\nmaterial    = \"dim\"", 1);
    assert!(dimmed.contains("= \"dim\"") && dimmed.contains("15.0"), "{dimmed}");
    std::fs::write(folder.path().join("scene.toml"), dimmed).unwrap();
    shot(&job, &fresh, &["--paths", "400000", "--seed", "7"]);
    let (ours, theirs) = (columns(&mix.join("patches.csv")), columns(&fresh.join("patches.csv")));
    let (mut squares, mut count) = (0.0, 0.0);
    for channel in ["r", "g", "b"] {
        let of = |table: &std::collections::HashMap<String, Vec<String>>, name: &str| {
            numbers(&table[&format!("{name}_{channel}")])
        };
        assert_eq!(of(&ours, "emittance"), of(&theirs, "emittance"));
        let (b, c) = (of(&ours, "radiosity"), of(&theirs, "radiosity"));
        let (e, f) = (of(&ours, "std_error"), of(&theirs, "std_error"));
        for i in 0..b.len() {
            squares += (b[i] - c[i]).powi(2) / (e[i] * e[i] + f[i] * f[i]);
            count += 1.0;
        }
    }
    let z2 = squares / count;
    assert!((0.4..1.8).contains(&z2), "mean squared z {z2}");

    // The folder of a mixture is one of its own: it is audited, made again, and mixed again.
    let table = std::fs::read(mix.join("patches.csv")).unwrap();
    done(&["audit", mix.to_str().unwrap(), "--share", "0.1", "--quiet"]);
    done(&["report", mix.to_str().unwrap(), "--quiet"]);
    assert!(std::fs::read(mix.join("patches.csv")).unwrap() == table);
    let again = path(&folder, "again");
    done(&[
        "combine",
        mix.to_str().unwrap(),
        "--set",
        "left=1",
        "--set",
        "rest=1",
        "--out",
        again.to_str().unwrap(),
        "--quiet",
    ]);
    for file in ["patches.csv", "sources.csv"] {
        assert!(std::fs::read(again.join(file)).unwrap() == std::fs::read(out.join(file)).unwrap(), "{file}");
    }
}

#[test]
fn what_cannot_be_told_apart_is_refused() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let says = |job: &Path, set: &[&str], parts: &[&str]| {
        let given = [job.to_str().unwrap(), "--out", out.to_str().unwrap(), "--quiet"];
        let sets: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
        let (code, _, stderr) = run(&[&["run"], &given[..], &sets].concat());
        assert_eq!(code, 2, "{stderr}");
        parts.iter().for_each(|part| assert!(stderr.contains(part), "{part:?} is not in {stderr}"));
    };
    let job = room(&folder, SOURCES);
    says(&job, &["method.walk=gathering"], &["several sources", "walk = \"shooting\""]);
    says(&job, &["method.walk=jacobi"], &["chains", "walk = \"shooting\""]);
    says(&job, &["method.sampler=sobol"], &["batches", "sampler = \"random\""]);
    let source = |body: &str| room(&folder, &format!("[[source]]\nname = \"s\"\n{body}\n"));
    says(&source(""), &[], &["room.toml:8", "surfaces", "missing"]);
    says(&source("surfaces = [\"lamp-lefd\"]"), &[], &["room.toml:10", "did you mean \"lamp-left\""]);
    says(&source("materials = [\"lampe\"]"), &[], &["room.toml:10", "did you mean \"lamp\""]);
    says(&source("surfaces = [\"floor\"]"), &[], &["\"s\"", "no patch that emits"]);
    says(&source("surfaces = [99]"), &[], &["room.toml:10", "out of range"]);
    let twice = "materials = [\"lamp\"]\n[[source]]\nname = \"t\"\nsurfaces = [\"lamp-right\"]";
    says(&source(twice), &[], &["patch 17", "\"s\"", "\"t\"", "take it out of one"]);
    says(
        &room(&folder, "[[source]]\nname = \"rest\"\npatches = [1]"),
        &[],
        &["room.toml:9", "rest", "another"],
    );
    says(&room(&folder, "[source]\nname = \"s\"\npatches = [1]"), &[], &["room.toml", "[[source]]"]);
    let cut = room(&folder, SENSITIVITY);
    let set = ["method.estimator=infinite", "method.infinite.end=cutoff"];
    says(&cut, &set, &["cut off", "roulette"]);
    says(&room(&folder, "[sensitivity]\nmaterials = []"), &[], &["names no material", "room.toml:9"]);
}

/// Before a pilot walks: nothing is chosen, and no folder is made.
#[test]
fn a_source_that_cannot_be_is_refused_at_once() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let job = room(&folder, "[[source]]\nname = \"dark\"\nsurfaces = [\"floor\"]\n");
    let (code, _, stderr) =
        run(&["run", job.to_str().unwrap(), "--set", "scene.patches=auto", "--out", out.to_str().unwrap()]);
    assert!(code == 2 && stderr.contains("no patch that emits"), "{code} {stderr}");
    assert!(!stderr.contains("chosen") && !out.exists(), "{stderr}");
}

#[test]
fn factors_that_cannot_be_are_refused() {
    let folder = tempdir().unwrap();
    let (plain, out) = (path(&folder, "plain"), path(&folder, "out"));
    shot(&room(&folder, ""), &plain, &["--paths", "5000"]);
    shot(&room(&folder, SOURCES), &out, &["--paths", "5000"]);
    let says = |run_folder: &Path, set: &[&str], part: &str| {
        let sets = set.iter().flat_map(|set| ["--set", set]);
        let args: Vec<&str> = ["combine", run_folder.to_str().unwrap()].into_iter().chain(sets).collect();
        let (code, _, stderr) = run(&args);
        assert!(code == 2 && stderr.contains(part), "{code} {stderr}");
    };
    says(&plain, &["left=1"], "a [[source]] table");
    says(&out, &["lef=1"], "no source \"lef\"); choose from left, right, rest");
    says(&out, &["left=-1"], "-1 is no factor");
    says(&out, &["left=nan"], "NaN is no factor");
    says(&out, &["left=1", "left=2"], "set twice");
    says(&out, &["left=0", "right=0", "rest=0"], "nothing emits");
    says(&out, &["left=1e308", "rest=1e308"], "choose other factors");
    says(&out, &["left"], "NAME=FACTOR");
    says(&path(&folder, "nowhere"), &["left=1"], "nowhere");
    assert!(!path(&folder, "out-mix").exists());
}

/// Of two closed rooms with a lamp each, mixtures that change the lamp of one leave the readings and patches of the other as well known as they were: a lamp that
/// brings nothing there has no error of its own, and what may have stayed out of it is little after 200,000 walks. In colour a lamp
/// without red takes no part in red at all.
#[test]
fn lamps_of_other_rooms_take_no_part() {
    let folder = tempdir().unwrap();
    let room = |number: usize| {
        let x = 2.0 * number as f64;
        let quads = [
            format!("[[{x},0,0], [{},0,0], [{x},1,0]]", x + 1.0),
            format!("[[{x},0,1], [{x},1,1], [{},0,1]]", x + 1.0),
            format!("[[{x},0,0], [{x},1,0], [{x},0,1]]"),
            format!("[[{0},0,0], [{0},0,1], [{0},1,0]]", x + 1.0),
            format!("[[{x},0,0], [{x},0,1], [{},0,0]]", x + 1.0),
            format!("[[{x},1,0], [{},1,0], [{x},1,1]]", x + 1.0),
        ];
        let surface = |(side, quad): (usize, &String)| {
            let material = if side == 1 { format!("lamp-{number}") } else { "white".into() };
            format!("[[surface]]\nname = \"r{number}-{side}\"\nmaterial = \"{material}\"\nquad = {quad}\n")
        };
        let sensor = format!(
            "[[sensor]]\nname = \"desk{number}\"\nquad = [[{0},0.2,0.3], [{1},0.2,0.3], [{0},0.8,0.3]]\n",
            x + 0.2,
            x + 0.8
        );
        quads.iter().enumerate().map(surface).collect::<String>() + &sensor
    };
    let materials = "[material.white]\nreflectance = 0.5\n[material.lamp-0]\nreflectance = 0.5\nemittance = 10.0\n\
                     [material.lamp-1]\nreflectance = 0.5\nemittance = [0.0, 0.0, 10.0]\n";
    std::fs::write(folder.path().join("rooms.toml"), [materials, &room(0), &room(1)].concat()).unwrap();
    let job = "scene = \"rooms.toml\"\nseed = 1\n[method]\nwalk = \"shooting\"\nbasis = \"constant\"\n[budget]\npaths = 200_000\n\
               [[source]]\nname = \"a\"\nsurfaces = [\"r0-1\"]\n[[source]]\nname = \"b\"\nsurfaces = [\"r1-1\"]\n";
    let (file, run_out) = (folder.path().join("job.toml"), path(&folder, "run"));
    std::fs::write(&file, job).unwrap();
    shot(&file, &run_out, &[]);
    let width = |out: &Path, table: &str, quantity: &str, channel: &str, row: usize| {
        let columns = columns(&out.join(table));
        let [low, high] =
            ["low", "high"].map(|end| numbers(&columns[&format!("{quantity}_{end}_{channel}")])[row]);
        high - low
    };
    for factor in ["0.5", "10", "1000"] {
        let mixed = path(&folder, factor);
        done(&[
            "combine",
            run_out.to_str().unwrap(),
            "--set",
            &format!("b={factor}"),
            "--out",
            mixed.to_str().unwrap(),
        ]);
        for (table, quantity) in [("sensors.csv", "ci"), ("patches.csv", "irradiance")] {
            let widths =
                |channel: &str| [&run_out, &mixed].map(|out| width(out, table, quantity, channel, 0));
            let [before, after] = widths("r");
            assert!(after < 1.001 * before, "red, {factor}, {table}: {before} {after}");
            // Of 200,000 walks none has come from room 1, whose lamp is `factor` times as bright as the other.
            let [before, after] = widths("b");
            let unmet = 2e-3 * factor.parse::<f64>().unwrap();
            assert!(after < 1.01 * before.hypot(2.0 * unmet), "blue, {factor}, {table}: {before} {after}");
        }
        let sensors = columns(&mixed.join("sensors.csv"));
        assert!(["r", "b"].iter().all(|c| !sensors[&format!("std_error_{c}")][0].is_empty()), "{sensors:?}");
    }
}
