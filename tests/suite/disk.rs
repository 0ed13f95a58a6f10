//! Disks that are slow or fail, and clocks that jump, by a library that stands between the program and the system (built here
//! with the C compiler that links Rust, and preloaded): the same bytes, or a clean end that says why.
#![cfg(target_os = "linux")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::support::{answer, finish, path, radwalk, run_job};
use tempfile::{TempDir, tempdir};

/// The coloured Cornell box has tallies that are offered before they are sent.
const LARGE: &str = "configs/cornell.toml";

const SHIM: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static long number(const char *name) { const char *text = getenv(name); return text ? atol(text) : 0; }

/* SHIM_SYNC_MS: each fsync takes so long. SHIM_SYNC_FAILS: so many in ten fail. */
int fsync(int file) {
    static int calls;
    static int (*real)(int);
    if (!real) real = (int (*)(int))dlsym(RTLD_NEXT, "fsync");
    usleep(1000 * number("SHIM_SYNC_MS"));
    if (__sync_fetch_and_add(&calls, 1) * 7 % 10 < number("SHIM_SYNC_FAILS")) { errno = EIO; return -1; }
    return real(file);
}

/* SHIM_CLOCK: the time of day jumps by a day, to and fro. */
int clock_gettime(clockid_t clock, struct timespec *now) {
    static int calls;
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int done = real(clock, now);
    if (clock == CLOCK_REALTIME && number("SHIM_CLOCK") && __sync_fetch_and_add(&calls, 1) % 2) now->tv_sec -= 86400;
    return done;
}
"#;

fn shim(folder: &TempDir) -> PathBuf {
    let [source, library] = ["shim.c", "shim.so"].map(|name| path(folder, name));
    fs::write(&source, SHIM).unwrap();
    let status = Command::new("cc")
        .args(["-shared", "-fPIC", "-O1", "-o"])
        .args([&library, &source])
        .arg("-ldl")
        .status();
    assert!(status.unwrap().success(), "the C compiler");
    library
}

/// Runs the job with a shim before it; returns its exit code and what it said.
fn run_with(library: &Path, what: &[(&str, &str)], out: &Path, args: &[&str]) -> (i32, String) {
    let mut command = radwalk();
    command.args([
        "run",
        LARGE,
        "--workers",
        "2",
        "--quiet",
        "--set",
        "budget.checkpoint_seconds=0.1",
        "--out",
    ]);
    command.arg(out).args(args).env("LD_PRELOAD", library).envs(what.iter().copied());
    let (code, _, stderr) = finish(command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap());
    (code, stderr)
}

#[test]
fn slow_and_failing_disks_and_jumping_clocks_change_nothing() {
    let folder = tempdir().unwrap();
    let library = shim(&folder);
    let straight = path(&folder, "straight");
    let paths = ["--paths", "600000", "--set", "budget.stream_paths=4096"];
    run_job(LARGE, &straight, &paths);
    for (n, what) in [
        &[("SHIM_SYNC_MS", "300")][..],
        &[("SHIM_SYNC_MS", "30"), ("SHIM_SYNC_FAILS", "1")],
        &[("SHIM_CLOCK", "1"), ("SHIM_SYNC_MS", "50")],
    ]
    .into_iter()
    .enumerate()
    {
        let out = path(&folder, &format!("out{n}"));
        let (code, said) = run_with(&library, what, &out, &paths);
        assert_eq!(code, 0, "{what:?}: {said}");
        assert!(answer(&out) == answer(&straight), "{what:?}");
    }
}

#[test]
fn a_disk_that_never_syncs_is_told_of_and_leaves_what_was_there() {
    let folder = tempdir().unwrap();
    let library = shim(&folder);
    let out = path(&folder, "out");
    run_job(LARGE, &out, &["--paths", "20000"]);
    let before = answer(&out);
    let (code, said) =
        run_with(&library, &[("SHIM_SYNC_FAILS", "10")], &out, &["--paths", "600000", "--resume"]);
    assert_eq!(code, 2, "{said}");
    assert!(said.contains("no checkpoint: cannot write") && said.contains("tried again in 8 s"), "{said}");
    assert!(answer(&out) == before);
}
