//! `radwalk audit`: traces a random sample of a result's leases again and holds them against what was delivered.
//!
//! That the sums of the result are those of all deliveries is known from the digests (`cluster::digest`), which reading
//! the file checks. So a sample of the deliveries speaks for the whole: if a part f of the leases were wrong, n that are
//! traced again would all be right with probability (1 − f)ⁿ.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::Mutex;

use cluster::access::random_bytes;
use cluster::checkpoint::{self, Checkpoint, CheckpointError, Part};
use cluster::deliveries::{Delivery, SEVERAL};
use cluster::digest::{self, Digest, Digester};
use judge::MOMENTS;
use radiosity::{Estimates, Experiment, Overflow, Sequence};
use serde_json::Value;

use crate::args::AuditArgs;
use crate::checkpoints::CURRENT;
use crate::console::{Phase, say};
use crate::fault::{Fault, Outcome};
use crate::merge::builds;
use crate::replica::{self, Replica, check_shape};
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

/// Audits a result.
pub fn audit(args: &AuditArgs) -> Result<Outcome, Fault> {
    if !(args.share > 0.0 && args.share <= 1.0) {
        return Err(Fault::Share(args.share));
    }
    let phase = Phase::begin("reading the result");
    let checkpoint = checkpoint::read(&args.run.join(CURRENT))?;
    let kept = |reason| Fault::Kept { path: args.run.clone(), reason, build: builds(&checkpoint) };
    let (settings, experiment) = replica::unpack(&checkpoint.book.job).map_err(kept)?;
    let path = args.run.join(CURRENT);
    check_shape(&checkpoint.tally, &experiment).map_err(|fault| CheckpointError { path, fault })?;
    check_files(&args.run, &checkpoint, &settings, &experiment)?;
    let job_hash = |part: &Part| job::job_hash(experiment.scene().hash(), &settings.method, part.seed);
    if !checkpoint.book.parts.iter().all(|part| part.job_hash == job_hash(part)) {
        return Err(kept("its walks are not those of the job".into()));
    }
    let seed = match args.seed {
        Some(seed) => seed,
        None => fresh_seed()?,
    };
    let what = if experiment.batch_paths().is_some() { "batches" } else { "walks" };
    let all = leases(&checkpoint);
    let sample = sample(all.clone(), args.share, seed);
    phase.now("tracing leases again");
    let wrong = wrong(&sample, &settings, &experiment).map_err(|Overflow| Fault::Overflow)?;
    drop(phase);
    let of = |leases: &[Lease]| leases.iter().map(|lease| lease.walks.end - lease.walks.start).sum::<u64>();
    let of = |leases: &[Lease]| of(leases) * experiment.paths_per_walk();
    let count = |leases: &[Lease]| leases.iter().map(|lease| lease.leases).sum::<u64>();
    if !args.quiet {
        say(&format!(
            "{} of {} paths, {} of {} leases, were traced again (drawn by seed {seed})",
            of(&sample),
            of(&all),
            count(&sample),
            count(&all)
        ));
    }
    if wrong.is_empty() {
        if !args.quiet {
            say("every one is exactly as it was delivered");
        }
        return Ok(Outcome::Done);
    }
    Err(Fault::Audit { wrong: wrong.len(), leases: sample.len(), workers: blame(&wrong, &checkpoint, what) })
}

/// Whether table, summary and picture beside a tally, those of them that are there, are made from it.
fn check_files(
    run: &Path,
    checkpoint: &Checkpoint,
    settings: &Settings,
    experiment: &Experiment,
) -> Result<(), Fault> {
    let level = settings.level(experiment.scene());
    let estimates = Estimates::new(experiment, &checkpoint.tally, level);
    let in_memory = |source| Fault::System { doing: "writing a file to memory", source };
    let other = |file| Fault::OtherTable { run: run.into(), file };
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

fn fresh_seed() -> Result<u64, Fault> {
    let bytes = random_bytes().map_err(|source| Fault::System { doing: "drawing a random seed", source })?;
    // Short enough to be typed.
    Ok(u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")).into())
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
