//! Tests of `--force`: an earlier result stays until there is something in its place.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};

use report::OutputFolder;
use results::daylight::DAYLIGHT_FILES;
use results::factors::{FILES, sparse_files};

use crate::support::{TABLES, answer, finish, path, radwalk, run, run_job, signal, wait_for};
use tempfile::tempdir;

/// A pilot chooses the patches.
const SCENE: &str = "configs/scenes/lamps.toml";
const AUTO: [&str; 4] = ["--set", "scene.patches=auto", "--paths", "30000"];

/// Before any worker joins.
const NO_TIME: [&str; 3] = ["--force", "--set", "budget.wall_seconds=1e-9"];

/// Runs or coordinates the job with a seed in a folder. Returns its exit code and its words.
fn tried(command: &str, out: &Path, seed: &str, more: &[&str]) -> (i32, String) {
    let first = [command, SCENE, "--seed", seed, "--out", out.to_str().unwrap()];
    let (code, _, stderr) = run(&[&first[..], &AUTO, &TABLES, more].concat());
    (code, stderr)
}

fn coordinator(out: &Path, seed: &str) -> Child {
    let mut command = radwalk();
    command
        .args(["coordinate", SCENE, "--force", "--seed", seed])
        .args(AUTO)
        .args(TABLES)
        .arg("--out")
        .arg(out);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

#[test]
fn a_result_is_not_replaced_before_the_first_walk() {
    let folder = tempdir().unwrap();
    let [out, fresh] = ["out", "fresh"].map(|name| path(&folder, name));
    run_job(SCENE, &out, &[&AUTO[..], &["--seed", "1"]].concat());
    let before = answer(&out);
    let is_whole = || {
        assert!(answer(&out) == before);
        let files = ["tally.bin", "partition.toml"].map(|file| out.join(file).exists());
        assert_eq!(files, [true; 2]);
        let (code, _, stderr) = run(&["audit", out.to_str().unwrap(), "--quiet"]);
        assert_eq!(code, 0, "{stderr}");
    };
    let (code, stderr) = tried("coordinate", &out, "2", &NO_TIME);
    assert!(code == 1 && stderr.contains("one that is there is from before"), "{code} {stderr}");
    is_whole();
    let (code, stderr) = tried("run", &out, "2", &["--force", "--watch", "192.0.2.1:80"]);
    assert_eq!(code, 3, "{stderr}");
    is_whole();
    let child = coordinator(&out, "2");
    wait_for("the access file", || out.join("access.json").exists().then_some(()));
    signal("TERM", child.id());
    assert_eq!(finish(child).0, 130);
    is_whole();

    // What the pilot has chosen is kept all the same, and gone on with in place of the result beside it.
    let pilot = fs::read(out.join("pilot.bin")).unwrap();
    run_job(SCENE, &fresh, &[&AUTO[..], &["--seed", "2"]].concat());
    let resumed = |why: &str| {
        let (code, stderr) = tried("run", &out, "2", &["--resume"]);
        assert!(code == 0 && answer(&out) == answer(&fresh), "{why}: {code} {stderr}");
        assert!(!out.join("pilot.bin").exists() && !out.join("tally.previous.bin").exists(), "{why}");
    };
    resumed("with the pilot beside the earlier result");
    // A crash between a checkpoint and the end of the pilot's file.
    fs::write(out.join("pilot.bin"), &pilot).unwrap();
    resumed("with the pilot beside its own tally");
    // The pilot of one job is nothing to another one.
    fs::write(out.join("pilot.bin"), &pilot).unwrap();
    assert_eq!(tried("run", &out, "1", &["--force"]).0, 0);
    assert!(answer(&out) == before && !out.join("pilot.bin").exists());
    fs::write(out.join("pilot.bin"), &pilot).unwrap();
    let (code, stderr) = tried("run", &out, "1", &["--resume"]);
    assert!(code == 0 && stderr.contains("resumed after 30000 paths"), "{stderr}");
    assert!(answer(&out) == before);
}

/// A pilot would otherwise be kept beside a result that it has no part in.
#[test]
fn a_result_without_a_pilot_is_not_gone_on_with_by_one() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    run_job(SCENE, &out, &["--set", "scene.patches=given", "--paths", "30000"]);
    let before = answer(&out);
    for _ in 0..2 {
        let (code, stderr) = tried("run", &out, "0", &["--resume"]);
        assert!(code == 2 && stderr.contains("another scene"), "{code} {stderr}");
        assert!(answer(&out) == before && !out.join("pilot.bin").exists());
    }
}

