//! What can be typed.

mod help;
mod options;
mod values;

use clap::{Parser, Subcommand};
use tracing::level_filters::LevelFilter;
use voice::{LineForm, Voice};

use self::help::*;
pub(crate) use self::options::*;

/// Distributed Monte Carlo radiosity with confidence intervals that are true.
#[derive(Parser)]
#[command(version = crate::build::BUILD, arg_required_else_help = true, disable_help_subcommand = true, after_help = AFTER)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Run a job on worker processes of this machine and write its results
    #[command(after_help = RUN)]
    Run(RunArgs),
    /// Coordinate a job for workers that are started elsewhere (`radwalk work`)
    #[command(after_help = COORDINATE)]
    Coordinate(CoordinateArgs),
    /// Work for the coordinator of an access file until its job is done
    #[command(after_help = WORK)]
    Work(WorkArgs),
    /// Join a coordinator as one worker, and coordinate workers of its own
    #[command(after_help = RELAY)]
    Relay(RelayArgs),
    /// Show the state of a running job: workers, rates, errors, time left, checkpoint, faults
    #[command(after_help = STATUS)]
    Status(StatusArgs),
    /// Compare two results of one scene, patch by patch
    #[command(after_help = DIFF)]
    Diff(DiffArgs),
    /// Solve the radiosity system of a small scene without any randomness
    #[command(after_help = EXACT)]
    Exact(ExactArgs),
    /// Count exchange factors between groups of surfaces, and the heat between them
    #[command(after_help = FACTORS)]
    Factors(FactorsArgs),
    /// Compute a year of daylight at the sensors of a job
    #[command(after_help = DAYLIGHT)]
    Daylight(DaylightArgs),
    /// Write a sky vector, or the sky matrix of a year, in the layout of Radiance's gendaymtx
    #[command(after_help = SKY)]
    Sky(SkyArgs),
    /// Combine runs of one scene and method into one result
    #[command(after_help = MERGE)]
    Merge(MergeArgs),
    /// Compute any mixture of a run's sources, without tracing a ray
    #[command(after_help = COMBINE)]
    Combine(CombineArgs),
    /// Trace a random sample of a result's walks again and compare exactly
    #[command(after_help = AUDIT)]
    Audit(AuditArgs),
    /// Make the files of a result again from its tally
    #[command(after_help = REPORT)]
    Report(ReportArgs),
    /// Describe one walk: its birth, its hits and its end
    #[command(after_help = REPLAY)]
    Replay(ReplayArgs),
    /// Predict the walks, rays, time, memory and traffic of a job
    #[command(after_help = PLAN)]
    Plan(PlanArgs),
    /// Moved to radwalk-lab
    #[command(hide = true)]
    Reproduce(MovedArgs),
    /// Write a job and a scene to begin with
    #[command(after_help = NEW)]
    New(NewArgs),
    /// Check a job or a scene, and say what will be modelled and why
    #[command(after_help = CHECK)]
    Check(CheckArgs),
    /// Describe a luminaire file (IES or EULUMDAT), and draw its polar curve
    #[command(after_help = LAMP)]
    Lamp(LampArgs),
    /// Moved to radwalk-lab
    #[command(hide = true)]
    Stability(MovedArgs),
    /// Chart speed against accuracy of every method that fits a scene
    #[command(after_help = COMPARE)]
    Compare(CompareArgs),
    /// Explain a command, or a word that radwalk uses
    #[command(after_help = HELP)]
    Help(HelpArgs),
}

impl Command {
    /// The voice that the command's messages have.
    pub(crate) fn voice(&self) -> Voice {
        let of = |out: &OutArgs, long| Voice::new(out.json, out.quiet, long);
        let told = |told: &ToldArgs| Voice::new(told.json, told.quiet, false);
        match self {
            Command::Run(args) => of(&args.work.out, true),
            Command::Coordinate(args) => of(&args.work.out, true),
            // The coordinator that started a quiet worker says what becomes of it.
            Command::Work(WorkArgs { quiet: true, .. }) => {
                Voice { form: LineForm::Plain, level: LevelFilter::OFF }
            }
            Command::Work(_) => Voice::new(false, false, true),
            Command::Relay(args) => Voice::new(false, args.quiet, true),
            Command::Exact(args) => of(&args.out, false),
            Command::Factors(args) => of(&args.out, false),
            Command::Daylight(args) => of(&args.out, false),
            Command::Sky(args) => told(&args.told),
            Command::Compare(args) => of(&args.out, false),
            Command::Plan(args) => Voice::new(args.json, false, false),
            Command::Status(args) => Voice::new(args.json, false, false),
            Command::Diff(args) => Voice::new(args.json, false, false),
            Command::Merge(args) => told(&args.made.told),
            Command::Combine(args) => told(&args.made.told),
            Command::Lamp(args) => Voice::new(args.json, args.quiet, false),
            Command::Audit(args) => Voice::new(false, args.quiet, false),
            Command::Report(args) => told(&args.told),
            Command::New(args) => told(&args.told),
            Command::Check(args) => Voice::new(args.json, args.quiet, false),
            Command::Reproduce(_) | Command::Stability(_) | Command::Replay(_) | Command::Help(_) => {
                Voice::new(false, false, false)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    /// Every command has examples, and what they show can be typed.
    #[test]
    fn the_examples_of_every_command_are_commands() {
        let cli = Cli::command();
        let shown =
            |command: &clap::Command| command.get_after_help().map(ToString::to_string).unwrap_or_default();
        for command in cli.get_subcommands().filter(|command| !command.is_hide_set()) {
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
