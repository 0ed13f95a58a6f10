//! Tests of output folders and access files in runs that go wrong: results of one run never stand beside those of
//! another.

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};

use crate::support::{answer, draw_job, finish, path, radwalk, run, run_job, signal, wait_for};
use tempfile::tempdir;

const JOB: &str = "tests/data/cube54.toml";
const DERIVED: [&str; 3] = ["patches.csv", "summary.json", "radiosity.png"];

/// A run that takes long and writes checkpoints often.
fn long_run(out: &Path, args: &[&str]) -> Child {
    let mut command = radwalk();
    command.args(["run", JOB, "--workers", "1", "--quiet", "--paths", "100000000000"]);
    command.args(["--set", "budget.checkpoint_seconds=0.05"]).args(args).arg("--out").arg(out);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

#[test]
fn a_run_that_replaces_another_and_dies_leaves_nothing_of_the_other() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    draw_job(JOB, &out, &["--paths", "20000", "--seed", "1"]);
    let before = fs::read(out.join("tally.bin")).unwrap();
    let mut child = long_run(&out, &["--seed", "2", "--force"]);
    wait_for("a checkpoint", || (fs::read(out.join("tally.bin")).ok()? != before).then_some(()));
    wait_for("the next", || out.join("tally.previous.bin").exists().then_some(()));
    child.kill().unwrap();
    child.wait().unwrap();
    for file in DERIVED {
        assert!(!out.join(file).exists(), "{file} of another seed");
    }
    assert!(
        fs::read(out.join("tally.previous.bin")).unwrap() != before,
        "nor is it what the run goes on from"
    );
}

#[test]
fn what_is_not_made_from_the_tally_beside_it_does_not_pass_an_audit() {
    let folder = tempdir().unwrap();
    let [one, two] = ["one", "two"].map(|name| path(&folder, name));
    let exports = ["exr", "vtu", "glb", "parquet"].map(|word| ["--export", word]).concat();
    for (out, seed) in [(&one, "1"), (&two, "2")] {
        draw_job(JOB, out, &[&["--paths", "20000", "--seed", seed], &exports[..]].concat());
    }
    assert_eq!(run(&["audit", one.to_str().unwrap(), "--quiet"]).0, 0);
    for file in
        DERIVED.iter().copied().chain(["radiosity.exr", "patches.vtu", "scene.glb", "patches.parquet"])
    {
        let own = fs::read(one.join(file)).unwrap();
        fs::copy(two.join(file), one.join(file)).unwrap();
        let (code, _, stderr) = run(&["audit", one.to_str().unwrap()]);
        assert_eq!(code, 3, "{stderr}");
        assert!(stderr.contains(&format!("{file} is not made from the tally")), "{stderr}");
        fs::write(one.join(file), own).unwrap();
    }
    assert_eq!(run(&["audit", one.to_str().unwrap(), "--quiet"]).0, 0);
}

#[test]
fn a_folder_that_is_replaced_under_a_run_keeps_the_results_of_its_own_run() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let first = long_run(&out, &["--seed", "1"]);
    wait_for("a checkpoint", || out.join("tally.bin").exists().then_some(()));
    // The folder is moved away in one step, since the run may write at any moment.
    fs::rename(&out, path(&folder, "away")).unwrap();
    fs::create_dir(&out).unwrap();
    fs::write(out.join("mine.txt"), "mine").unwrap();
    signal("INT", first.id());
    let (code, _, stderr) = finish(first);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("is not the one that this run began with"), "{stderr}");
    let left: Vec<_> = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["mine.txt"]);
}

#[test]
fn a_run_that_the_clock_ends_before_anything_is_known_is_no_success() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    run_job(JOB, &out, &["--paths", "20000", "--seed", "1"]);
    let before = answer(&out);
    let chains = ["--set", "method.walk=jacobi", "--paths", "80000000", "--set", "budget.wall_seconds=0.001"];
    let all = [&["run", JOB, "--seed", "2", "--force", "--out", out.to_str().unwrap()][..], &chains].concat();
    let (code, _, stderr) = run(&all);
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("no walk was finished"), "{stderr}");
    assert!(answer(&out) == before, "the folder is what it was");
}

