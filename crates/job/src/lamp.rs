//! Files of luminaires.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use photometry::{LARGEST_FILE, Luminaire};

use crate::error::Error;

/// Reads a luminaire from a file of LM-63 or EULUMDAT.
///
/// # Errors
/// A file that cannot be read, or breaks the rules of its format.
pub fn load_lamp(path: &Path) -> Result<Luminaire, Error> {
    if path.is_dir() {
        return Err(Error::Folder { file: path.into() });
    }
    let fault = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => Error::Missing { file: path.into() },
        _ => Error::Unreadable { file: path.into(), source },
    };
    let mut bytes = Vec::new();
    // One byte more than is allowed: the reader refuses it.
    File::open(path)
        .and_then(|file| file.take(LARGEST_FILE as u64 + 1).read_to_end(&mut bytes))
        .map_err(fault)?;
    Luminaire::read(&bytes).map_err(|source| Error::Lamp { file: path.into(), source })
}
