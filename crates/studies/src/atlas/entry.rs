//! What an entry of the atlas says.

use report::Chart;

use crate::claim::{Claim, Judge};
use crate::lab::Lab;
use crate::walking::Failure;

/// One way in which a method fails.
pub struct Entry {
    /// Names it on the command line and its chart.
    pub name: &'static str,
    /// A sentence.
    pub title: &'static str,
    /// Drives the method there.
    pub study: fn(&Lab) -> Result<Finding, Failure>,
}

/// What became of it.
pub struct Finding {
    /// What theory says will happen, and who says so.
    pub predicted: String,
    /// What happened, with standard errors.
    pub seen: String,
    /// What the program told its user, word by word.
    pub told: Vec<String>,
    /// What to do instead, and what that gave.
    pub instead: String,
    /// What has to hold of all this.
    pub claims: Vec<Claim>,
    /// The sweep.
    pub chart: Chart,
}

impl Finding {
    /// Whether all of it holds.
    pub fn holds(&self) -> bool {
        self.failed().next().is_none()
    }

    /// The claims that do not hold.
    pub fn failed(&self) -> impl Iterator<Item = &Claim> {
        self.claims.iter().filter(|claim| !Judge::EACH.passes(claim))
    }
}
