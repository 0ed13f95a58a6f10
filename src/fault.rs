//! Every way a command can end, and its exit code.

use std::path::PathBuf;

use cluster::ListenError;
use monitor::NoPage;
use thiserror::Error;

/// How a command ended that did what it was asked to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Done, and the target, if any, is reached.
    Done,
    /// The budget or the wall clock ended the job before its target was reached.
    TargetMissed,
    /// A check names faults.
    Faulty,
    /// A signal ended it; what was merged is written.
    Interrupted,
}

/// Why a command could not do what it was asked to.
#[derive(Debug, Error)]
pub(crate) enum Fault {
    /// The job or its scene is not usable.
    #[error(transparent)]
    Job(#[from] job::Error),
    /// The method would be wrong in this scene.
    #[error("{0}")]
    Unfit(#[from] radiosity::Unfit),
    /// Results cannot be written.
    #[error(transparent)]
    Report(#[from] report::Error),
    /// A result cannot be written, read, or believed.
    #[error(transparent)]
    Results(#[from] results::Error),
    /// A coordinator or a relay cannot listen at an address.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// A page of a running job cannot be opened.
    #[error(transparent)]
    NoPage(#[from] NoPage),
    /// An audit found walks that were delivered wrongly.
    #[error(transparent)]
    Audit(#[from] results::Wrong),
    /// Nothing is known of a job.
    #[error(transparent)]
    NoStatus(#[from] monitor::NoStatus),
    /// The scene has no deterministic solution here.
    #[error(transparent)]
    Exact(#[from] exact::ExactError),
    /// Light in two units.
    #[error(
        "--light gives {name:?} in W, beside light in lm or lx: a result has one unit, and its W would count as lm; give all in lm, or all in W"
    )]
    MixedUnits { name: String },
    /// An access file cannot be read.
    #[error(
        "cannot use the access file {path} ({source}); give the file that `radwalk coordinate` or `relay` wrote"
    )]
    AccessFile { path: PathBuf, source: std::io::Error },
    /// An access file cannot be written.
    #[error(
        "cannot write the access file {path} ({source}); choose a place that can be written with --access (for a relay, --out-access)"
    )]
    AccessFileWrite { path: PathBuf, source: std::io::Error },
    /// A relay would write over the access file that it reads.
    #[error(
        "--access and --out-access name the same file, {path} (a relay reads one and writes the other); give its workers another"
    )]
    OneAccessFile { path: PathBuf },
    /// A coordinator has not reported for some seconds.
    #[error(
        "the coordinator, process {pid} of {host}, has not reported for {seconds} s (it was killed, or its disk is full); go on with `radwalk run --resume` or `coordinate --resume`"
    )]
    Silent { host: String, pid: u32, seconds: u64 },
    /// The two results of `diff` differ.
    #[error("the results differ: {0}")]
    Differ(String),
    /// This worker could not work.
    #[error(transparent)]
    Worker(#[from] cluster::WorkerError),
    /// The workers are gone.
    #[error("no worker is left ({0}); see the messages above, then run the job again")]
    NoWorkers(String),
    /// A file would be written over.
    #[error("{} is there already (nothing is replaced unless asked for); replace it with --force", path.display())]
    Taken { path: PathBuf },
    /// A copy would be written over another.
    #[error("{} is there already (it would be lost); move it away", path.display())]
    CopyTaken { path: PathBuf },
    /// A file cannot be written.
    #[error("cannot write {} ({source}); choose a place that can be written", path.display())]
    NotWritten { path: PathBuf, source: std::io::Error },
    /// There was room for the tally alone.
    #[error(
        "{fault}. The walks are kept in {tally}; make room, then `radwalk report {out}` makes the other files",
        tally = out.join("tally.bin").display(), out = out.display()
    )]
    TallyAlone { fault: Box<Fault>, out: PathBuf },
    /// Results could not be written to stdout.
    #[error(
        "stdout cannot be written ({source}), so the output there is incomplete; send it to a place that has room"
    )]
    Unsaid { source: std::io::Error },
    /// The environment asks for a level of messages that there is not.
    #[error(
        "RADWALK_LOG={word}: there is no such level of messages; choose error, warn, info, debug, trace or off"
    )]
    LogLevel { word: String },
    /// Neither chains nor batches are walks.
    #[error(
        "a job of chains or Sobol batches has no walks to replay (the walks of one depend on each other); give --set method.walk=shooting --set method.sampler=random, or another job"
    )]
    NoWalks,
    /// A command needs patches that the job leaves to the program.
    #[error(
        "{}: the patches of the job are not cut yet (a pilot cuts them when it is run, and {command} is about given patches); run it first, and write patches = \"out/{name}/partition.toml\" in [scene]",
        path.display()
    )]
    OpenPatches {
        /// The path of the job file.
        path: PathBuf,
        /// The name of the job.
        name: String,
        /// The name of the command.
        command: &'static str,
    },
    /// A part of the walks is no part.
    #[error("--share {0} is outside (0, 1] (it is the part of the walks to trace again); give 0.001, say")]
    Share(f64),
    /// There is no help on a word.
    #[error(
        "there is no command and no word \"{word}\" (the words are those of docs/reference/glossary.md); choose a command, or {known}"
    )]
    NoWord { word: String, known: String },
    /// A table of earlier measurements cannot be read.
    #[error("cannot go on from {} ({source}); remove it, or start afresh with --force", path.display())]
    Table { path: PathBuf, source: std::io::Error },
    /// A command of the laboratory.
    #[error(
        "`radwalk {command}` is a command of the laboratory now (it studies methods, not your scene); use `radwalk-lab {command}`: cargo run --release -p radwalk-lab -- {command}"
    )]
    Moved { command: &'static str },
    /// Two jobs to compare in have the same name.
    #[error(
        "two jobs are called \"{0}\" (one's charts would replace the other's); give one of them another `name`"
    )]
    TwinJobs(String),
    /// A signal ended it.
    #[error("interrupted")]
    Interrupted,
    /// A sum of the tally overflowed.
    #[error(
        "a sum of the tally overflowed (scores are too many or too large to be kept exactly); use fewer paths"
    )]
    Overflow,
    /// Nothing happened any more.
    #[error(
        "no worker makes progress though walks are left (a fault of the program); the result so far is in {}: run the job again with --resume",
        out.display()
    )]
    Stuck { out: PathBuf },
    /// The system refused something that it should not.
    #[error("{doing} failed ({source}); this is a fault of the system, not of the job")]
    System { doing: &'static str, source: std::io::Error },
}

