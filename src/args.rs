//! What can be typed.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Distributed Monte Carlo radiosity with confidence intervals that are true.
#[derive(Parser)]
#[command(version = crate::BUILD, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    /// Shoot a job on worker processes of this machine and write its results
    Run(RunArgs),
    /// Coordinate a job for workers that are started elsewhere (`radwalk work`)
    Coordinate(CoordinateArgs),
    /// Work for the coordinator of an access file until its job is done
    Work(WorkArgs),
    /// Be one worker to a coordinator, and a coordinator to workers of its own
    Relay(RelayArgs),
    /// Solve the radiosity system of a small scene without any randomness
    Exact(ExactArgs),
    /// Combine runs of one scene and method into one result
    Merge(MergeArgs),
    /// Trace a random sample of a result's walks again and compare exactly
    Audit(AuditArgs),
    /// Trace one walk in words
    Replay(ReplayArgs),
    /// Say what a job will take: walks, rays, time, memory and traffic, by bounds and by a pilot
    Plan(PlanArgs),
    /// Measure the papers' tables and figures again and hold them to theory
    Reproduce(ReproduceArgs),
    /// Write a job and a scene to begin with
    New(NewArgs),
    /// Check a job or a scene and say what would be modelled, and why
    Check(CheckArgs),
    /// Drive methods to where they fail: what theory predicts, what is seen, what is said, what to do instead
    Stability(StabilityArgs),
    /// Chart speed against accuracy of every method that fits a scene, and say what to use when
    Compare(CompareArgs),
}

/// A job and what to change in it.
#[derive(Args)]
pub struct JobArgs {
    /// The job file
    pub job: PathBuf,
    /// Total walks (budget.paths)
    #[arg(long, value_name = "N")]
    pub paths: Option<u64>,
    /// The seed
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Set any key of the job, e.g. --set method.space=continuous
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl JobArgs {
    /// Every change as KEY=VALUE.
    pub fn overrides(&self) -> Vec<String> {
        let paths = self.paths.map(|paths| format!("budget.paths={paths}"));
        let seed = self.seed.map(|seed| format!("seed={seed}"));
        self.set.iter().cloned().chain(paths).chain(seed).collect()
    }
}

/// Where results go and what is said on the way.
#[derive(Args)]
pub struct OutArgs {
    /// The output folder [default: out/<job name>; of reproduce: out/papers]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace results that are in the output folder
    #[arg(long)]
    pub force: bool,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
    /// Report progress as JSON lines on stderr
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct RunArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
    /// Worker processes [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub workers: Option<u32>,
    /// Threads of each worker
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: u32,
    /// Go on from the checkpoint in the output folder; with more --paths, also from its end
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}

#[derive(Args)]
pub struct CoordinateArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
    /// Where to listen for workers: the name by which they reach this machine, e.g. node1:7600 (port 0: any free one)
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:0")]
    pub listen: String,
    /// The access file to write for workers [default: <output folder>/access.json]
    #[arg(long, value_name = "FILE")]
    pub access: Option<PathBuf>,
    /// Go on from the checkpoint in the output folder; with more --paths, also from its end
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}

#[derive(Args)]
pub struct WorkArgs {
    /// The access file that the coordinator wrote; - reads it from standard input
    #[arg(long, value_name = "FILE")]
    pub access: PathBuf,
    /// Threads
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: u32,
    /// Say nothing but panics; the coordinator reports what goes wrong
    #[arg(long)]
    pub quiet: bool,
    /// How long to look for a coordinator that is not there yet, or went away without a word [default: 600; started by
    /// hand, 0 for one that is not there yet]
    #[arg(long, value_name = "SECONDS")]
    pub wait: Option<u64>,
}

#[derive(Args)]
pub struct RelayArgs {
    /// The access file that the coordinator (or another relay) wrote
    #[arg(long, value_name = "FILE")]
    pub access: PathBuf,
    /// The access file to write for this relay's workers
    #[arg(long, value_name = "FILE")]
    pub out_access: PathBuf,
    /// Where to listen for workers: the name by which they reach this machine, e.g. node1:7600 (port 0: any free one)
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:0")]
    pub listen: String,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
    /// How long to look for a coordinator, as workers do
    #[arg(long, value_name = "SECONDS")]
    pub wait: Option<u64>,
}

#[derive(Args)]
pub struct MergeArgs {
    /// Output folders of runs of one scene and method
    #[arg(required = true, num_args = 1.., value_name = "OUT")]
    pub runs: Vec<PathBuf>,
    /// The output folder
    #[arg(long, value_name = "DIR", required = true)]
    pub out: PathBuf,
    /// Replace results that are in the output folder
    #[arg(long)]
    pub force: bool,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args)]
pub struct AuditArgs {
    /// The output folder of a run
    pub run: PathBuf,
    /// The part of the walks to trace again, drawn at random
    #[arg(long, value_name = "FRACTION", default_value_t = 0.001)]
    pub share: f64,
    /// Draw the same leases as another audit [default: a seed drawn anew]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args)]
pub struct ReplayArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// The number of the walk
    #[arg(long, value_name = "N")]
    pub walk: u64,
}

#[derive(Args)]
pub struct ExactArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
}

#[derive(Args)]
pub struct PlanArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// The plan as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct ReproduceArgs {
    /// Everything at reduced size: a minute
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    pub out: OutArgs,
    /// Threads; the answer does not depend on them [default: one per core]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
}

#[derive(Args)]
pub struct CompareArgs {
    /// Job files: their scenes are compared in, whatever their methods
    #[arg(required = true, num_args = 1.., value_name = "JOB")]
    pub jobs: Vec<PathBuf>,
    #[command(flatten)]
    pub out: OutArgs,
    /// Rays of the longest runs [default: 2^20, or 256 per patch]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1024..))]
    pub rays: Option<u64>,
    /// Runs of every method and size
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(2..))]
    pub runs: usize,
    /// Set any key of the jobs
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Worker processes [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub workers: Option<u32>,
    /// Threads of each worker
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: u32,
    /// Keep what is measured already
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}

#[derive(Args)]
pub struct StabilityArgs {
    #[command(flatten)]
    pub out: OutArgs,
    /// Fewer walks and shorter sweeps
    #[arg(long)]
    pub quick: bool,
    /// This entry only; may be repeated
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
}

#[derive(Args)]
pub struct CheckArgs {
    /// A job file or a scene file
    pub file: PathBuf,
    /// Set any key of the job
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Look for what is wrong with the geometry: flipped, doubled, buried and leaking surfaces, dark lamps
    #[arg(long)]
    pub fix_report: bool,
    /// Where the findings and pictures of the worst are written [default: out/<job name>-doctor]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write a copy of the scene with flipped surfaces turned round and doubled ones taken out: NAME.repaired.toml
    #[arg(long)]
    pub repair: bool,
}

#[derive(Args)]
pub struct NewArgs {
    /// What to begin with
    pub kind: Kind,
    /// Where to write the job and its scene
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
}

/// The kinds of beginnings.
#[derive(Clone, Copy, ValueEnum)]
pub enum Kind {
    /// An empty cube with a lamp in its ceiling
    Box,
    /// A room with a window, a table and a lamp
    Room,
    /// The Cornell box, in colour
    Cornell,
    /// The JSON schemas of job and scene files alone, for editors
    Schema,
}
