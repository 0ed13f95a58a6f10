//! Runs in this process, judged as `radwalk run` judges.

use job::Target;
use judge::checks;
use judge::target::{Observer, looks};
use radiosity::{Estimates, Experiment, Solution, Tally, precision::Quantity};
use report::{Check, Verdict};

use crate::walking::{CONFIDENCE, advance};

/// A run with the looks of a job.
pub(crate) struct JudgedRun {
    /// The tally at its end.
    pub tally: Tally,
    /// The solution of the tally.
    pub solution: Solution,
    /// The checks of the run.
    pub checks: Vec<Check>,
    /// Whether its target, if any, ended it.
    pub reached: bool,
}

/// Runs a job of at most `walks` walks, with its looks and checks.
pub(crate) fn run(experiment: &Experiment, seed: u64, walks: u64, target: Option<Target>) -> JudgedRun {
    let mut observer = Observer::new(experiment.clone(), CONFIDENCE, target);
    let (mut tally, mut seen, mut reached) = (experiment.tally(), Vec::new(), false);
    for mark in looks(experiment, walks) {
        advance(experiment, seed, mark, &mut tally);
        let look = observer.look(&tally, &seen);
        reached = look.reached;
        seen.push(look);
        if reached {
            break;
        }
    }
    let estimates = Estimates::new(experiment, &tally, CONFIDENCE);
    let checks = checks(
        &estimates,
        None,
        &estimates.precision(Quantity::Irradiance, &radiosity::parallel::in_turn),
        &seen,
    );
    let solution = Solution::new(experiment, &tally, CONFIDENCE);
    JudgedRun { tally, solution, checks, reached }
}

impl JudgedRun {
    /// The checks that did not pass, and the one that tells of sealed area, in the words of summaries.
    pub(crate) fn messages(&self) -> Vec<String> {
        let tells = |check: &&Check| check.verdict == Verdict::Failed || check.message.contains("is sealed");
        self.checks
            .iter()
            .filter(tells)
            .map(|check| format!("check `{}`: {}", check.name, check.message))
            .collect()
    }

    /// Whether a check failed.
    pub(crate) fn fails(&self, name: &str) -> bool {
        self.checks.iter().any(|check| check.name == name && check.verdict == Verdict::Failed)
    }

    /// The flags of a patch in `patches.csv`.
    pub(crate) fn flags(&self, experiment: &Experiment, patch: usize) -> String {
        let known = self.solution.face(patch);
        report::flags(&experiment.scene().faces().get(patch), known.as_deref())
    }
}
