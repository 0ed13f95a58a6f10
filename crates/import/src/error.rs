//! The error of a mesh file, as one message: problem, reason and remedy.

use std::fmt;
use std::path::PathBuf;

use thiserror::Error;

/// The error of a mesh file that cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{}{spot}: {problem} ({why}); {remedy}", file.display())]
pub struct Error {
    /// The file at fault.
    pub file: PathBuf,
    /// The spot of the problem in the file.
    pub spot: FileSpot,
    /// The problem: what was found.
    pub problem: String,
    /// The reason why it cannot be used.
    pub why: String,
    /// The remedy for the problem.
    pub remedy: String,
}

/// A spot in a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FileSpot {
    /// The file as a whole.
    File,
    /// A line of a text file, from 1.
    Line(usize),
    /// An element of a file without lines, such as `nodes[3].mesh` or `face 17`.
    Element(String),
}

impl fmt::Display for FileSpot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FileSpot::File => Ok(()),
            FileSpot::Line(line) => write!(f, ":{line}"),
            FileSpot::Element(path) => write!(f, ": {path}"),
        }
    }
}

/// A fault whose file is not yet known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct UnplacedError {
    pub(crate) problem: String,
    pub(crate) why: String,
    pub(crate) remedy: String,
}

impl UnplacedError {
    pub(crate) fn new(problem: impl Into<String>, why: impl Into<String>, remedy: impl Into<String>) -> Self {
        UnplacedError { problem: problem.into(), why: why.into(), remedy: remedy.into() }
    }

    /// The fault of a file that ends before it has said all that it announces.
    pub(crate) fn short() -> Self {
        UnplacedError::new("the file ends here", "it announces more than it holds", "export it again")
    }

    /// The error at a spot of a file.
    pub(crate) fn at(self, file: impl Into<PathBuf>, spot: FileSpot) -> Error {
        let UnplacedError { problem, why, remedy } = self;
        Error { file: file.into(), spot, problem, why, remedy }
    }
}
