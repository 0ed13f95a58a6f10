//! Why a command failed, and its exit code.

use std::path::PathBuf;

use thiserror::Error;

use crate::walking::Failure;

/// Why a command could not do what it was asked to.
#[derive(Debug, Error)]
pub(crate) enum LabFault {
    /// Results cannot be written.
    #[error(transparent)]
    Report(#[from] report::Error),
    /// Some rows of the papers' tables came out otherwise.
    #[error(
        "{} rows differ from theory by more than chance explains ({}); see {}, then find out which is wrong",
        rows.len(), rows.join("; "), page.display()
    )]
    NotReproduced { page: PathBuf, rows: Vec<String> },
    /// The atlas has no such entry.
    #[error("the atlas has no entry \"{name}\" (--only takes names of entries); choose from {known}")]
    NoEntry { name: String, known: String },
    /// Some claims of the atlas do not hold.
    #[error(
        "claims of {} entries of the atlas do not hold ({}); see {}, then find out whether theory or program is wrong",
        entries.len(), entries.join(", "), page.display()
    )]
    Unfounded { entries: Vec<&'static str>, page: PathBuf },
    /// An entry of the atlas cannot be studied.
    #[error(
        "the entry \"{entry}\" of the atlas cannot be studied ({source}); this is a fault of the program"
    )]
    Entry { entry: &'static str, source: Failure },
    /// A study cannot be done: mostly words that it does not take.
    #[error("{source}")]
    Study { source: Failure },
    /// Results on stdout are lost.
    #[error("results cannot be written to stdout ({source}); make room, or write them elsewhere")]
    Unsaid { source: std::io::Error },
    /// The environment asks for messages of an unknown level.
    #[error("RADWALK_LOG={word} is no level of messages; choose error, warn, info, debug, trace or off")]
    LogLevel { word: String },
}

impl LabFault {
    /// 2 for bad input and lost output, 3 for claims that do not hold.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            LabFault::Report(_) | LabFault::NoEntry { .. } | LabFault::Study { .. } => 2,
            LabFault::Unsaid { .. } | LabFault::LogLevel { .. } => 2,
            LabFault::NotReproduced { .. } | LabFault::Unfounded { .. } | LabFault::Entry { .. } => 3,
        }
    }
}
