//! What can be typed.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use job::{OutputFile, Word};
use tracing::level_filters::LevelFilter;
use voice::{Form, Voice};

/// What every help page ends with.
const AFTER: &str = "\
Examples:
  radwalk new box && radwalk run box.toml      a first scene, on all cores: out/box/
  radwalk check room.glb --fix-report          what is wrong with a mesh
  radwalk plan box.toml                        what its target will take
  radwalk coordinate box.toml --listen node1:7600 --access box.json
  radwalk work --access box.json --threads 8   on every other machine
  radwalk status box.json                      how it gets on

Exit codes:
  0    done, and the target, if any, is reached; comparisons and audits agree
  1    the budget or the wall clock ended the job before its target was reached
  2    bad input or usage, or results that cannot be written
  3    the cluster failed, or an audit, a difference or a page of results did not hold
  130  interrupted; what was walked is written, `--resume` goes on from it

Environment:
  RADWALK_LOG     the least level that is told on stderr: error, warn, info, debug, trace or off [default: info; with
                  --quiet: warn]
  GLIBC_TUNABLES  as of the C library; where it is not set, workers of `radwalk run` ask for huge pages

Jobs, scenes, output files and checks: docs/reference/.";

const RUN: &str = "\
Examples:
  radwalk run box.toml                                       all cores, to the budget or the target of the job
  radwalk run box.toml --paths 1e9 --set target.relative_error=0.01
  radwalk run box.toml --resume --paths 2e9                  goes on from the checkpoint, or from the end, to more walks
  radwalk run room.glb --set method.walk=auto                a mesh with every default of a job";

const COORDINATE: &str = "\
Examples:
  radwalk coordinate box.toml --listen node1:7600 --access shared/box.json
  radwalk coordinate box.toml --listen 0.0.0.0:7600 --advertise gate.example.org:443 --metrics 9600";

const WORK: &str = "\
Examples:
  radwalk work --access shared/box.json --threads 8
  ssh node1 cat shared/box.json | radwalk work --access -";

const RELAY: &str = "\
Examples:
  radwalk relay --access shared/box.json --out-access rack7.json --listen node7:0
  radwalk work --access rack7.json                           on the machines of the rack; a node at once: scripts/node.sh";

const CHECK: &str = "\
Examples:
  radwalk check box.toml
  radwalk check room.glb --fix-report                        flipped, doubled, buried and leaking surfaces, dark lamps
  radwalk check room.glb --repair                            writes room.repaired.toml";

const STATUS: &str = "\
Examples:
  radwalk status out/box                                     a run on this machine, by its output folder
  radwalk status shared/box.json --json                      a job of `radwalk coordinate`, by its access file";

const EXACT: &str = "\
Examples:
  radwalk exact box.toml --out out/exact                     exact.csv: radiosities without noise, and variances of walks";

const AUDIT: &str = "\
Examples:
  radwalk audit out/box                                      traces one walk in a thousand again
  radwalk audit out/box --share 1                            traces all of them; names who delivered a wrong one";

const REPORT: &str = "\
Examples:
  radwalk report out/box                                     makes report.html and the rest again
  radwalk report out/box --export vtu,glb                    for ParaView, and for glTF viewers";

const REPLAY: &str = "\
Examples:
  radwalk replay box.toml --walk 7                           where walk 7 is born, what it meets, where it ends";

const PLAN: &str = "\
Examples:
  radwalk plan box.toml                                      what the target of the job will take
  radwalk plan box.toml --set target.relative_error=0.01 --json";

const REPRODUCE: &str = "\
Examples:
  radwalk reproduce --out out/papers                         a page with the papers' tables and figures";

const NEW: &str = "\
Examples:
  radwalk new box                                            box.toml, which `radwalk run box.toml` takes";

const STABILITY: &str = "\
Examples:
  radwalk stability --out out/atlas                          a page of all failures and their remedies";

const COMPARE: &str = "\
Examples:
  radwalk compare box.toml --out out/compare                 charts of time and rays against error, with a verdict";

