//! What errors are measured against in the scene of a job, and on which patches.

use report::words::percent;

use super::contender::{Arena, Contender, Trial};
use super::measure::JudgedPatches;
use super::shoot::TrialRuns;
use super::truth::ReferenceSolution;
use crate::fault::Fault;

/// The references of a job, and the patches on which errors are measured against each.
pub(super) struct Truths {
    discrete: (ReferenceSolution, JudgedPatches),
    continuous: (ReferenceSolution, JudgedPatches),
}

impl Truths {
    /// The references for runs of up to `rays` rays.
    ///
    /// # Errors
    /// As `shoot`.
    pub(super) fn new(
        arena: Arena<'_>,
        rays: u64,
        mut shoot: impl FnMut(&Trial) -> Result<TrialRuns, Fault>,
    ) -> Result<Self, Fault> {
        let judged = |truth: ReferenceSolution| {
            let judged = JudgedPatches::new(arena.scene, &truth);
            (truth, judged)
        };
        Ok(Truths {
            discrete: judged(ReferenceSolution::discrete(&arena, rays, &mut shoot)?),
            continuous: judged(ReferenceSolution::continuous(&arena, rays, &mut shoot)?),
        })
    }

    /// The reference of a contender.
    pub(super) fn of(&self, contender: &Contender) -> &(ReferenceSolution, JudgedPatches) {
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
