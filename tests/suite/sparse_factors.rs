//! `radwalk factors --sparse`: rows counted one by one, whatever counts them, and the files that are made of them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::factors::CORNER;
use crate::support::{columns, numbers, path, radwalk, run};

/// A folder with the corner: a floor of `cells` × `cells` cells, and a wall of 2 × 3.
fn folder(cells: u32) -> TempDir {
    let folder = tempdir().unwrap();
    let scene = CORNER.replace("[2, 1]", &format!("[{cells}, {cells}]")) + "patches  = [2, 3]\n";
    fs::write(path(&folder, "corner.toml"), scene).unwrap();
    folder
}

/// The arguments that count the corner's rows into a folder.
fn words(folder: &TempDir, out: &str, more: &str) -> Vec<String> {
    let at = |name| path(folder, name).to_str().unwrap().to_owned();
    let more = more.split_whitespace().map(String::from);
    ["factors".to_owned(), at("corner.toml"), "--sparse".into(), "--quiet".into(), "--out".into(), at(out)]
        .into_iter()
        .chain(more)
        .collect()
}

/// Counts the corner's rows; the exit code, and what was said on stderr.
fn count(folder: &TempDir, out: &str, more: &str) -> (i32, String) {
    let words = words(folder, out, more);
    let (code, _, stderr) = run(&words.iter().map(String::as_str).collect::<Vec<_>>());
    (code, stderr)
}

/// The entries of `factors.mtx`, and its size.
fn matrix(out: &Path) -> (BTreeMap<(usize, usize), f64>, [usize; 3]) {
    let text = fs::read_to_string(out.join("factors.mtx")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('%'));
    let whole = |line: &str| -> Vec<f64> { line.split(' ').map(|word| word.parse().unwrap()).collect() };
    let size = whole(lines.next().unwrap());
    let entry = |line| {
        let numbers = whole(line);
        ((numbers[0] as usize - 1, numbers[1] as usize - 1), numbers[2])
    };
    (lines.map(entry).collect(), [size[0] as usize, size[1] as usize, size[2] as usize])
}

/// The sums of rows, forwards.
fn sums(entries: &BTreeMap<(usize, usize), f64>, rows: usize) -> Vec<f64> {
    let mut sums = vec![0.0; rows];
    entries.iter().for_each(|((row, _), factor)| sums[*row] += factor);
    sums
}

fn summary(out: &Path) -> Value {
    serde_json::from_slice(&fs::read(out.join("factors.json")).unwrap()).unwrap()
}

/// The walks of a row are those of the same row among dense groups, also after reflections.
#[test]
fn rows_are_those_of_the_dense_table() {
    let folder = folder(4);
    for kind in ["", "--reflections"] {
        // A budget of eight times as many walks, at a tolerance that the first look reaches.
        let corner = path(&folder, "corner.toml");
        let budget = (22 * 8 * 1024).to_string();
        let dense = path(&folder, &format!("dense{kind}"));
        let mut words = vec!["factors", corner.to_str().unwrap(), "--quiet", "--paths", &budget];
        words.extend(["--tolerance", "0.99", "--out", dense.to_str().unwrap()]);
        words.extend(kind.split_whitespace());
        assert_eq!(run(&words).0, 0);
        let walks = numbers(&columns(&dense.join("groups.csv"))["walks"]);
        assert!(walks.iter().all(|walks| *walks == 1024.0), "{walks:?}");
        let sparse = format!("sparse{kind}");
        assert_eq!(count(&folder, &sparse, &format!("--rays 1024 {kind}")).0, 0);
        let (entries, size) = matrix(&path(&folder, &sparse));
        assert_eq!(size, [22, 24, entries.len()]);
        let table = numbers(&columns(&dense.join("factors.csv"))["factor"]);
        for (place, factor) in table.iter().enumerate() {
            let found = entries.get(&(place / 24, place % 24)).copied().unwrap_or(0.0);
            assert_eq!(found, *factor, "{kind} row {} column {}", place / 24, place % 24);
        }
    }
}