const MERGE: &str = "\
Examples:
  radwalk merge out/seed1 out/seed2 --out out/both           runs of other seeds, or of other ranges of walks";

const DIFF: &str = "\
Examples:
  radwalk diff out/seed1 out/seed2                           two runs with other seeds agree, but for chance
  radwalk diff out/box out/exact                             a run and the output folder of `radwalk exact`";

/// Distributed Monte Carlo radiosity with confidence intervals that are true.
#[derive(Parser)]
#[command(version = crate::build::BUILD, arg_required_else_help = true, after_help = AFTER)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Shoot a job on worker processes of this machine and write its results
    #[command(after_help = RUN)]
    Run(RunArgs),
    /// Coordinate a job for workers that are started elsewhere (`radwalk work`)
    #[command(after_help = COORDINATE)]
    Coordinate(CoordinateArgs),
    /// Work for the coordinator of an access file until its job is done
    #[command(after_help = WORK)]
    Work(WorkArgs),
    /// Be one worker to a coordinator, and a coordinator to workers of its own
    #[command(after_help = RELAY)]
    Relay(RelayArgs),
    /// Say how a running job gets on: workers, rates, errors, time left, last checkpoint, faults
    #[command(after_help = STATUS)]
    Status(StatusArgs),
    /// Hold two results of one scene against each other, patch by patch
    #[command(after_help = DIFF)]
    Diff(DiffArgs),
    /// Solve the radiosity system of a small scene without any randomness
    #[command(after_help = EXACT)]
    Exact(ExactArgs),
    /// Combine runs of one scene and method into one result
    #[command(after_help = MERGE)]
    Merge(MergeArgs),
    /// Trace a random sample of a result's walks again and compare exactly
    #[command(after_help = AUDIT)]
    Audit(AuditArgs),
    /// Make table, summary, picture and page of a result again from its tally
    #[command(after_help = REPORT)]
    Report(ReportArgs),
    /// Trace one walk in words
    #[command(after_help = REPLAY)]
    Replay(ReplayArgs),
    /// Say what a job will take: walks, rays, time, memory and traffic, by bounds and by a pilot
    #[command(after_help = PLAN)]
    Plan(PlanArgs),
    /// Measure the papers' tables and figures again and hold them to theory
    #[command(after_help = REPRODUCE)]
    Reproduce(ReproduceArgs),
    /// Write a job and a scene to begin with
    #[command(after_help = NEW)]
    New(NewArgs),
    /// Check a job or a scene and say what would be modelled, and why
    #[command(after_help = CHECK)]
    Check(CheckArgs),
    /// Drive methods to where they fail: what theory predicts, what is seen, what is said, what to do instead
    #[command(after_help = STABILITY)]
    Stability(StabilityArgs),
    /// Chart speed against accuracy of every method that fits a scene, and say what to use when
    #[command(after_help = COMPARE)]
    Compare(CompareArgs),
}

/// A whole number as people write it: 1000000, 1_000_000 or 1e6. TOML holds none beyond 63 bits.
fn count(typed: &str) -> Result<u64, String> {
    let largest = i64::MAX as u64;
    let too_large = || format!("it is above {largest}, the largest number of a job file");
    let no_number = || Err("it is not a whole number; write 1000000, 1_000_000 or 1e6".into());
    if typed.starts_with('_') {
        return no_number();
    }
    let digits = typed.replace('_', "");
    if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return digits.parse().ok().filter(|&n| n <= largest).ok_or_else(too_large);
    }
    match digits.parse::<f64>() {
        Ok(number) if number.is_finite() && number >= largest as f64 => Err(too_large()),
        // Above, floats do not hold every integer.
        Ok(number) if number.fract() == 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&number) => {
            Ok(number as u64)
        }
        _ => no_number(),
    }
}

/// A number of worker processes.
fn workers(typed: &str) -> Result<u32, String> {
    within(typed, 4096)
}

/// A number of threads.
fn threads(typed: &str) -> Result<u32, String> {
    within(typed, 1024)
}