#[test]
fn a_coordinator_leaves_the_access_file_of_another_alone() {
    let folder = tempdir().unwrap();
    let access = path(&folder, "access.json");
    let coordinate = |name: &str| {
        let mut command = radwalk();
        command.args(["coordinate", JOB, "--quiet", "--access"]).arg(&access);
        command
            .arg("--out")
            .arg(path(&folder, name))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let first = coordinate("one");
    let of_first = wait_for("the access file", || fs::read(&access).ok());
    let second = coordinate("two");
    let of_second =
        wait_for("another access file", || fs::read(&access).ok().filter(|file| *file != of_first));
    signal("INT", first.id());
    assert_eq!(finish(first).0, 130);
    assert_eq!(fs::read(&access).unwrap(), of_second);
    signal("INT", second.id());
    assert_eq!(finish(second).0, 130);
    assert!(!access.exists());
}

/// A file that is no access file is not replaced, let alone removed at the end; that of a coordinator goes with it.
#[test]
fn access_files_replace_no_others_and_go_with_their_coordinators() {
    let folder = tempdir().unwrap();
    let (notes, out) = (path(&folder, "notes.txt"), path(&folder, "out"));
    fs::write(&notes, "mine").unwrap();
    let words = ["coordinate", JOB, "--out", out.to_str().unwrap(), "--access", notes.to_str().unwrap()];
    let (code, _, stderr) = run(&words);
    assert!(code == 2 && stderr.contains("no access file") && stderr.contains("--access"), "{stderr}");
    assert_eq!(fs::read(&notes).unwrap(), b"mine");
    let access = path(&folder, "access.json");
    let mut command = radwalk();
    command.args(["coordinate", JOB, "--quiet", "--access"]).arg(&access).arg("--out").arg(&out);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let mut coordinator = command.spawn().unwrap();
    wait_for("the access file", || access.exists().then_some(()));
    signal("INT", coordinator.id());
    assert_eq!(coordinator.wait().unwrap().code(), Some(130));
    assert!(!access.exists());
}

/// A process that is to outlive its terminal (`nohup`) is not ended by the hangup; others end in good order.
#[test]
fn nohup_outlives_its_terminal() {
    let folder = tempdir().unwrap();
    for (shell, expected) in [("trap '' HUP; exec \"$@\"", 0), ("exec \"$@\"", 130)] {
        let out = path(&folder, &format!("{expected}"));
        let mut command = std::process::Command::new("sh");
        command.args(["-c", shell, "sh", env!("CARGO_BIN_EXE_radwalk"), "run"]);
        command
            .arg(format!("{}/{JOB}", env!("CARGO_MANIFEST_DIR")))
            .args(["--paths", "40000000", "--quiet", "--out"])
            .arg(&out);
        command.args(["--set", "budget.checkpoint_seconds=0.05"]);
        let run = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_for("a checkpoint", || out.join("tally.bin").exists().then_some(()));
        signal("HUP", run.id());
        assert_eq!(finish(run).0, expected, "{shell}");
    }
}

/// The command `timeout` signals its child and then the child's group.
#[test]
fn a_signal_that_comes_twice_is_one() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let child = long_run(&out, &[]);
    wait_for("a checkpoint", || out.join("tally.bin").exists().then_some(()));
    signal("TERM", child.id());
    signal("TERM", child.id());
    let (code, _, stderr) = finish(child);
    assert_eq!(code, 130, "{stderr}");
    for file in DERIVED {
        assert!(out.join(file).exists(), "{file}");
    }
}

/// The forged tally has a right checksum.
#[test]
fn a_forged_tally_is_refused_in_words() {
    let folder = tempdir().unwrap();
    let [out, merged] = ["out", "merged"].map(|name| path(&folder, name));
    run_job(JOB, &out, &["--paths", "20000"]);
    let whole = fs::read(out.join("tally.bin")).unwrap();
    for (layout, patches) in [([1, 2, 0], 53_u64), ([0, 0, 0], 54), ([2, 1, 0], 54), ([1, 1, 1], 54)] {
        let columns = u64::from(layout[0] * layout[1] + layout[2]);
        let mut forged = whole.clone();
        forged[12..15].copy_from_slice(&layout);
        forged[16..24].copy_from_slice(&patches.to_le_bytes());
        let sums = 16 * 54 * 2..whole.len() - 304 - 32;
        forged.truncate(304);
        forged.extend(&whole[304..304 + 16 * (patches * columns) as usize]);
        forged.extend(&whole[304..][sums]);
        forged.extend(*blake3::hash(&forged).as_bytes());
        fs::write(out.join("tally.bin"), &forged).unwrap();
        let of_out = out.to_str().unwrap();
        for args in [
            &["run", JOB, "--resume", "--out", of_out][..],
            &["merge", of_out, "--out", merged.to_str().unwrap()],
            &["audit", of_out],
        ] {
            let (code, _, stderr) = run(args);
            assert_eq!(code, 2, "{layout:?} {patches} {args:?}: {stderr}");
            assert!(!stderr.contains("panicked"), "{stderr}");
        }
    }
}

