//! What a coordinator does while its job is walked: the job is measured, reported, shown to browsers, and kept.

use protocol::{Coordinator, Notice};
use results::{Error, Identity, Keeper, Latest};

use crate::gauge::Gauge;
use crate::reports::Reports;
use crate::run_status::RunStatus;
use crate::showing::Showing;

/// The coordinator's work beside the leases of one run: reports, the page in browsers, and checkpoints.
pub struct Watch<'a> {
    gauge: Gauge<'a>,
    reports: Reports,
    showing: Option<Showing>,
    identity: &'a Identity,
    keeper: Keeper,
    /// Whether memory has failed.
    broken: bool,
}

/// What a look at a running job came to.
pub struct Looked {
    /// Where the job stands, if that was asked for.
    pub status: Option<RunStatus>,
    /// Why there is no checkpoint, and what becomes of the run, where one could not be written.
    pub trouble: Option<String>,
    /// Whether the run may go on.
    pub goes_on: bool,
}

impl<'a> Watch<'a> {
    /// A watch over the run of an `identity`, whose checkpoints `keeper` writes.
    pub fn new(
        gauge: Gauge<'a>,
        (reports, showing): (Reports, Option<Showing>),
        (identity, keeper): (&'a Identity, Keeper),
    ) -> Self {
        Watch { gauge, reports, showing, identity, keeper, broken: false }
    }

    /// Takes note of where the job stands and of what has happened. The status is returned if it is `asked` for.
    pub fn look(&mut self, coordinator: &Coordinator, notices: &[Notice], asked: bool) -> Looked {
        notices.iter().for_each(|notice| self.gauge.heed(notice));
        self.gauge.follow(coordinator, self.keeper.saved());
        let mut status = None;
        if self.reports.are_due() || asked {
            self.gauge.estimate(coordinator);
            let now = self.gauge.status(coordinator);
            self.reports.write(&now, coordinator);
            status = asked.then_some(now);
        }
        if let Some(showing) = &mut self.showing {
            showing.supervise(coordinator, self.identity);
        }
        let trouble = self.keeper.supervise(coordinator).err().map(|error| self.without_checkpoint(&error));
        Looked { status, trouble, goes_on: !self.broken }
    }

    fn without_checkpoint(&mut self, error: &Error) -> String {
        // Memory that has failed once is not to be trusted with the rest.
        self.broken |= matches!(error, Error::Checkpoint(_));
        let rest = if self.broken { "the run ends" } else { "the run goes on, the one before is kept" };
        self.gauge.checkpoint_failed();
        format!("no checkpoint: {error}; {rest}")
    }

    /// Ends it. Returns what the last checkpoint is made from, and what the latest one on disk is.
    pub fn finish(self) -> (Identity, Latest) {
        drop(self.reports);
        self.keeper.finish()
    }
}