fn within(typed: &str, most: u32) -> Result<u32, String> {
    let number = count(typed).ok().and_then(|number| u32::try_from(number).ok());
    number
        .filter(|number| (1..=most).contains(number))
        .ok_or(format!("write a whole number from 1 to {most}"))
}

/// The rays of a comparison's longest runs.
fn rays(typed: &str) -> Result<u64, String> {
    count(typed)?.checked_sub(1024).map(|more| more + 1024).ok_or("fewer than 1024 rays tell nothing".into())
}

/// A job and what to change in it.
#[derive(Args)]
pub(crate) struct JobArgs {
    /// The job file
    pub job: PathBuf,
    /// Total walks (budget.paths): 1000000, 1_000_000 or 1e6
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub paths: Option<u64>,
    /// The seed
    #[arg(long, value_name = "S", value_parser = count, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Set any key of the job, e.g. --set method.space=continuous
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

impl JobArgs {
    /// Every change as KEY=VALUE.
    pub(crate) fn overrides(&self) -> Vec<String> {
        let paths = self.paths.map(|paths| format!("budget.paths={paths}"));
        let seed = self.seed.map(|seed| format!("seed={seed}"));
        self.set.iter().cloned().chain(paths).chain(seed).collect()
    }
}

/// Where results go and what is said on the way.
#[derive(Args)]
pub(crate) struct OutArgs {
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

/// What is written beside the files that the job names.
#[derive(Args)]
pub(crate) struct ExportArgs {
    /// Write these files, too; may be a list, e.g. --export vtu,glb
    #[arg(long, value_name = "FILE", value_delimiter = ',', value_parser = output_file())]
    pub export: Vec<OutputFile>,
}

/// The words of `[output] files`.
fn output_file() -> impl TypedValueParser<Value = OutputFile> {
    let word = |file: &OutputFile| {
        PossibleValue::new(file.word()).help(format!("{}: {}", file.name(), file.purpose()))
    };
    let named = |word: String| OutputFile::ALL.iter().copied().find(|file| file.word() == word);
    let words = PossibleValuesParser::new(OutputFile::ALL.iter().map(word));
    words.map(move |word| named(word).expect("one of these words"))
}

/// Whom a job lets see how it gets on.
#[derive(Args)]
pub(crate) struct MonitorArgs {
    /// Metrics for Prometheus at http://HOST:PORT/metrics; a port alone: for this machine only. Nothing is secret there,
    /// and nothing is asked of who reads it
    #[arg(long, value_name = "HOST:PORT")]
    pub metrics: Option<String>,
    /// The report of the result so far at http://HOST:PORT/, which follows the run; a port alone: for this machine only.
    /// Elsewhere the address that is told has a key; what is read is not encrypted
    #[arg(long, value_name = "HOST:PORT")]
    pub watch: Option<String>,
}

#[derive(Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
    #[command(flatten)]
    pub export: ExportArgs,
    /// Worker processes [default: one per core]
    #[arg(long, value_name = "N", value_parser = workers)]
    pub workers: Option<u32>,
    /// Threads of each worker
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = threads)]
    pub threads: u32,
    /// Go on from the checkpoint in the output folder; with more --paths, also from its end
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    #[command(flatten)]
    pub monitor: MonitorArgs,
}

#[derive(Args)]
pub(crate) struct CoordinateArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
    #[command(flatten)]
    pub export: ExportArgs,
    /// Where to listen for workers: the name by which they reach this machine, e.g. node1:7600 (port 0: any free one)
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:0")]
    pub listen: String,
    /// The name or address by which others reach this machine, where that is not the one of --listen; with a port, where
    /// a gate in between has another
    #[arg(long, value_name = "HOST")]
    pub advertise: Option<String>,
    /// The access file to write for workers [default: <output folder>/access.json]
    #[arg(long, value_name = "FILE")]
    pub access: Option<PathBuf>,
    /// Go on from the checkpoint in the output folder; with more --paths, also from its end
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    #[command(flatten)]
    pub monitor: MonitorArgs,
}