/// A floor and a wall that repeat along y, beside a floor that does not: what the wall's neighbours take does not escape. Rows of other steps
/// are no rows to go on from, and steps shorter than the scene are refused.
#[test]
fn a_scene_repeats() {
    let folder = folder(2);
    let escaped = |out: &str| summary(&path(&folder, out))["escape"].as_f64().unwrap();
    assert_eq!(count(&folder, "one", "--rays 4096").0, 0);
    assert_eq!(count(&folder, "endless", "--rays 4096 --periodic 0,1").0, 0);
    assert!(escaped("endless") < escaped("one") - 0.05, "{} {}", escaped("endless"), escaped("one"));
    let (entries, size) = matrix(&path(&folder, "endless"));
    assert!(sums(&entries, size[0]).iter().all(|sum| *sum == 1.0));
    assert_eq!(summary(&path(&folder, "endless"))["periods"], serde_json::json!([0.0, 1.0]));
    let (code, stderr) = count(&folder, "endless", "--rays 4096 --periodic 0,2 --resume");
    assert!(code == 2 && stderr.contains("other surfaces"), "{stderr}");
    let (code, stderr) = count(&folder, "short", "--rays 64 --periodic 0,0.25");
    assert!(code == 2 && stderr.contains("long in y"), "{stderr}");
    let (code, stderr) = count(&folder, "wrong", "--rays 64 --periodic 3");
    assert!(code == 2 && stderr.contains("write 30,20"), "{stderr}");
}

