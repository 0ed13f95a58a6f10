//! Skies, the sun and weather files, and what daylight coefficients make of them. Walks know nothing of weather.
//!
//! A [`Sky`] is a radiance for each direction: one of the CIE's standard skies, or Perez's all-weather sky of an hour of a weather
//! file ([`Weather`]). A [`Dome`] turns it into a mean radiance for each patch of the sky: a sky vector, and the columns of a sky matrix
//! ([`Matrix`]) in the layout of Radiance's `gendaymtx`. [`SkyPatchCounts`] is what walks from one sensor have counted by patch, and [`Year`] what
//! such counts say of the hours of a year, with intervals.
//!
//! The zenith is +z, the north +y, the east +x. Azimuths are clockwise from the north. Where a formula has a radiance, its unit is
//! W/(m² sr) or cd/m², as the horizontal value that the sky is scaled to is in W/m² or lx.

#![warn(unreachable_pub, unnameable_types)]

mod annual;
mod dome;
mod epw;
mod luminance;
mod matrix;
mod metrics;
mod perez;
mod replicates;
mod sun;

pub use annual::{BoundedValue, Hour, SkyPatchCounts, Year};
pub use dome::{Dome, SUN_PATCHES};
pub use epw::{MalformedWeather, Weather, WeatherHour};
pub use luminance::{STANDARD_SKIES, Sky};
pub use matrix::{EFFICACY, Encoding, Matrix, MatrixError};
pub use metrics::{Level, Metrics, SensorYear, TARGETS, Wanted};
pub use perez::{Conditions, SkyUnit};
pub use sun::{SUN_ANGLE, Site, SunPosition};
