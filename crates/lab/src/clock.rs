//! Processor time, which is shown beside what is counted, and never judged; and the date of pages.

use std::time::SystemTime;

use rustix::time::{ClockId, clock_gettime};

/// The processor time of this thread so far [s].
pub(crate) fn thread_seconds() -> f64 {
    seconds_of(ClockId::ThreadCPUTime)
}

/// The processor time of this process so far [s].
pub(crate) fn process_seconds() -> f64 {
    seconds_of(ClockId::ProcessCPUTime)
}

fn seconds_of(clock: ClockId) -> f64 {
    let time = clock_gettime(clock);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// The processor time of the child processes that were waited for so far, and of theirs [s]; `None` where the system does not tell it.
pub(crate) fn children_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The fields after the name, which may hold blanks, begin with the third; the times of children are the 16th and 17th, in ticks of 10 ms.
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace().skip(13);
    let mut seconds = || Some(fields.next()?.parse::<f64>().ok()? * 0.01);
    Some(seconds()? + seconds()?)
}

/// The date of today in UTC.
pub(crate) fn today() -> time::Date {
    time::OffsetDateTime::from(SystemTime::now()).date()
}
