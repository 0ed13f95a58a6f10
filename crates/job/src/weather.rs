//! Files of weather.

use std::path::Path;

use ::sky::Weather;

use crate::bytes::first_bytes;
use crate::error::Error;

/// The largest file of weather that is read [bytes]: a year of minutes has 100 MB.
const LARGEST_WEATHER: u64 = 128 << 20;

/// Reads a weather file of EnergyPlus (EPW).
///
/// # Errors
/// A file that cannot be read, or breaks the rules of its format.
pub fn load_weather(path: &Path) -> Result<Weather, Error> {
    let bytes = first_bytes(path, LARGEST_WEATHER)?;
    Weather::read(&bytes).map_err(|source| Error::Weather { file: path.into(), source })
}