/// The same bytes of all files by one thread and by five, in three parts that are joined, and after twenty kills at any moment.
#[test]
fn the_rows_are_a_function_of_the_job() {
    let folder = folder(40);
    let job = "--rays 3000 --smooth --export mtx,npz,parquet,view3d,udales,udales-netcdf,energyplus,openfoam";
    assert_eq!(count(&folder, "one", &format!("{job} --workers 1")).0, 0);
    assert_eq!(count(&folder, "five", &format!("{job} --workers 5")).0, 0);
    for part in 1..=3 {
        assert_eq!(count(&folder, &format!("part{part}"), &format!("{job} --part {part}/3")).0, 0);
    }
    let at = |name: &str| path(&folder, name).to_str().unwrap().to_owned();
    let parts = [at("part2"), at("part3"), at("part1")].join(",");
    let (code, stderr) = count(&folder, "joined", &format!("{job} --join {parts}"));
    assert_eq!(code, 0, "{stderr}");
    let start = |resume: &str| -> Child {
        let words = words(&folder, "killed", &format!("{job} --workers 2 {resume}"));
        radwalk().args(words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    };
    let mut resume = "";
    for kill in 0..20 {
        let mut child = start(resume);
        std::thread::sleep(Duration::from_millis(5 + 13 * kill % 170));
        child.kill().unwrap();
        child.wait().unwrap();
        // A torn row, as a loss of power leaves it.
        let rows = path(&folder, "killed").join("factors.rows");
        if let Ok(file) = fs::OpenOptions::new().write(true).open(&rows) {
            let length = file.metadata().unwrap().len();
            file.set_len(length.saturating_sub(kill % 3).max(600.min(length))).unwrap();
            resume = "--resume";
        }
    }
    assert!(start(resume).wait().unwrap().success());
    let files =
        ["factors.rows", "factors.mtx", "factors.npz", "factors.vf", "vfsparse.inp", "vf.nc.inp", "svf.inp"];
    let others = ["factors.idf", "F", "globalFaceFaces", "subMap", "constructMap", "constructMapDim"];
    let more = ["groups.csv", "smoothed.npz", "factors.parquet"];
    for file in files.iter().chain(&others).chain(&more) {
        let read = |out: &str| fs::read(path(&folder, out).join(file)).unwrap();
        let one = read("one");
        for other in ["five", "joined", "killed"] {
            assert!(read(other) == one, "{file} of {other}");
        }
    }
    let reflected = ["1", "5"].map(|workers| {
        let out = format!("reflected-{workers}");
        let words = format!("--rays 1000 --reflections --smooth --export npz --workers {workers}");
        assert_eq!(count(&folder, &out, &words).0, 0);
        ["factors.rows", "factors.npz", "smoothed.npz"]
            .map(|file| fs::read(path(&folder, &out).join(file)).unwrap())
    });
    assert!(reflected[0] == reflected[1], "rows with reflections");
    // Parts that are not all, and rows of another question.
    let two = [at("part1"), at("part3")].join(",");
    let (code, stderr) = count(&folder, "torn", &format!("{job} --join {two}"));
    assert!(code == 2 && stderr.contains("in none of the folders"), "{stderr}");
    let (code, stderr) = count(&folder, "one", "--rays 3001 --reflections --resume");
    assert!(code == 2 && stderr.contains("other surfaces, groups, seed"), "{stderr}");
}

/// What is dropped is said, and stands in a column of its own, so that rows add up to 1; the rows that are kept have all of it.
#[test]
fn rows_add_up_to_one_and_say_what_was_dropped() {
    let folder = folder(8);
    assert_eq!(count(&folder, "out", "--rays 3000").0, 0);
    let out = path(&folder, "out");
    let (all, [rows, columns, _]) = matrix(&out);
    assert!(sums(&all, rows).iter().all(|sum| (sum - 1.0).abs() < 1e-12));
    // The same rows, from the file, with a threshold.
    assert_eq!(count(&folder, "out", "--rays 3000 --drop 0.004 --resume").0, 0);
    let (kept, [_, wider, _]) = matrix(&out);
    assert_eq!(wider, columns + 1);
    assert!(sums(&kept, rows).iter().all(|sum| (sum - 1.0).abs() < 1e-12));
    let small = all.iter().filter(|((_, column), factor)| *column < rows && **factor < 0.004);
    let (number, sum) = small.fold((0, 0.0), |(number, sum), (_, factor)| (number + 1, sum + factor));
    let dropped = &summary(&out)["dropped"];
    assert!(number > 20, "there is nothing to drop");
    assert_eq!(dropped["entries"], number);
    assert!((dropped["mean"].as_f64().unwrap() * rows as f64 - sum).abs() < 1e-12);
    let rest: f64 = kept.iter().filter(|((_, column), _)| *column == columns).map(|(_, factor)| factor).sum();
    assert!((rest - sum).abs() < 1e-12, "{rest} {sum}");
    assert!(
        kept.iter().filter(|((_, column), _)| *column < columns).all(|(at, x)| (all[at] - x).abs() < 1e-15)
    );
}

/// Rows end at their error, each when it is known so well; the most walks end those that are not.
#[test]
fn rows_end_at_an_error() {
    let folder = folder(2);
    assert_eq!(count(&folder, "out", "--tolerance 0.1 --rays 1000000").0, 0);
    let walks = numbers(&columns(&path(&folder, "out").join("groups.csv"))["walks"]);
    assert!(walks.iter().all(|walks| *walks < 1e6 && *walks >= 1024.0), "{walks:?}");
    assert!(walks.iter().any(|other| *other != walks[0]), "{walks:?}");
    assert_eq!(summary(&path(&folder, "out"))["unreached"], 0);
    let (code, _) = count(&folder, "out2", "--tolerance 0.01 --rays 2000");
    assert_eq!((code, summary(&path(&folder, "out2"))["unreached"].as_u64()), (1, Some(10)));
}

/// Of all walks together rows have shares by area and variance, which make more of them: the variance by area, times the walks, falls. The
/// floor is 1 patch of 1 m², the wall has 1,024.
#[test]
fn walks_go_where_area_and_variance_are() {
    let folder = folder(1);
    let scene = CORNER.replace("patches  = [2, 1]", "") + "patches  = [32, 32]\n";
    fs::write(path(&folder, "corner.toml"), scene).unwrap();
    assert_eq!(count(&folder, "equal", "--rays 1000").0, 0);
    assert_eq!(count(&folder, "shared", "--paths 1025000").0, 0);
    let walks = numbers(&columns(&path(&folder, "shared").join("groups.csv"))["walks"]);
    let total: f64 = walks.iter().sum();
    assert!(total <= 1_025_000.0 && total > 0.5 * 1_025_000.0, "{total}");
    // √1 m² beside 1,024 · √(1/1,024) m²: the floor has a thirty-third of all, of which it takes √V = 0.6, for 0.8 of its walks escape.
    assert!((walks[0] / (0.6 * 1_025_000.0 / 33.0) - 1.0).abs() < 0.02, "{}", walks[0]);
    let cost = |out: &str| {
        let summary = summary(&path(&folder, out));
        summary["error"].as_f64().unwrap().powi(2) * summary["walks"].as_f64().unwrap()
    };
    let gain = cost("shared") / cost("equal");
    println!("{gain} {total}");
    assert!(gain < 0.75, "{gain}");
    // The same rows by more threads; other shares are another question.
    assert_eq!(count(&folder, "threads", "--paths 1025000 --workers 3").0, 0);
    let rows = |out: &str| fs::read(path(&folder, out).join("factors.rows")).unwrap();
    assert!(rows("shared") == rows("threads"), "rows depend on threads");
    let (code, stderr) = count(&folder, "threads", "--paths 1025001 --resume");
    assert!(code == 2 && stderr.contains("other surfaces, groups, seed"), "{stderr}");
}

/// Smoothed rows add up to 1 and are reciprocal; the counted ones are kept.
#[test]
fn smoothed_rows_are_reciprocal() {
    let folder = folder(6);
    assert_eq!(count(&folder, "raw", "--rays 3000").0, 0);
    assert_eq!(count(&folder, "out", "--rays 3000 --smooth").0, 0);
    let [raw, out] = ["raw", "out"].map(|name| path(&folder, name));
    assert!(fs::read(raw.join("factors.rows")).unwrap() == fs::read(out.join("factors.rows")).unwrap());
    let (factors, [rows, _, _]) = matrix(&out);
    assert!(sums(&factors, rows).iter().all(|sum| (sum - 1.0).abs() < 1e-12));
    let areas = numbers(&columns(&out.join("groups.csv"))["area"]);
    let defect = |factors: &BTreeMap<(usize, usize), f64>| {
        let inner = factors.iter().filter(|((_, column), _)| *column < rows);
        let pair = |((i, j), factor): (&(usize, usize), &f64)| {
            let back = factors.get(&(*j, *i)).copied().unwrap_or(0.0);
            (areas[*i] * factor - areas[*j] * back).abs()
        };
        inner.map(pair).fold(0.0, f64::max)
    };
    let (counted, _) = matrix(&raw);
    assert!(defect(&factors) < 1e-14 && defect(&counted) > 1e-5, "{} {}", defect(&factors), defect(&counted));
    // 95 % of the intervals hold the truth, which these are nearer to.
    let smoothing = &summary(&out)["smoothing"];
    assert!(smoothing["outside"].as_u64().unwrap() < factors.len() as u64 / 20, "{smoothing}");
    assert_eq!(summary(&raw)["smoothing"], Value::Null);
}

/// A mesh without light that a job names has no lamps of its own and needs no budget: its rows are those of the mesh.
#[test]
fn a_job_of_a_mesh_without_light_is_counted() {
    let folder = tempdir().unwrap();
    // A closed box seen from inside, in which the program would hang a lamp.
    let mut box_ = String::new();
    for corner in 0..8 {
        let [x, y, z] = [1, 2, 4].map(|bit| if corner & bit != 0 { 3 } else { 0 });
        box_ += &format!("v {x} {y} {z}\n");
    }
    for [a, b, c, d] in [[1, 2, 4, 3], [5, 7, 8, 6], [1, 5, 6, 2], [3, 4, 8, 7], [1, 3, 7, 5], [2, 6, 8, 4]] {
        box_ += &format!("f {a} {b} {c} {d}\n");
    }
    fs::write(path(&folder, "box.obj"), box_).unwrap();
    fs::write(path(&folder, "job.toml"), "scene = \"box.obj\"\n").unwrap();
    let rows = |name: &str| {
        let (job, out) = (path(&folder, name), path(&folder, &format!("out-{name}")));
        let words = ["factors", job.to_str().unwrap(), "--sparse", "--quiet", "--rays", "100", "--out"];
        let (code, _, stderr) = run(&[&words[..], &[out.to_str().unwrap()]].concat());
        assert_eq!(code, 0, "{stderr}");
        fs::read(out.join("factors.rows")).unwrap()
    };
    let (job, mesh) = (rows("job.toml"), rows("box.obj"));
    assert!(job == mesh, "the job's rows are not the mesh's");
}

/// The floor sees less of the sky behind the wall than before it: the sky's columns by azimuth. A sky of the scene gives way to them.
#[test]
fn the_sky_is_told_apart() {
    let folder = folder(1);
    let scene = CORNER.replace("patches  = [2, 1]", "") + "patches  = [2, 3]\n[sky]\nemittance = 1.0\n";
    fs::write(path(&folder, "corner.toml"), scene).unwrap();
    assert_eq!(count(&folder, "out", "--rays 200000 --sky-patches 145").0, 0);
    let (entries, [rows, columns, _]) = matrix(&path(&folder, "out"));
    assert_eq!((rows, columns), (7, 7 + 2 + 145));
    // The wall stands in x = 0: patch 7 of the lowest band is about the east, patch 22 about the west.
    let of = |patch: usize| entries.get(&(0, rows + 2 + patch)).copied().unwrap_or(0.0);
    let [east, west]: [f64; 2] = [5..10, 20..25].map(|patches| patches.map(of).sum());
    assert!(east > 4.0 * west && east > 0.005, "{east} {west}");
    let seen: f64 = (0..145).map(of).sum();
    let wall: f64 = (1..7).map(|column| entries.get(&(0, column)).copied().unwrap_or(0.0)).sum();
    assert!((wall - 0.200_043_776).abs() < 5.0 * (0.16_f64 / 200_000.0).sqrt(), "{wall}");
    assert!((seen + wall - 1.0).abs() < 1e-12, "nothing of the floor goes below the horizon");
}

/// The oven by its facets: temperatures are given by surface, and the heat is that of the closed form.
#[test]
fn heat_between_facets() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let words = ["factors", "configs/oven.toml", "--sparse", "--quiet", "--rays", "40000"];
    let rest = ["--temperatures", "configs/heat/oven.toml", "--out", out.to_str().unwrap()];
    let (code, _, stderr) = run(&[&words[..], &rest].concat());
    assert_eq!(code, 0, "{stderr}");
    let table = columns(&out.join("thermal.csv"));
    let [flux, error] = ["flux", "flux_error"]
        .map(|name| table[name].iter().map(|cell| cell.parse().unwrap_or(0.0)).collect::<Vec<f64>>());
    let heater = |place: &usize| table["group"][*place].starts_with("heater");
    let places: Vec<usize> = (0..flux.len()).filter(heater).collect();
    let sum: f64 = places.iter().map(|&place| flux[place]).sum();
    let spread = places.iter().map(|&place| error[place].powi(2)).sum::<f64>().sqrt();
    // The four walls are alike, so that they have the one temperature of the closed form. Six standard errors: once in 10⁹.
    assert!(spread < 0.01 * sum && (sum - 17_629.0).abs() < 6.0 * spread, "{sum} {spread}");
}

