//! Tests of the laboratory's commands, in one binary.

mod commands;
mod reproduce;
mod stability;

use std::process::{Command, Stdio};

/// Runs a command of the laboratory to its end; returns exit code, stdout, stderr.
fn run(args: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_radwalk-lab"));
    let output = command.args(args).stdin(Stdio::null()).env_remove("COLUMNS").output().unwrap();
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    (output.status.code().unwrap_or(-1), stdout, stderr)
}