#[test]
fn a_refused_job_leaves_nothing_in_the_way_of_the_corrected_one() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let job = path(&folder, "job.toml");
    let tried = |walk: &str| {
        let scene = format!("{}/{SCENE}", env!("CARGO_MANIFEST_DIR"));
        let source = "[[source]]\nname = \"left\"\nsurfaces = [\"lamp-left\"]\n";
        fs::write(&job, format!("[scene]\nfile = \"{scene}\"\npatches = \"auto\"\n{source}")).unwrap();
        let words = ["run", job.to_str().unwrap(), "--paths", "30000", "--out", out.to_str().unwrap()];
        run(&[&words[..], &["--set", &format!("method.walk={walk}")], &TABLES].concat())
    };
    // Samples of gathering belong to several sources, which is seen when there are patches.
    let (code, _, stderr) = tried("gathering");
    assert!(code == 2 && out.join("pilot.bin").exists(), "{stderr}");
    let (code, _, stderr) = tried("shooting");
    assert_eq!(code, 0, "{stderr}");
}

#[test]
fn counts_are_not_replaced_before_there_are_others() {
    let folder = tempdir().unwrap();
    let scene = "configs/scenes/daylit.toml";
    for (command, table) in [
        (&["factors", scene, "--groups", "by-surface", "--paths", "1e4"][..], "factors.csv"),
        (&["daylight", scene, "--weather", "configs/weather/made.epw", "--paths", "1e6"], "annual.csv"),
    ] {
        let out = path(&folder, command[0]);
        let words = [command, &["--quiet", "--out", out.to_str().unwrap()]].concat();
        assert!(run(&words).0 < 2);
        let before = fs::read(out.join(table)).unwrap();
        let elsewhere = [&words[..], &["--force", "--seed", "7", "--listen", "192.0.2.1:80"]].concat();
        let (code, _, stderr) = run(&elsewhere);
        assert_eq!(code, 3, "{stderr}");
        assert!(fs::read(out.join(table)).unwrap() == before, "{table}");
        assert!(run(&[&words[..], &["--force", "--seed", "7"]].concat()).0 < 2);
        assert!(fs::read(out.join(table)).unwrap() != before, "{table}");
    }
}

#[test]
fn folders_know_the_files_of_every_command() {
    let folder = tempdir().unwrap();
    for name in [&FILES[..], &DAYLIGHT_FILES, &sparse_files()].concat() {
        fs::write(path(&folder, name), "").unwrap();
    }
    OutputFolder::claim(folder.path(), &[], false).unwrap();
}

#[test]
fn results_of_all_commands_may_stand_beside_each_other() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let place = ["--quiet", "--out", out.to_str().unwrap()];
    let cube = "tests/data/cube54.toml";
    for words in [
        &["factors", cube, "--sparse", "--rays", "10", "--export", "mtx,npz,view3d,openfoam"][..],
        &["exact", cube],
        &["run", cube, "--paths", "20000"],
    ] {
        let (code, _, stderr) = run(&[words, &place].concat());
        assert_eq!(code, 0, "{words:?}: {stderr}");
    }
    // An earlier result of the same command is refused as before.
    assert_eq!(run(&[&["exact", cube][..], &place].concat()).0, 2);
}
