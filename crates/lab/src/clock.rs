//! Processor time, which is shown beside what is counted, and never judged; and the date of pages.

use std::time::SystemTime;

use rustix::time::{ClockId, clock_gettime};

/// The processor time of this thread so far [s].
pub(crate) fn thread_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// The date of today in UTC.
pub(crate) fn today() -> time::Date {
    time::OffsetDateTime::from(SystemTime::now()).date()
}
