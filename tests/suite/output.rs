//! Tests of `[output]` and `[view]`: the files that a run writes, the commands that work without the others, and the
//! view of the picture.

use std::collections::BTreeSet;
use std::path::Path;

use tempfile::tempdir;

use crate::support::{answer, draw_job, path, run, summary};

const JOB: &str = "tests/data/cube54.toml";

/// The files of a folder.
fn files(folder: &Path) -> BTreeSet<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    names.map(|name| name.into_string().unwrap()).collect()
}

fn set_of(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_job_chooses_its_files_and_the_rest_is_made_from_the_tally() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let short = ["run", JOB, "--paths", "20000", "--out", text(&out)];
    let chosen = ["--set", "output.files=[\"csv\", \"exr\"]", "--export", "vtu"];
    let (code, stdout, stderr) = run(&[&short[..], &chosen].concat());
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(files(&out), set_of(&["tally.bin", "patches.csv", "radiosity.exr", "patches.vtu"]));
    let line = "left out: summary.json, radiosity.png, report.html; radwalk report";
    assert!(stdout.contains(line) && stdout.contains("status needs summary.json"), "{stdout}");
    assert_eq!(std::fs::read(out.join("radiosity.exr")).unwrap()[..4], [0x76, 0x2f, 0x31, 0x01]);
    let (code, _, stderr) = run(&["status", text(&out)]);
    assert!(code == 2 && stderr.contains("--export summary"), "{stderr}");
    // The files that the job names are made again, with those asked for beside them; an export of another time is
    // removed.
    let (code, _, stderr) = run(&["report", text(&out), "--export", "summary,picture"]);
    assert_eq!(code, 0, "{stderr}");
    let made = ["tally.bin", "patches.csv", "radiosity.exr", "summary.json", "radiosity.png"];
    assert_eq!(files(&out), set_of(&made));
    let (code, _, stderr) = run(&["audit", text(&out), "--share", "1"]);
    assert_eq!(code, 0, "{stderr}");
    let (_, line, _) = run(&["check", JOB, "--set", "output.files=[\"glb\"]"]);
    assert!(line.contains("output: tally.bin, scene.glb"), "{line}");
}

/// Where a job names no files, a long table is short in its digits, and all of them are beside it.
#[test]
fn a_long_table_has_the_digits_of_its_errors_and_all_beside_it() {
    let folder = tempdir().unwrap();
    let scene = path(&folder, "plain.toml");
    let text_of = |rows: u32| {
        let quads =
            [("floor", 0, "[[0,0,0],[1,0,0],[0,1,0]]", 0), ("lamp", 1, "[[0,0,1],[0,1,1],[1,0,1]]", 1)];
        let surface = |(name, cells, quad, light): (&str, u32, &str, u32)| {
            let patches = if cells == 0 { rows } else { 1 };
            format!(
                "[material.{name}]\nreflectance = 0.5\nemittance = {light}.0\n[[surface]]\nname = \"{name}\"\n\
                 material = \"{name}\"\nquad = {quad}\npatches = [{patches}, 1]\n"
            )
        };
        quads.map(surface).concat()
    };
    for (rows, is_long) in [(19_999, false), (20_000, true)] {
        std::fs::write(&scene, text_of(rows)).unwrap();
        let out = path(&folder, if is_long { "long" } else { "short" });
        let keys = ["--set", "method.walk=shooting", "--set", "view.size=[8, 8]", "--paths", "100000"];
        let run_it = [&["run", text(&scene), "--out", text(&out)], &keys[..]].concat();
        let (code, line, stderr) = run(&run_it);
        assert_eq!(code, 0, "{stderr}");
        assert_eq!(out.join("patches.parquet").exists(), is_long);
        assert_eq!(line.contains("patches.parquet has all digits"), is_long, "{line}");
        let table = std::fs::read_to_string(out.join("patches.csv")).unwrap();
        let longest = table.lines().skip(1).flat_map(|line| line.split(',')).map(str::len).max().unwrap();
        assert_eq!(longest <= 12, is_long, "{longest}");
        let (code, _, stderr) = run(&["audit", text(&out), "--share", "1"]);
        assert_eq!(code, 0, "{stderr}");
    }
}