#[test]
fn what_a_file_holds_does_not_command_the_terminal() {
    let folder = tempdir().unwrap();
    let job = path(&folder, "job.toml");
    fs::write(&job, "scene = \"x.toml\"\n\"\\u001b]0;owned\\u0007\" = 1\n").unwrap();
    let (code, _, stderr) = run(&["check", job.to_str().unwrap()]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("]0;owned") && !stderr.contains('\u{1b}'), "{stderr:?}");
}

#[test]
fn intervals_that_can_hardly_fail_are_wide_and_no_panic() {
    let folder = tempdir().unwrap();
    let sure = ["--set", "confidence=0.9999999999999999", "--set", "simultaneous=true", "--paths", "20000"];
    run_job(JOB, &path(&folder, "out"), &sure);
}

/// A process that fails while it knows a key leaves no image of its memory. If the machine keeps no images of any
/// process, this test shows nothing.
#[cfg(target_os = "linux")]
#[test]
fn no_core_dump_holds_a_key() {
    use std::os::unix::process::ExitStatusExt;
    use std::process::Command;

    let folder = tempdir().unwrap();
    let aborted = |words: &str, ready: &dyn Fn() -> bool| {
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("ulimit -c unlimited && exec {words}")]).current_dir(folder.path());
        let mut child = shell.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        wait_for("the process", || ready().then_some(()));
        signal("ABRT", child.id());
        child.wait().unwrap()
    };
    let began = std::time::Instant::now();
    let control = aborted("sleep 60", &|| began.elapsed().as_millis() > 300);
    if !control.core_dumped() {
        println!("this machine keeps no core dumps");
    }
    let access = path(&folder, "access.json");
    let words = format!(
        "{} coordinate {}/{JOB} --quiet --access {} --out {}",
        env!("CARGO_BIN_EXE_radwalk"),
        env!("CARGO_MANIFEST_DIR"),
        access.display(),
        path(&folder, "out").display()
    );
    let status = aborted(&words, &|| access.exists());
    assert_eq!((status.signal(), status.core_dumped()), (Some(6), false));
}

/// A build from sources without git, as from an archive, is named by a digest of its sources.
#[test]
fn builds_without_git_are_told_apart() {
    use std::process::Command;

    let folder = tempdir().unwrap();
    let build = path(&folder, "build");
    let stamp = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/stamp/src/lib.rs");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/build.rs");
    for (words, source) in [
        (["--crate-type", "lib", "--crate-name", "stamp"].as_slice(), stamp),
        (&["--extern", "stamp", "-o", "build"], script),
    ] {
        let mut rustc = Command::new(std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into()));
        rustc.args(["--edition", "2024", source, "-L", "."]).args(words).current_dir(folder.path());
        assert!(rustc.status().unwrap().success());
    }
    let archive = path(&folder, "archive");
    fs::create_dir_all(archive.join("src")).unwrap();
    let name = |source: &str| {
        fs::write(archive.join("src/main.rs"), source).unwrap();
        // A repository above the folder must not be used.
        let ceiling = folder.path();
        let output = Command::new(&build)
            .current_dir(&archive)
            .env("CARGO_MANIFEST_DIR", &archive)
            .env("GIT_CEILING_DIRECTORIES", ceiling)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        let name = said.lines().find_map(|line| line.strip_prefix("cargo::rustc-env=RADWALK_GIT=")).unwrap();
        assert!(name.starts_with("sources-"), "{name}");
        name.to_owned()
    };
    let one = name("fn main() {}");
    assert_eq!(name("fn main() {}"), one);
    assert_ne!(name("fn main() { }"), one);
}
