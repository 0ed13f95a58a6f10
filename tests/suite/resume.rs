//! Tests of runs that are stopped, killed, damaged and resumed: they end with the bytes of an undisturbed run.

use std::path::Path;
use std::process::{Child, Stdio};
use std::time::Duration;

use crate::support::{
    TABLES, answer, finish, kill_until_done, path, radwalk, run, run_job, signal, summary, wait_for,
};
use tempfile::tempdir;

const JOB: &str = "tests/data/cube54.toml";
/// The setting by which checkpoints are written as often as possible.
const OFTEN: [&str; 2] = ["--set", "budget.checkpoint_seconds=0.02"];

fn spawn_run(out: &Path, args: &[&str]) -> Child {
    let mut command = radwalk();
    command.args(["run", JOB, "--workers", "2"]).args(TABLES).args(OFTEN).args(args).arg("--out").arg(out);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Resumes a run that must succeed. Returns its words on stderr.
fn resume(out: &Path, args: &[&str]) -> String {
    let job = ["run", JOB, "--resume", "--workers", "2", "--out", out.to_str().unwrap()];
    let (code, stdout, stderr) = run(&[&job[..], &TABLES, args].concat());
    assert_eq!(code, 0, "{stdout}{stderr}");
    stderr
}

fn wait_for_checkpoint(out: &Path) {
    wait_for("a checkpoint", || out.join("tally.bin").exists().then_some(()));
}

#[test]
fn a_coordinator_that_is_killed_again_and_again_loses_nothing() {
    let folder = tempdir().unwrap();
    let (out, straight) = (path(&folder, "out"), path(&folder, "straight"));
    let job = ["--paths", "8000000"];
    run_job(JOB, &straight, &job);
    // Each kill comes later, so that all phases are met: before the first checkpoint, between two, while one is
    // written.
    let pause = |killed| Duration::from_millis(100 + 37 * killed);
    let start = || spawn_run(&out, &[&job[..], &["--resume", "--quiet"]].concat());
    let killed = kill_until_done(start, pause, 200);
    assert!(answer(&out) == answer(&straight), "after {killed} deaths");
}

#[test]
fn a_run_that_is_interrupted_goes_on_to_the_same_end() {
    let folder = tempdir().unwrap();
    let straight = path(&folder, "straight");
    run_job(JOB, &straight, &["--paths", "8000000"]);
    for name in ["INT", "TERM"] {
        let out = path(&folder, name);
        let child = spawn_run(&out, &["--paths", "8000000", "--quiet"]);
        wait_for_checkpoint(&out);
        signal(name, child.id());
        let (code, ..) = finish(child);
        assert!(code == 130 || code == 0, "{code}");
        resume(&out, &["--paths", "8000000", "--quiet"]);
        assert!(answer(&out) == answer(&straight), "SIG{name}");
    }
}

/// The first look after a resume also has walks to compare with.
#[test]
fn the_check_of_drift_says_the_same_kind_of_thing_after_a_resume() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    let drift = || {
        let checks = summary(&out)["checks"].clone();
        let drift = checks.as_array().unwrap().iter().find(|check| check["name"] == "drift").unwrap().clone();
        (drift["ok"].clone(), drift["message"].as_str().unwrap().rsplit_once(':').unwrap().0.to_owned())
    };
    run_job(JOB, &out, &["--paths", "300000"]);
    let straight = drift();
    assert!(
        straight.1.starts_with("probability that the last walks and those before them differ"),
        "{straight:?}"
    );
    // There is a look at 2^19 walks, of which 224,288 are new.
    run_job(JOB, &out, &["--paths", "600000", "--resume"]);
    assert_eq!(drift(), straight);
}

#[test]
fn a_finished_run_is_extended_without_tracing_again() {
    let folder = tempdir().unwrap();
    let (out, straight) = (path(&folder, "out"), path(&folder, "straight"));
    // The walks are no whole number of streams: the last stream is begun anew in its middle.
    let first = run_job(JOB, &out, &["--paths", "100001"]);
    let old: Vec<_> = first["provenance"]["workers"].as_array().unwrap().to_vec();
    let (code, text, _) =
        run(&["run", JOB, "--resume", "--workers", "1", "--out", out.to_str().unwrap(), "--paths", "300000"]);
    assert!(
        code == 0 && text.contains("by 1 worker in this session (") && text.contains(" in 2 sessions):"),
        "{text}"
    );
    run_job(JOB, &straight, &["--paths", "300000"]);
    assert!(answer(&out) == answer(&straight));
    let extended = summary(&out);
    let workers = extended["provenance"]["workers"].as_array().unwrap();
    assert_eq!(workers[..old.len()], old[..], "the ledger of the first session stays as it was");
    let paths =
        |workers: &[serde_json::Value]| workers.iter().map(|w| w["paths"].as_u64().unwrap()).sum::<u64>();
    assert_eq!(paths(&workers[old.len()..]), 199_999, "only what was missing was walked");
    assert_eq!(extended["provenance"]["sessions"].as_array().unwrap().len(), 2);
    let (code, _, stderr) = run(&["run", JOB, "--resume", "--paths", "1000", "--out", out.to_str().unwrap()]);
    assert_eq!(code, 2);
    assert!(stderr.contains("holds 300000 paths"), "{stderr}");
}

