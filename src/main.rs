//! `radwalk`: arguments, processes, and what is printed.

#![warn(unreachable_pub, unnameable_types)]
#![forbid(unsafe_code)]

mod args;
mod build;
mod choose;
mod clock;
mod commands;
mod date;
mod fault;
#[cfg(debug_assertions)]
mod faulty;
mod keeping;
mod lead;
mod local;
mod pilot;
mod progress;
mod rounds;
mod shift;
mod signals;
mod summary;
mod team;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::Parser;
use tracing::error;
use voice::{Voice, emit, record, say, unsaid};

use crate::args::{Cli, Command};
use crate::commands::{
    audit, check, combine, compare, coordinate, daylight, diff, exact, factors, help, lamp, merge, new, plan,
    relay, replay, report, sky, status, work,
};
use crate::fault::{Fault, Outcome};

#[global_allocator]
static ALLOCATOR: pages::HugePages = pages::HugePages;

fn main() -> ExitCode {
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command,
        Err(error) => return usage(&error),
    };
    if let Err(word) = command.voice().begin() {
        return end(Err(Fault::LogLevel { word }));
    }
    end(match command {
        Command::Run(args) => coordinate::run(&args),
        Command::Coordinate(args) => coordinate::coordinate(&args),
        Command::Work(args) => work::work(&args),
        Command::Relay(args) => relay::relay(&args),
        Command::Exact(args) => exact::exact(&args),
        Command::Factors(args) => factors::factors(&args),
        Command::Daylight(args) => daylight::daylight(&args),
        Command::Sky(args) => sky::sky(&args),
        Command::Status(args) => status::status(&args),
        Command::Diff(args) => diff::diff(&args),
        Command::Merge(args) => merge::merge(&args),
        Command::Combine(args) => combine::combine(&args),
        Command::Audit(args) => audit::audit(&args),
        Command::Report(args) => report::report(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Plan(args) => plan::plan(&args),
        Command::Reproduce(_) => Err(Fault::Moved { command: "reproduce" }),
        Command::New(args) => new::new(&args),
        Command::Check(args) => check::check(&args),
        Command::Stability(_) => Err(Fault::Moved { command: "stability" }),
        Command::Compare(args) => compare::compare(&args),
        Command::Lamp(args) => lamp::lamp(&args),
        Command::Help(args) => help::help(&args),
    })
}

/// Says what went wrong, if anything did, and how the program ends. A command whose results could not be written has failed.
fn end(done: Result<Outcome, Fault>) -> ExitCode {
    let code = match &done {
        Ok(outcome) => outcome.exit_code(),
        Err(fault) => {
            error!("{fault}");
            fault.exit_code()
        }
    };
    let unsaid = unsaid().map(|source| Fault::Unsaid { source });
    if let Some(fault) = &unsaid {
        error!("{fault}");
    }
    ExitCode::from(unsaid.filter(|_| code == 0).map_or(code, |fault| fault.exit_code()))
}

/// Help and versions, and what was typed wrongly.
fn usage(error: &clap::Error) -> ExitCode {
    let json = std::env::args_os().any(|arg| arg == "--json");
    // There is no level to be wrong yet.
    let _ = Voice::new(json, false, false).begin();
    let code = u8::try_from(error.exit_code()).unwrap_or(2);
    if error.use_stderr() {
        if json {
            emit(&record("error", "error", error.to_string().trim()).into());
        } else {
            // What a reader that is gone does not read, it does not miss.
            let _ = error.print();
        }
    } else if std::io::stdout().is_terminal() {
        let _ = error.print();
    } else {
        // Colours are for terminals; and a full disk is heard of.
        say(error.to_string().trim_end());
    }
    match unsaid() {
        Some(source) => end(Err(Fault::Unsaid { source })),
        None => ExitCode::from(code),
    }
}