/// Temperatures are given by surface, and of a patch by the name that the tables have.
#[test]
fn a_facet_may_have_a_temperature_of_its_own() {
    let folder = folder(1);
    let heat =
        "[[group]]\nname = \"*\"\ntemperature = 300.0\n[[group]]\nname = \"wall 3\"\ntemperature = 400.0\n";
    fs::write(path(&folder, "heat.toml"), heat).unwrap();
    let heat = path(&folder, "heat.toml");
    let (code, stderr) = count(&folder, "out", &format!("--rays 100 --temperatures {}", heat.display()));
    assert_eq!(code, 0, "{stderr}");
    let table = columns(&path(&folder, "out/thermal.csv"));
    let warm: Vec<&String> = table["group"]
        .iter()
        .zip(&table["temperature"])
        .filter(|(_, t)| *t == "400.0")
        .map(|(name, _)| name)
        .collect();
    assert_eq!(warm, ["wall 3"], "{table:?}");
}

/// A file of groups may have as many groups as there are faces, in an order of its own: names and temperatures are those of its groups.
#[test]
fn groups_of_a_face_each_go_by_their_names() {
    let folder = folder(1);
    let of = |patch| format!("[[group]]\nname = \"of {patch}\"\npatches = [{patch}]\n");
    fs::write(path(&folder, "groups.toml"), (0..7).rev().map(of).collect::<String>()).unwrap();
    let hot =
        "[[group]]\nname = \"*\"\ntemperature = 300.0\n[[group]]\nname = \"of 0\"\ntemperature = 900.0\n";
    fs::write(path(&folder, "heat.toml"), hot).unwrap();
    let [groups, heat] = ["groups.toml", "heat.toml"].map(|name| path(&folder, name).display().to_string());
    let words = format!("--rays 2000 --groups {groups} --temperatures {heat}");
    let (code, stderr) = count(&folder, "out", &words);
    assert_eq!(code, 0, "{stderr}");
    let table = columns(&path(&folder, "out/thermal.csv"));
    assert_eq!(table["group"], columns(&path(&folder, "out/groups.csv"))["group"]);
    // The floor of 1 m², ε = 0.5, alone is hot: it gives 0.5·σ·900⁴ less what comes back, and nothing else gives anything.
    let hot = table["group"].iter().position(|name| name == "of 0").unwrap();
    let fluxes: Vec<f64> = table["flux"].iter().map(|cell| cell.parse().unwrap()).collect();
    assert!((15_000.0..18_602.0).contains(&fluxes[hot]), "{table:?}");
    assert!(fluxes.iter().filter(|flux| **flux > 5_000.0).count() == 1, "{table:?}");
}