/// Resume, merge and audit need the tally alone, and end with the answer of a run that wrote everything.
#[test]
fn a_tally_alone_is_resumed_merged_and_audited() {
    let folder = tempdir().unwrap();
    let [whole, alone, rest, merged] = ["whole", "alone", "rest", "merged"].map(|name| path(&folder, name));
    draw_job(JOB, &whole, &["--paths", "60000"]);
    let bare = ["--quiet", "--set", "output.files=[]"];
    for (more, paths) in [(&["--force"][..], "20000"), (&["--resume"], "40000")] {
        let args = [&["run", JOB, "--paths", paths, "--out", text(&alone)], more, &bare].concat();
        let (code, _, stderr) = run(&args);
        assert_eq!(code, 0, "{stderr}");
    }
    assert_eq!(files(&alone), set_of(&["tally.bin", "tally.previous.bin"]));
    let (code, _, stderr) = run(&["audit", text(&alone), "--share", "1", "--quiet"]);
    assert_eq!(code, 0, "{stderr}");
    let (code, _, stderr) = run(&["diff", text(&whole), text(&alone)]);
    assert!(code == 2 && stderr.contains("--export csv"), "{stderr}");
    let range = ["run", JOB, "--paths", "20000", "--set", "budget.first_path=40000", "--out", text(&rest)];
    assert_eq!(run(&[&range[..], &bare].concat()).0, 0);
    let all = ["merge", text(&alone), text(&rest), "--out", text(&merged), "--quiet"];
    let (code, _, stderr) = run(&[&all[..], &["--export", "csv,summary"]].concat());
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(files(&merged), set_of(&["tally.bin", "patches.csv", "summary.json"]));
    assert!(answer(&merged) == answer(&whole), "the same walks have the same answer");
}

#[test]
fn a_view_is_what_the_job_says() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let view =
        "view={ eye = [0.5, 0.1, 0.5], look_at = [0.5, 0.9, 0.6], fov = 70, size = [64, 48], exposure = 2 }";
    let set = ["--paths", "20000", "--set", view];
    let picture = draw_job(JOB, &out, &set)["picture"].clone();
    assert_eq!((&picture["eye"], &picture["size"]), (&[0.5, 0.1, 0.5].into(), &[64, 48].into()));
    assert_eq!((&picture["exposure"], &picture["white"]), (&[2.0; 3].into(), &[3.0; 3].into()));
    assert!((picture["fov"].as_f64().unwrap() - 70.0).abs() < 1e-9);
    let png = std::fs::read(out.join("radiosity.png")).unwrap();
    assert_eq!(png[16..24], [0, 0, 0, 64, 0, 0, 0, 48], "width and height");
    // The camera is kept with the tally, so the picture that is made again is the same picture.
    let (code, _, stderr) = run(&["report", text(&out), "--quiet"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(std::fs::read(out.join("radiosity.png")).unwrap() == png);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("\"eye\":[0.5,0.1,0.5]"));
    // Without a view the camera stands outside, and the summary says how bright white is.
    let free = path(&folder, "free");
    let picture = draw_job(JOB, &free, &["--paths", "20000"])["picture"].clone();
    assert!(
        picture["white"][0].as_f64() > Some(0.0) && picture["size"][0].as_u64() <= Some(800),
        "{picture}"
    );
    assert_eq!(summary(&free)["tally_hash"], summary(&out)["tally_hash"]);
}

