//! `radwalk-lab`: studies of the program and its methods. [`papers`] measures the published tables and figures again, [`atlas`] drives methods to
//! where they fail, [`validation`] holds walks to closed forms; [`honesty`], [`choice`], [`groups`] and [`patches`] ask how true and how good runs are, and
//! [`kernel`] has what measures walks themselves.
//!
//! The laboratory uses the libraries of the program, and the program nothing of it. Seeds are fixed, so that an answer depends on the size of a
//! study alone, not on threads or machines. Times are the exception, and are never judged.
//!
//! Papers are cited by key: S97 = Sbert, *Error and Complexity of Random Walk Monte Carlo Radiosity* (1997);
//! SInf = Sbert, *Variance of two infinite path length random walk radiosity estimators*; BS = Bekaert & Seidel,
//! *A Theoretical Comparison of Monte Carlo Radiosity Algorithms*; Sh91 = Shirley, *Time Complexity of Monte Carlo
//! Radiosity* (1991).

#![allow(rustdoc::broken_intra_doc_links, reason = "units are written in square brackets")]

mod args;
mod arithmetic;
mod atlas;
mod choice;
mod claim;
mod clock;
mod edition;
mod fault;
mod groups;
mod honesty;
mod judged_run;
mod kernel;
mod lab;
mod papers;
mod patches;
mod reproduce;
mod series;
mod stability;
mod validation;
mod walking;

use std::process::ExitCode;

use clap::Parser;
use tracing::error;
use voice::unsaid;

use crate::args::{LabCli, LabCommand};
use crate::fault::LabFault;

fn main() -> ExitCode {
    // Refusals and help end the process here.
    let command = LabCli::parse().command;
    let begun = command.voice().begin().map_err(|word| LabFault::LogLevel { word });
    let done = begun.and_then(|()| run(&command));
    let done = done.and_then(|()| unsaid().map_or(Ok(()), |source| Err(LabFault::Unsaid { source })));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            error!("{fault}");
            ExitCode::from(fault.exit_code())
        }
    }
}

fn run(command: &LabCommand) -> Result<(), LabFault> {
    match command {
        LabCommand::Reproduce(args) => reproduce::reproduce(args),
        LabCommand::Stability(args) => stability::stability(args),
        LabCommand::Study(study) => study.run().map_err(|source| LabFault::Study { source }),
    }
}
