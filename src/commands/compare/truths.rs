//! What errors are measured against in the scene of a job, and on which patches.

use report::words::percent;

use super::contender::{Arena, Contender, Trial};
use super::measure::Judged;
use super::shoot::Shot;
use super::truth::Truth;
use crate::fault::Fault;

/// The references of a job, and the patches on which errors are measured against each.
pub(super) struct Truths {
    discrete: (Truth, Judged),
    continuous: (Truth, Judged),
}

impl Truths {
    /// The references for runs of up to `rays` rays.
    ///
    /// # Errors
    /// As `shoot`.
    pub(super) fn new(
        arena: Arena<'_>,
        rays: u64,
        mut shoot: impl FnMut(&Trial) -> Result<Shot, Fault>,
    ) -> Result<Self, Fault> {
        let judged = |truth: Truth| {
            let judged = Judged::new(arena.scene, &truth);
            (truth, judged)
        };
        Ok(Truths {
            discrete: judged(Truth::discrete(&arena, rays, &mut shoot)?),
            continuous: judged(Truth::continuous(&arena, rays, &mut shoot)?),
        })
    }

    /// The reference of a contender.
    pub(super) fn of(&self, contender: &Contender) -> &(Truth, Judged) {
        if contender.is_continuous() { &self.continuous } else { &self.discrete }
    }

    /// The references of discrete methods and of continuous ones, in words.
    pub(super) fn words(&self) -> [String; 2] {
        [&self.discrete, &self.continuous].map(|(truth, judged)| match judged.own_error(truth) {
            0.0 => truth.how.clone(),
            own => format!("{} (rms {})", truth.how, percent(own.sqrt())),
        })
    }
}
