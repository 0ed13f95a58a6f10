//! Traces a random sample of a result's leases again and holds them against what was delivered.
//!
//! That the sums of the result are those of all deliveries is known from the digests (`protocol::digest`), which reading
//! the file checks. So a sample of the deliveries speaks for the whole: if a part f of the leases were wrong, n that are
//! traced again would all be right with probability (1 − f)ⁿ.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

use judge::MOMENTS;
use protocol::checkpoint::{Checkpoint, Part};
use protocol::deliveries::{Delivery, SEVERAL};
use protocol::digest::{self, Digest, Digester};
use radiosity::{Estimates, Experiment, Overflow, Sequence};
use serde_json::Value;

use crate::error::Error;
use crate::kept::{Kept, unusable};
use crate::replica::Replica;
use crate::settings::Settings;

/// The most walks between two emptyings of a board.
const BOARD_WALKS: u64 = 1 << 22;

/// A lease as the ledger has it, or several that were folded into one entry.
#[derive(Clone, Debug)]
struct Lease {
    seed: u64,
    walks: Range<u64>,
    leases: u64,
    worker: u32,
    digest: Digest,
    spared: bool,
}

/// Walks of a result that were traced again.
#[derive(Clone, Debug)]
pub struct Audit {
    /// Leases and paths that were traced again.
    pub traced: Extent,
    /// Leases and paths of the whole result.
    pub all: Extent,
    /// What differs from what was delivered, and the workers that delivered it; `None` where all is as it was delivered.
    pub wrong: Option<Wrong>,
}

/// Some leases, and the paths of their walks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Leases.
    pub leases: u64,
    /// Paths.
    pub paths: u64,
}

/// Leases that differ from what was delivered.
#[derive(Clone, Debug)]
pub struct Wrong {
    /// Entries of the ledger that differ.
    pub differ: usize,
    /// Entries of the ledger that were traced again.
    pub traced: usize,
    /// The workers that delivered them, in words.
    pub workers: String,
}