#[derive(Args)]
pub(crate) struct WorkArgs {
    /// The access file that the coordinator wrote; - reads it from standard input
    #[arg(long, value_name = "FILE")]
    pub access: PathBuf,
    /// Threads
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = threads)]
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
pub(crate) struct RelayArgs {
    /// The access file that the coordinator (or another relay) wrote
    #[arg(long, value_name = "FILE")]
    pub access: PathBuf,
    /// The access file to write for this relay's workers
    #[arg(long, value_name = "FILE")]
    pub out_access: PathBuf,
    /// Where to listen for workers: the name by which they reach this machine, e.g. node1:7600 (port 0: any free one)
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:0")]
    pub listen: String,
    /// The name or address by which others reach this machine, where that is not the one of --listen; with a port, where
    /// a gate in between has another
    #[arg(long, value_name = "HOST")]
    pub advertise: Option<String>,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
    /// How long to look for a coordinator, as workers do
    #[arg(long, value_name = "SECONDS")]
    pub wait: Option<u64>,
}

#[derive(Args)]
pub(crate) struct StatusArgs {
    /// The access file or the output folder of the job
    #[arg(value_name = "ACCESS-or-OUT")]
    pub of: PathBuf,
    /// The status as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct DiffArgs {
    /// The output folder of a run
    pub first: PathBuf,
    /// The output folder of another run of the same scene
    pub second: PathBuf,
    /// The comparison as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct MergeArgs {
    /// Output folders of runs of one scene and method
    #[arg(required = true, num_args = 1.., value_name = "OUT")]
    pub runs: Vec<PathBuf>,
    /// The output folder
    #[arg(long, value_name = "DIR", required = true)]
    pub out: PathBuf,
    #[command(flatten)]
    pub export: ExportArgs,
    /// Replace results that are in the output folder
    #[arg(long)]
    pub force: bool,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args)]
pub(crate) struct AuditArgs {
    /// The output folder of a run
    pub run: PathBuf,
    /// The part of the walks to trace again, drawn at random
    #[arg(long, value_name = "FRACTION", default_value_t = 0.001)]
    pub share: f64,
    /// Draw the same leases as another audit [default: a seed drawn anew]
    #[arg(long, value_name = "S", value_parser = count, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args)]
pub(crate) struct ReportArgs {
    /// The output folder of a run
    pub run: PathBuf,
    #[command(flatten)]
    pub export: ExportArgs,
    /// Say nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Args)]
pub(crate) struct ReplayArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// The number of the walk
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub walk: u64,
}

#[derive(Args)]
pub(crate) struct ExactArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub out: OutArgs,
}

#[derive(Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub job: JobArgs,
    /// The plan as JSON on stdout
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub(crate) struct ReproduceArgs {
    /// Everything at reduced size: a minute
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    pub out: OutArgs,
    /// Threads; the answer does not depend on them [default: one per core]
    #[arg(long, value_name = "T", value_parser = threads)]
    pub threads: Option<u32>,
}

#[derive(Args)]
pub(crate) struct CompareArgs {
    /// Job files: their scenes are compared in, whatever their methods
    #[arg(required = true, num_args = 1.., value_name = "JOB")]
    pub jobs: Vec<PathBuf>,
    #[command(flatten)]
    pub out: OutArgs,
    /// Rays of the longest runs [default: 2^20, or 256 per patch]
    #[arg(long, value_name = "N", value_parser = rays)]
    pub rays: Option<u64>,
    /// Runs of every method and size
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(2..))]
    pub runs: usize,
    /// Set any key of the jobs
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Worker processes [default: one per core]
    #[arg(long, value_name = "N", value_parser = workers)]
    pub workers: Option<u32>,
    /// Threads of each worker
    #[arg(long, value_name = "T", default_value_t = 1, value_parser = threads)]
    pub threads: u32,
    /// Keep what is measured already
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
}

