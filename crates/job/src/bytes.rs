//! Bytes of files that other crates read.

use std::fs::{self, File, Metadata};
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

/// All bytes of a file. A pipe ends where its writer does; of a device that is not sure, so that a scene which names one is refused.
///
/// # Errors
/// A folder, a device, and what cannot be opened or read.
pub(crate) fn all_bytes(path: &Path) -> Result<Vec<u8>, Error> {
    if path.is_dir() {
        return Err(Error::Folder { file: path.into() });
    }
    let fault = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => Error::Missing { file: path.into() },
        _ => Error::Unreadable { file: path.into(), source },
    };
    if fs::metadata(path).map(|about| is_device(&about)).map_err(fault)? {
        let endless = io::Error::new(io::ErrorKind::InvalidInput, "it is a device, which may have no end");
        return Err(fault(endless));
    }
    fs::read(path).map_err(fault)
}

#[cfg(unix)]
fn is_device(about: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = about.file_type();
    kind.is_char_device() || kind.is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: &Metadata) -> bool {
    false
}
