//! Bytes of files that other crates read.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::error::Error;

/// The first bytes of a file, at most `most`.
///
/// # Errors
/// A folder, and what cannot be opened or read.
pub(crate) fn first_bytes(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    if path.is_dir() {
        return Err(Error::Folder { file: path.into() });
    }
    let fault = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => Error::Missing { file: path.into() },
        _ => Error::Unreadable { file: path.into(), source },
    };
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(most).read_to_end(&mut bytes)).map_err(fault)?;
    Ok(bytes)
}
