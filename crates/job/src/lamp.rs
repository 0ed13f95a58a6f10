//! Files of luminaires.

use std::path::Path;

use photometry::{LARGEST_FILE, Luminaire};

use crate::bytes::first_bytes;
use crate::error::Error;

/// Reads a luminaire from a file of LM-63 or EULUMDAT.
///
/// # Errors
/// A file that cannot be read, or breaks the rules of its format.
pub fn load_lamp(path: &Path) -> Result<Luminaire, Error> {
    // One byte more than is allowed: the reader refuses it.
    let bytes = first_bytes(path, LARGEST_FILE as u64 + 1)?;
    Luminaire::read(&bytes).map_err(|source| Error::Lamp { file: path.into(), source })
}