/// Each view with a name has a picture and a place in the summary and on the page; those of an earlier result go with it.
#[test]
fn views_with_names_have_pictures_of_their_own() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let views = [
        "view.size=[64, 48]",
        "views.door={ eye = [0.5, 0.1, 0.5], look_at = [0.5, 0.9, 0.6], fov = 70 }",
        "views.lamp-1={ eye = [0.5, 0.9, 0.5], look_at = [0.5, 0.1, 0.6] }",
    ];
    let set: Vec<&str> = views.iter().flat_map(|view| ["--set", view]).collect();
    let result = draw_job(JOB, &out, &[&["--paths", "20000", "--export", "exr"][..], &set].concat());
    let named: Vec<&str> =
        result["views"].as_array().unwrap().iter().map(|view| view["name"].as_str().unwrap()).collect();
    assert_eq!(named, ["door", "lamp-1"]);
    let door = &result["views"][0];
    assert_eq!((&door["eye"], &door["size"]), (&[0.5, 0.1, 0.5].into(), &[64, 48].into()));
    assert!((door["fov"].as_f64().unwrap() - 70.0).abs() < 1e-9, "{door}");
    let pictures =
        ["radiosity-door.png", "radiosity-lamp-1.png", "radiosity-door.exr", "radiosity-lamp-1.exr"];
    assert!(set_of(&pictures).is_subset(&files(&out)), "{:?}", files(&out));
    let png = std::fs::read(out.join("radiosity-door.png")).unwrap();
    assert!(png != std::fs::read(out.join("radiosity-lamp-1.png")).unwrap());
    assert!(std::fs::read_to_string(out.join("report.html")).unwrap().contains("\"name\":\"lamp-1\""));
    // They are kept with the tally.
    std::fs::remove_file(out.join("radiosity-door.png")).unwrap();
    assert_eq!(run(&["report", text(&out), "--quiet"]).0, 0);
    assert!(std::fs::read(out.join("radiosity-door.png")).unwrap() == png);
    // A picture that a person put there stays.
    std::fs::write(out.join("radiosity-before.png"), &png).unwrap();
    let again = draw_job(JOB, &out, &["--paths", "20000", "--set", "view.size=[64, 48]", "--force"]);
    assert_eq!(again["tally_hash"], result["tally_hash"]);
    assert!(again.get("views").is_none() && set_of(&pictures).is_disjoint(&files(&out)));
    assert!(std::fs::read(out.join("radiosity-before.png")).unwrap() == png);
    let refused = |view: &str| run(&["check", JOB, "--set", view]).2;
    let text = refused("views.\"a/b\"={ eye = [0.5, 0.1, 0.5], look_at = [0.5, 0.9, 0.6] }");
    assert!(text.contains("cannot name a view"), "{text}");
    let text = refused("views.door={ }");
    assert!(text.contains("views.door.eye"), "{text}");
}

#[test]
fn a_view_that_shows_nothing_is_reported_before_the_run() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let away = "view={ eye = [0.5, -3, 0.5], look_at = [0.5, -9, 0.5], size = [32, 32] }";
    let (code, _, stderr) = run(&["run", JOB, "--paths", "1000", "--out", text(&out), "--set", away]);
    assert!(code == 0 && stderr.contains("[view] sees nothing"), "{stderr}");
    let (code, text, _) = run(&["check", JOB, "--set", away]);
    assert!(code == 0 && text.contains("[view] sees nothing"), "{text}");
    let (code, _, stderr) = run(&["check", JOB, "--set", "view.fov=40"]);
    assert!(code == 2 && stderr.contains("fov without eye"), "{stderr}");
}

#[test]
fn new_names_what_it_writes_and_replaces_it_with_force_alone() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "new");
    let new =
        |kind: &str, more: &[&str]| run(&[&["new", kind, "--out", out.to_str().unwrap()], more].concat());
    let (code, stdout, _) = new("schema", &[]);
    let schema = out.join("schema/job.json");
    assert!(code == 0 && stdout.matches(schema.to_str().unwrap()).count() == 2, "{stdout}");
    assert_eq!(new("box", &["-q"]), (0, String::new(), String::new()));
    std::fs::write(out.join("box.toml"), "mine").unwrap();
    let (code, _, stderr) = new("box", &[]);
    assert!(code == 2 && stderr.contains("replace it with --force"), "{stderr}");
    assert_eq!(new("box", &["--force"]).0, 0);
    assert_ne!(std::fs::read_to_string(out.join("box.toml")).unwrap(), "mine");
}
