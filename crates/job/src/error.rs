//! What can be wrong with a file, as one message: problem, why it is one, what to do.

use std::fmt;
use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// A job or scene file that cannot be used.
#[derive(Debug, Error)]
pub enum Error {
    /// There is nothing at this path.
    #[error("{}: there is no such file; check the path", file.display())]
    Missing {
        /// The path as asked for.
        file: PathBuf,
    },
    /// The path is a folder.
    #[error("{}: this is a folder, not a file; name the file in it", file.display())]
    Folder {
        /// The path as asked for.
        file: PathBuf,
    },
    /// The operating system refuses to hand the file over.
    #[error("{}: the file cannot be read ({source}); check its permissions", file.display())]
    Unreadable {
        /// The path as asked for.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The bytes are not UTF-8.
    #[error("{}:{line}: the text is not UTF-8 (TOML is); save the file as UTF-8", file.display())]
    NotText {
        /// The path as asked for.
        file: PathBuf,
        /// The line of the first stray byte, from 1.
        line: usize,
    },
    /// The file holds no key.
    #[error("{}: the file is empty (it says neither what to solve nor how); write {expected}", file.display())]
    Empty {
        /// The path as asked for.
        file: PathBuf,
        /// What such a file must hold.
        expected: &'static str,
    },
    /// A scene in a format that no reader exists for.
    #[error(
        "{}: {format} are unknown (no reader exists for them); write the scene as .toml, or export it as {formats}",
        file.display(), formats = MESH_FORMATS
    )]
    SceneFormat {
        /// The path as asked for.
        file: PathBuf,
        /// Such files, as their names tell it.
        format: String,
    },
    /// A mesh that cannot be used.
    #[error(transparent)]
    Import(Box<import::Error>),
    /// A luminaire that cannot be used.
    #[error("{}:{source}", file.display())]
    Lamp {
        /// The path as asked for.
        file: PathBuf,
        /// The line, and what is wrong there.
        source: photometry::Malformed,
    },
    /// A file of weather that cannot be used.
    #[error("{}:{source}", file.display())]
    Weather {
        /// The path as asked for.
        file: PathBuf,
        /// The line, and what is wrong there.
        source: ::sky::MalformedWeather,
    },
    /// The text is not TOML.
    #[error("{place}: not valid TOML: {problem}; correct the line")]
    Syntax {
        /// Where the parser stopped.
        place: Box<SourceLocation>,
        /// What the parser says of it.
        problem: String,
    },
    /// An override that is not of the form `key=value`, or whose key leads nowhere.
    #[error("--set {text}: {problem}; write --set key=value, for example --set budget.paths=1000000")]
    Override {
        /// The override as typed.
        text: String,
        /// What is wrong with it.
        problem: String,
    },
    /// An element of a list that is written as a table of its own.
    #[error(
        "{place}: [{list}] in single brackets opens one table (there is a list of them); write [[{list}]] in double brackets each time"
    )]
    OneOfMany {
        /// Where it is opened.
        place: Box<SourceLocation>,
        /// The name of the list.
        list: &'static str,
    },
    /// A key that does not exist.
    #[error("{place}: unknown key (nothing would read it); {hint}known here: {}", known.join(", "))]
    UnknownKey {
        /// The key at fault.
        place: Box<SourceLocation>,
        /// What was probably meant, ending in `; `; empty where nothing is near.
        hint: String,
        /// The keys that may stand there.
        known: &'static [&'static str],
    },
    /// A key that must be given.
    #[error("{place}: this key is missing ({why}); write {remedy}")]
    MissingKey {
        /// The place of the missing key.
        place: Box<SourceLocation>,
        /// Why there is no default.
        why: &'static str,
        /// What to write in its place.
        remedy: String,
    },
    /// A value of the wrong type.
    #[error("{place}: {found} has the wrong type; write {expected}")]
    WrongType {
        /// The key at fault.
        place: Box<SourceLocation>,
        /// The type that was found.
        found: String,
        /// The type to write.
        expected: &'static str,
    },
    /// A word that is not among the choices.
    #[error("{place}: {found:?} is not one of the choices; {hint}write {choices}")]
    UnknownWord {
        /// The key at fault.
        place: Box<SourceLocation>,
        /// What was probably meant, ending in `; `; empty where nothing is near.
        hint: String,
        /// The word that was found.
        found: String,
        /// The words to choose from.
        choices: String,
    },
    /// A value that is not allowed.
    #[error("{place}: {problem} ({why}); {remedy}")]
    Refused {
        /// The key at fault.
        place: Box<SourceLocation>,
        /// The value that was found.
        problem: String,
        /// Why it cannot be used.
        why: &'static str,
        /// What the user can do.
        remedy: String,
    },
    /// A surface of a material that the file does not define.
    #[error(
        "{place}: there is no material {material:?} (a surface takes its reflectance from it); {}",
        materials_remedy(material, known)
    )]
    UnknownMaterial {
        /// The key at fault.
        place: Box<SourceLocation>,
        /// The name that was found.
        material: String,
        /// The names that the file defines.
        known: Vec<String>,
    },
    /// A scene that [`radiosity::Scene::build`] refuses.
    #[error("{place}: {problem}")]
    Scene {
        /// The surface or material key at fault, or the file.
        place: Box<SourceLocation>,
        /// The message: problem, reason, remedy.
        problem: String,
    },
}

/// The formats of meshes, for messages.
pub(crate) const MESH_FORMATS: &str =
    ".obj, .gltf, .glb, .stl, .ply, .mgf, .xml (Mitsuba), .vs3 (View3D), .vtu, .vtp or .vtk";

impl Error {
    pub(crate) fn of_mesh(error: import::Error) -> Self {
        Error::Import(Box::new(error))
    }
}

/// Where something is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLocation {
    /// The file that holds it.
    pub file: PathBuf,
    /// The spot in it, or the override that took its place.
    pub spot: SourceSpot,
    /// The key, dotted; empty where no key is meant.
    pub key: String,
}

/// A spot of a [`SourceLocation`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SourceSpot {
    /// The file as a whole.
    File,
    /// A line, from 1.
    Line(usize),
    /// An element of a file without lines, such as a face of a mesh.
    Element(String),
    /// An override, as it was typed: `--set` and what follows, or another option.
    Override(String),
}

impl fmt::Display for SourceLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display();
        match &self.spot {
            SourceSpot::File => write!(f, "{file}")?,
            SourceSpot::Line(line) => write!(f, "{file}:{line}")?,
            SourceSpot::Element(element) => write!(f, "{file}: {element}")?,
            SourceSpot::Override(text) => write!(f, "{file} with {text}")?,
        }
        if self.key.is_empty() { Ok(()) } else { write!(f, ": {}", self.key) }
    }
}

impl From<import::FileSpot> for SourceSpot {
    fn from(spot: import::FileSpot) -> Self {
        match spot {
            import::FileSpot::File => SourceSpot::File,
            import::FileSpot::Line(line) => SourceSpot::Line(line),
            import::FileSpot::Element(element) => SourceSpot::Element(element),
        }
    }
}

fn materials_remedy(material: &str, known: &[String]) -> String {
    if known.is_empty() {
        return "the file defines none: add a [material.NAME] table".into();
    }
    let hint = crate::near::hint(material, known.iter().map(String::as_str));
    format!("{hint}the file defines {}", known.join(", "))
}
