//! The laboratory: runs experiments on the threads of this machine, with answers that do not depend on the threads.

use std::sync::Mutex;

use radiosity::{Experiment, Sequence, Tally};

/// The size of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StudyScale {
    /// Everything is done at reduced size, in a minute.
    Quick,
    /// Everything is done as published, and more where chance would hide the effect.
    Full,
}

/// The threads that run experiments.
#[derive(Clone, Copy, Debug)]
pub struct Lab {
    /// The size of a study.
    pub effort: StudyScale,
    /// The number of threads.
    pub threads: usize,
}

/// The walks (of chains: one chain) that a thread takes at a time towards one tally.
const PIECE: u64 = 1 << 20;

/// The seed of the first run.
const FIRST_SEED: u64 = 1000;

impl Lab {
    /// A laboratory of `threads` threads, or of all cores for `None`.
    pub fn new(effort: StudyScale, threads: Option<usize>) -> Self {
        Lab { effort, threads: threads.unwrap_or_else(parallel::cores) }
    }

    /// The first argument for a quick study, the second for a full one.
    pub fn pick<T>(&self, quick: T, full: T) -> T {
        match self.effort {
            StudyScale::Quick => quick,
            StudyScale::Full => full,
        }
    }

    /// The results of independent runs, in their order: run r has walks r·`walks` … (r + 1)·`walks` − 1 of the sequence
    /// of `seed`.
    pub fn runs<T: Send>(
        &self,
        experiment: &Experiment,
        seed: u64,
        runs: usize,
        walks: u64,
        read: impl Fn(&Tally) -> T + Sync,
    ) -> Vec<T> {
        let sequence = Sequence::new(seed);
        self.each(
            runs,
            || experiment.board(),
            |board, run| {
                let first = run as u64 * walks;
                experiment.walk(&sequence, first..first + walks, board);
                read(&board.take().expect("a run is short"))
            },
        )
    }

    /// The results of `of` for `runs` seeds, in their order.
    pub fn each_seed<T: Send>(&self, runs: u64, of: impl Fn(u64) -> T + Sync) -> Vec<T> {
        self.each(runs as usize, || (), |(), run| of(FIRST_SEED + run as u64))
    }

    /// The tally of walks 0 … `walks` − 1 of the sequence of `seed`.
    pub fn tally(&self, experiment: &Experiment, seed: u64, walks: u64) -> Tally {
        let sequence = Sequence::new(seed);
        let piece = if experiment.unit().is_walk() { PIECE } else { 1 };
        let whole = Mutex::new(experiment.tally());
        self.each(
            walks.div_ceil(piece) as usize,
            || experiment.board(),
            |board, i| {
                let first = i as u64 * piece;
                experiment.walk(&sequence, first..walks.min(first + piece), board);
                board
                    .add_to(&mut whole.lock().expect("no thread has panicked"))
                    .expect("sums of fewer than 2^60 walks fit");
            },
        );
        whole.into_inner().expect("no thread has panicked")
    }

    /// Does `count` independent tasks, each with the value that `prepare` made for its thread. Returns the results in
    /// order.
    pub fn each<S, T: Send>(
        &self,
        count: usize,
        prepare: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, usize) -> T + Sync,
    ) -> Vec<T> {
        parallel::on_threads(self.threads, count, prepare, work)
    }
}

#[cfg(test)]
mod tests {
    use radiosity::{EstimatorKind, Method};

    use super::*;
    use crate::walking::experiment;

    #[test]
    fn threads_do_not_enter_the_answer() {
        let experiment = experiment(&scenes::cube(1), Method::shooting(EstimatorKind::Collision)).unwrap();
        let [one, three] = [1, 3].map(|threads| Lab { effort: StudyScale::Quick, threads });
        let read = |tally: &Tally| tally.sums().to_vec();
        let runs = |lab: Lab| lab.runs(&experiment, 1, 20, 100, read);
        assert_eq!(runs(one), runs(three));
        let walks = 2 * PIECE + 5;
        assert_eq!(one.tally(&experiment, 1, walks), three.tally(&experiment, 1, walks));
    }
}
