//! Traces a random sample of a result's leases again and holds them against what was delivered.
//!
//! That the sums of the result are those of all deliveries is known from the digests (`protocol::digest`), which reading
//! the file checks. So a sample of the deliveries speaks for the whole: if a part f of the leases were wrong, n that are
//! traced again would all be right with probability (1 − f)ⁿ.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io;
use std::ops::Range;
use std::path::Path;

use job::{Keyword, OutputFile};
use protocol::digest::{self, Digest, Digester};
use protocol::{Checkpoint, Contributor, Delivery, WalkRange};
use radiosity::{Experiment, Overflow, Sequence};
use serde_json::Value;

use crate::error::Error;
use crate::outputs::TallyFiles;
use crate::replica::Replica;
use crate::settings::Settings;
use crate::stored_run::{StoredRun, unusable};

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
    /// How many leases it stands for in a draw.
    weight: f64,
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
    /// The number of leases.
    pub leases: u64,
    /// The number of their paths.
    pub paths: u64,
}

/// Leases that differ from what was delivered.
#[derive(Clone, Debug, thiserror::Error)]
#[error(
    "{differ} of {traced} leases that were traced again differ from what was delivered (by {workers}: faulty memory, or another program); do not trust this result, run the job again without them"
)]
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
    let kept = StoredRun::open(run)?;
    let StoredRun { checkpoint, settings, experiment } = &kept;
    check_files(run, &kept)?;
    let job_hash = |part: &WalkRange| settings.job_hash(experiment.scene().hash(), part.seed);
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
            * experiment.unit().paths(),
    };
    let unit = if experiment.unit().is_walk() { "walks" } else { "batches" };
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

/// Whether the files beside a tally are made from it. The page, pictures of named views and the partition are not looked at.
fn check_files(run: &Path, kept: &StoredRun) -> Result<(), Error> {
    let other = |file| Error::OtherFile { run: run.into(), file };
    let there = |file: &OutputFile| *file != OutputFile::Report && run.join(file.name()).is_file();
    let exports: Vec<OutputFile> = OutputFile::ALL.iter().copied().filter(there).collect();
    let (estimates, hash) =
        (kept.estimates(), blake3::Hash::from_bytes(kept.checkpoint.tally.hash()).to_hex());
    let files = TallyFiles::new(&kept.settings, &estimates, &exports);
    let check = |name, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        let Ok(found) = std::fs::read(run.join(name)) else { return Ok(()) };
        let mut expected = Vec::new();
        write(&mut expected).map_err(|source| Error::System { doing: "writing a file to memory", source })?;
        if found == expected { Ok(()) } else { Err(other(name)) }
    };
    for file in exports {
        if file != OutputFile::Summary {
            check(file.name(), &|written| files.write(file, written))?;
        } else if told_hash(run).as_deref() != Some(hash.as_str()) {
            return Err(other(file.name()));
        }
    }
    files.beside().iter().try_for_each(|(name, write)| check(name, &|written| write(written)))
}

/// The hash of the tally that the summary tells of.
fn told_hash(run: &Path) -> Option<String> {
    let summary = std::fs::read(run.join(OutputFile::Summary.name())).ok()?;
    let summary: Value = serde_json::from_slice(&summary).ok()?;
    Some(summary["tally_hash"].as_str()?.into())
}

/// All leases of a result. A single lease stands for more where most of those beside it were folded: a relay of many workers
/// tells of few of their leases one by one. The walks in the result and those of single leases say for how many.
fn leases(checkpoint: &Checkpoint) -> Vec<Lease> {
    let mut leases = all_leases(checkpoint);
    let workers = &checkpoint.book.workers;
    let classes = classes(workers);
    let class = |worker: u32| classes.get(worker as usize).copied().unwrap_or("");
    let (mut walks, mut single) = (HashMap::new(), HashMap::new());
    for (worker, &class) in workers.iter().zip(&classes) {
        *walks.entry(class).or_insert(0.0) += worker.walks as f64;
    }
    for lease in leases.iter().filter(|lease| lease.spared) {
        *single.entry(class(lease.worker)).or_insert(0.0) += (lease.walks.end - lease.walks.start) as f64;
    }
    for lease in leases.iter_mut().filter(|lease| lease.spared) {
        let class = class(lease.worker);
        lease.weight = (walks.get(class).copied().unwrap_or(0.0) / single[class]).max(1.0);
    }
    leases
}

/// Whose leases were folded alike: of each worker the relay that answers for it, or nothing where there is none.
fn classes(workers: &[Contributor]) -> Vec<&str> {
    let behind = workers.iter().filter(|worker| worker.peer() != worker.name);
    let relays: HashSet<&str> = behind.map(Contributor::peer).collect();
    workers.iter().map(|worker| relays.get(worker.peer()).copied().unwrap_or("")).collect()
}

fn all_leases(checkpoint: &Checkpoint) -> Vec<Lease> {
    let of_part = |part: &WalkRange| {
        let mut next = part.first;
        let lease = |&Delivery { walks, leases, worker, digest, spared }: &Delivery| {
            let walks = next..next.saturating_add(walks);
            next = walks.end;
            Lease { seed: part.seed, walks, leases, worker, digest, spared, weight: 1.0 }
        };
        part.deliveries.entries().iter().map(lease).collect::<Vec<_>>()
    };
    checkpoint.book.parts.iter().flat_map(of_part).collect()
}

