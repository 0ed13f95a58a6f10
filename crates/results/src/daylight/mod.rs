//! Daylight: what `radwalk daylight` counts and writes.
//!
//! A [`DaylightQuestion`] is made of a job, a weather file and of what is [`Wished`]; [`count`] walks, round by round, by processes of the caller, and [`count_here`] on threads; a
//! [`DaylightAnswer`] holds the figures of every sensor, and writes the files.

mod answer;
mod count;
mod question;
mod stored;

pub use answer::{DaylightAnswer, DaylightFile, FILES as DAYLIGHT_FILES};
pub use count::{DaylightCounted, count, count_here};
pub use question::{DaylightQuestion, Wished};
pub(crate) use stored::COUNTS as DAYLIGHT_COUNTS;
