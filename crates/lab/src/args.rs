//! What can be typed.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use voice::Voice;

use crate::walking::Failure;
use crate::{choice, groups, honesty, kernel, patches};

/// Studies of radwalk and its methods: the papers again, the atlas of failure, and what measures the program.
#[derive(Parser)]
#[command(name = "radwalk-lab", version, arg_required_else_help = true, disable_help_subcommand = true)]
pub(crate) struct LabCli {
    #[command(subcommand)]
    pub command: LabCommand,
}

#[derive(Subcommand)]
pub(crate) enum LabCommand {
    /// Measure the papers' tables and figures again and hold them to theory
    Reproduce(ReproduceArgs),
    /// Drive methods to where they fail, and show prediction, measurement, messages and remedy
    Stability(StabilityArgs),
    #[command(flatten)]
    Study(Study),
}

/// Studies that take words and print, or write a page into a folder.
#[derive(Subcommand)]
pub(crate) enum Study {
    /// Hold what runs tell of their errors against the truth: FOLDER [--quick] [SCENE…] [ROOM…] → honesty.md
    Honesty(Words),
    /// Hold what the program chooses against jobs by hand: FOLDER MILLIONS KEPT ROOM… → choice.md
    Choice(Words),
    /// Show what the program chooses in even light, at R 0.99, by night, in halves, with one small lamp and a million triangles: FOLDER [quick] → survival.md
    Survival(Words),
    /// Measure what chosen groups of faces save in an imported interior: FOLDER [MILLIONS] → groups.md
    Groups(Words),
    /// Measure what chosen patches save: FOLDER [MILLIONS [SCENE | spread]] → patches.md, spread.md
    Patches(Words),
    /// Measure the gain of chains over collision walks: FOLDER [SCENE…] | FOLDER draw → gain.csv, charts
    Gain(Words),
    /// Measure the gain of Sobol sequences over random numbers: [SCENE…]
    Quasi(Words),
    /// Measure the gain of a final gather for one patch: [SCENE…]
    Gather(Words),
    /// Time per ray against patches and surfaces: FOLDER [draw] → scaling.csv, scaling.svg
    Scaling(Words),
    /// Time the kinds of walks against each other
    Methods(Words),
    /// Time walks that tell sources apart and measure what materials do
    Sources(Words),
    /// Measure what knowing hits, or sorting rays, would win in the tree: [TRIANGLES | MESH …]
    Ceiling(Words),
    /// Time and memory of reading scenes in every format: [TRIANGLES…]
    Reading(Words),
    /// Compare whole walks with Embree, as scripts/embree.sh does: COMPARE ROUNDS [MESH…]
    Embree(Words),
    /// Walk, for scripts/instructions.sh, and print the number of rays: WALKS (cube | cornell | TRIANGLES | MESH)
    Walk(Words),
    /// Trace rays through the tree and against every facet: TRIANGLES RAYS
    Brute(Words),
    /// Search for rays that fall out of closed scenes: RAYS
    Closed(Words),
    /// Time births at lamps, and count how often intervals of planes hold: FOLDER [RUNS] → lamps.md
    Lamps(Words),
    /// Count how often intervals of daylight hold: FOLDER [SEEDS] → daylight.md
    Daylight(Words),
    /// Print a made scene as a scene file: cornell | cube CELLS_PER_EDGE | interior TRIANGLES | two-rooms REFLECTANCE
    Write(Words),
}

impl Study {
    /// Runs the study.
    ///
    /// # Errors
    /// Why it cannot be done.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        match self {
            Study::Honesty(args) => honesty::run(&args.words),
            Study::Choice(args) => choice::run(&args.words),
            Study::Survival(args) => choice::survival::run(&args.words),
            Study::Groups(args) => groups::run(&args.words),
            Study::Patches(args) => patches::run(&args.words),
            Study::Gain(args) => kernel::gain::run(&args.words),
            Study::Quasi(args) => kernel::quasi::run(&args.words),
            Study::Gather(args) => kernel::gather::run(&args.words),
            Study::Scaling(args) => kernel::scaling::run(&args.words),
            Study::Methods(_) => kernel::methods::run(),
            Study::Sources(_) => kernel::sources::run(),
            Study::Ceiling(args) => kernel::ceiling::run(&args.words),
            Study::Reading(args) => kernel::reading::run(&args.words),
            Study::Embree(args) => kernel::embree::run(&args.words),
            Study::Walk(args) => kernel::walk::run(&args.words),
            Study::Brute(args) => kernel::brute::run(&args.words),
            Study::Closed(args) => kernel::closed::run(&args.words),
            Study::Lamps(args) => kernel::lamps::run(&args.words),
            Study::Daylight(args) => kernel::daylight::run(&args.words),
            Study::Write(args) => kernel::write::run(&args.words),
        }
    }
}

/// The words of a study, in their order.
#[derive(Args)]
pub(crate) struct Words {
    /// What the study takes
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<String>,
}

/// Where results go, and which messages are shown.
#[derive(Args)]
pub(crate) struct LabOutArgs {
    /// The output folder [default: out/papers, out/validation or out/stability]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the output folder
    #[arg(long)]
    pub force: bool,
    /// Say nothing but errors
    #[arg(long, short)]
    pub quiet: bool,
    /// Report progress as JSON lines on stderr
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct ReproduceArgs {
    /// Everything at reduced size: a minute
    #[arg(long)]
    pub quick: bool,
    /// Configurations with closed forms in place of the papers: the scorecard
    #[arg(long)]
    pub validation: bool,
    #[command(flatten)]
    pub out: LabOutArgs,
    /// Threads; the answer does not depend on them [default: one per core]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
}

#[derive(Args)]
pub(crate) struct StabilityArgs {
    #[command(flatten)]
    pub out: LabOutArgs,
    /// Fewer walks and shorter sweeps
    #[arg(long)]
    pub quick: bool,
    /// This entry only; may be repeated
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
}

impl LabCommand {
    /// The voice that the command's messages have.
    pub(crate) fn voice(&self) -> Voice {
        match self {
            LabCommand::Reproduce(ReproduceArgs { out, .. })
            | LabCommand::Stability(StabilityArgs { out, .. }) => Voice::new(out.json, out.quiet, false),
            LabCommand::Study(_) => Voice::new(false, false, false),
        }
    }
}
