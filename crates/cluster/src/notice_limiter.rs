//! Notices about strangers, at a bounded rate, so that no stranger can fill a terminal or a log.

use protocol::{Notice, Now};
use std::time::Duration;

/// The number of notices that may be passed on at once, and the number per second after that.
const BURST: f64 = 20.0;
const PER_SECOND: f64 = 0.5;

/// The state of the bounded rate.
#[derive(Debug)]
pub(crate) struct NoticeLimiter {
    left: f64,
    since: Now,
    hushed: usize,
}

impl NoticeLimiter {
    /// The state before any notice.
    pub(crate) fn new() -> Self {
        NoticeLimiter { left: BURST, since: Duration::ZERO, hushed: 0 }
    }

    /// Passes a notice on, or counts it where the rate is exceeded.
    pub(crate) fn pass(&mut self, notice: Notice, now: Now, tell: &mut impl FnMut(Notice)) {
        let stranger = matches!(notice, Notice::Failed(_) | Notice::Refused { .. });
        if !stranger {
            return tell(notice);
        }
        self.left = BURST.min(self.left + now.saturating_sub(self.since).as_secs_f64() * PER_SECOND);
        self.since = now;
        if self.left < 1.0 {
            self.hushed += 1;
            return;
        }
        self.left -= 1.0;
        tell(notice);
        self.finish(tell);
    }

    /// Passes on the number of notices that were held back.
    pub(crate) fn finish(&mut self, tell: &mut impl FnMut(Notice)) {
        if self.hushed > 0 {
            tell(Notice::Hushed(self.hushed));
            self.hushed = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floods_are_counted_and_losses_always_reported() {
        let (mut limiter, mut passed) = (NoticeLimiter::new(), Vec::new());
        let mut pass = |notice: Notice, seconds: u64| {
            limiter.pass(notice, Duration::from_secs(seconds), &mut |notice| passed.push(notice));
        };
        (0..1000).for_each(|n| pass(Notice::Failed(n.to_string()), 1));
        let lost = Notice::Lost { name: "one".into(), reason: "it went silent".into() };
        pass(lost.clone(), 1);
        pass(Notice::Failed("later".into()), 11);
        assert_eq!(passed.len(), 23);
        assert_eq!(passed[20..], [lost, Notice::Failed("later".into()), Notice::Hushed(980)]);
    }
}