/// Leases drawn at random, each in proportion to what it stands for, until they hold this share of the walks. Those of a long
/// run that lots have spared come first: they are a fair sample, and the others are folded, so that many have to be traced for one.
/// The least of exponential times is each lease's with a probability in proportion to its rate (Efraimidis & Spirakis 2006).
fn sample(leases: Vec<Lease>, share: f64, seed: u64) -> Vec<Lease> {
    let total: u64 = leases.iter().map(|lease| lease.walks.end - lease.walks.start).sum();
    let mut dice = Sequence::new(seed).walk(0);
    let mut time = |lease: &Lease| -(((dice.bits() >> 11) as f64 + 0.5) * 2f64.powi(-53)).ln() / lease.weight;
    let mut timed: Vec<(f64, Lease)> = leases.into_iter().map(|lease| (time(&lease), lease)).collect();
    timed.sort_by(|(a, one), (b, other)| other.spared.cmp(&one.spared).then(a.total_cmp(b)));
    let mut walks = 0;
    let is_asked_for = |lease: &Lease| {
        let before = walks;
        walks += lease.walks.end - lease.walks.start;
        (before as f64) < share * total as f64
    };
    timed.into_iter().map(|(_, lease)| lease).take_while(is_asked_for).collect()
}

/// The leases that come out otherwise than they were delivered.
fn wrong(sample: &[Lease], settings: &Settings, experiment: &Experiment) -> Result<Vec<Lease>, Overflow> {
    let digester = Digester::new(&experiment.scene().hash());
    let board = || experiment.board();
    let found = parallel::on_threads(parallel::cores(), sample.len(), board, |board, i| {
        let lease = &sample[i];
        let replica = Replica::new(experiment.clone(), settings, lease.seed);
        let mut sum = 0;
        for first in lease.walks.clone().step_by(BOARD_WALKS as usize) {
            let end = lease.walks.end.min(first + BOARD_WALKS);
            sum = digest::add(sum, digester.digest(&replica.trace(first..end, board)?));
        }
        Ok((sum != lease.digest).then(|| lease.clone()))
    });
    found.into_iter().filter_map(Result::transpose).collect()
}

/// The workers that delivered wrong leases, in words.
fn blame(wrong: &[Lease], checkpoint: &Checkpoint, what: &str) -> String {
    let mut of_worker: BTreeMap<u32, Vec<&Lease>> = BTreeMap::new();
    for lease in wrong {
        of_worker.entry(lease.worker).or_default().push(lease);
    }
    let name = |worker: u32| match worker {
        Delivery::SEVERAL => "one or more of several workers",
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
    let mut words = words.collect::<Vec<_>>().join("; ");
    if of_worker
        .keys()
        .any(|&worker| worker != Delivery::SEVERAL && name(worker).contains(Contributor::BEHIND))
    {
        words += " (a name after > is the word of the relay before it)";
    }
    words
}

#[cfg(test)]
mod tests {
    use protocol::{Book, Deliveries, Growing};

    use super::*;

    fn lease(first: u64) -> Lease {
        Lease {
            seed: 1,
            walks: first..first + 10,
            leases: 1,
            worker: 0,
            digest: 0,
            spared: true,
            weight: 1.0,
        }
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

    /// A relay tells of ten leases one by one for a hundred of its workers; as many are a direct worker's, all of them single.
    /// The first that is drawn is behind the relay every other time: 2,000 draws, at most 5 standard deviations off; a false
    /// alarm has a probability of 6·10⁻⁷ for these seeds, once and for all.
    #[test]
    fn leases_behind_a_relay_are_drawn_in_proportion_to_all_of_them() {
        let worker = |name: &str, walks| Contributor { name: name.into(), walks, ..Contributor::default() };
        let workers = [
            worker("direct", 1000),
            worker("relay", 900),
            worker("relay > one", 70),
            worker("relay > two", 30),
        ];
        assert_eq!(classes(&workers), ["", "relay", "relay", "relay"]);
        let mut deliveries = Growing::new(Deliveries::default(), 0, 0);
        (0..100).for_each(|_| deliveries.push(Delivery::lease(10, 0, 0)));
        for n in 0..10 {
            deliveries.push(Delivery::lease(10, 2 + u32::from(n > 6), 0));
            deliveries.push(Delivery { leases: 9, spared: false, ..Delivery::lease(90, 1, 0) });
        }
        let all = leases(&of(deliveries.into_deliveries(), &workers));
        let weights =
            |worker: u32| all.iter().find(|lease| lease.worker == worker && lease.spared).unwrap().weight;
        assert_eq!([0, 2, 3].map(weights), [1.0, 10.0, 10.0]);
        let behind = (0..2000).filter(|&seed| sample(all.clone(), 1e-9, seed)[0].worker >= 2).count();
        assert!((behind as f64 - 1000.0).abs() < 5.0 * (2000.0 * 0.25_f64).sqrt(), "{behind}");
    }

    /// A result that these deliveries came to.
    fn of(deliveries: Deliveries, workers: &[Contributor]) -> Checkpoint {
        let layout = radiosity::Layout { scores: 1, moments: 2, slopes: 0, events: false };
        let book = Book {
            parts: vec![WalkRange { job_hash: [0; 32], seed: 1, first: 0, deliveries }],
            out_of_order: vec![],
            workers: workers.into(),
            looks: vec![],
            goal: [0; 32],
            effort: protocol::Effort::default(),
            sessions: vec![],
            job: [].into(),
        };
        Checkpoint { scene_hash: [0; 32], tally: radiosity::Tally::new(1, layout).into(), book }
    }
}