#[test]
fn a_target_is_reached_at_the_same_walk_through_any_number_of_deaths() {
    let folder = tempdir().unwrap();
    let (out, straight) = (path(&folder, "out"), path(&folder, "straight"));
    let job = ["--set", "target.relative_error=0.01", "--paths", "100000000"];
    let expected = run_job(JOB, &straight, &job);
    assert_eq!(expected["target"]["reached"], true);
    for killed in 0.. {
        assert!(killed < 200, "it gets nowhere");
        let mut child = spawn_run(&out, &[&job[..], &["--resume", "--quiet"]].concat());
        std::thread::sleep(Duration::from_millis(200 + 50 * killed));
        if child.try_wait().unwrap().is_some_and(|status| status.success()) {
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert_eq!(summary(&out)["paths"], expected["paths"]);
    assert!(answer(&out) == answer(&straight));
    // Resumed once more, the run has nothing left to do.
    resume(&out, &[&job[..], &["--quiet"]].concat());
    assert!(answer(&out) == answer(&straight));
}

/// A run of three sessions: its folder has a latest and a previous checkpoint of different walks.
fn two_checkpoints(out: &Path) {
    run_job(JOB, out, &["--paths", "70000"]);
    resume(out, &["--paths", "150000", "--quiet"]);
}

/// Damages one byte of every region of the file, the first and last bytes included, and cuts the file at the same
/// places.
#[test]
fn damage_anywhere_is_noticed_and_the_previous_checkpoint_used() {
    let folder = tempdir().unwrap();
    let (template, straight) = (path(&folder, "template"), path(&folder, "straight"));
    two_checkpoints(&template);
    run_job(JOB, &straight, &["--paths", "200000"]);
    let whole = std::fs::read(template.join("tally.bin")).unwrap();
    let book = 304 + 54 * 2 * 16;
    for place in [0, 8, 12, 16, 24, 32, 64, 303, 304, book - 1, book, whole.len() - 33, whole.len() - 1] {
        for cut in [false, true] {
            let out = path(&folder, &format!("out{place}{cut}"));
            std::fs::create_dir(&out).unwrap();
            for file in ["tally.previous.bin", "patches.csv"] {
                std::fs::copy(template.join(file), out.join(file)).unwrap();
            }
            let mut damaged = whole.clone();
            if cut {
                damaged.truncate(place);
            } else {
                damaged[place] ^= 1 << (place % 8);
            }
            std::fs::write(out.join("tally.bin"), damaged).unwrap();
            let said = resume(&out, &["--paths", "200000"]);
            assert!(said.contains("the previous checkpoint is used"), "byte {place}: {said}");
            assert!(said.contains("resumed after 70000 paths"), "byte {place}: {said}");
            assert!(answer(&out) == answer(&straight), "byte {place}, cut: {cut}");
        }
    }
}

#[test]
fn foreign_and_hopeless_checkpoints_are_refused_with_the_reason() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    two_checkpoints(&out);
    let resume = |args: &[&str]| {
        let all = [&["run", JOB, "--resume", "--paths", "200000", "--out", out.to_str().unwrap()], args];
        run(&all.concat())
    };
    let before = std::fs::read(out.join("tally.bin")).unwrap();
    for (args, reason) in [
        (&["--seed", "7"][..], "those of another job"),
        (&["--set", "method.estimator=absorption"], "those of another job"),
        (&["--set", "budget.first_path=5"], "those of another job"),
        (&["--set", "scene=../../configs/scenes/furnace.toml"], "in another scene"),
    ] {
        let (code, _, stderr) = resume(args);
        assert_eq!(code, 2, "{args:?}: {stderr}");
        assert!(stderr.contains(reason), "{args:?}: {stderr}");
    }
    assert!(std::fs::read(out.join("tally.bin")).unwrap() == before, "nothing was touched");
    for file in ["tally.bin", "tally.previous.bin"] {
        std::fs::write(out.join(file), "RWTALLY").unwrap();
    }
    let (code, _, stderr) = resume(&[]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("tally.bin"), "{stderr}");
    let (code, _, stderr) = resume(&["--force"]);
    assert_eq!(code, 2, "{stderr}");
}

/// The system refuses files of more than 1 KiB, as a full disk would. The run ends with an error, and can be resumed
/// from the files that were there before.
#[test]
fn a_full_disk_leaves_the_checkpoint_before() {
    let folder = tempdir().unwrap();
    let (out, straight) = (path(&folder, "out"), path(&folder, "straight"));
    run_job(JOB, &out, &["--paths", "70000"]);
    let before = std::fs::read(out.join("tally.bin")).unwrap();
    let script = "trap '' XFSZ; ulimit -f 1; exec \"$@\"";
    let resume = ["run", JOB, "--resume", "--paths", "6000000", "--workers", "1"];
    let full = std::process::Command::new("sh")
        .args(["-c", script, "sh", env!("CARGO_BIN_EXE_radwalk")])
        .args(resume)
        .args(["--set", "budget.checkpoint_seconds=0.02", "--out"])
        .arg(&out)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (code, _, stderr) = finish(full);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("the run goes on, the one before is kept"), "{stderr}");
    assert!(stderr.contains("cannot write"), "{stderr}");
    assert!(std::fs::read(out.join("tally.bin")).unwrap() == before);
    let (code, _, stderr) = run(&[&resume[..], &["--quiet", "--out", out.to_str().unwrap()]].concat());
    assert_eq!(code, 0, "{stderr}");
    run_job(JOB, &straight, &["--paths", "6000000"]);
    assert!(answer(&out) == answer(&straight));
}

