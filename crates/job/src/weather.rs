//! Files of weather and of skies.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use ::sky::{Matrix, Weather};

use crate::error::Error;

/// The largest file of weather that is read [bytes]: a year of minutes has 100 MB.
const LARGEST_WEATHER: u64 = 128 << 20;

/// The largest matrix that is read [bytes].
const LARGEST_MATRIX: u64 = 4 << 30;

/// Reads a weather file of EnergyPlus (EPW).
///
/// # Errors
/// A file that cannot be read, or breaks the rules of its format.
pub fn load_weather(path: &Path) -> Result<Weather, Error> {
    let bytes = read(path, LARGEST_WEATHER)?;
    Weather::read(&bytes).map_err(|source| Error::Weather { file: path.into(), source })
}

/// Reads a sky vector or matrix in the layout of Radiance.
///
/// # Errors
/// A file that cannot be read, or breaks the rules of its format.
pub fn load_matrix(path: &Path) -> Result<Matrix, Error> {
    let bytes = read(path, LARGEST_MATRIX)?;
    Matrix::read(&bytes).map_err(|source| Error::Matrix { file: path.into(), source })
}

fn read(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
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