/// Traces a share of the walks in the result of `run` again, drawn by a seed. `now` hears what is being done.
///
/// # Errors
/// Where the result cannot be read, where a file beside the tally is not made from it, and where a sum overflows.
pub fn audit(run: &Path, share: f64, seed: u64, now: &dyn Fn(&'static str)) -> Result<Audit, Error> {
    let kept = Kept::open(run)?;
    let Kept { checkpoint, settings, experiment } = &kept;
    check_files(run, &kept)?;
    let job_hash = |part: &Part| job::job_hash(experiment.scene().hash(), &settings.method, part.seed);
    if !checkpoint.book.parts.iter().all(|part| part.job_hash == job_hash(part)) {
        return Err(unusable(run, checkpoint, "its walks are not those of the job".into()));
    }
    let all = leases(checkpoint);
    let sample = sample(all.clone(), share, seed);
    now("tracing leases again");
    let wrong = wrong(&sample, settings, experiment).map_err(|Overflow| Error::Overflow)?;
    let extent = |leases: &[Lease]| Extent {
        leases: leases.iter().map(|lease| lease.leases).sum(),
        paths: leases.iter().map(|lease| lease.walks.end - lease.walks.start).sum::<u64>()
            * experiment.paths_per_walk(),
    };
    let unit = if experiment.batch_paths().is_some() { "batches" } else { "walks" };
    Ok(Audit {
        traced: extent(&sample),
        all: extent(&all),
        wrong: (!wrong.is_empty()).then(|| Wrong {
            differ: wrong.len(),
            traced: sample.len(),
            workers: blame(&wrong, checkpoint, unit),
        }),
    })
}

/// Whether table, summary and picture beside a tally, those of them that are there, are made from it.
fn check_files(run: &Path, Kept { checkpoint, settings, experiment }: &Kept) -> Result<(), Error> {
    let level = settings.level(experiment.scene());
    let estimates = Estimates::new(experiment, &checkpoint.tally, level);
    let in_memory = |source| Error::System { doing: "writing a file to memory", source };
    let other = |file| Error::OtherTable { run: run.into(), file };
    if let Ok(table) = std::fs::read(run.join("patches.csv")) {
        let mut expected = Vec::new();
        report::write_patches(&mut expected, &estimates).map_err(in_memory)?;
        if table != expected {
            return Err(other("patches.csv"));
        }
    }
    if let Ok(summary) = std::fs::read(run.join("summary.json")) {
        let hash =
            serde_json::from_slice::<Value>(&summary).ok().map(|summary| summary["tally_hash"].clone());
        let expected = blake3::Hash::from_bytes(checkpoint.tally.hash()).to_hex();
        if hash != Some(expected.as_str().into()) {
            return Err(other("summary.json"));
        }
    }
    if let Ok(picture) = std::fs::read(run.join("radiosity.png")) {
        let mut expected = Vec::new();
        let smooth = report::Smooth::new(&estimates);
        let drawn = report::Photo::shoot(&estimates, &smooth, &settings.view).picture;
        drawn.write_png(&mut expected).map_err(in_memory)?;
        if picture != expected {
            return Err(other("radiosity.png"));
        }
    }
    Ok(())
}

/// All leases of a result.
fn leases(checkpoint: &Checkpoint) -> Vec<Lease> {
    let of_part = |part: &Part| {
        let mut next = part.first;
        let lease = |&Delivery { walks, leases, worker, digest, spared }: &Delivery| {
            let walks = next..next.saturating_add(walks);
            next = walks.end;
            Lease { seed: part.seed, walks, leases, worker, digest, spared }
        };
        part.deliveries.entries().iter().map(lease).collect::<Vec<_>>()
    };
    checkpoint.book.parts.iter().flat_map(of_part).collect()
}

/// Leases drawn at random, each as likely as any other, until they hold this share of the walks. Those of a long run that
/// lots have spared come first: they are a fair sample, and the others are folded, so that many have to be traced for one.
fn sample(mut leases: Vec<Lease>, share: f64, seed: u64) -> Vec<Lease> {
    let total: u64 = leases.iter().map(|lease| lease.walks.end - lease.walks.start).sum();
    leases.sort_by_key(|lease| !lease.spared);
    let spared = leases.partition_point(|lease| lease.spared);
    let mut dice = Sequence::new(seed).walk(0);
    let (mut drawn, mut walks) = (0, 0);
    while drawn < leases.len() && (walks as f64) < share * total as f64 {
        let end = if drawn < spared { spared } else { leases.len() };
        let rest = (end - drawn) as u128;
        // Fisher & Yates; the bias of a product of 64 bits is below 2⁻⁴⁰ for fewer than 2²⁴ leases.
        leases.swap(drawn, drawn + ((u128::from(dice.bits()) * rest) >> 64) as usize);
        walks += leases[drawn].walks.end - leases[drawn].walks.start;
        drawn += 1;
    }
    leases.truncate(drawn);
    leases
}

/// The leases that come out otherwise than they were delivered.
fn wrong(sample: &[Lease], settings: &Settings, experiment: &Experiment) -> Result<Vec<Lease>, Overflow> {
    let queue = Mutex::new(sample.iter());
    let next = || queue.lock().expect("no thread panics while it holds this").next();
    let digester = Digester::new(&experiment.scene().hash());
    let work = || {
        let mut wrong = Vec::new();
        let mut board = experiment.board::<MOMENTS>();
        while let Some(lease) = next() {
            let replica = Replica::new(experiment.clone(), settings, lease.seed);
            let mut sum = 0;
            for first in lease.walks.clone().step_by(BOARD_WALKS as usize) {
                let end = lease.walks.end.min(first + BOARD_WALKS);
                sum = digest::add(sum, digester.digest(&replica.trace(first..end, &mut board)?));
            }
            if sum != lease.digest {
                wrong.push(lease.clone());
            }
        }
        Ok(wrong)
    };
    std::thread::scope(|scope| {
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(sample.len());
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let found = threads.into_iter().map(|thread| thread.join().expect("walks do not panic"));
        found.collect::<Result<Vec<_>, _>>().map(|found| found.concat())
    })
}

/// Who delivered them, in words.
fn blame(wrong: &[Lease], checkpoint: &Checkpoint, what: &str) -> String {
    let mut of_worker: BTreeMap<u32, Vec<&Lease>> = BTreeMap::new();
    for lease in wrong {
        of_worker.entry(lease.worker).or_default().push(lease);
    }
    let name = |worker: u32| match worker {
        SEVERAL => "one or more of several workers",
        _ => &checkpoint.book.workers[worker as usize].name,
    };
    let words = of_worker.iter().map(|(&worker, leases)| {
        let first = leases.iter().min_by_key(|lease| (lease.seed, lease.walks.start)).expect("one at least");
        format!(
            "{}: {} leases, the first of {what} {} to {} of seed {}",
            name(worker),
            leases.len(),
            first.walks.start,
            first.walks.end - 1,
            first.seed
        )
    });
    words.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lease(first: u64) -> Lease {
        Lease { seed: 1, walks: first..first + 10, leases: 1, worker: 0, digest: 0, spared: true }
    }

    #[test]
    fn a_sample_has_its_share_and_no_lease_twice() {
        let all: Vec<Lease> = (0..100).map(|i| lease(10 * i)).collect();
        let starts = |share, seed| {
            let mut starts: Vec<u64> =
                sample(all.clone(), share, seed).iter().map(|lease| lease.walks.start).collect();
            starts.sort_unstable();
            starts
        };
        assert_eq!(starts(1.0, 1).len(), 100);
        assert!(starts(1.0, 1).windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(starts(0.1, 1).len(), 10);
        assert_eq!(starts(1e-9, 1).len(), 1);
        assert_eq!(starts(0.1, 1), starts(0.1, 1));
        assert_ne!(starts(0.1, 1), starts(0.1, 2));
    }

    /// In a long run most leases are folded: those that are not are traced first, and of those each is as likely as any other.
    #[test]
    fn folded_leases_are_drawn_last() {
        let folded = |first| Lease { leases: 7, spared: false, ..lease(first) };
        let all: Vec<Lease> =
            (0..100).map(|i| if i % 2 == 0 { lease(10 * i) } else { folded(10 * i) }).collect();
        assert!(sample(all.clone(), 0.5, 3).iter().all(|lease| lease.leases == 1));
        let more = sample(all.clone(), 0.51, 3);
        assert_eq!((more.len(), more[50].leases), (51, 7));
        assert_eq!(sample(all, 1.0, 3).len(), 100);
    }

    /// Each of 100 leases is drawn in 10 % of the samples: 2,000 samples, at most 5 standard deviations off; a false
    /// alarm has a probability of 6·10⁻⁵ for these seeds, once and for all.
    #[test]
    fn every_lease_is_as_likely_as_any_other() {
        let all: Vec<Lease> = (0..100).map(|i| lease(10 * i)).collect();
        let mut drawn = [0; 100];
        for seed in 0..2000 {
            for lease in sample(all.clone(), 0.1, seed) {
                drawn[lease.walks.start as usize / 10] += 1;
            }
        }
        let sigma = (2000.0 * 0.1 * 0.9_f64).sqrt();
        assert!(drawn.iter().all(|&times| (f64::from(times) - 200.0).abs() < 5.0 * sigma), "{drawn:?}");
    }
}
