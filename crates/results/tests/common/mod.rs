//! What the tests of chosen patches share.

use radiosity::{Experiment, Sequence, Tally};
use stats::Coverage;

/// The tally of some walks of a seed.
pub fn tally(experiment: &Experiment, seed: u64, walks: u64) -> Tally {
    let (sequence, mut board) = (Sequence::new(seed), experiment.board());
    let mut tally = experiment.tally();
    for first in (0..walks).step_by(1 << 20) {
        experiment.walk(&sequence, first..walks.min(first + (1 << 20)), &mut board);
        board.add_to(&mut tally).unwrap();
    }
    tally
}

/// The part of intervals that held the truth: the mean over seeds, its standard error by their spread, and the number of intervals.
pub fn over_seeds(seeds: &[Coverage]) -> (f64, f64, u64) {
    let (mut sum, mut squares, mut intervals) = (0.0, 0.0, 0);
    for Coverage { covered, trials } in seeds {
        let part = *covered as f64 / *trials as f64;
        (sum, squares, intervals) = (sum + part, squares + part * part, intervals + trials);
    }
    let n = seeds.len() as f64;
    let mean = sum / n;
    (mean, ((squares / n - mean * mean) / (n - 1.0)).sqrt(), intervals)
}