#[test]
fn workers_find_a_restarted_coordinator() {
    let folder = tempdir().unwrap();
    let (out, access, straight) =
        (path(&folder, "out"), path(&folder, "access.json"), path(&folder, "straight"));
    let coordinate = |more: &[&str]| {
        let mut command = radwalk();
        command.args(["coordinate", JOB, "--paths", "10000000", "--quiet", "--listen", "127.0.0.1:0"]);
        command.args(TABLES).args(OFTEN).args(more).arg("--out").arg(&out).arg("--access").arg(&access);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let mut first = coordinate(&[]);
    wait_for("the access file", || access.exists().then_some(()));
    let mut worker =
        radwalk().args(["work", "--access"]).arg(&access).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_checkpoint(&out);
    assert!(first.try_wait().unwrap().is_none(), "the job is over too soon for this test");
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(worker.try_wait().unwrap().is_none(), "the worker waits");
    let (code, _, stderr) = finish(coordinate(&["--resume"]));
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(finish(worker).0, 0);
    assert_eq!(summary(&out)["provenance"]["workers"].as_array().unwrap().len(), 1, "it was the same worker");
    run_job(JOB, &straight, &["--paths", "10000000"]);
    assert!(answer(&out) == answer(&straight));
}

/// `tests/data/tally.v4.bin` has 5,000 paths of the cube in streams of 1,000, as radwalk 0.1 wrote them in format 4.
/// `tally.v5.bin` has as many that came through a relay before relays reported their workers, in format 5.
#[test]
fn tallies_of_earlier_versions_are_audited_merged_and_gone_on_from() {
    let folder = tempdir().unwrap();
    let [straight, rest] = ["straight", "rest"].map(|name| path(&folder, name));
    run_job(JOB, &straight, &["--paths", "20000"]);
    run_job(JOB, &rest, &["--paths", "15000", "--set", "budget.first_path=5000"]);
    for version in ["v4", "v5"] {
        let [out, merged] = ["out", "merged"].map(|name| path(&folder, &format!("{name}.{version}")));
        std::fs::create_dir(&out).unwrap();
        std::fs::copy(format!("tests/data/tally.{version}.bin"), out.join("tally.bin")).unwrap();
        let (code, stdout, stderr) = run(&["audit", out.to_str().unwrap(), "--share", "1"]);
        assert_eq!(code, 0, "{stderr}");
        assert!(stdout.contains("5000 of 5000 paths"), "{stdout}");
        let runs = [out.to_str().unwrap(), rest.to_str().unwrap()];
        assert_eq!(run(&["merge", runs[0], runs[1], "--quiet", "--out", merged.to_str().unwrap()]).0, 0);
        assert!(answer(&merged) == answer(&straight));
        let said = resume(&out, &["--paths", "20000"]);
        assert!(said.contains("resumed after 5000 paths"), "{said}");
        assert!(answer(&out) == answer(&straight));
        assert_eq!(std::fs::read(out.join("tally.bin")).unwrap()[8], 5, "it is written anew in this format");
        let (code, ..) = run(&["audit", out.to_str().unwrap(), "--share", "1", "--quiet"]);
        assert_eq!(code, 0);
    }
}

#[test]
fn tallies_of_unknown_formats_are_refused_in_words() {
    let folder = tempdir().unwrap();
    let out = path(&folder, "out");
    std::fs::create_dir(&out).unwrap();
    let mut bytes = std::fs::read("tests/data/tally.v4.bin").unwrap();
    for version in [3, 6] {
        bytes[8] = version;
        std::fs::write(out.join("tally.bin"), &bytes).unwrap();
        for command in [&["run", JOB, "--resume", "--out"][..], &["audit"]] {
            let (code, _, stderr) = run(&[command, &[out.to_str().unwrap()]].concat());
            assert_eq!(code, 2, "{stderr}");
            assert!(
                stderr.contains(&format!("it is of format {version} (this program knows 4 and 5)")),
                "{stderr}"
            );
        }
    }
}
