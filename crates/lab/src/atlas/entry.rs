//! The form of an entry of the atlas.

use report::Chart;

use crate::claim::{Claim, ClaimJudge};
use crate::lab::Lab;
use crate::walking::Failure;

/// An entry: one way in which a method fails.
pub struct Entry {
    /// The name of the entry on the command line and of its chart.
    pub name: &'static str,
    /// The title of the entry, one sentence.
    pub title: &'static str,
    /// The study that drives the method there.
    pub study: fn(&Lab) -> Result<StudyFinding, Failure>,
}

/// The findings of an entry's study.
pub struct StudyFinding {
    /// The prediction of theory, with its source.
    pub predicted: String,
    /// The measurement, with standard errors.
    pub seen: String,
    /// The program's words to its user, verbatim.
    pub messages: Vec<String>,
    /// The remedy, and what it gave.
    pub instead: String,
    /// The claims that must hold.
    pub claims: Vec<Claim>,
    /// The chart of the sweep.
    pub chart: Chart,
}

impl StudyFinding {
    /// Whether all claims hold.
    pub fn holds(&self) -> bool {
        self.failed().next().is_none()
    }

    /// The claims that do not hold.
    pub fn failed(&self) -> impl Iterator<Item = &Claim> {
        self.claims.iter().filter(|claim| !ClaimJudge::EACH.passes(claim))
    }
}
