//! `radwalk`: arguments, progress, exit codes; the only place that prints.

mod args;
mod audit;
mod check;
mod checkpoints;
mod compare;
mod console;
mod coordinate;
mod date;
mod doctor_report;
mod exact_command;
mod fault;
mod launcher;
mod local;
mod merge;
mod new;
mod outputs;
mod plan;
mod progress;
mod relay;
mod replay;
mod replica;
mod reproduce;
mod settings;
mod signals;
mod stability;
mod work;

use std::process::ExitCode;

use clap::Parser;

use crate::args::{Cli, Command};
use crate::console::tell;

/// Version and commit: workers join only coordinators of the same build.
pub const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("RADWALK_GIT"));

fn main() -> ExitCode {
    let command = Cli::parse().command;
    // The coordinator that started a quiet worker says what becomes of it.
    let silent = matches!(&command, Command::Work(args) if args.quiet);
    let done = match command {
        Command::Run(args) => coordinate::run(&args),
        Command::Coordinate(args) => coordinate::coordinate(&args),
        Command::Work(args) => work::work(&args),
        Command::Relay(args) => relay::relay(&args),
        Command::Exact(args) => exact_command::exact(&args),
        Command::Merge(args) => merge::merge(&args),
        Command::Audit(args) => audit::audit(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Plan(args) => plan::plan(&args),
        Command::Reproduce(args) => reproduce::reproduce(&args),
        Command::New(args) => new::new(&args),
        Command::Check(args) => check::check(&args),
        Command::Stability(args) => stability::stability(&args),
        Command::Compare(args) => compare::compare(&args),
    };
    match done {
        Ok(outcome) => ExitCode::from(outcome.exit_code()),
        Err(fault) => {
            if !silent {
                tell(&format!("radwalk: {fault}"));
            }
            ExitCode::from(fault.exit_code())
        }
    }
}
