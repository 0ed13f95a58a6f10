//! The date, for pages that say when they were written.

use std::time::SystemTime;

/// The date of today in UTC.
pub(crate) fn today() -> time::Date {
    time::OffsetDateTime::from(SystemTime::now()).date()
}