#[test]
fn what_cannot_be_counted_is_refused() {
    let folder = folder(1);
    for (words, message) in [
        ("--sky-patches 144", "choose 145, 577 or 2305"),
        ("--part 3/2", "write 1/4"),
        ("--rays 0", "from 1 to"),
        ("--rays 10 --paths 100", "cannot be used with"),
        ("--smooth --drop 0.1", "cannot be used with"),
        ("--paths 2", "a budget of 2 walks has none for each of the 7 groups"),
        ("--rays 10 --reflections --export npz,energyplus", "would count them twice"),
    ] {
        let (code, stderr) = count(&folder, "out", words);
        assert!(code == 2 && stderr.contains(message), "{words}: {stderr}");
    }
    let corner = path(&folder, "corner.toml");
    let (code, _, stderr) = run(&["factors", corner.to_str().unwrap(), "--export", "udales"]);
    assert!(code == 2 && stderr.contains("give --sparse"), "{stderr}");
}

/// Parts are neither written over while they are read, nor is anything replaced by what does not fit.
#[test]
fn parts_that_cannot_be_joined_leave_what_is_there() {
    let folder = folder(1);
    let rows = |out: &str| fs::read(path(&folder, out).join("factors.rows")).unwrap();
    for (out, words) in [("a", "--rays 10 --part 1/2"), ("b", "--rays 10 --part 2/2"), ("whole", "--rays 20")]
    {
        assert_eq!(count(&folder, out, words).0, 0);
    }
    let [a, b, missing] = ["a", "b", "missing"].map(|name| path(&folder, name).display().to_string());
    for (out, parts, message) in [
        ("a", format!("{a},{b}"), "--out is among the folders of --join"),
        ("whole", format!("{a},{missing}"), "no rows were counted in"),
        ("whole", a.clone(), "give all parts"),
    ] {
        let before = rows(out);
        let (code, stderr) = count(&folder, out, &format!("--rays 10 --force --join {parts}"));
        assert!(code == 2 && stderr.contains(message), "{stderr}");
        assert!(rows(out) == before && path(&folder, "whole/factors.mtx").exists(), "{message}");
    }
    assert_eq!(count(&folder, "whole", &format!("--rays 10 --force --join {a},{b}")).0, 0);
}

/// Who brings factors to a command for runs is told what they are.
#[test]
fn factors_are_no_run() {
    let folder = folder(1);
    let [rows, dense] = ["rows", "dense"].map(|name| path(&folder, name).to_str().unwrap().to_owned());
    assert_eq!(count(&folder, "rows", "--rays 50").0, 0);
    let (code, stderr) = count(&folder, "rows", "--rays 100 --resume");
    assert!(code == 2 && stderr.contains("or, by rows, walks"), "{stderr}");
    let corner = path(&folder, "corner.toml");
    assert_eq!(
        run(&["factors", corner.to_str().unwrap(), "--out", &dense, "--paths", "7000", "--quiet"]).0,
        0
    );
    for words in [
        &["report", &rows][..],
        &["audit", &rows],
        &["diff", &rows, &rows],
        &["merge", &rows, &rows, "--out", "x"],
    ] {
        let (code, _, stderr) = run(words);
        assert!(
            code == 2 && stderr.contains("holds no run, but exchange factors by rows"),
            "{words:?}: {stderr}"
        );
    }
    let (code, _, stderr) = run(&["report", &dense]);
    assert!(code == 2 && stderr.contains("`radwalk merge` adds up several seeds"), "{stderr}");
}