impl Outcome {
    /// 0, 1 or 130.
    pub(crate) fn exit_code(self) -> u8 {
        match self {
            Outcome::Done => 0,
            Outcome::TargetMissed | Outcome::Faulty => 1,
            Outcome::Interrupted => 130,
        }
    }
}

impl Fault {
    /// 2 for bad input, 3 for a failed cluster.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Fault::Job(_) | Fault::Unfit(_) | Fault::Report(_) | Fault::Exact(_) => 2,
            Fault::AccessFile { .. } | Fault::AccessFileWrite { .. } | Fault::OneAccessFile { .. } => 2,
            Fault::Share(_) | Fault::NoWalks | Fault::OpenPatches { .. } => 2,
            Fault::NoWord { .. } | Fault::Moved { .. } | Fault::Table { .. } | Fault::TwinJobs(_) => 2,
            Fault::Listen(error) if error.is_usage() => 2,
            Fault::NoPage(error) if error.is_usage() => 2,
            Fault::NoStatus(_) => 2,
            Fault::Taken { .. }
            | Fault::CopyTaken { .. }
            | Fault::NotWritten { .. }
            | Fault::Unsaid { .. } => 2,
            Fault::LogLevel { .. } | Fault::MixedUnits { .. } => 2,
            Fault::Results(error) => exit_code_of(error),
            Fault::TallyAlone { fault, .. } => fault.exit_code(),
            Fault::Silent { .. } | Fault::Differ(_) | Fault::Audit(_) => 3,
            Fault::Listen(_) | Fault::NoPage(_) | Fault::Worker(_) | Fault::NoWorkers(_) => 3,
            Fault::Overflow | Fault::System { .. } | Fault::Stuck { .. } => 3,
            Fault::Interrupted => Outcome::Interrupted.exit_code(),
        }
    }
}

/// A result that does not hold is no bad input.
fn exit_code_of(error: &results::Error) -> u8 {
    use results::Error;
    match error {
        Error::Report(_) | Error::Checkpoint(_) | Error::StoredRun { .. } | Error::Merge { .. } => 2,
        Error::Incomparable { .. } | Error::NoRun { .. } | Error::NoTable { .. } | Error::Mixture { .. } => 2,
        Error::BeyondBudget { .. } | Error::OtherBatches { .. } => 2,
        Error::Job(_)
        | Error::Unfit(_)
        | Error::Factors(_)
        | Error::DaylightChannel
        | Error::FewDaylightWalks { .. }
        | Error::OtherDaylight { .. }
        | Error::UnreadableDaylight { .. }
        | Error::NoRoom { .. } => 2,
        Error::OtherFile { .. } | Error::Overflow | Error::System { .. } | Error::Rows { .. } => 3,
    }
}
