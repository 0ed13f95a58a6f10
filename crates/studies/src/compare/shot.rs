//! The runs of a trial, as the caller's processes walked them.

use radiosity::{Counts, Tally};

/// The result of some runs of a trial.
pub struct Shot {
    /// The tally of each run.
    pub tallies: Vec<Tally>,
    /// The processor time of one run's walks [s].
    pub seconds: f64,
    /// The most memory that a worker process took [bytes], if the system tells.
    pub memory: Option<u64>,
    /// The bytes that workers sent for one run.
    pub traffic: u64,
}

impl Shot {
    /// The tally of each run, by the tallies of all walks up to the end of each; `empty` is that of none.
    pub fn runs(empty: Tally, prefixes: impl Iterator<Item = Tally>) -> Vec<Tally> {
        let runs = prefixes.scan(empty, |before, now| {
            let run = since(before, &now);
            *before = now;
            Some(run)
        });
        runs.collect()
    }
}

/// The walks of `now` that are not those of `before`.
fn since(before: &Tally, now: &Tally) -> Tally {
    let (earlier, later) = (before.counts.to_array(), now.counts.to_array());
    let counts = Counts::from_array(std::array::from_fn(|i| later[i] - earlier[i]));
    let sums = now.sums().iter().zip(before.sums()).map(|(now, before)| now - before).collect();
    let counts = counts.expect("fewer walks than before are counted where those were");
    Tally::from_parts(counts, now.patches(), now.layout(), sums).expect("as many sums as before")
}
