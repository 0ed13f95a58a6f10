//! What can go wrong with results: every message says what is wrong, why, and what to do.

use std::path::PathBuf;

use protocol::{CheckpointError, MergeFault};

use crate::factors::FactorsFault;

/// A result that cannot be written, read, or believed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The job or its scene is not usable.
    #[error(transparent)]
    Job(#[from] job::Error),
    /// The method would be wrong in this scene.
    #[error("{0}")]
    Unfit(#[from] radiosity::Unfit),
    /// Exchange factors cannot be counted, or say nothing of heat.
    #[error(transparent)]
    Factors(#[from] FactorsFault),
    /// Coefficients are those of one channel.
    #[error(
        "the scene is in colour, and daylight coefficients are those of one reflectance a surface; choose --channel r, g or b (g is the nearest to what eyes see)"
    )]
    DaylightChannel,
    /// A look would have no walks.
    #[error(
        "{paths} walks for {cells} places are fewer than {fewest} for each, the least that says something; give more --paths, or fewer sensors"
    )]
    FewDaylightWalks {
        /// Walks of the job.
        paths: u64,
        /// Places where light is measured.
        cells: u64,
        /// The least for each.
        fewest: u64,
    },
    /// The counts are those of another question.
    #[error(
        "the counts in {} are those of other surfaces, sensors, seed or patches of the sky; use another --out, or --force in place of --resume", path.display()
    )]
    OtherDaylight {
        /// The file of the counts.
        path: PathBuf,
    },
    /// The counts cannot be read.
    #[error("the counts in {} cannot be read ({reason}); use --force in place of --resume", path.display())]
    UnreadableDaylight {
        /// The file of the counts.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file of counted rows cannot be read or written.
    #[error("the rows in {} cannot be read or written ({source}); see to the file, or count anew with --force", path.display())]
    Rows {
        /// The path of the file.
        path: PathBuf,
        /// What the system says, or what is wrong with the file.
        source: std::io::Error,
    },
    /// A file of the output folder cannot be written.
    #[error(transparent)]
    Report(#[from] report::Error),
    /// A tally cannot be used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The job that a tally keeps cannot be read.
    #[error(
        "the job kept in {} cannot be used ({reason}); it was written by radwalk {build}, use that",
        path.display()
    )]
    StoredRun {
        /// The output folder of the job.
        path: PathBuf,
        /// Why it cannot be used.
        reason: String,
        /// The build that wrote it.
        build: String,
    },
    /// A run holds more walks than the job has.
    #[error(
        "the checkpoint holds {walks} paths, the job has {paths} (walks that are merged cannot be taken out); give --paths {walks} or more"
    )]
    BeyondBudget {
        /// Walks of the checkpoint.
        walks: u64,
        /// Walks of the job.
        paths: u64,
    },
    /// A checkpoint holds chains, or batches of walks, of another length.
    #[error(
        "the checkpoint holds chains or batches of {theirs} paths, the job asks for {ours} (a part of budget.paths unless it says otherwise; only equal ones are one sample); give --set method.batch_paths={theirs}"
    )]
    OtherBatches {
        /// Paths of a batch in the checkpoint.
        theirs: u64,
        /// Paths of a batch of the job.
        ours: u64,
    },
    /// Runs cannot be merged.
    #[error("cannot merge {}: {fault}", path.display())]
    Merge {
        /// The run that does not go with those before it.
        path: PathBuf,
        /// Why it cannot be merged.
        fault: MergeFault,
    },
    /// A mixture of sources cannot be computed.
    #[error("cannot combine the sources of {} ({problem}); {remedy}", run.display())]
    Mixture {
        /// The folder of the run.
        run: PathBuf,
        /// The reason why the sources cannot be mixed.
        problem: String,
        /// What the user can do.
        remedy: String,
    },
    /// A file stands beside the tally of another run.
    #[error(
        "{0}/{file} is not made from the tally beside it (the run was not finished, the file was changed, or another version wrote it); `radwalk report {0}` makes all files again from the tally, `radwalk run --resume` goes on with the run",
        run.display()
    )]
    OtherFile {
        /// The output folder of the run.
        run: PathBuf,
        /// What is in it.
        file: &'static str,
    },
    /// A sum of walks that are traced again overflows.
    #[error(
        "a sum of the tally overflowed (scores are too many or too large to be kept exactly); use fewer paths"
    )]
    Overflow,
    /// The tallies of a job do not fit the memory.
    #[error(
        "the tallies of {patches} patches need at least {}, and this machine has {} (for the coordinator and {}); use coarser patches or fewer workers here",
        report::words::bytes(*needed), report::words::bytes(*there), report::words::counted(*workers as u64, "worker")
    )]
    NoRoom {
        /// The patches of the job.
        patches: u64,
        /// The memory that they need at least [bytes].
        needed: u64,
        /// The memory that there is [bytes].
        there: u64,
        /// The workers on this machine.
        workers: usize,
    },
    /// Two results cannot be held against each other.
    #[error("{} cannot be compared with {} ({reason}); {remedy}", second.display(), first.display())]
    Incomparable {
        /// The folder of one result.
        first: PathBuf,
        /// The folder of the other result.
        second: PathBuf,
        /// Why they cannot be compared.
        reason: String,
        /// What the user can do.
        remedy: &'static str,
    },
    /// A folder holds a result, and not that of a run.
    #[error("{} holds no run, but {holds}", folder.display())]
    NoRun {
        /// The folder.
        folder: PathBuf,
        /// What it holds, and who reads it.
        holds: &'static str,
    },
    /// A table cannot be read.
    #[error(
        "{} cannot be read ({reason}); give the output folder of `radwalk run` or `merge`, and where the table was left out there, make it from the tally: radwalk report OUT --export csv",
        path.display()
    )]
    NoTable {
        /// The path of the table.
        path: PathBuf,
        /// Why it cannot be read.
        reason: String,
    },
    /// The system refused something that it should not.
    #[error("{doing} failed ({source}); this is a fault of the system, not of the job")]
    System {
        /// What the program was doing.
        doing: &'static str,
        /// What the system says.
        source: std::io::Error,
    },
}
