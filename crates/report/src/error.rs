//! What can go wrong while writing or reading results: every message names the file.

use std::io;
use std::path::{Path, PathBuf};

/// A result file or folder that could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("cannot {action} {}: {source}; check that the path exists, is writable and has space", path.display())]
    Io {
        /// What was tried, as a verb.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The folder holds something already.
    #[error(
        "the output folder {} is not empty (its results would be lost); choose another with --out, or replace them with --force",
        path.display()
    )]
    OutputExists {
        /// The path of the folder.
        path: PathBuf,
    },
    /// The name of the folder is taken by a file.
    #[error(
        "the output folder {} is a file (results are written into a folder); choose another with --out",
        path.display()
    )]
    NotAFolder {
        /// The path of the file.
        path: PathBuf,
    },
    /// The folder was removed, and another is in its place.
    #[error(
        "the output folder {} is not the one that this run began with (it was replaced meanwhile, and another run may write there); nothing is written to it, run the job again with another --out",
        path.display()
    )]
    Replaced {
        /// The path of the folder.
        path: PathBuf,
    },
    /// Another process writes there.
    #[error(
        "another radwalk writes to the output folder {} (its results and these would mix); wait for its end, or choose another folder with --out",
        path.display()
    )]
    InUse {
        /// The path of the folder.
        path: PathBuf,
    },
}

impl Error {
    /// An adapter for `map_err`: `action` on `path` failed.
    pub(crate) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Error::Io { action, path, source }
    }
}