#[derive(Args)]
pub(crate) struct StabilityArgs {
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
pub(crate) struct CheckArgs {
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
pub(crate) struct NewArgs {
    /// What to begin with
    pub kind: Kind,
    /// Where to write the job and its scene
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
}

/// The kinds of beginnings.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Kind {
    /// An empty cube with a lamp in its ceiling
    Box,
    /// A room with a window, a table and a lamp
    Room,
    /// The Cornell box, in colour
    Cornell,
    /// The JSON schemas of job and scene files alone, for editors
    Schema,
}

impl Command {
    /// In what voice the command tells what it does.
    pub(crate) fn voice(&self) -> Voice {
        let of = |out: &OutArgs, long| Voice::new(out.json, out.quiet, long);
        match self {
            Command::Run(args) => of(&args.out, true),
            Command::Coordinate(args) => of(&args.out, true),
            // The coordinator that started a quiet worker says what becomes of it.
            Command::Work(WorkArgs { quiet: true, .. }) => {
                Voice { form: Form::Plain, level: LevelFilter::OFF }
            }
            Command::Work(_) => Voice::new(false, false, true),
            Command::Relay(args) => Voice::new(false, args.quiet, true),
            Command::Exact(args) => of(&args.out, false),
            Command::Reproduce(args) => of(&args.out, false),
            Command::Stability(args) => of(&args.out, false),
            Command::Compare(args) => of(&args.out, false),
            Command::Plan(args) => Voice::new(args.json, false, false),
            Command::Status(args) => Voice::new(args.json, false, false),
            Command::Diff(args) => Voice::new(args.json, false, false),
            Command::Merge(args) => Voice::new(false, args.quiet, false),
            Command::Audit(args) => Voice::new(false, args.quiet, false),
            Command::Report(args) => Voice::new(false, args.quiet, false),
            Command::Replay(_) | Command::New(_) | Command::Check(_) => Voice::new(false, false, false),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn counts_are_written_as_people_write_them() {
        for (typed, number) in [
            ("0", 0),
            ("1_000_000", 1_000_000),
            ("1e6", 1_000_000),
            ("2.5E3", 2500),
            ("9223372036854775807", i64::MAX as u64),
        ] {
            assert_eq!(count(typed), Ok(number), "{typed}");
        }
        for typed in ["", "_1", "-1", "1.5", "1e-3", "many", "inf", "nan", "0x10"] {
            assert!(count(typed).unwrap_err().contains("1_000_000"), "{typed}");
        }
        assert_eq!((workers("4096"), threads("1e3")), (Ok(4096), Ok(1000)));
        for typed in ["0", "4097", "many", "-1"] {
            assert_eq!(workers(typed), Err("write a whole number from 1 to 4096".into()), "{typed}");
        }
        for typed in ["9223372036854775808", "99999999999999999999", "1e30"] {
            assert!(count(typed).unwrap_err().contains("largest number"), "{typed}");
        }
    }

    /// Every command has examples, and what they show can be typed.
    #[test]
    fn the_examples_of_every_command_are_commands() {
        let cli = Cli::command();
        let shown =
            |command: &clap::Command| command.get_after_help().map(ToString::to_string).unwrap_or_default();
        for command in cli.get_subcommands() {
            let (name, help) = (command.get_name(), shown(command));
            let own = format!("  radwalk {name} ");
            assert!(help.starts_with("Examples:") && help.contains(&own), "radwalk {name} --help: {help}");
        }
        let all = cli.get_subcommands().map(shown).chain([shown(&cli)]).collect::<Vec<_>>().join("\n");
        let typed = all.lines().filter_map(|line| line.strip_prefix("  radwalk"));
        // What is beside it says what it does.
        let typed = typed.map(|line| line.split("  ").next().unwrap()).filter(|line| !line.contains("&&"));
        for line in typed {
            let words = ["radwalk"].into_iter().chain(line.split_whitespace());
            if let Err(error) = Cli::try_parse_from(words) {
                panic!("radwalk{line}: {error}");
            }
        }
    }
}
